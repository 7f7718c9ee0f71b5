//! The loops over measurements: see [`crate::vectors`].
#![allow(unsafe_code)]

use nalgebra::Vector3;

use crate::vectors::for_each_processor;

/// Rows that are worked on at once: the loops over them are long enough that the compiler makes vectors of them.
const LANES: usize = 32;
type Lanes = [f64; LANES];

/// Columns of rows, all of one length; see [`super::rows`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a> {
    pub a: [&'a [f64]; 3],
    pub b: &'a [f64],
    /// Of the rays, where they are not all the station's.
    pub origin: Option<[&'a [f64]; 3]>,
}

/// The residual of a row is (offset b - slope . a) / (1 - n . origin), in standard deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub slope: [f64; 3],
    pub offset: f64,
    pub n: [f64; 3],
}

/// What a plane is fitted from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sums {
    pub count: usize,
    /// Of a b.
    pub products: [f64; 3],
    /// Of a a^T: xx, xy, xz, yy, yz, zz.
    pub squares: [f64; 6],
}

impl std::ops::AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.count += other.count;
        self.products.iter_mut().zip(other.products).for_each(|(sum, v)| *sum += v);
        self.squares.iter_mut().zip(other.squares).for_each(|(sum, v)| *sum += v);
    }
}

/// Rows that lie in a plane, and how many lie in two shells of the same thickness around it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Tally {
    pub inside: Sums,
    pub shells: usize,
}

/// Numbers from `start`. What is beyond the end is not a number, and put into `room`.
#[inline(always)]
fn lanes<'a>(column: &'a [f64], start: usize, room: &'a mut Lanes) -> &'a Lanes {
    let rest = &column[start..];
    if let Some(all) = rest.first_chunk() {
        return all;
    }
    *room = [f64::NAN; LANES];
    room[..rest.len()].copy_from_slice(rest);
    room
}

#[repr(align(64))]
struct Sizes(Lanes);

/// Some of the rows; not numbers beyond the end.
struct Stretch<'a> {
    x: &'a Lanes,
    y: &'a Lanes,
    z: &'a Lanes,
    b: &'a Lanes,
}

impl<'a> Stretch<'a> {
    #[inline(always)]
    fn of(rows: &Columns<'a>, start: usize, room: &'a mut [Lanes; 4]) -> Self {
        let [x, y, z, b] = room;
        Self {
            x: lanes(rows.a[0], start, x),
            y: lanes(rows.a[1], start, y),
            z: lanes(rows.a[2], start, z),
            b: lanes(rows.b, start, b),
        }
    }

    /// How far they are from a plane.
    #[inline(always)]
    fn sizes(&self, rows: &Columns<'_>, start: usize, cut: &Cut) -> Sizes {
        let ([p, q, r], mut sizes) = (cut.slope, Sizes([0.0; LANES]));
        let Sizes(out) = &mut sizes;
        for (l, out) in out.iter_mut().enumerate() {
            *out = (cut.offset * self.b[l] - (p * self.x[l] + q * self.y[l] + r * self.z[l])).abs();
        }
        if let Some([x, y, z]) = rows.origin {
            let [p, q, r] = cut.n;
            let mut room = [[0.0; LANES]; 3];
            let [first, second, third] = &mut room;
            let (x, y, z) = (lanes(x, start, first), lanes(y, start, second), lanes(z, start, third));
            for l in 0..LANES {
                out[l] /= (1.0 - (p * x[l] + q * y[l] + r * z[l])).abs();
            }
        }
        sizes
    }
}

/// How many rows are within a distance, and in the shells beyond it.
#[inline(always)]
fn within(sizes: &Lanes, threshold: f64) -> [u64; 2] {
    let (mut inside, mut both) = (0, 0);
    for size in sizes {
        inside += u64::from(*size <= threshold);
        both += u64::from(*size <= 2.0 * threshold);
    }
    [inside, both - inside]
}

/// Sums in lanes. Vectors that lie across the lines of the cache take twice the time.
#[repr(align(64))]
struct Adding {
    products: [Lanes; 3],
    squares: [Lanes; 6],
}

impl Adding {
    #[inline(always)]
    fn new() -> Self {
        Self { products: [[0.0; LANES]; 3], squares: [[0.0; LANES]; 6] }
    }

