//! Things that move where they have to rest, and objects that do not go with their hands.

use super::{Breeder, log_uniform, one_of, sign};
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_plan::plan::PoseData;
use regrasp_plan::robot_plan::RobotSegmentKind;
use regrasp_robot::Part;

/// What is reported of an object that is somewhere else.
const ELSEWHERE: [Kind; 5] =
    [Kind::ObjectMovesAtRest, Kind::GraspChanges, Kind::StartMismatch, Kind::GoalMismatch, Kind::SegmentsDoNotMeet];

impl Breeder<'_> {
    pub(super) fn break_rest(&mut self) {
        let carries = self.moving_carries();
        let outside = self.segments(|s| !self.kind(s).is_in_hand());
        let resting = self.segments(|s| !carries.contains(&s) && outside.contains(&s));
        self.add("another pose of the object at one waypoint", &ELSEWHERE, |plan, rng| {
            let s = one_of(rng, &outside)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len());
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 2e-9, 1e-2);
            (0..3).for_each(|k| waypoints[w].world_from_objects[0].position[k] += shift[k]);
            Some(())
        });
        self.add("the object turned at one waypoint", &ELSEWHERE, |plan, rng| {
            let s = one_of(rng, &outside)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len());
            let pose = &mut waypoints[w].world_from_objects[0];
            let turn = Vector::from(rng.direction()) * log_uniform(rng, 2e-8, 1.0);
            let turned = Pose::from(&*pose);
            let rotation = turned.rotation * nalgebra::UnitQuaternion::from_scaled_axis(turn);
            *pose = PoseData::from(&Pose::from_parts(turned.translation, rotation));
            Some(())
        });
        let resting = &resting;
        self.add("an object that no one drives", &ELSEWHERE, |plan, rng| {
            let s = one_of(rng, resting)?;
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1e-6, 1e-2);
            let n = plan.segments[s].waypoints.len() as f64 - 1.0;
            // It drifts, and stays there for the rest of the plan.
            for (w, waypoint) in plan.segments[s].waypoints.iter_mut().enumerate() {
                (0..3).for_each(|k| waypoint.world_from_objects[0].position[k] += shift[k] * w as f64 / n);
            }
            for waypoint in plan.segments[s + 1..].iter_mut().flat_map(|segment| &mut segment.waypoints) {
                (0..3).for_each(|k| waypoint.world_from_objects[0].position[k] += shift[k]);
            }
            Some(())
        });
        self.add("an object that stays where it was grasped", &ELSEWHERE, |plan, rng| {
            let s = one_of(rng, &carries)?;
            let first = plan.segments[s].waypoints[0].world_from_objects.clone();
            let moved = |a: &PoseData, b: &PoseData| Vector::from(a.position) - Vector::from(b.position);
            let is_moved =
                plan.segments[s].waypoints.iter().any(|w| moved(&w.world_from_objects[0], &first[0]).norm() > 1e-6);
            plan.segments[s].waypoints.iter_mut().for_each(|waypoint| waypoint.world_from_objects.clone_from(&first));
            is_moved.then_some(())
        });
        self.add("the object drifts in the hand", &ELSEWHERE, |plan, rng| {
            let s = one_of(rng, &carries)?;
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1e-8, 1e-2);
            let n = plan.segments[s].waypoints.len() as f64 - 1.0;
            for (w, waypoint) in plan.segments[s].waypoints.iter_mut().enumerate() {
                (0..3).for_each(|k| waypoint.world_from_objects[0].position[k] += shift[k] * w as f64 / n);
            }
            Some(())
        });
        self.break_joints_at_rest();
    }

    /// Coordinates of the fingers of a hand of the scene.
    fn fingers_of(&self, name: &str) -> std::ops::Range<usize> {
        let robot = &self.scene.robots[self.query.robot];
        let carrier = self.scene.hand_named(name).and_then(|hand| self.scene.hands[hand].carrier);
        carrier.map_or(0..0, |carrier| robot.layout.range(Part::Hand(carrier.hand)))
    }

    fn break_joints_at_rest(&mut self) {
        let robot = &self.scene.robots[self.query.robot];
        let held = self.segments(|s| !self.hands_in(s).is_empty());
        let mut fingers: Vec<(usize, usize)> = Vec::new();
        for &s in &held {
            for name in self.hands_in(s) {
                fingers.extend(self.fingers_of(&name).map(|k| (s, k)));
            }
        }
        self.add("a finger moves while its hand holds", &[Kind::GraspChanges], |plan, rng| {
            let (s, k) = one_of(rng, &fingers)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = 1 + rng.below(waypoints.len() - 1);
            waypoints[w].joints[k] += sign(rng) * log_uniform(rng, 1.1e-9, 1e-2);
            Some(())
        });
        self.add("a finger has a speed while its hand holds", &[Kind::GraspChanges], |plan, rng| {
            let (s, k) = one_of(rng, &fingers)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len());
            waypoints[w].joint_velocities[k] += sign(rng) * log_uniform(rng, 1.1e-9, 1e-2);
            Some(())
        });
        let ties = robot.layout.ties.clone();
        self.add("a jaw leaves the motor that it shares", &[Kind::JointLimit], |plan, rng| {
            let (s, t) = (rng.below(plan.segments.len()), rng.below(ties.len().max(1)));
            let (follower, _) = ties.get(t)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len());
            if rng.chance(0.5) {
                waypoints[w].joints[*follower] += sign(rng) * log_uniform(rng, 1.1e-8, 1e-2);
            } else {
                // Over a step of a tenth of a second the joint is off by more than rounding.
                waypoints[w].joint_velocities[*follower] += sign(rng) * log_uniform(rng, 1e-4, 1e-1);
            }
            Some(())
        });
        let is_finger: Vec<bool> =
            robot.layout.coordinates.iter().map(|coordinate| matches!(coordinate.part, Part::Hand(_))).collect();
        let closing = self.segments(|s| matches!(self.kind(s), RobotSegmentKind::Grasp | RobotSegmentKind::Release));
        self.add("an arm moves while a hand closes or opens", &[Kind::JointMovesAtRest], |plan, rng| {
            let s = one_of(rng, &closing)?;
            let arms: Vec<usize> = (0..is_finger.len()).filter(|&k| !is_finger[k]).collect();
            let waypoints = &mut plan.segments[s].waypoints;
            let w = 1 + rng.below(waypoints.len() - 1);
            waypoints[w].joints[one_of(rng, &arms)?] += sign(rng) * log_uniform(rng, 1.1e-9, 1e-2);
            Some(())
        });
        // A hand holds and the object rests: its arm may not even move so that the object stays.
        let resting: Vec<(usize, usize)> = held
            .iter()
            .filter(|&&s| !self.moving_carries().contains(&s))
            .flat_map(|&s| {
                let hands = self.hands_in(s);
                let carriers = hands.iter().filter_map(|name| self.scene.hands[self.scene.hand_named(name)?].carrier);
                let bases: Vec<_> = carriers.map(|carrier| robot.hands[carrier.hand].hand.base).collect();
                bases
                    .into_iter()
                    .flat_map(|base| robot.coordinates_above(base))
                    .map(move |k| (s, k))
                    .collect::<Vec<_>>()
            })
            .collect();
        self.add(
            "an arm has a speed while its hand holds an object at rest",
            &[Kind::JointMovesAtRest, Kind::VelocityInconsistent],
            |plan, rng| {
                let (s, k) = one_of(rng, &resting)?;
                let waypoints = &mut plan.segments[s].waypoints;
                let w = rng.below(waypoints.len());
                waypoints[w].joint_velocities[k] += sign(rng) * log_uniform(rng, 1.1e-6, 1e-2);
                Some(())
            },
        );
    }
}
