//! Pieces of one line, joined across gaps.

use nalgebra::Vector2;

use super::LineSegment;

/// Cosine of the greatest angle between two pieces, 5 degrees.
const ALIGNED: f64 = 0.996;
/// Pixels that pieces may overlap: their ends are known no better.
const OVERLAP: f64 = 4.0;
/// Chi-square with two degrees of freedom, 1 %.
const CHI_SQUARE: f64 = 9.21;
/// Standard deviation by which pieces of one edge may be off its line besides their noise, pixels.
const UNEVEN: f64 = 0.1;

/// Joins what is one line: the end of one piece meets, after a gap, the beginning of the next (both
/// have their bright side on the right), and one line fits both pieces.
pub fn merge(mut segments: Vec<LineSegment>, max_gap: f64) -> Vec<LineSegment> {
    if max_gap <= 0.0 {
        return segments;
    }
    // Beginnings by cell of a grid; within reach of an end are those of 3 x 3 cells.
    let size = max_gap + OVERLAP;
    let cell = |p: &Vector2<f64>| [(p.x / size).floor() as i64, (p.y / size).floor() as i64];
    loop {
        let mut grid: Vec<([i64; 2], usize)> =
            segments.iter().enumerate().map(|(i, s)| (cell(&s.ends[0]), i)).collect();
        grid.sort_unstable();
        let mut candidates = Vec::new();
        for (i, a) in segments.iter().enumerate() {
            let [x, y] = cell(&a.ends[1]);
            for dx in -1..=1 {
                let from = grid.partition_point(|(c, _)| *c < [x + dx, y - 1]);
                let near = grid[from..].iter().take_while(|(c, _)| *c <= [x + dx, y + 1]);
                for (_, j) in near.filter(|(_, j)| *j != i) {
                    candidates.extend(joined(a, &segments[*j], max_gap).map(|(chi, s)| (chi, i, *j, s)));
                }
            }
        }
        // The best first; each piece once a round.
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut taken = vec![false; segments.len()];
        let mut all = Vec::new();
        for (_, i, j, s) in candidates {
            if !taken[i] && !taken[j] {
                (taken[i], taken[j]) = (true, true);
                all.push(s);
            }
        }
        if all.is_empty() {
            return segments;
        }
        let rest = segments.iter().zip(&taken).filter(|(_, taken)| !**taken).map(|(s, _)| *s);
        all.extend(rest);
        segments = all;
    }
}

/// The line of both pieces, and how badly it fits them (chi-square); `None` if it does not.
fn joined(a: &LineSegment, b: &LineSegment, max_gap: f64) -> Option<(f64, LineSegment)> {
    let whole = b.ends[1] - a.ends[0];
    let length = whole.norm();
    let u = whole / length;
    let gap = (b.ends[0] - a.ends[1]).dot(&u);
    let aligned = a.direction().dot(&b.direction()) >= ALIGNED && a.direction().dot(&u) >= ALIGNED;
    if !aligned || gap > max_gap.min(a.support).min(b.support) || gap < -OVERLAP {
        return None;
    }
    // A line v = at + slope (t - mean) in the frame of `u`, through four points with variances.
    let n = Vector2::new(-u.y, u.x);
    let origin = a.ends[0];
    let points = [(a, 0), (a, 1), (b, 0), (b, 1)].map(|(s, i): (&LineSegment, usize)| {
        let p = s.points[i] - origin;
        (p.dot(&u), p.dot(&n), s.variance)
    });
    let line = |extra: f64| {
        let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|(t, v, c)| f(*t, *v) / (c + extra)).sum::<f64>();
        let weight = sum(&|_, _| 1.0);
        let (mean, at) = (sum(&|t, _| t) / weight, sum(&|_, v| v) / weight);
        let spread2 = sum(&|t, _| (t - mean).powi(2)) / weight;
        let slope = sum(&|t, v| (t - mean) * (v - at)) / (weight * spread2);
        let chi = sum(&|t, v| (v - at - slope * (t - mean)).powi(2));
        (weight, mean, at, spread2.sqrt(), slope, chi)
    };
    let (.., chi) = line(UNEVEN * UNEVEN);
    if chi.is_nan() || chi > CHI_SQUARE {
        return None;
    }
    let (weight, mean, at, spread, slope, misfit) = line(0.0);
    let place = |t: f64| origin + u * t + n * (at + slope * (t - mean));
    let share = a.support / (a.support + b.support);
    let mix = |x: f64, y: f64| share * x + (1.0 - share) * y;
    Some((
        chi,
        LineSegment {
            ends: [place(0.0), place(length)],
            points: [place(mean - spread), place(mean + spread)],
            variance: 2.0 / weight * (0.5 * misfit).max(1.0),
            contrast: mix(a.contrast, b.contrast),
            blur: mix(a.blur, b.blur),
            support: a.support + b.support,
        },
    ))
}
