//! Where a smooth hull touches the surface near it.
//!
//! The normal is sought at which the tip's touching point and the nearest point of the surface face each other. The surface is
//! seen from a little inside the tip, so that a tip that presses in has a nearest point too. Differences of what is sought give
//! the steps: no curvature of either body is asked for.
//!
//! On surfaces that fold there are many such normals, and that search finds none at some sharp rims. So what it finds counts only
//! where it is proven that nothing of the surface is nearer (`smooth_reach`); otherwise the nearest point of all triangles is sought.

use crate::check::patch::Patch;
use crate::check::rolling::Touch;
use crate::check::tip_surface::Smooth;
use nalgebra::{Matrix2, Matrix3, Vector2};
use regrasp_geometry::{Point, Vector};
use std::cell::RefCell;

/// How far inside the tip the surface is seen from, in metres: more than the contact tolerance.
pub const SEEN_FROM: f64 = 1.5e-3;
/// Difference of two normals over which slopes are taken, in radians.
const NUDGE: f64 = 1e-7;
/// Normals that agree so well are one.
const AGREED: f64 = 1e-12;
/// The same where rounding allows no better.
const NEARLY_AGREED: f64 = 1e-9;
/// Slopes are kept for the next step when a step leaves less than this share of the difference.
const KEEP_BELOW: f64 = 0.2;
/// Gaps and feet, in metres, between which the nearest point found in two ways may differ.
const SAME_GAP: f64 = 1e-6;
const SAME_FOOT: f64 = 5e-5;
/// Steps, halvings of a step, and the longest step, in radians.
const MOST_STEPS: usize = 60;
const MOST_HALVINGS: usize = 12;
const LONGEST_STEP: f64 = 0.3;

/// A smooth hull as it stands over a surface, in the object frame.
pub struct Place<'a> {
    /// The surface.
    pub patch: &'a Patch<'a>,
    /// The hull.
    pub smooth: &'a Smooth,
    /// Its centre.
    pub center: Point,
    /// Its rotation.
    pub turn: Matrix3<f64>,
    /// Per triangle of the patch, the plane of the hull that last proved it to be no nearer; may be empty.
    pub proofs: &'a RefCell<Vec<usize>>,
}

impl Place<'_> {
    /// How much the normal of the surface, seen from the tip whose normal is `-normal`, differs from `normal`; and the touch as
    /// if they agreed.
    fn look(&self, normal: &Vector) -> Option<(Vector, Touch)> {
        let facing = self.center + self.turn * self.smooth.point(&-self.turn.tr_mul(normal));
        let inside = facing + normal * SEEN_FROM;
        let foot = self.patch.foot(&inside)?;
        let seen = (inside - foot).try_normalize(1e-9)?;
        Some((seen - normal, Touch { foot, normal: *normal, gap: (facing - foot).dot(normal) }))
    }

    /// The touch: that with a normal near one of the guesses, where nothing is nearer by more than `slack`, else where the surface is
    /// nearest. None where no surface is near, and on primitives where no guess leads to one.
    pub(super) fn touch(&self, guesses: &[Vector], slack: f64) -> Option<Touch> {
        let mut settled = guesses.iter().filter_map(|guess| self.settle(guess));
        if let Some(touch) = settled.find(|touch| self.is_nothing_nearer(touch, touch.gap - slack)) {
            return Some(touch);
        }
        let nearest = self.nearest()?;
        // The same point, to rounding.
        let same = |touch: &Touch| {
            (touch.gap - nearest.gap).abs() < SAME_GAP && (touch.foot - nearest.foot).norm() < SAME_FOOT
        };
        Some(self.settle(&nearest.normal).filter(same).unwrap_or(nearest))
    }

    /// A touch with a normal near `first`; none where none is found.
    pub(super) fn settle(&self, first: &Vector) -> Option<Touch> {
        let (mut off, mut touch) = self.look(first)?;
        let mut kept: Option<Slopes> = None;
        for _ in 0..MOST_STEPS {
            let left = off.norm();
            if left < AGREED {
                return Some(touch);
            }
            let old = kept.take();
            let is_old = old.is_some();
            let Some(slopes) = old.or_else(|| self.slopes(&touch.normal, &off)) else { break };
            let step = slopes.step(&off);
            let mut share = (LONGEST_STEP / step.norm()).min(1.0);
            let mut better = None;
            for _ in 0..if is_old { 1 } else { MOST_HALVINGS } {
                better = self.look(&(touch.normal + step * share).normalize()).filter(|(next, _)| next.norm() < left);
                if better.is_some() {
                    break;
                }
                share *= 0.5;
            }
            match better {
                Some(next) => {
                    kept = Some(slopes).filter(|_| next.0.norm() < KEEP_BELOW * left);
                    (off, touch) = next;
                }
                // Slopes that were kept are too old.
                None if is_old => {}
                None => break,
            }
        }
        (off.norm() < NEARLY_AGREED).then_some(touch)
    }

    /// How the difference changes with the normal.
    fn slopes(&self, normal: &Vector, off: &Vector) -> Option<Slopes> {
        let aside = if normal.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
        let first = normal.cross(&aside).normalize();
        let across = [first, normal.cross(&first)];
        let slope = |t: &Vector| {
            let (there, _) = self.look(&(normal + t * NUDGE).normalize())?;
            let change = (there - off) / NUDGE;
            Some(Vector2::new(change.dot(&across[0]), change.dot(&across[1])))
        };
        let inverse = Matrix2::from_columns(&[slope(&across[0])?, slope(&across[1])?]).try_inverse()?;
        inverse.iter().all(|x| x.is_finite()).then_some(Slopes { across, inverse })
    }
}

/// Slopes of the difference in two directions across a normal.
struct Slopes {
    across: [Vector; 2],
    inverse: Matrix2<f64>,
}

impl Slopes {
    /// The change of the normal that brings the difference to zero.
    fn step(&self, off: &Vector) -> Vector {
        let step = self.inverse * Vector2::new(off.dot(&self.across[0]), off.dot(&self.across[1]));
        -(self.across[0] * step.x + self.across[1] * step.y)
    }
}
