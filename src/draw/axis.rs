//! From values to places on a chart's axis, and round numbers to label it.

/// Three digits.
pub(super) fn short(v: f64) -> String {
    significant(v, 3)
}

/// So many digits, without needless zeros, "-" for what is no number.
pub fn significant(v: f64, digits: i32) -> String {
    if !v.is_finite() {
        return "-".into();
    }
    let decimals = if v == 0.0 { 0 } else { (digits - 1 - v.abs().log10().floor() as i32).clamp(0, 9) };
    let text = format!("{v:.*}", decimals as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// From values to the share of an axis's length.
pub(super) struct Scale {
    log: bool,
    pub low: f64,
    pub high: f64,
}

impl Scale {
    /// Over all values, with some air; a linear one of values above zero begins at zero where that is near.
    pub fn new(log: bool, values: impl Iterator<Item = f64>) -> Self {
        let mapped = values.map(|v| if log { v.log10() } else { v });
        let (mut low, mut high) = mapped.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if !log && low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        let air = if high > low { 0.04 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        let below = if !log && low == 0.0 { 0.0 } else { air };
        Self { log, low: low - below, high: high + air }
    }

    pub fn share(&self, value: f64) -> f64 {
        let v = if self.log { value.log10() } else { value };
        (v - self.low) / (self.high - self.low)
    }

    /// Round numbers within.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let mut ticks = Vec::new();
        if self.log {
            let wide = self.high - self.low > 3.0;
            for decade in self.low.floor() as i32..=self.high.ceil() as i32 {
                for digit in if wide { [1.0].as_slice() } else { [1.0, 2.0, 5.0].as_slice() } {
                    ticks.push(digit * 10f64.powi(decade));
                }
            }
        } else {
            let rough = (self.high - self.low) / 6.0;
            let unit = 10f64.powf(rough.log10().floor());
            let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * unit).find(|s| *s >= rough).unwrap_or(rough);
            let first = (self.low / step).ceil() as i64;
            ticks.extend((0..20).map(|k| (first + k) as f64 * step));
        }
        ticks.retain(|t| (-1e-9..=1.0 + 1e-9).contains(&self.share(*t)));
        ticks.into_iter().map(|t| (t, short(if t.abs() < 1e-12 { 0.0 } else { t }))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_within_the_axis() {
        let labels = |log, low: f64, high: f64| -> Vec<String> {
            Scale::new(log, [low, high].into_iter()).ticks().into_iter().map(|(_, label)| label).collect()
        };
        assert_eq!(labels(false, 0.0, 5.0), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(labels(true, 0.1, 20.0), ["0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(labels(true, 1e-3, 1e3), ["0.001", "0.01", "0.1", "1", "10", "100", "1000"]);
        assert!(!labels(false, 3.0, 3.0).is_empty());
        assert!(!Scale::new(false, std::iter::empty()).ticks().is_empty());
    }
}
