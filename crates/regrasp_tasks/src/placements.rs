//! Where the object may lie: the start, the goal, and places on supports.

use crate::context::Context;
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_arms::World;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use std::cell::OnceCell;
use std::sync::Arc;

/// The object touches a support that is no farther than this, in metres.
pub const TOUCHING: f64 = 5e-4;
/// Directions differ by no more than this in one stable pose, in radians.
const SAME_POSE: f64 = 0.05;

/// A pose at which the object lies on a support.
pub struct Place {
    /// Pose of the object.
    pub world_from_object: Pose,
    /// Index in `Scene::supports`; the first of what rests.
    pub support: usize,
    touching: Vec<usize>,
    with_object: OnceCell<Arc<World>>,
    without_supports: OnceCell<Arc<World>>,
}

impl Place {
    /// None where the object touches no support.
    pub fn new(context: &Context, world_from_object: &Pose) -> Option<Self> {
        let touching: Vec<usize> = (0..context.scene.supports.len())
            .filter(|&support| !is_apart(context, world_from_object, support, TOUCHING))
            .collect();
        let support = *touching.first()?;
        // Supports come first among what rests.
        Some(Place {
            world_from_object: *world_from_object,
            support,
            touching,
            with_object: OnceCell::new(),
            without_supports: OnceCell::new(),
        })
    }

    /// Everything that rests, the object too.
    pub fn with_object(&self, context: &Context) -> &Arc<World> {
        self.with_object.get_or_init(|| Arc::new(context.with_object(&self.world_from_object)))
    }

    /// Everything that rests but the supports that the object touches, without the object.
    pub fn without_supports(&self, context: &Context) -> &Arc<World> {
        self.without_supports.get_or_init(|| Arc::new(context.fixed.without(&self.touching)))
    }

    /// Name of the support.
    pub fn support_name<'s>(&self, context: &Context<'s>) -> &'s str {
        &context.scene.supports[self.support].body.name
    }
}

/// True where the object, or its hull, keeps `distance` from what rests, by its index in [`Context::fixed`].
pub fn is_apart(context: &Context, world_from_object: &Pose, other: usize, distance: f64) -> bool {
    let at_object = Placement::from(world_from_object);
    let cover = &context.covers.objects[&context.query.object];
    // The shapes of a cover are convex.
    cover.shapes.iter().all(|own| {
        let at = at_object.then(&Placement::from(&own.parent_from_shape));
        context.fixed.is_apart(other, &own.shape, &at, distance)
    })
}

/// Indices of stable poses of a list in which the object lies at a pose.
pub fn stable_pose(context: &Context, hand: usize, world_from_object: &Pose) -> Option<usize> {
    let down = world_from_object.rotation.inverse() * -context.up();
    let poses = context.hands[hand].list.stable_poses.iter();
    let alike = |down_in_object: &[f64; 3]| Vector::from(*down_in_object).dot(&down);
    let (index, best) =
        poses.enumerate().map(|(k, pose)| (k, alike(&pose.down_in_object))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best > SAME_POSE.cos()).then_some(index)
}

/// Poses on supports with flat tops, by any stable pose of the lists. Others in each round.
pub fn intermediate(context: &Context, round: usize) -> Vec<Place> {
    let mut found: Vec<Place> = Vec::new();
    let mut rng = Rng::keyed(context.seed, "placements", round as u64);
    let mut downs: Vec<(Vector, f64)> = Vec::new();
    for pose in context.hands.iter().flat_map(|hand| &hand.list.stable_poses) {
        let down = Vector::from(pose.down_in_object);
        if downs.iter().all(|(other, _)| other.dot(&down) < SAME_POSE.cos()) {
            downs.push((down, pose.height));
        }
    }
    let tops: Vec<(Pose, [f64; 2])> =
        context.scene.supports.iter().filter_map(|support| top(context, &support.body.placed)).collect();
    if downs.is_empty() || tops.is_empty() {
        return found;
    }
    let up = context.up();
    // In turn over supports and stable poses.
    for draw in 0..context.settings.placements * DRAWS_PER_PLACE {
        if found.len() >= context.settings.placements {
            break;
        }
        let (down, height) = downs[draw % downs.len()];
        let (top, half) = &tops[(draw / downs.len()) % tops.len()];
        let at =
            top * regrasp_geometry::Point::new(rng.uniform(-half[0], half[0]), rng.uniform(-half[1], half[1]), 0.0);
        let upright = UnitQuaternion::rotation_between(&down, &-up).unwrap_or_else(|| {
            let (aside, _) = regrasp_geometry::frame::tangents(&regrasp_geometry::UnitVector::new_normalize(up));
            UnitQuaternion::from_axis_angle(&aside, std::f64::consts::PI)
        });
        let turn = UnitQuaternion::from_scaled_axis(up * rng.uniform(-std::f64::consts::PI, std::f64::consts::PI));
        let rotation = turn * upright;
        // The object's lowest points are on the top, its centre of mass over the point drawn.
        let center = rotation * context.object.center_of_mass.coords;
        let flat = |v: &Vector| v - up * up.dot(v);
        let position = flat(&(at.coords - center)) + up * (up.dot(&at.coords) + height);
        let pose = Pose::from_parts(Translation3::from(position), rotation);
        let mut others = context.scene.supports.len()..context.fixed.obstacles.len();
        let is_clear = others.all(|other| is_apart(context, &pose, other, ROOM));
        if is_clear && let Some(place) = Place::new(context, &pose) {
            found.push(place);
        }
    }
    found
}

/// Distance of the object to what stands on a support, in metres.
const ROOM: f64 = 5e-3;
/// Draws for each place that is wanted.
const DRAWS_PER_PLACE: usize = 20;

/// The flat top of a support: a frame in its middle with z up, and half its sizes less a margin for the object. None for other shapes,
/// and tops that are not level.
fn top(context: &Context, placed: &PlacedShape) -> Option<(Pose, [f64; 2])> {
    let up = context.up();
    let margin = context.object.radius;
    let (half, axis_of_top) = match &placed.shape {
        Shape::Cuboid { half_extents } => {
            let local = placed.parent_from_shape.rotation.inverse() * up;
            let k = (0..3).find(|&k| local[k].abs() > 1.0 - 1e-9)?;
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            ([half_extents[i], half_extents[j]], (k, i, half_extents[k]))
        }
        Shape::Cylinder { half_length, radius } => {
            let local = placed.parent_from_shape.rotation.inverse() * up;
            if local.z.abs() < 1.0 - 1e-9 {
                return None;
            }
            let side = radius * std::f64::consts::FRAC_1_SQRT_2;
            ([side, side], (2, 0, *half_length))
        }
        _ => return None,
    };
    let (_, i, height) = axis_of_top;
    let half = half.map(|half| half - margin);
    if half[0] <= 0.0 || half[1] <= 0.0 {
        return None;
    }
    let x = placed.parent_from_shape.rotation * Vector::ith(i, 1.0);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, up.cross(&x), up]));
    let middle = placed.parent_from_shape.translation.vector + up * height;
    Some((Pose::from_parts(Translation3::from(middle), UnitQuaternion::from_rotation_matrix(&rotation)), half))
}
