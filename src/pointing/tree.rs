//! A k-d tree over points: their spacing, and the points near a place or a ray.

use nalgebra::Vector3;

use crate::geometry::Ray;

/// Points of a leaf, at most.
const LEAF: usize = 16;

/// Points in the order of the leaves, and boxes over them. Node 0 is the root; the children of node i
/// halve its range and are 2 i + 1 and 2 i + 2.
#[derive(Debug)]
pub(super) struct Tree {
    points: Vec<Vector3<f64>>,
    order: Vec<u32>,
    boxes: Vec<[Vector3<f64>; 2]>,
    depth: u32,
}

impl Tree {
    /// Of finite points, at least one.
    pub fn new(positions: &[Vector3<f64>]) -> Self {
        let depth = (positions.len().div_ceil(LEAF)).next_power_of_two().trailing_zeros();
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        let mut boxes = vec![[Vector3::zeros(); 2]; (2 << depth) - 1];
        split(positions, &mut order, &mut boxes, 0, depth);
        let points = order.iter().map(|i| positions[*i as usize]).collect();
        Self { points, order, boxes, depth }
    }

    /// In the tree's order.
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// The number that each point was given with.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Distance of each point to its k-th neighbour, or to its last where there are fewer.
    pub fn spacings(&self, k: usize) -> Vec<f64> {
        let mut found = Nearest::new(k + 1);
        self.points.iter().map(|p| self.search(p, &mut found).sqrt()).collect()
    }

    /// Calls `each` with every point within `radius` of a place.
    pub fn within(&self, place: &Vector3<f64>, radius: f64, mut each: impl FnMut(usize)) {
        let square = radius * radius;
        self.descend(
            |[low, high]| outside(&[*low, *high], place) <= square,
            |i| {
                if (self.points[i] - place).norm_squared() <= square {
                    each(i);
                }
            },
        );
    }

    /// Returns the squared distance of the farthest found.
    fn search(&self, to: &Vector3<f64>, found: &mut Nearest) -> f64 {
        found.0.clear();
        self.visit(0, 0, 0..self.points.len(), to, found);
        found.0.last().map_or(0.0, |(d, _)| *d)
    }

    fn visit(&self, node: usize, level: u32, range: std::ops::Range<usize>, to: &Vector3<f64>, found: &mut Nearest) {
        if level == self.depth {
            for i in range {
                found.offer((self.points[i] - to).norm_squared(), i);
            }
            return;
        }
        let middle = halfway(&range);
        let children = [(2 * node + 1, range.start..middle), (2 * node + 2, middle..range.end)];
        let distances = [0, 1].map(|c| outside(&self.boxes[children[c].0], to));
        let [a, b] = children;
        let ordered = if distances[0] <= distances[1] {
            [(a, distances[0]), (b, distances[1])]
        } else {
            [(b, distances[1]), (a, distances[0])]
        };
        for ((child, range), distance) in ordered {
            if distance < found.limit() {
                self.visit(child, level + 1, range, to, found);
            }
        }
    }

    /// Calls `each` with every point in front of the ray's origin and within `angle` (radians, small) of
    /// the ray.
    pub fn along(&self, ray: &Ray, angle: f64, mut each: impl FnMut(usize)) {
        self.descend(
            |limits| near_ray(limits, ray, angle),
            |i| {
                let offset = self.points[i] - ray.origin;
                let along = offset.dot(&ray.direction);
                if along > 0.0 && offset.norm_squared() - along * along <= (angle * along).powi(2) {
                    each(i);
                }
            },
        );
    }

    /// Visits the points of all leaves whose boxes, and those above them, are wanted.
    fn descend(&self, wanted: impl Fn(&[Vector3<f64>; 2]) -> bool, mut each: impl FnMut(usize)) {
        let mut stack = vec![(0usize, 0u32, 0..self.points.len())];
        while let Some((node, level, range)) = stack.pop() {
            if range.is_empty() || !wanted(&self.boxes[node]) {
                continue;
            }
            if level == self.depth {
                range.for_each(&mut each);
                continue;
            }
            let middle = halfway(&range);
            stack.push((2 * node + 1, level + 1, range.start..middle));
            stack.push((2 * node + 2, level + 1, middle..range.end));
        }
    }
}

fn halfway(range: &std::ops::Range<usize>) -> usize {
    range.start + range.len() / 2
}

