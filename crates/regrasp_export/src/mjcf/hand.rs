//! A hand: bodies, joints, couplings, drives and sensors.

use super::geom::{Geom, Look, Weight, open_body, write_geom, write_inertial};
use super::inertia;
use super::names::HandNames;
use super::tip::{own_tip, tip_name};
use super::xml::{Xml, numbers};
use regrasp_geometry::{Point, Pose};
use regrasp_robot::{Coupling, Finger, Hand, JointId, JointKind, JointMotion};
use regrasp_scene::SceneHand;

const PALM_COLOR: &str = "0.55 0.56 0.6 1";
/// Fingers in turn.
const FINGER_COLORS: [&str; 6] =
    ["0.3 0.5 0.8 1", "0.8 0.35 0.3 1", "0.35 0.7 0.4 1", "0.65 0.4 0.75 1", "0.3 0.7 0.75 1", "0.85 0.55 0.25 1"];
/// Stiffness of servos of a finger of [`SERVO_REACH`], in N m/rad, and damping, in N m s/rad: those of replays
/// (`docs/reference/replay.md`), so that a hand at rest is as stiff as one that moves.
pub(super) const SERVO_STIFFNESS: f64 = 5.0;
pub(super) const SERVO_DAMPING: f64 = 0.08;
/// Reach of the finger that the servos were set for, in metres.
pub(super) const SERVO_REACH: f64 = 0.108;
/// Least reach that servos are set for, in metres: fingers that only turn about their tips.
const LEAST_REACH: f64 = 0.005;

/// How the joints of a hand are driven.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Drive {
    /// By motors: torques are commanded.
    Motors,
    /// By servos: positions are commanded.
    Servos,
}

/// A hand of the model.
pub(super) struct ModelHand<'a> {
    pub placed: &'a SceneHand,
    pub world_from_hand: Pose,
    pub names: &'a HandNames,
    pub drive: Drive,
    /// Joints of the chain of every finger, base first, as the robot names them.
    moving: Vec<Vec<JointId>>,
}

impl<'a> ModelHand<'a> {
    pub fn new(placed: &'a SceneHand, world_from_hand: Pose, names: &'a HandNames, drive: Drive) -> Self {
        let moving = placed.hand.fingers.iter().map(|finger| moving_joints(&placed.hand, finger)).collect();
        ModelHand { placed, world_from_hand, names, drive, moving }
    }

