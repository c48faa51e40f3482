//! Real roots of polynomials of degree four and less in `[-1, 1]`, by the roots of their derivatives.
//!
//! Between neighbouring roots of the derivative a polynomial is monotone, so that a sign change brackets exactly one
//! root. Slower than Ferrari's formulas, but it can't lose a root to cancellation.

use arrayvec::ArrayVec;

/// A touching root is accepted when the extremum is below this share of the sum of absolute coefficients.
const TOUCH: f64 = 1e-11;

/// Roots, in rising order. Room for every root and for extrema that count as touching roots.
pub type Roots = ArrayVec<f64, 8>;

/// Roots in `[-1, 1]` of `sum_i coefficients[i] * t^i`, of degree four at most. Roots that nearly coincide may be
/// given twice. None of a polynomial that vanishes.
pub fn roots_in_unit(coefficients: &[f64]) -> Roots {
    let mut roots = Roots::new();
    let degree = coefficients.len() - 1;
    let scale: f64 = coefficients.iter().map(|c| c.abs()).sum();
    if degree == 0 || scale == 0.0 {
        return roots;
    }
    let mut derivative = [0.0; 5];
    for i in 1..=degree {
        derivative[i - 1] = i as f64 * coefficients[i];
    }
    let extrema = roots_in_unit(&derivative[..degree]);
    let mut low = -1.0;
    let mut value_low = evaluate(coefficients, low);
    for (i, &high) in extrema.iter().chain([&1.0]).enumerate() {
        let value_high = evaluate(coefficients, high);
        if value_low == 0.0 {
            push(&mut roots, low);
        } else if value_low * value_high < 0.0 {
            push(&mut roots, bracketed_root(coefficients, &derivative[..degree], low, value_low, high));
        } else if i < extrema.len() && value_high.abs() <= TOUCH * scale {
            push(&mut roots, high);
        }
        (low, value_low) = (high, value_high);
    }
    if value_low == 0.0 {
        push(&mut roots, low);
    }
    roots
}

fn push(roots: &mut Roots, root: f64) {
    if !roots.is_full() && roots.last() != Some(&root) {
        roots.push(root);
    }
}

fn evaluate(coefficients: &[f64], t: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// Newton steps kept inside a shrinking bracket.
fn bracketed_root(coefficients: &[f64], derivative: &[f64], low: f64, value_low: f64, high: f64) -> f64 {
    let (mut low, mut high) = (low, high);
    let mut t = 0.5 * (low + high);
    for _ in 0..80 {
        let value = evaluate(coefficients, t);
        if value == 0.0 {
            return t;
        }
        if (value < 0.0) == (value_low < 0.0) {
            low = t;
        } else {
            high = t;
        }
        let newton = t - value / evaluate(derivative, t);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - t).abs() < 1e-15 {
            return next;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_roots_a_polynomial_was_made_of() {
        let mut rng = regrasp_base::Rng::keyed(5, "quartic", 0);
        for _ in 0..5000 {
            let mut planted: Vec<f64> = (0..4).map(|_| rng.uniform(-1.6, 1.6)).collect();
            planted.sort_by(f64::total_cmp);
            let mut coefficients = vec![rng.uniform(0.5, 2.0)];
            for root in &planted {
                let mut next = vec![0.0; coefficients.len() + 1];
                for (i, c) in coefficients.iter().enumerate() {
                    next[i] -= root * c;
                    next[i + 1] += c;
                }
                coefficients = next;
            }
            let found = roots_in_unit(&coefficients);
            for root in planted.iter().filter(|root| root.abs() < 1.0) {
                assert!(found.iter().any(|t| (t - root).abs() < 1e-3), "{planted:?} {found:?}");
            }
            for t in &found {
                assert!(planted.iter().any(|root| (t - root).abs() < 1e-3), "{planted:?} {found:?}");
            }
        }
    }

    #[test]
    fn a_double_root_is_found() {
        // (t - 0.3)^2 (t^2 + 1)
        let found = roots_in_unit(&[0.09, -0.6, 1.09, -0.6, 1.0]);
        assert!(found.iter().any(|t| (t - 0.3).abs() < 1e-5), "{found:?}");
    }
}
