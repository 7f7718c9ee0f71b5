//! Of repeated measurements.

use super::report::Measured;

/// Mean and its standard deviation.
pub fn mean(values: &[f64]) -> Measured {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n.max(1.0);
    let square = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Measured { value, sigma: (square / n.max(1.0)).sqrt(), count: values.len() as u32 }
}

/// Standard deviation within two groups, and that of it.
pub fn deviation(a: &[f64], b: &[f64]) -> Measured {
    let within = |v: &[f64]| {
        let m = mean(v).value;
        v.iter().map(|x| (x - m).powi(2)).sum::<f64>()
    };
    let freedom = (a.len() + b.len()).saturating_sub(2).max(1) as f64;
    let value = ((within(a) + within(b)) / freedom).sqrt();
    Measured { value, sigma: value / (2.0 * freedom).sqrt(), count: (a.len() + b.len()) as u32 }
}

/// Slope of a line through (time, angle), absolute.
pub fn slope(points: &[(f64, f64)]) -> Option<Measured> {
    let n = points.len() as f64;
    if points.len() < 4 {
        return None;
    }
    let (t, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let tt: f64 = points.iter().map(|p| (p.0 - t).powi(2)).sum();
    let ty: f64 = points.iter().map(|p| (p.0 - t) * (p.1 - y)).sum();
    if tt <= 0.0 {
        return None;
    }
    let value = ty / tt;
    let rest: f64 = points.iter().map(|p| (p.1 - y - value * (p.0 - t)).powi(2)).sum();
    Some(Measured { value: value.abs(), sigma: (rest / (n - 2.0) / tt).sqrt(), count: points.len() as u32 })
}
