//! Pieces of plans with forces and times, each from rest to rest: made once, put together as often as wanted.

use crate::model::Model;
use crate::recording::plan::plan_of;
use crate::timing;
use crate::tolerances::{CONTACT_TOLERANCE, SLIP_TOLERANCE};
use regrasp_geometry::Pose;
use regrasp_plan::plan::{Plan, Promises, Segment, SegmentKind, Statistics, relocations};
use regrasp_scene::InHandQuery;
use regrasp_scene::query::IN_HAND;

/// Motions that follow each other, from rest to rest, with contact forces and times. Times count from any moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The motions.
    pub segments: Vec<Segment>,
    /// The smallest closure margin at any moment; dimensionless.
    pub kept_margin: f64,
}

impl Piece {
    /// The same motions gone backwards, with the same forces: cubics through the same points with turned velocities are the same
    /// curves. Fingers that land lift, so that the first motion's fingers are where the last one's were.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        self.segments.reverse();
        let end = self.segments.first().and_then(|segment| segment.waypoints.last()).map_or(0.0, |last| last.time);
        for segment in &mut self.segments {
            segment.waypoints.reverse();
            for waypoint in &mut segment.waypoints {
                waypoint.time = end - waypoint.time;
                // Not minus zero.
                waypoint.joint_velocities.iter_mut().for_each(|velocity| *velocity = 0.0 - *velocity);
            }
        }
        self
    }
}

/// Pieces one after the other, each of which begins where the one before ends: their motions in the time of the whole, and the
/// smallest closure margin.
///
/// Forces change between two motions, in [`crate::settings::SpeedSettings::ramp`] seconds. Between two transfers they do not: the
/// second begins with those that the first ends with.
pub fn joined(model: &Model, pieces: impl IntoIterator<Item = Piece>) -> Piece {
    let mut whole = Piece { segments: Vec::new(), kept_margin: f64::INFINITY };
    let mut now = 0.0;
    for piece in pieces {
        whole.kept_margin = whole.kept_margin.min(piece.kept_margin);
        for mut segment in piece.segments {
            let before = whole.segments.last();
            let goes_on = segment.kind == SegmentKind::Transfer
                && before.is_some_and(|before| before.kind == SegmentKind::Transfer);
            if model.settings.forces.is_some() && before.is_some() && !goes_on {
                now += model.settings.speed.ramp;
            }
            let shift = now - segment.waypoints.first().map_or(0.0, |first| first.time);
            segment.waypoints.iter_mut().for_each(|waypoint| waypoint.time += shift);
            let last = before.filter(|_| goes_on).and_then(|before| before.waypoints.last());
            if let (Some(last), Some(first)) = (last, segment.waypoints.first_mut()) {
                for (own, held) in first.contacts.iter_mut().zip(&last.contacts) {
                    (own.force_in_object, own.torsion) = (held.force_in_object, held.torsion);
                }
                first.joint_torques.clone_from(&last.joint_torques);
            }
            now = segment.waypoints.last().map_or(now, |last| last.time);
            whole.segments.push(segment);
        }
    }
    whole
}

/// The plan of a query without way poses that `whole` answers; method and settings are left to be said. `statistics` has what the
/// motions themselves do not say.
pub fn plan_of_piece(model: &Model, query: &InHandQuery, seed: u64, whole: Piece, statistics: Statistics) -> Plan {
    let names: Vec<String> = model.view.hand.fingers.iter().map(|finger| finger.name.clone()).collect();
    let transfers = || whole.segments.iter().filter(|segment| segment.kind == SegmentKind::Transfer);
    let has_free_finger = |segment: &&Segment| {
        segment.waypoints.first().is_some_and(|first| first.contacts.iter().any(|contact| !contact.holds()))
    };
    let statistics = Statistics {
        transfers: transfers().count() as u64,
        transfers_with_free_fingers: transfers().filter(has_free_finger).count() as u64,
        relocations: relocations(&names, &whole.segments),
        ..statistics
    };
    let ends: [&Pose; 2] = [&query.world_from_object_start, &query.world_from_object_goal];
    let promises = promises(model, whole.kept_margin);
    Plan { seed, statistics, ..plan_of(model.view, IN_HAND, ends, promises, whole.segments) }
}

/// What plans of `model` promise, with the closure margin that they keep.
pub fn promises(model: &Model, kept_margin: f64) -> Promises {
    Promises {
        contact_tolerance: CONTACT_TOLERANCE,
        friction: model.frame.friction,
        required_margin: model.settings.closure_margin,
        kept_margin,
        torque_scale: model.frame.torque_scale,
        friction_margin: model.settings.friction_margin,
        slip_tolerance: SLIP_TOLERANCE,
        tracking: None,
        motion: timing::limits(model),
        forces: model.forces.as_ref().map(|forces| forces.promises()),
    }
}

/// Everything but geometry that forces and times of a [`Piece`] depend on, as numbers in one order: promises, least and wanted
/// forces, gravity, and the time in which forces change. Pieces are for scenes in which these are the same.
pub fn dynamics(model: &Model) -> Vec<f64> {
    let mut numbers: Vec<f64> = promises(model, 0.0).numbers().collect();
    if let Some(forces) = &model.settings.forces {
        numbers.extend([forces.squeeze, forces.squeeze_weight, forces.cone_weight, forces.torque_share]);
        numbers.extend(forces.normal_force);
    }
    if let Some(forces) = &model.forces {
        numbers.extend(forces.weight_in_world().iter());
    }
    numbers.push(model.settings.speed.ramp);
    numbers
}