    /// Those of the rows whose `is_chosen` is true.
    #[inline(always)]
    fn add(&mut self, rows: &Stretch<'_>, is_chosen: impl Fn(usize) -> bool) {
        let Self { products: [xb, yb, zb], squares: [xx, xy, xz, yy, yz, zz] } = self;
        for l in 0..LANES {
            let pick = |v: f64| if is_chosen(l) { v } else { 0.0 };
            let (x, y, z, b) = (pick(rows.x[l]), pick(rows.y[l]), pick(rows.z[l]), pick(rows.b[l]));
            xb[l] += x * b;
            yb[l] += y * b;
            zb[l] += z * b;
            xx[l] += x * x;
            xy[l] += x * y;
            xz[l] += x * z;
            yy[l] += y * y;
            yz[l] += y * z;
            zz[l] += z * z;
        }
    }

    #[inline(always)]
    fn sums(&self, count: u64) -> Sums {
        Sums {
            count: count as usize,
            products: self.products.map(|lanes| total(&lanes)),
            squares: self.squares.map(|lanes| total(&lanes)),
        }
    }
}

#[inline(always)]
fn total(lanes: &Lanes) -> f64 {
    let mut halves = *lanes;
    let mut count = LANES / 2;
    while count > 0 {
        for l in 0..count {
            halves[l] += halves[l + count];
        }
        count /= 2;
    }
    halves[0]
}