    pub fn hand(&self) -> &'a Hand {
        &self.placed.hand
    }

    pub fn write_meshes(&self, xml: &mut Xml) {
        let (hand, names) = (self.hand(), self.names);
        for (palm, name) in hand.palm.iter().zip(&names.palm) {
            super::geom::write_mesh(xml, &palm.placed.shape, name);
        }
        for (finger, names) in hand.fingers.iter().zip(&names.fingers) {
            for (shape, name) in finger.shapes.iter().zip(names) {
                super::geom::write_mesh(xml, &shape.placed.shape, name);
            }
        }
    }

    pub fn write_bodies(&self, xml: &mut Xml) {
        let (hand, names) = (self.hand(), self.names);
        open_body(xml, names.link(hand, hand.base), &self.world_from_hand, Weight::Falls);
        for (palm, name) in hand.palm.iter().zip(&names.palm) {
            let body_from_shape = palm.placed.parent_from_shape;
            write_geom(xml, &Geom { name, look: Look::Color(PALM_COLOR), body_from_shape, shape: &palm.placed.shape });
        }
        for (index, finger) in hand.fingers.iter().enumerate() {
            let color = FINGER_COLORS[index % FINGER_COLORS.len()];
            let mut parent = Pose::identity();
            for (body, (joint, &id)) in finger.chain.joints.iter().zip(&self.moving[index]).enumerate() {
                let name = names.link(hand, hand.robot.joints[id.0].child);
                open_body(xml, name, &(parent * joint.parent_from_joint), Weight::Compensated);
                parent = Pose::identity();
                self.write_joint(xml, finger, body, id);
                let on_body =
                    || finger.shapes.iter().zip(&names.fingers[index]).filter(|(shape, _)| shape.body == body);
                write_inertial(xml, &inertia::of_link(on_body().map(|(shape, _)| &shape.placed)));
                for (shape, name) in on_body() {
                    let (body_from_shape, shape) = (shape.placed.parent_from_shape, &shape.placed.shape);
                    write_geom(xml, &Geom { name, look: Look::Color(color), body_from_shape, shape });
                }
            }
            self.write_tip(xml, index, color);
            for _ in &finger.chain.joints {
                xml.close();
            }
        }
        xml.close();
    }

    fn write_joint(&self, xml: &mut Xml, finger: &Finger, body: usize, id: JointId) {
        let (joint, as_read) = (&finger.chain.joints[body], &self.hand().robot.joints[id.0]);
        let mut attributes =
            vec![("name", self.names.joint(self.hand(), id)), ("axis", numbers(joint.axis.iter().copied()))];
        match joint.motion {
            JointMotion::Turn => attributes.push(("type", "hinge".into())),
            JointMotion::Slide => attributes.extend([("type", "slide".into()), ("class", "slide".into())]),
        }
        let limits = match (&as_read.coupling, joint.drive.single()) {
            // The coupling holds a follower within its limits, which the leader's already respect.
            (Some(_), Some(_)) => None,
            (Some(_), None) => as_read.limits.map(|limits| (limits.lower, limits.upper)),
            (None, single) => single.map(|(k, _)| (finger.chain.lower[k], finger.chain.upper[k])),
        };
        if let Some((lower, upper)) =
            limits.filter(|(lower, upper)| lower.is_finite() && upper.is_finite() && lower < upper)
        {
            attributes.push(("range", numbers([lower, upper])));
        }
        xml.leaf("joint", &attributes);
    }

    fn write_tip(&self, xml: &mut Xml, index: usize, color: &str) {
        let finger = &self.hand().fingers[index];
        let center = finger.tip.center_in_body;
        let name = &self.names.named(&tip_name(finger));
        let own = own_tip(finger);
        if let Some(own) = own.as_ref().filter(|_| !self.names.fingers[index].contains(name)) {
            let body_from_shape = own.parent_from_shape;
            write_geom(xml, &Geom { name, look: Look::Color(color), body_from_shape, shape: &own.shape });
        }
        // Every contact of the tip lies in its site, so that the touch sensor sees it.
        let reach = match own {
            Some(own) => 1.5 * own.shape.reach_from(&Point::origin()) + 0.001,
            None => {
                let tips = finger.shapes.iter().filter(|shape| shape.is_tip);
                tips.map(|shape| shape.placed.shape.reach_from(&(shape.placed.parent_from_shape.inverse() * center)))
                    .fold(0.001, f64::max)
            }
        };
        xml.leaf(
            "site",
            &[
                ("name", name.clone()),
                ("pos", numbers(center.iter().copied())),
                ("size", numbers([reach])),
                ("rgba", "0 0 0 0".into()),
            ],
        );
    }

    /// Joints that follow several others, each with its coupling.
    pub fn sums(&self) -> Vec<(JointId, &'a Coupling)> {
        let robot = &self.hand().robot;
        let coupling =
            |id: JointId| robot.joints[id.0].coupling.as_ref().filter(|coupling| coupling.single().is_none());
        self.moving.iter().flatten().filter_map(|&id| Some((id, coupling(id)?))).collect()
    }

    fn sum_name(&self, follower: JointId) -> String {
        format!("{}:leaders", self.names.joint(self.hand(), follower))
    }

    /// A tendon for each joint that follows several others: its length is the joint's position less the leaders' share.
    pub fn write_sums(&self, xml: &mut Xml) {
        let name_of = |joint: JointId| self.names.joint(self.hand(), joint);
        for (follower, coupling) in self.sums() {
            xml.open("fixed", &[("name", self.sum_name(follower))]);
            xml.leaf("joint", &[("joint", name_of(follower)), ("coef", "1".into())]);
            for (leader, multiplier) in &coupling.terms {
                xml.leaf("joint", &[("joint", name_of(*leader)), ("coef", numbers([-multiplier]))]);
            }
            xml.close();
        }
    }

    /// Joints that follow others.
    pub fn write_couplings(&self, xml: &mut Xml) {
        let hand = self.hand();
        for (finger, ids) in hand.fingers.iter().zip(&self.moving) {
            for (joint, &id) in finger.chain.joints.iter().zip(ids) {
                let Some(coupling) = &hand.robot.joints[id.0].coupling else { continue };
                let stiff = [("solref", "0.004 1".to_owned()), ("solimp", "0.99 0.999 0.0001".to_owned())];
                let offset = joint.drive.offset;
                match coupling.single() {
                    Some((leader, multiplier)) => {
                        let what = [
                            ("joint1", self.names.joint(hand, id)),
                            ("joint2", self.names.joint(hand, leader)),
                            ("polycoef", numbers([offset, multiplier, 0.0, 0.0, 0.0])),
                        ];
                        xml.leaf("joint", &[&what[..], &stiff].concat());
                    }
                    None => {
                        let what =
                            [("tendon1", self.sum_name(id)), ("polycoef", numbers([offset, 0.0, 0.0, 0.0, 0.0]))];
                        xml.leaf("tendon", &[&what[..], &stiff].concat());
                    }
                }
            }
        }
    }

    /// A motor or a servo per independent joint, in the order of `Hand::joint_names`.
    pub fn write_drives(&self, xml: &mut Xml) {
        for (finger, ids) in self.hand().fingers.iter().zip(&self.moving) {
            let reach = reach(finger);
            for (joint, &id) in finger.chain.joints.iter().zip(ids) {
                let as_read = &self.hand().robot.joints[id.0];
                if as_read.coupling.is_some() {
                    continue;
                }
                let name = self.names.joint(self.hand(), id);
                let mut attributes = vec![("name", name.clone()), ("joint", name)];
                if let Some(effort) = as_read.limits.and_then(|limits| limits.effort).filter(|&effort| effort > 0.0) {
                    attributes.push(("forcerange", numbers([-effort, effort])));
                }
                match self.drive {
                    Drive::Motors => xml.leaf("motor", &attributes),
                    Drive::Servos => {
                        let lever = if joint.motion == JointMotion::Turn { reach } else { 1.0 };
                        let factor = (lever / SERVO_REACH).powi(2);
                        attributes.push(("kp", numbers([SERVO_STIFFNESS * factor])));
                        attributes.push(("kv", numbers([SERVO_DAMPING * factor])));
                        xml.leaf("position", &attributes);
                    }
                }
            }
        }
    }

    /// Velocities of fingertips in the world, and the sum of normal forces on each tip.
    pub fn write_sensors(&self, xml: &mut Xml) {
        for finger in &self.hand().fingers {
            let site = self.names.named(&tip_name(finger));
            for (kind, what) in [("framelinvel", "linear_velocity"), ("frameangvel", "angular_velocity")] {
                let name = self.names.named(&format!("{}:{what}", finger.name));
                xml.leaf(kind, &[("name", name), ("objtype", "site".into()), ("objname", site.clone())]);
            }
            let name = self.names.named(&format!("{}:normal_force", finger.name));
            xml.leaf("touch", &[("name", name), ("site", site)]);
        }
    }

    /// Positions of all joints of the model for these coordinates.
    pub fn positions(&self, coordinates: &[f64]) -> Vec<f64> {
        let mut left = coordinates;
        let mut positions = Vec::new();
        for finger in &self.hand().fingers {
            let own = left.split_off(..finger.chain.n_coordinates()).unwrap_or_default();
            positions.extend(finger.chain.joints.iter().map(|joint| joint.position(own)));
        }
        positions
    }
}

/// Joints of the chain of `finger`, base first, as the robot names them.
fn moving_joints(hand: &Hand, finger: &Finger) -> Vec<JointId> {
    let joints = hand.robot.joints_to(finger.tip.link);
    let moving: Vec<JointId> =
        joints.into_iter().filter(|id| hand.robot.joints[id.0].kind != JointKind::Fixed).collect();
    // Joints between root and base are none of the finger's.
    moving[moving.len() - finger.chain.joints.len()..].to_vec()
}

/// Distance from the first turning joint of a finger to its tip along the straight finger, in metres.
pub(super) fn reach(finger: &Finger) -> f64 {
    let joints = &finger.chain.joints;
    let Some(first) = joints.iter().position(|joint| joint.motion == JointMotion::Turn) else { return SERVO_REACH };
    let links = joints[first + 1..].iter().map(|joint| joint.parent_from_joint.translation.vector.norm());
    (links.sum::<f64>() + finger.tip.center_in_body.coords.norm()).max(LEAST_REACH)
}
