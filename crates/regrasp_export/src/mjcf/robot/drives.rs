//! What moves the robot: joints, couplings, servos; and where it is at every waypoint.

use super::RobotModel;
use crate::mjcf::hand::{SERVO_DAMPING, SERVO_REACH, SERVO_STIFFNESS, reach};
use crate::mjcf::inertia::{self, Inertial};
use crate::mjcf::xml::{Xml, numbers};
use regrasp_geometry::Pose;
use regrasp_plan::robot_plan::RobotPlan;
use regrasp_robot::{Coupling, JointKind, LinkId, Part};

/// Natural frequency of servos, in rad/s: that of stiff position controllers of arms. Damping is critical.
const SERVO_FREQUENCY: f64 = 60.0;
/// Share of the inertia about a joint that its drive adds, and the least that a drive has, in kg m^2 or kg.
const DRIVE_SHARE: f64 = 0.2;
const LEAST_DRIVE: f64 = 2e-3;
/// Armature and damping of the joints of fingers that grasp: those of replays of one hand (`docs/reference/replay.md`).
const FINGER_DRIVE: [f64; 2] = [0.0002, 0.005];
const SLIDING_FINGER_DRIVE: [f64; 2] = [0.02, 0.5];

impl RobotModel<'_> {
    fn is_of_hand(&self, id: usize) -> bool {
        matches!(self.robot.part_of(self.robot.robot.joints[id].child), Part::Hand(_))
    }

    /// Stiffness and damping of a joint of a hand: tips of all fingers are about equally stiff.
    fn finger_gains(&self, id: usize) -> [f64; 2] {
        let joint = &self.robot.robot.joints[id];
        let mut fingers = self.robot.hands.iter().flat_map(|hand| &hand.hand.fingers);
        let lever = match joint.kind {
            JointKind::Prismatic => 1.0,
            _ => fingers.find(|finger| finger.chain.names.contains(&joint.name)).map_or(SERVO_REACH, reach),
        };
        let factor = (lever / SERVO_REACH).powi(2);
        [SERVO_STIFFNESS * factor, SERVO_DAMPING * factor]
    }

    pub(super) fn write_joint(&self, xml: &mut Xml, id: usize) {
        let joint = &self.robot.robot.joints[id];
        let slides = joint.kind == JointKind::Prismatic;
        let kind = if slides { "slide" } else { "hinge" };
        let is_free_finger = self.free.is_some() && self.is_of_hand(id);
        let [drive, damping] = match (is_free_finger, slides) {
            (false, _) => [self.drive_inertia(id), 0.0],
            (true, false) => FINGER_DRIVE,
            (true, true) => SLIDING_FINGER_DRIVE,
        };
        let mut attributes = vec![
            ("name", joint.name.clone()),
            ("type", kind.to_owned()),
            ("axis", numbers(joint.axis.iter().copied())),
            ("armature", numbers([drive])),
        ];
        if damping > 0.0 {
            attributes.push(("damping", numbers([damping])));
        }
        // Followers are held by their coupling, which leaders' limits respect.
        if let Some(limits) = joint.limits.filter(|limits| limits.lower < limits.upper && joint.coupling.is_none())
            && joint.kind != JointKind::Continuous
        {
            attributes.push(("range", numbers([limits.lower, limits.upper])));
        }
        xml.leaf("joint", &attributes);
    }

    /// Inertia about a joint of all that it carries, at the start, in kg m^2; of a sliding joint the mass.
    fn carried_inertia(&self, id: usize) -> f64 {
        let (robot, joint) = (&self.robot.robot, &self.robot.robot.joints[id]);
        let frame = self.world_from_link[joint.child.0];
        let axis = frame.rotation * joint.axis.into_inner();
        let is_carried = |link: LinkId| link == joint.child || robot.joints_to(link).iter().any(|other| other.0 == id);
        let mut sum = 0.0;
        let mut add = |world_from_body: &Pose, inertial: &Inertial| {
            if joint.kind == JointKind::Prismatic {
                sum += inertial.mass;
                return;
            }
            let arm = axis.cross(&(world_from_body * inertial.center - frame * regrasp_geometry::Point::origin()));
            let own = world_from_body.rotation.inverse() * axis;
            sum += inertial.mass * arm.norm_squared() + own.dot(&(inertial.inertia * own));
        };
        for (link, shapes) in self.shapes.iter().enumerate().filter(|(link, _)| is_carried(LinkId(*link))) {
            add(&self.world_from_link[link], &inertia::of_link(shapes.iter().map(|geom| &geom.placed)));
        }
        for carried in self.carried.iter().filter(|carried| is_carried(carried.link)) {
            add(&(self.world_from_link[carried.link.0] * carried.link_from_object), &carried.inertial);
        }
        sum
    }

    /// What the drive of a joint adds to it.
    fn drive_inertia(&self, id: usize) -> f64 {
        (DRIVE_SHARE * self.carried_inertia(id)).max(LEAST_DRIVE)
    }

    fn couplings(&self) -> impl Iterator<Item = (usize, &Coupling)> {
        let joints = &self.robot.robot.joints;
        self.order.iter().filter_map(|&id| Some((id, joints[id].coupling.as_ref()?)))
    }

    pub(super) fn write_couplings(&self, xml: &mut Xml) {
        let name = |id: usize| self.robot.robot.joints[id].name.clone();
        let several = || self.couplings().filter(|(_, coupling)| coupling.single().is_none());
        if several().next().is_some() {
            xml.open("tendon", &[]);
            for (follower, coupling) in several() {
                xml.open("fixed", &[("name", format!("{}:leaders", name(follower)))]);
                xml.leaf("joint", &[("joint", name(follower)), ("coef", "1".into())]);
                for (leader, multiplier) in &coupling.terms {
                    xml.leaf("joint", &[("joint", name(leader.0)), ("coef", numbers([-multiplier]))]);
                }
                xml.close();
            }
            xml.close();
        }
        xml.open("equality", &[]);
        let stiff = [("solref", "0.004 1".to_owned()), ("solimp", "0.99 0.999 0.0001".to_owned())];
        for (follower, coupling) in self.couplings() {
            match coupling.single() {
                Some((leader, multiplier)) => {
                    let polynomial = numbers([coupling.offset, multiplier, 0.0, 0.0, 0.0]);
                    let what = [("joint1", name(follower)), ("joint2", name(leader.0)), ("polycoef", polynomial)];
                    xml.leaf("joint", &[&what[..], &stiff].concat());
                }
                None => {
                    let polynomial = numbers([coupling.offset, 0.0, 0.0, 0.0, 0.0]);
                    let what = [("tendon1", format!("{}:leaders", name(follower))), ("polycoef", polynomial)];
                    xml.leaf("tendon", &[&what[..], &stiff].concat());
                }
            }
        }
        xml.close();
    }

    /// A servo per independent joint, in the order of the joint vector.
    pub(super) fn write_servos(&self, xml: &mut Xml) {
        xml.open("actuator", &[]);
        for coordinate in &self.robot.layout.coordinates {
            let id = coordinate.joint.0;
            let name = [("name", coordinate.name.clone()), ("joint", coordinate.name.clone())];
            let mut attributes = Vec::from(name);
            let [stiffness, damping] = match self.free.is_some() && self.is_of_hand(id) {
                true => {
                    let effort = self.robot.robot.joints[id].limits.and_then(|limits| limits.effort);
                    if let Some(effort) = effort.filter(|effort| *effort > 0.0) {
                        attributes.push(("forcerange", numbers([-effort, effort])));
                    }
                    self.finger_gains(id)
                }
                false => {
                    let inertia = self.carried_inertia(id) + self.drive_inertia(id);
                    [inertia * SERVO_FREQUENCY * SERVO_FREQUENCY, 2.0 * inertia * SERVO_FREQUENCY]
                }
            };
            attributes.extend([("kp", numbers([stiffness])), ("kv", numbers([damping]))]);
            xml.leaf("position", &attributes);
        }
        xml.close();
    }

    pub(super) fn write_keyframes(&self, xml: &mut Xml, plan: &RobotPlan) {
        let (robot, layout) = (&self.robot.robot, &self.robot.layout);
        xml.open("keyframe", &[]);
        for (s, segment) in plan.segments.iter().enumerate() {
            for (w, waypoint) in segment.waypoints.iter().enumerate() {
                let position =
                    |id: usize| layout.drive_of(robot, id).map_or(0.0, |d| d.position(|k| waypoint.joints[k]));
                let pose = self.free.as_ref().and_then(|_| waypoint.world_from_objects.first());
                let object = pose.into_iter().flat_map(|pose| {
                    let [x, y, z, w] = pose.quat_xyzw;
                    pose.position.into_iter().chain([w, x, y, z])
                });
                xml.leaf(
                    "key",
                    &[
                        ("name", format!("{s}_{w}")),
                        ("time", numbers([waypoint.time])),
                        ("qpos", numbers(self.order.iter().map(|&id| position(id)).chain(object))),
                        ("ctrl", numbers(waypoint.joints.iter().copied())),
                    ],
                );
            }
        }
        xml.close();
    }
}
