//! Connected components of a sparse set of pixels, given as runs of rows.

/// Pixels [start, end) of a row that belong together; `class` keeps unlike pixels apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    pub row: u32,
    pub start: u32,
    pub end: u32,
    pub class: u8,
}

/// Room is made for as many runs at once: noise makes more of them in one frame than in another.
pub const USUAL_RUNS: usize = 256;

/// Memory that serves one labelling after the other.
#[derive(Debug, Default)]
pub struct Components {
    parent: Vec<u32>,
    labels: Vec<u32>,
}

impl Components {
    /// The component of each run (8-connected, one class each), numbered from 0 in order of their first
    /// run, and their number. Runs ascend by row, then by column, and are disjoint.
    pub fn label(&mut self, runs: &[Run]) -> (&[u32], usize) {
        self.parent.clear();
        self.labels.clear();
        self.parent.reserve(USUAL_RUNS);
        self.labels.reserve(USUAL_RUNS);
        self.parent.extend(0..runs.len() as u32);
        connect(runs, &mut self.parent);
        let mut count = 0;
        for i in 0..runs.len() as u32 {
            let root = find(&mut self.parent, i);
            // A root is the least run of its component, so it was numbered before.
            self.labels.push(if root == i { count } else { self.labels[root as usize] });
            count += (root == i) as u32;
        }
        (&self.labels, count as usize)
    }
}

fn connect(runs: &[Run], parent: &mut [u32]) {
    // Runs of the row above that may still touch the current one begin here.
    let (mut above, mut row_start) = (0, 0);
    for i in 0..runs.len() {
        let run = runs[i];
        if runs[row_start].row != run.row {
            above = if runs[row_start].row + 1 == run.row { row_start } else { i };
            row_start = i;
        }
        // The last run that touches may reach the next run too, so only those that end before are left behind.
        while above < row_start && runs[above].end < run.start {
            above += 1;
        }
        for j in (above..row_start).take_while(|&j| runs[j].start <= run.end) {
            if runs[j].class == run.class {
                join(parent, j as u32, i as u32);
            }
        }
        if i > row_start && runs[i - 1].end == run.start && runs[i - 1].class == run.class {
            join(parent, (i - 1) as u32, i as u32);
        }
    }
}

fn find(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

fn join(parent: &mut [u32], i: u32, j: u32) {
    let (i, j) = (find(parent, i), find(parent, j));
    parent[i.max(j) as usize] = i.min(j);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    /// Labels by flooding, numbered in order of the first pixel.
    fn flood(pixels: &[Vec<u8>]) -> Vec<Vec<Option<u32>>> {
        let (h, w) = (pixels.len() as i32, pixels[0].len() as i32);
        let mut labels = vec![vec![None; w as usize]; h as usize];
        let mut next = 0;
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            let class = pixels[y as usize][x as usize];
            if class == 0 || labels[y as usize][x as usize].is_some() {
                continue;
            }
            let mut open = vec![(y, x)];
            while let Some((y, x)) = open.pop() {
                let inside = y >= 0 && x >= 0 && y < h && x < w;
                if !inside || pixels[y as usize][x as usize] != class || labels[y as usize][x as usize].is_some() {
                    continue;
                }
                labels[y as usize][x as usize] = Some(next);
                open.extend((-1..2).flat_map(|j| (-1..2).map(move |i| (y + j, x + i))));
            }
            next += 1;
        }
        labels
    }

    #[test]
    fn labels_are_those_of_flooding() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut components = Components::default();
        for trial in 0..300 {
            let fill = 1 + trial % 7;
            let pixels: Vec<Vec<u8>> = (0..13)
                .map(|_| {
                    let mut class = || if rng.next_u32() % 8 < fill { 1 + (rng.next_u32() % 3 == 0) as u8 } else { 0 };
                    (0..17).map(|_| class()).collect()
                })
                .collect();
            let mut runs: Vec<Run> = Vec::new();
            for (y, row) in pixels.iter().enumerate() {
                for (x, &class) in row.iter().enumerate().filter(|(_, c)| **c != 0) {
                    match runs.last_mut() {
                        Some(r) if r.row == y as u32 && r.end == x as u32 && r.class == class => r.end += 1,
                        _ => runs.push(Run { row: y as u32, start: x as u32, end: x as u32 + 1, class }),
                    }
                }
            }
            let (labels, count) = components.label(&runs);
            let wanted = flood(&pixels);
            assert_eq!(count as u32, wanted.iter().flatten().flatten().max().map_or(0, |m| m + 1));
            for (run, l) in runs.iter().zip(labels) {
                for x in run.start..run.end {
                    assert_eq!(wanted[run.row as usize][x as usize], Some(*l));
                }
            }
        }
        assert_eq!(components.label(&[]), (&[][..], 0));
    }
}
