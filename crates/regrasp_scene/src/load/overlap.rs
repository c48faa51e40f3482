//! Obstacles that stand in supports.

use crate::scene::{Obstacle, Support};
use regrasp_base::toml_table::{Entry, Found};
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Shape, Vector};

/// An obstacle may be this deep in a support, in metres: it stands on it, by numbers that were rounded.
const DEEPEST: f64 = 1e-3;

/// Refuses obstacles that overlap a support: one of the two is not where the author wants it. `entries` are those of the obstacles.
///
/// Errors: an overlap of more than a millimetre (`S113`).
pub(super) fn refuse_overlaps(supports: &[Support], obstacles: &[Obstacle], entries: &[Entry], found: &mut Found) {
    for (obstacle, entry) in obstacles.iter().zip(entries) {
        let is_in = |support: &&Support| overlap(&obstacle.placed, &support.body.placed);
        let Some(support) = supports.iter().find(is_in) else { continue };
        let problem = format!("\"{}\" overlaps the support \"{}\"", obstacle.name, support.body.name);
        let diagnostic = entry.error("S113", found, problem).element("obstacle", &obstacle.name);
        let expected = "an obstacle that stands on the support, or beside it";
        found.diagnostics.push(diagnostic.expected(expected).fix("raise `position` of the obstacle"));
    }
}

/// True when neither a shift of `first` by [`DEEPEST`] along an axis nor no shift at all takes it out of `second`. Meshes are passed
/// over: only convex shapes are compared.
fn overlap(first: &PlacedShape, second: &PlacedShape) -> bool {
    if [first, second].into_iter().any(|placed| matches!(placed.shape, Shape::Mesh(_))) {
        return false;
    }
    let at = |placed: &PlacedShape, shift: Vector| Placement {
        rotation: placed.parent_from_shape.rotation.to_rotation_matrix().into_inner(),
        translation: placed.parent_from_shape.translation.vector + shift,
    };
    let fixed = at(second, Vector::zeros());
    let axes = [Vector::zeros(), Vector::x(), -Vector::x(), Vector::y(), -Vector::y(), Vector::z(), -Vector::z()];
    axes.iter().all(|axis| {
        let moved = at(first, axis * DEEPEST);
        let (mut direction, mut hints) = (Vector::zeros(), [0, 0]);
        let [a, b] = [Placed { shape: &first.shape, at: &moved }, Placed { shape: &second.shape, at: &fixed }];
        separation(a, b, 0.0, 0.0, &mut direction, &mut hints) == Separation::TooNear
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::Pose;

    fn upright(radius: f64, half_length: f64, z: f64) -> PlacedShape {
        let parent_from_shape = Pose::translation(0.1, 0.0, z);
        PlacedShape { parent_from_shape, shape: Shape::Cylinder { half_length, radius } }
    }

    #[test]
    fn a_post_may_stand_on_a_table_and_not_in_it() {
        let half_extents = Vector::new(0.3, 0.5, 0.02);
        let table = PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Cuboid { half_extents } };
        for (z, expected) in [(0.17, false), (0.1701, false), (0.1695, false), (0.168, true), (0.0, true), (0.3, false)]
        {
            assert_eq!(overlap(&upright(0.01, 0.15, z), &table), expected, "at {z}");
        }
    }
}
