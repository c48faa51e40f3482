//! Segments and waypoints.

use crate::context::{Context, Grasp};
use crate::forces::Carried;
use regrasp_arms::times::TimedPath;
use regrasp_geometry::Pose;
use regrasp_grasp::wrench::BalancedForces;
use regrasp_plan::plan::{ContactMode, PoseData};
use regrasp_plan::robot_plan::{RobotContact, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_robot::ContactModel;
use std::collections::BTreeMap;

/// A hand that holds all through a segment, with its forces at every waypoint.
pub struct Holding<'g> {
    /// The hand.
    pub hand: usize,
    /// Its grasp.
    pub grasp: &'g Grasp,
    /// By waypoint.
    pub forces: Vec<BalancedForces>,
}

/// Where the object is in a segment.
pub enum Moves<'g> {
    /// It rests.
    Not(Pose),
    /// It goes with a hand.
    With(Carried<'g>),
}

/// Segments, one after the other.
#[derive(Default)]
pub struct Record {
    /// The segments.
    pub segments: Vec<RobotSegment>,
    now: f64,
}

impl Record {
    /// Adds segments that have times of their own, with a moment of rest before the first.
    pub fn embed(&mut self, segments: Vec<RobotSegment>, rest: f64) {
        let first = segments.first().and_then(|segment| segment.waypoints.first()).map_or(0.0, |first| first.time);
        let begin = self.now + rest - first;
        for mut segment in segments {
            for waypoint in &mut segment.waypoints {
                waypoint.time += begin;
                self.now = waypoint.time;
            }
            self.segments.push(segment);
        }
        self.now += rest;
    }

    /// Adds a segment that begins when the last one ends.
    pub fn add(
        &mut self,
        context: &Context,
        kind: RobotSegmentKind,
        held_by: Vec<String>,
        holding: &[Holding],
        moves: &Moves,
        timed: &TimedPath,
    ) {
        let begin = self.now - timed.points[0].time;
        let waypoint = |index: usize| {
            let point = &timed.points[index];
            let pose = match moves {
                Moves::Not(pose) => *pose,
                Moves::With(carried) => carried.world_from_object(context, &point.joints),
            };
            RobotWaypoint {
                time: begin + point.time,
                joints: point.joints.clone(),
                joint_velocities: point.velocities.clone(),
                world_from_objects: vec![PoseData::from(&pose)],
                contacts: in_order(context, holding).flat_map(|own| contacts(context, own, index)).collect(),
            }
        };
        let waypoints: Vec<RobotWaypoint> = (0..timed.points.len()).map(waypoint).collect();
        self.now = waypoints.last().map_or(self.now, |last| last.time);
        let held_by = BTreeMap::from([(context.object.name.clone(), held_by)]);
        self.segments.push(RobotSegment { kind, held_by, in_hand: None, waypoints });
    }
}

/// Hands in the order of the plan.
fn in_order<'h, 'g>(context: &Context, holding: &'h [Holding<'g>]) -> impl Iterator<Item = &'h Holding<'g>> {
    let mut sorted: Vec<&Holding> = holding.iter().collect();
    sorted.sort_by_key(|own| context.hands[own.hand].index);
    sorted.into_iter()
}

/// The fingers of a hand that touch.
fn contacts(context: &Context, own: &Holding, waypoint: usize) -> Vec<RobotContact> {
    let hand = &context.hands[own.hand];
    let placed = &context.scene.hands[hand.index];
    let touching = own.grasp.held.fingers.iter().zip(own.grasp.held.grips());
    let contact = |(index, (&finger, grip)): (usize, (&usize, &regrasp_grasp::Grip))| {
        let exerted = &own.forces[waypoint][index];
        let of_hand = &placed.hand.fingers[finger];
        let is_soft = matches!(of_hand.tip.contact, ContactModel::SoftFinger { .. });
        RobotContact {
            hand: placed.name.clone(),
            finger: of_hand.name.clone(),
            object: context.object.name.clone(),
            mode: ContactMode::Fixed,
            point_in_object: grip.contact.point_in_object.into(),
            normal_in_object: grip.contact.normal_in_object.into_inner().into(),
            force_in_object: Some(exerted.force.into()),
            torsion: is_soft.then_some(exerted.torsion),
        }
    };
    touching.enumerate().map(contact).collect()
}
