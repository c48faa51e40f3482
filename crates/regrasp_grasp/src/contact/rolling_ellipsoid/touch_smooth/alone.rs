//! The normal with which a smooth convex tip touches one face, edge or corner, as if the object were nothing else.
//!
//! A face says it itself. On an edge or a corner the touching point of the tip lies along the normal, seen from there: one or two
//! equations, which Newton's method solves with the tip's radii of curvature. Where the tip is pressed in deeper than it is
//! curved there is no such normal.

use super::Stance;
use nalgebra::{Matrix2, Vector2};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::surface::Facing;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_robot::tip::smooth_hull::SmoothHull;

/// Steps of Newton's method, and how often a step is halved.
const MOST_STEPS: usize = 20;
const MOST_HALVINGS: usize = 5;
/// Longest step, in radians.
const LONGEST_STEP: f64 = 0.4;
/// After a step that is shorter, in radians, nobody looks again: what is left falls with the square of the step.
const LAST_STEP: f64 = 1e-7;
/// How far the touching point may be off the normal, in metres.
const OFF: f64 = 2e-16;

/// The normal of the touch at `place` on what `facing` says, from the normal of `stance` on; None where none is found.
pub(super) fn normal(tip: &SmoothHull, stance: &Stance, facing: &Facing, place: &Point) -> Option<Vector> {
    let along = match facing {
        Facing::Face(normal) => return Some(normal.into_inner()),
        Facing::Edge(along) => Some(along.into_inner()),
        Facing::Corner => None,
    };
    let start = match along {
        Some(along) => (stance.normal - along * along.dot(&stance.normal)).try_normalize(1e-3)?,
        None => stance.normal,
    };
    let mut now = Aside::of(tip, stance, along.as_ref(), place, start);
    for _ in 0..MOST_STEPS {
        let left = now.off.norm();
        if left <= OFF {
            break;
        }
        let turn = now.turn()?;
        if turn.norm() < LAST_STEP {
            return Some((now.normal + turn).normalize());
        }
        let mut share = (LONGEST_STEP / turn.norm()).min(1.0);
        let better = (0..MOST_HALVINGS).find_map(|_| {
            let next = Aside::of(tip, stance, along.as_ref(), place, (now.normal + turn * share).normalize());
            share *= 0.5;
            (next.off.norm() < left).then_some(next)
        });
        match better {
            Some(next) => now = next,
            // As near as rounding lets it come, or no nearer at all: the caller sees which.
            None => break,
        }
    }
    Some(now.normal)
}

/// How far the touching point of the tip is off the normal from a place.
struct Aside {
    normal: Vector,
    /// Two directions across the normal; of an edge the first is across it and the second not used.
    across: [Vector; 2],
    is_edge: bool,
    off: Vector2<f64>,
    /// How `off` falls when the normal turns.
    falls: Matrix2<f64>,
}

impl Aside {
    fn of(tip: &SmoothHull, stance: &Stance, along: Option<&Vector>, place: &Point, normal: Vector) -> Self {
        let across = match along {
            Some(along) => [along.cross(&normal), *along],
            None => {
                let (x, y) = tangents(&UnitVector::new_unchecked(normal));
                [x.into_inner(), y.into_inner()]
            }
        };
        let turn = stance.object_from_link;
        let bend = tip.bend(&-turn.tr_mul(&normal));
        let way = stance.center + turn * bend.point - place;
        let in_link = across.map(|t| turn.tr_mul(&t));
        let radius = |i: usize, j: usize| in_link[i].dot(&(bend.radii * in_link[j]));
        let gap = way.dot(&normal);
        let (xx, xy, yy) = (radius(0, 0), radius(0, 1), radius(1, 1));
        Aside {
            normal,
            across,
            is_edge: along.is_some(),
            off: Vector2::new(across[0].dot(&way), if along.is_some() { 0.0 } else { across[1].dot(&way) }),
            falls: Matrix2::new(xx + gap, xy, xy, yy + gap),
        }
    }

    /// The turn of the normal after which nothing is off, to first order; None where the tip is pressed in too deep.
    fn turn(&self) -> Option<Vector> {
        if self.is_edge {
            let falls = self.falls.m11;
            return (falls > 0.0).then(|| self.across[0] * (self.off.x / falls));
        }
        let is_positive = self.falls.m11 > 0.0 && self.falls.determinant() > 0.0;
        let turn = is_positive.then(|| self.falls.try_inverse())?? * self.off;
        Some(self.across[0] * turn.x + self.across[1] * turn.y)
    }
}