for_each_processor! {
    /// How many rows are within `threshold` of a plane, and how many in the shells around it.
    pub(super) fn count(rows: &Columns<'_>, cut: &Cut, threshold: f64) -> [usize; 2] {
        let (mut inside, mut shells) = (0, 0);
        for start in (0..rows.b.len()).step_by(LANES) {
            let mut room = [[0.0; LANES]; 4];
            let Sizes(sizes) = Stretch::of(rows, start, &mut room).sizes(rows, start, cut);
            let [i, s] = within(&sizes, threshold);
            inside += i;
            shells += s;
        }
        [inside as usize, shells as usize]
    }

    /// The same, with the sums of those within.
    pub(super) fn tally(rows: &Columns<'_>, cut: &Cut, threshold: f64) -> Tally {
        let (mut adding, mut inside, mut shells) = (Adding::new(), 0, 0);
        for start in (0..rows.b.len()).step_by(LANES) {
            let mut room = [[0.0; LANES]; 4];
            let some = Stretch::of(rows, start, &mut room);
            let Sizes(sizes) = some.sizes(rows, start, cut);
            let [i, s] = within(&sizes, threshold);
            inside += i;
            shells += s;
            adding.add(&some, |l| sizes[l] <= threshold);
        }
        Tally { inside: adding.sums(inside), shells: shells as usize }
    }

    /// How many rows are within `threshold` of a plane, and how many of them of another one too.
    pub(super) fn common(rows: &Columns<'_>, cuts: [&Cut; 2], threshold: f64) -> [usize; 2] {
        let (mut own, mut both) = (0u64, 0u64);
        for start in (0..rows.b.len()).step_by(LANES) {
            let mut room = [[0.0; LANES]; 4];
            let some = Stretch::of(rows, start, &mut room);
            let [Sizes(first), Sizes(second)] = cuts.map(|cut| some.sizes(rows, start, cut));
            for l in 0..LANES {
                let inside = first[l] <= threshold;
                own += u64::from(inside);
                both += u64::from(inside & (second[l] <= threshold));
            }
        }
        [own as usize, both as usize]
    }

    /// How far rows are from a plane, in front of it or behind it.
    pub(super) fn residuals(out: &mut [f64], rows: &Columns<'_>, cut: &Cut) {
        let [p, q, r] = cut.slope;
        let [x, y, z] = rows.a;
        for ((((out, x), y), z), b) in out.iter_mut().zip(x).zip(y).zip(z).zip(rows.b) {
            *out = cut.offset * b - (p * x + q * y + r * z);
        }
        if let Some([x, y, z]) = rows.origin {
            let [p, q, r] = cut.n;
            for (((out, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
                *out /= 1.0 - (p * x + q * y + r * z);
            }
        }
    }

    /// Labels with `number` what is within a plane and has no label (a negative one) yet; how many those are,
    /// and how many without a label remain in the shells around it. There may be more labels than rows, and there
    /// are so many that they can be worked on together.
    pub(super) fn label(labels: &mut [f64], number: f64, rows: &Columns<'_>, cut: &Cut, threshold: f64) -> [usize; 2] {
        let (mut inside, mut both) = (0u64, 0u64);
        for (labels, start) in labels.as_chunks_mut::<LANES>().0.iter_mut().zip((0..rows.b.len()).step_by(LANES)) {
            let mut room = [[0.0; LANES]; 4];
            let Sizes(sizes) = Stretch::of(rows, start, &mut room).sizes(rows, start, cut);
            for l in 0..LANES {
                let (free, near) = (labels[l] < 0.0, sizes[l] <= threshold);
                inside += u64::from(free & near);
                both += u64::from(free & (sizes[l] <= 2.0 * threshold));
                labels[l] = if free & near { number } else { labels[l] };
            }
        }
        [inside as usize, (both - inside) as usize]
    }

    /// Sums of the rows with a label.
    pub(super) fn labelled(rows: &Columns<'_>, labels: &[f64], number: f64, count: usize) -> Sums {
        let mut adding = Adding::new();
        for start in (0..rows.b.len()).step_by(LANES) {
            let (mut room, mut room_of_labels) = ([[0.0; LANES]; 4], [0.0; LANES]);
            let labels = lanes(labels, start, &mut room_of_labels);
            adding.add(&Stretch::of(rows, start, &mut room), |l| labels[l] == number);
        }
        adding.sums(count as u64)
    }

    /// Labels as numbers, `none` for negative ones.
    pub(super) fn numbers(out: &mut [u16], labels: &[f64], none: u16) {
        for (out, label) in out.iter_mut().zip(labels) {
            *out = if *label < 0.0 { none } else { whole(label.abs()) as u16 };
        }
    }

    /// Sums of rows.
    pub(super) fn sums(rows: &Columns<'_>) -> Sums {
        let (mut adding, count) = (Adding::new(), rows.b.len());
        for start in (0..count).step_by(LANES) {
            let mut room = [[0.0; LANES]; 4];
            let some = Stretch::of(rows, start, &mut room);
            adding.add(&some, |l| !some.b[l].is_nan());
        }
        adding.sums(count as u64)
    }

    /// The least and the greatest coordinates.
    pub(super) fn bounds(points: &[Vector3<f64>]) -> [[f64; 3]; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            for k in 0..3 {
                low[k] = if p[k] < low[k] { p[k] } else { low[k] };
                high[k] = if p[k] > high[k] { p[k] } else { high[k] };
            }
        }
        [low, high]
    }

    /// Points less a middle, in columns.
    pub(super) fn columns_of(points: &[Vector3<f64>], middle: &Vector3<f64>, x: &mut [f64], y: &mut [f64], z: &mut [f64]) {
        for (((p, x), y), z) in points.iter().zip(x).zip(y).zip(z) {
            *x = p.x - middle.x;
            *y = p.y - middle.y;
            *z = p.z - middle.z;
        }
    }

    /// How many points are finite and within a range.
    pub(super) fn usable(points: &[Vector3<f64>], range: &[f64; 2]) -> usize {
        points.iter().map(|p| u64::from(is_usable(p, range))).sum::<u64>() as usize
    }

    /// a . x + b . y + c . z + d.
    pub(super) fn project(out: &mut [f64], places: &[&[f64]; 3], axis: &[f64; 3], offset: f64) {
        let ([x, y, z], [a, b, c]) = (places, axis);
        for (((out, x), y), z) in out.iter_mut().zip(*x).zip(*y).zip(*z) {
            *out = a * x + b * y + c * z + offset;
        }
    }

    /// Quotients in place.
    pub(super) fn divide(x: &mut [f64], y: &mut [f64], z: &mut [f64], b: &[f64]) {
        for (((x, y), z), b) in x.iter_mut().zip(y).zip(z).zip(b) {
            let inverse = 1.0 / b;
            *x *= inverse;
            *y *= inverse;
            *z *= inverse;
        }
    }

    /// The sum of numbers.
    pub(super) fn sum(numbers: &[f64]) -> f64 {
        let mut sums = [0.0; LANES];
        let (all, rest) = numbers.as_chunks::<LANES>();
        for some in all {
            for l in 0..LANES {
                sums[l] += some[l];
            }
        }
        total(&sums) + rest.iter().sum::<f64>()
    }

    /// The sum of numbers' squares.
    pub(super) fn sum_of_squares(numbers: &[f64]) -> f64 {
        let mut sums = [0.0; LANES];
        let (all, rest) = numbers.as_chunks::<LANES>();
        for some in all {
            for l in 0..LANES {
                sums[l] += some[l] * some[l];
            }
        }
        total(&sums) + rest.iter().map(|v| v * v).sum::<f64>()
    }

    /// In which of a grid's cells places are, row by row; `outside` beyond them. The grid begins at `low` and has
    /// so many cells a metre.
    pub(super) fn cells(
        out: &mut [u32],
        u: &[f64],
        v: &[f64],
        low: [f64; 2],
        per_metre: [f64; 2],
        counts: [u32; 2],
        outside: u32,
    ) {
        let size = counts.map(f64::from);
        for ((out, u), v) in out.iter_mut().zip(u).zip(v) {
            let (s, t) = ((u - low[0]) * per_metre[0], (v - low[1]) * per_metre[1]);
            let inside = (s >= 0.0) & (s <= size[0]) & (t >= 0.0) & (t <= size[1]);
            let (i, j) = (whole(if inside { s } else { 0.0 }), whole(if inside { t } else { 0.0 }));
            let (i, j) = (i.min(counts[0] - 1), j.min(counts[1] - 1));
            *out = if inside { i * counts[1] + j } else { outside };
        }
    }

    /// Directions on the faces of a cube, of equal angles: where on a face from 0 to 1 one way, and the other way
    /// with the face's number added; and ranges. Not numbers for the origin and what is not finite.
    pub(super) fn directions(u: &mut [f64], v: &mut [f64], range: &mut [f64], x: &[f64], y: &[f64], z: &[f64]) {
        for (((((u, v), range), x), y), z) in u.iter_mut().zip(v).zip(range).zip(x).zip(y).zip(z) {
            [*u, *v] = direction(*x, *y, *z);
            *range = (x * x + y * y + z * z).sqrt();
        }
    }

    /// The cells of directions on faces of so many cells a side; `none` of those that are not numbers.
    pub(super) fn cells_of_directions(out: &mut [u32], u: &[f64], v: &[f64], side: u32, none: u32) {
        let size = f64::from(side);
        for ((out, u), v) in out.iter_mut().zip(u).zip(v) {
            let inside = *u >= 0.0;
            let (u, v) = if inside { (*u, *v) } else { (0.0, 0.0) };
            let face = v.floor();
            let (i, j) = (whole(u * size).min(side - 1), whole((v - face) * size).min(side - 1));
            *out = if inside { (whole(face) * side + i) * side + j } else { none };
        }
    }
}

/// The whole part of a number from 0 to a million or so.
#[inline(always)]
fn whole(number: f64) -> u32 {
    debug_assert!((0.0..1e9).contains(&number));
    // SAFETY: the number is finite and small.
    unsafe { number.to_int_unchecked::<i32>() as u32 }
}

/// See `directions`.
#[inline(always)]
pub(super) fn direction(x: f64, y: f64, z: f64) -> [f64; 2] {
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let (first, second) = ((ax >= ay) & (ax >= az), ay >= az);
    let pick = |a: f64, b: f64, c: f64| {
        if first {
            a
        } else if second {
            b
        } else {
            c
        }
    };
    let (along, size) = (pick(x, y, z), pick(ax, ay, az));
    let face = pick(0.0, 2.0, 4.0) + if along < 0.0 { 1.0 } else { 0.0 };
    // Of equal angles, to a fifth of a degree, rather than of equal sides: the arctangent up to 45 degrees as a share
    // of the right angle (Rajan et al., "Efficient approximations for the arctangent function", IEEE SPM 2006).
    let share = |v: f64| {
        let t = v / size;
        t * (0.5 + 0.1737 * (1.0 - t.abs())) + 0.5
    };
    let (u, v) = (share(pick(y, z, x)), share(pick(z, x, y)).max(0.0));
    let usable = (size > 0.0) & x.is_finite() & y.is_finite() & z.is_finite();
    if usable { [u, face + if v < BELOW_ONE { v } else { BELOW_ONE }] } else { [f64::NAN; 2] }
}

/// The end of a face belongs to it.
const BELOW_ONE: f64 = 1.0 - 1e-9;

#[inline(always)]
pub(super) fn is_usable(p: &Vector3<f64>, range: &[f64; 2]) -> bool {
    let finite = p.x.is_finite() & p.y.is_finite() & p.z.is_finite();
    let norm = (p.x * p.x + p.y * p.y + p.z * p.z).sqrt();
    finite & (norm >= range[0]) & (norm <= range[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::planes::rows::{Kind, Rows};
    use crate::vectors::tests::of_each_processor;

    /// Numbers that look random.
    fn number(i: usize) -> f64 {
        (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) as f64 / u64::MAX as f64 - 0.5
    }

    fn rows(count: usize, with_origins: bool) -> Rows {
        let mut rows = Rows::new(with_origins, count);
        for i in 0..count {
            let vector = |k: usize| Vector3::from_fn(|r, _| number(100 * i + 10 * k + r));
            rows.push(&vector(0), 1.0 + number(i), &vector(1));
        }
        rows
    }

    #[test]
    fn processors_agree_and_count_as_one_by_one() {
        for (count_of_rows, with_origins) in [(0, false), (7, false), (32, true), (1000, false), (1001, true)] {
            let rows = rows(count_of_rows, with_origins);
            let (columns, n) = (rows.columns(), Vector3::new(0.4, -0.9, 0.3));
            let cuts = [Kind::Shots.cut(&n), Kind::Points { sigma: 0.4, middle: Vector3::z() }.cut(&n)];
            for cut in &cuts {
                let results = of_each_processor(|| {
                    let (mut all, mut labels) =
                        (vec![0.0; count_of_rows], vec![-1.0; count_of_rows.next_multiple_of(LANES)]);
                    residuals(&mut all, &columns, cut);
                    let taken = label(&mut labels, 3.0, &columns, cut, 0.3);
                    let tallied = tally(&columns, cut, 0.3);
                    assert_eq!(tallied.inside, labelled(&columns, &labels, 3.0, taken[0]));
                    assert_eq!([tallied.inside.count, tallied.shells], taken);
                    assert_eq!(count(&columns, cut, 0.3), taken);
                    (all, labels, tallied, common(&columns, [cut, &cuts[0]], 0.3), sums(&columns))
                });
                assert!(results.iter().all(|r| *r == results[0]));
                let (all, labels, tallied, _, whole) = &results[0];
                let inside: Vec<usize> = (0..count_of_rows).filter(|i| all[*i].abs() <= 0.3).collect();
                assert_eq!((tallied.inside.count, whole.count), (inside.len(), count_of_rows));
                assert!((0..count_of_rows).all(|i| (labels[i] == 3.0) == inside.contains(&i)));
                let xy: f64 = inside.iter().map(|i| rows.row(*i)[0] * rows.row(*i)[1]).sum();
                assert!((xy - tallied.inside.squares[1]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn directions_and_cells_are_the_same_everywhere() {
        let column = |k: usize| -> Vec<f64> { (0..777).map(|i| number(3 * i + k)).collect() };
        let (x, y, z) = (column(0), column(1), column(2));
        let results = of_each_processor(|| {
            let [mut u, mut v, mut range] = [0; 3].map(|_| vec![0.0; 777]);
            directions(&mut u, &mut v, &mut range, &x, &y, &z);
            let (mut directed, mut flat) = (vec![0; 777], vec![0; 777]);
            cells_of_directions(&mut directed, &u, &v, 45, u32::MAX);
            cells(&mut flat, &x, &y, [-0.4, -0.3], [20.0, 30.0], [16, 18], 288);
            (u, v, range, directed, flat)
        });
        assert!(results.iter().all(|r| *r == results[0]));
        let (_, _, _, directed, flat) = &results[0];
        assert!(directed.iter().all(|c| *c < 6 * 45 * 45) && flat.iter().all(|c| *c <= 288));
        assert!(flat.contains(&288) && flat.iter().any(|c| *c < 288));
        assert!(direction(0.0, 0.0, 0.0)[0].is_nan() && direction(f64::INFINITY, 1.0, 0.0)[0].is_nan());
    }
}
