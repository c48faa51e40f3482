//! Shorter paths.

use super::distance;
use regrasp_base::Rng;

/// Settings of [`simplify`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimplifySettings {
    /// Shortcuts between any two places that are tried.
    pub n_shortcuts: usize,
    /// Tries after the last that helped.
    pub patience: usize,
}

impl Default for SimplifySettings {
    fn default() -> Self {
        SimplifySettings { n_shortcuts: 100, patience: 15 }
    }
}

/// Makes a path shorter: leaves out configurations, then connects places between them. The ends stay.
pub fn simplify(
    path: &mut Vec<Vec<f64>>,
    settings: &SimplifySettings,
    rng: &mut Rng,
    mut is_free: impl FnMut(&[f64], &[f64]) -> bool,
) {
    leave_out(path, &mut is_free);
    let mut failed = 0;
    for _ in 0..settings.n_shortcuts {
        if path.len() < 3 || failed > settings.patience {
            break;
        }
        failed = if shortcut(path, rng, &mut is_free) { 0 } else { failed + 1 };
    }
    if settings.n_shortcuts > 0 {
        leave_out(path, &mut is_free);
    }
}

/// From each configuration straight to the last one that is seen.
fn leave_out(path: &mut Vec<Vec<f64>>, is_free: &mut impl FnMut(&[f64], &[f64]) -> bool) {
    let mut first = 0;
    while first + 2 < path.len() {
        let seen = (first + 2..path.len()).rev().find(|&last| is_free(&path[first], &path[last]));
        if let Some(last) = seen {
            path.drain(first + 1..last);
        }
        first += 1;
    }
}

/// Connects two random places, by length; true where that helped.
fn shortcut(path: &mut Vec<Vec<f64>>, rng: &mut Rng, is_free: &mut impl FnMut(&[f64], &[f64]) -> bool) -> bool {
    let lengths: Vec<f64> = path.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect();
    let whole: f64 = lengths.iter().sum();
    let mut draw = || rng.uniform(0.0, whole);
    let (a, b) = (draw(), draw());
    let place = |mut at: f64| {
        for (k, length) in lengths.iter().enumerate() {
            if at <= *length || k + 1 == lengths.len() {
                let share = if *length > 0.0 { (at / length).min(1.0) } else { 0.0 };
                let point: Vec<f64> = path[k].iter().zip(&path[k + 1]).map(|(p, q)| p + share * (q - p)).collect();
                return (k, point);
            }
            at -= length;
        }
        (0, path[0].clone())
    };
    let ((first, from), (last, to)) = (place(a.min(b)), place(a.max(b)));
    if first == last || (a - b).abs() - distance(&from, &to) < 1e-3 * whole {
        return false;
    }
    if !is_free(&from, &to) {
        return false;
    }
    path.splice(first + 1..=last, [from, to]);
    true
}
