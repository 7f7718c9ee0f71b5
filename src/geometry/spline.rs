//! Cubic Hermite interpolation of values at given places, by slopes of parabolas through three
//! neighbours; and with those slopes limited so that monotone values stay monotone (Fritsch and
//! Carlson, "Monotone piecewise cubic interpolation", SIAM J. Numer. Anal. 17, 1980).

/// The interval that holds `x`: the index of its left end. `places` ascend, two at least.
fn interval(places: &[f64], x: f64) -> usize {
    places.partition_point(|p| *p <= x).clamp(1, places.len() - 1) - 1
}

fn slopes(places: &[f64], values: &[f64]) -> Vec<f64> {
    let n = places.len();
    let h: Vec<f64> = places.windows(2).map(|p| p[1] - p[0]).collect();
    let d: Vec<f64> = values.windows(2).zip(&h).map(|(v, h)| (v[1] - v[0]) / h).collect();
    if n == 2 {
        return vec![d[0]; 2];
    }
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    (0..n)
        .map(|i| match i {
            0 => end(h[0], h[1], d[0], d[1]),
            i if i == n - 1 => end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]),
            i => (h[i - 1] * d[i] + h[i] * d[i - 1]) / (h[i - 1] + h[i]),
        })
        .collect()
}

/// Slopes for which no piece overshoots.
fn limited(places: &[f64], values: &[f64]) -> Vec<f64> {
    let mut m = slopes(places, values);
    for i in 0..places.len() - 1 {
        let d = (values[i + 1] - values[i]) / (places[i + 1] - places[i]);
        for k in [i, i + 1] {
            if m[k] * d <= 0.0 {
                m[k] = 0.0;
            }
        }
        if d != 0.0 {
            let length = (m[i] / d).hypot(m[i + 1] / d);
            if length > 3.0 {
                m[i] *= 3.0 / length;
                m[i + 1] *= 3.0 / length;
            }
        }
    }
    m
}

fn hermite(places: &[f64], values: &[f64], slopes: &[f64], x: f64) -> f64 {
    let i = interval(places, x);
    let h = places[i + 1] - places[i];
    let t = (x - places[i]) / h;
    let s = 1.0 - t;
    let (left, right) = (s * s * (1.0 + 2.0 * t), t * t * (1.0 + 2.0 * s));
    values[i] * left + values[i + 1] * right + h * t * s * (s * slopes[i] - t * slopes[i + 1])
}

/// Weights of the values in the interpolated one, which is linear in them; `places` ascend strictly.
pub fn weights(places: &[f64], x: f64) -> Vec<f64> {
    let n = places.len();
    if n == 1 {
        return vec![1.0];
    }
    (0..n)
        .map(|k| {
            let unit: Vec<f64> = (0..n).map(|i| f64::from(i == k)).collect();
            hermite(places, &unit, &slopes(places, &unit), x)
        })
        .collect()
}

/// The monotone interpolation and its derivatives by the values.
pub fn monotone(places: &[f64], values: &[f64], x: f64) -> (f64, Vec<f64>) {
    if places.len() == 1 {
        return (values[0], vec![1.0]);
    }
    let at = |values: &[f64]| hermite(places, values, &limited(places, values), x);
    // The limit makes it nonlinear, with kinks: differences are as good as any derivative.
    let range =
        values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v)) - values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
    let step = 1e-6 * range.max(1e-300);
    let mut moved = values.to_vec();
    let by = (0..values.len())
        .map(|k| {
            let mut ends = [0.0; 2];
            for (end, sign) in ends.iter_mut().zip([1.0, -1.0]) {
                moved[k] = values[k] + sign * step;
                *end = at(&moved);
            }
            moved[k] = values[k];
            (ends[0] - ends[1]) / (2.0 * step)
        })
        .collect();
    (at(values), by)
}