fn split(positions: &[Vector3<f64>], order: &mut [u32], boxes: &mut [[Vector3<f64>; 2]], node: usize, levels: u32) {
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for i in order.iter() {
        low = low.inf(&positions[*i as usize]);
        high = high.sup(&positions[*i as usize]);
    }
    boxes[node] = [low, high];
    if levels == 0 {
        return;
    }
    let middle = order.len() / 2;
    if !order.is_empty() {
        let axis = (high - low).imax();
        let by =
            |a: &u32, b: &u32| positions[*a as usize][axis].total_cmp(&positions[*b as usize][axis]).then(a.cmp(b));
        order.select_nth_unstable_by(middle, by);
    }
    let (left, right) = order.split_at_mut(middle);
    split(positions, left, boxes, 2 * node + 1, levels - 1);
    split(positions, right, boxes, 2 * node + 2, levels - 1);
}

/// Squared distance of a point from a box.
fn outside([low, high]: &[Vector3<f64>; 2], p: &Vector3<f64>) -> f64 {
    (0..3).map(|i| (low[i] - p[i]).max(p[i] - high[i]).max(0.0).powi(2)).sum()
}

/// Can a point of the box be within an angle of the ray? Asked of the box's sphere.
fn near_ray([low, high]: &[Vector3<f64>; 2], ray: &Ray, angle: f64) -> bool {
    let (centre, radius) = ((low + high) * 0.5, (high - low).norm() * 0.5);
    let offset = centre - ray.origin;
    let along = offset.dot(&ray.direction);
    let across = (offset.norm_squared() - along * along).max(0.0).sqrt();
    along + radius > 0.0 && across <= radius + angle * (along + radius)
}

/// The nearest so far, nearest first: squared distances and indices.
struct Nearest(Vec<(f64, usize)>, usize);

impl Nearest {
    fn new(k: usize) -> Self {
        Self(Vec::with_capacity(k + 1), k)
    }

    fn limit(&self) -> f64 {
        if self.0.len() < self.1 { f64::INFINITY } else { self.0.last().map_or(f64::INFINITY, |(d, _)| *d) }
    }

    fn offer(&mut self, distance: f64, index: usize) {
        if distance >= self.limit() {
            return;
        }
        let place = self.0.partition_point(|(d, i)| (*d, *i) < (distance, index));
        self.0.insert(place, (distance, index));
        self.0.truncate(self.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::Random;

    fn cloud(n: usize, random: &mut Random) -> Vec<Vector3<f64>> {
        (0..n).map(|_| Vector3::from_fn(|_, _| random.below(1000) as f64 * 1e-2)).collect()
    }

    #[test]
    fn points_about_a_place_are_those_of_a_search_of_all() {
        let mut random = Random(1);
        for n in [1, 2, 15, 16, 17, 33, 500, 4097] {
            let points = cloud(n, &mut random);
            let tree = Tree::new(&points);
            let mut sorted = tree.order().to_vec();
            sorted.sort_unstable();
            assert!(sorted.iter().enumerate().all(|(i, o)| i == *o as usize), "{n}");
            for _ in 0..50 {
                let to = cloud(1, &mut random)[0];
                let mut all: Vec<f64> = points.iter().map(|p| (p - to).norm()).collect();
                all.sort_by(f64::total_cmp);
                let mut found = Vec::new();
                tree.within(&to, 2.0, |i| found.push((tree.points()[i] - to).norm()));
                found.sort_by(f64::total_cmp);
                let wanted = all.partition_point(|d| *d <= 2.0);
                assert_eq!(found.len(), wanted);
                assert!(found.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-12));
            }
            if n > 20 {
                let spacings = tree.spacings(3);
                let mut all: Vec<f64> = points.iter().map(|p| (p - tree.points()[5]).norm()).collect();
                all.sort_by(f64::total_cmp);
                assert!((spacings[5] - all[3]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn points_along_a_ray_are_those_of_a_search_of_all() {
        let mut random = Random(2);
        let points = cloud(3000, &mut random);
        let tree = Tree::new(&points);
        for _ in 0..100 {
            let (origin, to) = (cloud(1, &mut random)[0], cloud(1, &mut random)[0]);
            let Some(direction) = (to - origin).try_normalize(1e-9) else { continue };
            let ray = Ray { origin, direction };
            let near = |p: &Vector3<f64>| {
                let along = (p - origin).dot(&direction);
                along > 0.0 && (p - origin - direction * along).norm() <= 0.05 * along
            };
            let mut found = Vec::new();
            tree.along(&ray, 0.05, |i| found.push(tree.order()[i] as usize));
            found.sort_unstable();
            let wanted: Vec<usize> = (0..points.len()).filter(|i| near(&points[*i])).collect();
            assert_eq!(found, wanted);
        }
    }
}
