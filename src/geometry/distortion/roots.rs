//! Real roots of polynomials of low degree: where a lens stops growing.

/// Value of c0 + c1 s + c2 s^2 + ...
fn value(c: &[f64], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |v, k| v * s + k)
}

/// Roots in [low, high] at which the polynomial c0 + c1 s + c2 s^2 + ... changes sign, ascending.
/// Between the roots of its derivative it is monotone, so bisection finds each.
fn roots(c: &[f64], low: f64, high: f64) -> Vec<f64> {
    if c.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = c.iter().enumerate().skip(1).map(|(i, k)| i as f64 * k).collect();
    let mut knots = vec![low];
    knots.extend(roots(&derivative, low, high));
    knots.push(high);
    let positive = |s: f64| value(c, s) > 0.0;
    knots.windows(2).filter(|w| positive(w[0]) != positive(w[1])).map(|w| bisect(c, w[0], w[1])).collect()
}

fn bisect(c: &[f64], mut low: f64, mut high: f64) -> f64 {
    let sign = value(c, low) > 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (value(c, middle) > 0.0) == sign { low = middle } else { high = middle }
    }
    low
}

/// Smallest positive root of c0 + c1 s + c2 s^2 + ... with c0 > 0.
pub(super) fn smallest_positive_root(c: &[f64]) -> Option<f64> {
    let degree = c.iter().rposition(|k| *k != 0.0)?;
    // Cauchy's bound: every root is below it.
    let bound = 1.0 + c[..degree].iter().map(|k| (k / c[degree]).abs()).fold(0.0, f64::max);
    roots(&c[..=degree], 0.0, bound.min(f64::MAX)).first().copied()
}

#[cfg(test)]
mod tests {
    use super::smallest_positive_root;

    /// Coefficients of the product of (1 - s / root).
    fn with_roots(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |c, root| {
            let mut next = c.clone();
            next.push(0.0);
            for (i, k) in c.iter().enumerate() {
                next[i + 1] -= k / root;
            }
            next
        })
    }

    #[test]
    fn finds_the_smallest_of_known_roots() {
        for roots in [&[2.0][..], &[3.0, 0.7], &[-1.0, 5.0, 9.0], &[0.4, -0.3, 1.2, 8.0], &[40.0, 0.01, -2.0, 3.0]] {
            let least = roots.iter().copied().filter(|r| *r > 0.0).fold(f64::INFINITY, f64::min);
            let found = smallest_positive_root(&with_roots(roots)).unwrap();
            assert!((found - least).abs() < 1e-12 * least.max(1.0), "{roots:?} {found}");
        }
    }

    #[test]
    fn without_a_positive_root_there_is_none() {
        assert!(smallest_positive_root(&with_roots(&[-1.0, -2.0, -0.1])).is_none());
        // 1 - s + s^2 has complex roots; s = 0 is no positive root.
        assert!(smallest_positive_root(&[1.0, -1.0, 1.0]).is_none());
        assert!(smallest_positive_root(&[1.0, 0.0, 0.0]).is_none());
        assert!(smallest_positive_root(&[]).is_none());
    }
}