/// The monotone interpolation of values that ascend or descend strictly, and its inverse.
#[derive(Debug, Clone, PartialEq)]
pub struct MonotoneSpline {
    places: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl MonotoneSpline {
    /// `places` ascend strictly, two at least.
    pub fn new(places: Vec<f64>, values: Vec<f64>) -> Self {
        let slopes = limited(&places, &values);
        Self { places, values, slopes }
    }

    pub fn at(&self, x: f64) -> f64 {
        hermite(&self.places, &self.values, &self.slopes, x)
    }

    /// Its derivative.
    pub fn slope(&self, x: f64) -> f64 {
        let i = interval(&self.places, x);
        let h = self.places[i + 1] - self.places[i];
        let t = (x - self.places[i]) / h;
        let d = (self.values[i + 1] - self.values[i]) / h;
        let (left, right) = (self.slopes[i], self.slopes[i + 1]);
        6.0 * t * (1.0 - t) * d + (1.0 - t) * (1.0 - 3.0 * t) * left + t * (3.0 * t - 2.0) * right
    }

    /// The place of a value between the first and the last: Newton's method in a bracket that is halved
    /// where a step leaves it.
    pub fn place(&self, value: f64) -> f64 {
        let n = self.values.len();
        let up = self.values[n - 1] > self.values[0];
        let before = |v: f64| if up { v <= value } else { v >= value };
        let i = self.values.partition_point(|v| before(*v)).clamp(1, n - 1) - 1;
        let (mut low, mut high) = (self.places[i], self.places[i + 1]);
        let mut x = low + (high - low) * (value - self.values[i]) / (self.values[i + 1] - self.values[i]);
        for _ in 0..100 {
            let off = self.at(x) - value;
            if (off <= 0.0) == up {
                low = x;
            } else {
                high = x;
            }
            let mut next = x - off / self.slope(x);
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            if off == 0.0 || (next - x).abs() <= f64::EPSILON * x.abs().max(high - low) {
                return if off == 0.0 { x } else { next };
            }
            x = next;
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_interpolated_exactly_and_weights_are_derivatives() {
        let places = [0.0, 0.3, 0.5, 1.0, 1.2];
        let f = |x: f64| 2.0 + 3.0 * x - 0.7 * x * x;
        let values = places.map(f);
        for i in 0..=24 {
            let x = 0.05 * f64::from(i);
            let w = weights(&places, x);
            let sum: f64 = w.iter().zip(&values).map(|(w, v)| w * v).sum();
            assert!((sum - f(x)).abs() < 1e-12, "{x}: {sum}");
            // Monotone values far from the limit: the same.
            let (value, by) = monotone(&places, &values, x);
            assert!((value - f(x)).abs() < 1e-12);
            assert!(by.iter().zip(&w).all(|(a, b)| (a - b).abs() < 1e-6), "{x}");
        }
    }

    #[test]
    fn monotone_values_stay_monotone() {
        let places = [0.0, 0.1, 0.2, 0.9, 1.0, 1.1];
        let values = [0.0, 0.01, 2.0, 2.001, 2.002, 5.0];
        let at = |x: f64| monotone(&places, &values, x).0;
        let mut last = at(0.0);
        for i in 1..=1100 {
            let next = at(f64::from(i) * 1e-3);
            assert!(next >= last - 1e-12, "{i}");
            last = next;
        }
        for (p, v) in places.iter().zip(&values) {
            assert!((at(*p) - v).abs() < 1e-12);
        }
        // The unlimited one overshoots here.
        let free = |x: f64| weights(&places, x).iter().zip(&values).map(|(w, v)| w * v).sum::<f64>();
        assert!((0..=1100).any(|i| free(f64::from(i) * 1e-3) < -0.01));
    }

    #[test]
    fn derivatives_by_the_values_hold_where_the_limit_acts() {
        let places = [0.0, 0.1, 0.2, 0.9];
        let values = [0.0, 0.01, 2.0, 2.4];
        let (x, h) = (0.15, 1e-4);
        let by = monotone(&places, &values, x).1;
        for k in 0..4 {
            let mut up = values;
            up[k] += h;
            let slope = (monotone(&places, &up, x).0 - monotone(&places, &values, x).0) / h;
            assert!((slope - by[k]).abs() < 1e-3, "{k}: {slope} {}", by[k]);
        }
    }

    #[test]
    fn the_inverse_gives_back_every_place() {
        for sign in [1.0, -1.0] {
            let places = vec![-1.0, -0.4, 0.1, 0.2, 0.9, 1.0];
            let values = vec![-3.0, -0.5, 0.0, 0.01, 2.0, 2.4].into_iter().map(|v| sign * v).collect();
            let spline = MonotoneSpline::new(places.clone(), values);
            for k in 0..=2000 {
                let x = -1.0 + f64::from(k) * 1e-3;
                let back = spline.place(spline.at(x));
                // Where the curve is flat a value says less of its place.
                let blur = 1e-15 / spline.slope(x).abs().max(1e-9);
                assert!((back - x).abs() < 1e-13 + 8.0 * blur, "{x}: {back}");
                if places.iter().all(|p| (p - x).abs() > 1e-5) {
                    let slope = (spline.at(x + 1e-6) - spline.at(x - 1e-6)) / 2e-6;
                    assert!((slope - spline.slope(x)).abs() < 1e-5, "{x}: {slope} {}", spline.slope(x));
                }
            }
        }
    }
}
