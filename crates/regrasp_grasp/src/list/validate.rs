//! What a grasp list may not say.

use super::{GraspList, ListedContact, ListedGrasp};
use crate::record::PoseData;
use regrasp_base::InputError;
use regrasp_base::diagnostic::{Diagnostics, GOOD_NAME, fault_of_name, number};
use regrasp_base::json_place::PathStep::{Index, Key};
use regrasp_base::json_place::{PathStep, diagnostic};
use std::path::Path;

/// How far a quaternion's or a direction's length may be from one.
const UNIT_TOLERANCE: f64 = 1e-9;

/// Largest numbers of things in a list, so that a hostile file is refused before it costs anything.
mod caps {
    pub const GRASPS: usize = 1_000_000;
    pub const FINGERS: usize = 64;
    pub const JOINTS: usize = 1_000;
    pub const INPUTS: usize = 10_000;
    pub const STABLE_POSES: usize = 10_000;
    /// Largest position, in metres or radians.
    pub const POSITION: f64 = 1e6;
    /// Largest force, torque or mass.
    pub const SIZE: f64 = 1e9;
}

/// `list`, which `text` says, if nothing is wrong with it.
pub(super) fn validate(path: &Path, text: &str, list: GraspList) -> Result<GraspList, InputError> {
    let mut reader = Reader { path, text, found: Diagnostics::default() };
    reader.list(&list);
    reader.found.into_result(list)
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    found: Diagnostics,
}

impl Reader<'_> {
    fn fail(&mut self, code: &'static str, steps: &[PathStep], problem: String, expected: impl Into<String>) {
        // A broken writer breaks every grasp in the same way.
        if !self.found.counted_only() {
            self.found.push(diagnostic(self.path, self.text, code, steps, problem).expected(expected));
        }
    }

    fn list(&mut self, list: &GraspList) {
        for (key, n_seen, most) in [
            ("hand", list.hand.fingers.len(), caps::FINGERS),
            ("hand", list.hand.joint_names.len(), caps::JOINTS),
            ("hand", list.hand.held_joints.len(), caps::JOINTS),
            ("inputs", list.inputs.len(), caps::INPUTS),
            ("stable_poses", list.stable_poses.len(), caps::STABLE_POSES),
            ("grasps", list.grasps.len(), caps::GRASPS),
        ] {
            if n_seen > most {
                return self.fail("G710", &[Key(key)], format!("has {n_seen} entries"), format!("at most {most}"));
            }
        }
        for (owner, key, name) in [
            ("hand", "name", &list.hand.name),
            ("hand", "base_link", &list.hand.base_link),
            ("object", "name", &list.object.name),
        ] {
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", &[Key(owner), Key(key)], fault, GOOD_NAME);
            }
        }
        for (key, names) in [("fingers", &list.hand.fingers), ("joint_names", &list.hand.joint_names)] {
            self.names(key, names);
        }
        for (name, position) in &list.hand.held_joints {
            let steps = [Key("hand"), Key("held_joints"), Key(name)];
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", &steps, fault, GOOD_NAME);
            } else if list.hand.joint_names.contains(name) {
                let expected = "joints that no grasp moves";
                self.fail("G708", &steps, format!("\"{name}\" is one of hand.joint_names too"), expected);
            }
            self.within(&steps, *position, [-caps::POSITION, caps::POSITION]);
        }
        for (i, input) in list.inputs.iter().enumerate() {
            let is_hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
            if input.sha256.len() != 64 || !input.sha256.bytes().all(is_hex) {
                let steps = [Key("inputs"), Index(i), Key("sha256")];
                self.fail("G709", &steps, format!("is \"{}\"", input.sha256), "64 lower-case hex digits");
            }
        }
        self.object(list);
        self.promises(list);
        for (i, pose) in list.stable_poses.iter().enumerate() {
            let inside = |key| [Key("stable_poses"), Index(i), Key(key)];
            self.direction(&inside("down_in_object"), &pose.down_in_object);
            self.within(&inside("height"), pose.height, [-caps::POSITION, caps::POSITION]);
            self.within(&inside("tipping_angle"), pose.tipping_angle, [0.0, std::f64::consts::FRAC_PI_2]);
        }
        for (i, grasp) in list.grasps.iter().enumerate() {
            self.grasp(list, i, grasp);
        }
    }

    fn names(&mut self, key: &'static str, names: &[String]) {
        if names.is_empty() {
            self.fail("G704", &[Key("hand"), Key(key)], "is empty".into(), "at least one name");
        }
        for (i, name) in names.iter().enumerate() {
            let steps = [Key("hand"), Key(key), Index(i)];
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", &steps, fault, GOOD_NAME);
            } else if names[..i].contains(name) {
                self.fail("G708", &steps, format!("\"{name}\" is used twice"), "each once");
            }
        }
    }

    fn object(&mut self, list: &GraspList) {
        let object = &list.object;
        let inside = |key| [Key("object"), Key(key)];
        self.within(&inside("mass"), object.mass, [0.0, caps::SIZE]);
        self.within(&inside("friction"), object.friction, [0.0, 1e3]);
        self.position(&inside("center_of_mass"), &object.center_of_mass);
        if let Some(radius) = list.source.as_ref().and_then(|source| source.torsion_radius) {
            self.within(&[Key("source"), Key("torsion_radius")], radius, [1e-9, 1.0]);
        }
        let Some(mesh) = list.source.as_ref().and_then(|source| source.mesh.as_ref()) else { return };
        let inside = |key| [Key("source"), Key("mesh"), Key(key)];
        self.within(&inside("scale"), mesh.scale, [1e-9, 1e9]);
        self.within(&inside("mass"), mesh.mass, [0.0, caps::SIZE]);
        self.within(&inside("friction"), mesh.friction, [0.0, 1e3]);
        self.within(&inside("edge_distance"), mesh.edge_distance.unwrap_or(0.0), [0.0, caps::POSITION]);
        self.within(&inside("crease_angle_deg"), mesh.crease_angle_deg.unwrap_or(30.0), [1.0, 180.0]);
    }

    fn promises(&mut self, list: &GraspList) {
        let promises = &list.promises;
        let inside = |key| [Key("promises"), Key(key)];
        for (key, value, range) in [
            ("contact_tolerance", promises.contact_tolerance, [0.0, 1.0]),
            ("friction", promises.friction, [0.0, 1e3]),
            ("friction_margin", promises.friction_margin, [1.0, 1e3]),
            ("required_margin", promises.required_margin, [-1.0, 1.0]),
            ("torque_scale", promises.torque_scale, [1e-9, 1e3]),
            ("normal_force", promises.normal_force[0], [0.0, caps::SIZE]),
            ("normal_force", promises.normal_force[1], [promises.normal_force[0].max(0.0), caps::SIZE]),
            ("tipping_angle", promises.tipping_angle, [0.0, std::f64::consts::FRAC_PI_2]),
        ] {
            self.within(&inside(key), value, range);
        }
        self.per_joint(list, &inside("joint_torques"), promises.joint_torques.len());
        for limit in promises.joint_torques.iter().flatten() {
            self.within(&inside("joint_torques"), *limit, [0.0, caps::SIZE]);
        }
    }

    fn grasp(&mut self, list: &GraspList, i: usize, grasp: &ListedGrasp) {
        let inside = |key| [Key("grasps"), Index(i), Key(key)];
        self.pose(&inside("object_from_hand"), &grasp.object_from_hand);
        for (key, values, most) in [
            ("joints", &grasp.joints, caps::POSITION),
            ("open_joints", &grasp.open_joints, caps::POSITION),
            ("joint_torques", &grasp.joint_torques, caps::SIZE),
        ] {
            self.per_joint(list, &inside(key), values.len());
            for value in values {
                self.within(&inside(key), *value, [-most, most]);
            }
        }
        self.direction(&inside("approach"), &grasp.approach.direction_in_object);
        self.within(&inside("approach"), grasp.approach.distance, [0.0, 1e3]);
        for (key, value, range) in [
            ("margin", grasp.margin, [-1.0, 1.0]),
            ("margin_before_refinement", grasp.margin_before_refinement.unwrap_or(0.0), [-1.0, 1.0]),
            ("score", grasp.score, [0.0, 1.0]),
        ] {
            self.within(&inside(key), value, range);
        }
        for term in grasp.scores.numbers() {
            self.within(&inside("scores"), term, [0.0, 1.0]);
        }
        for (k, &pose) in grasp.stable_poses.iter().enumerate() {
            if pose >= list.stable_poses.len() || grasp.stable_poses[..k].contains(&pose) {
                let expected = format!("indices below {}, each once", list.stable_poses.len());
                self.fail("G709", &inside("stable_poses"), format!("holds {pose}"), expected);
            }
        }
        if grasp.contacts.is_empty() {
            self.fail("G707", &inside("contacts"), "is empty".into(), "at least one contact");
        }
        for (k, contact) in grasp.contacts.iter().enumerate() {
            let at = [Key("grasps"), Index(i), Key("contacts"), Index(k)];
            self.contact(list, &at, contact);
            if grasp.contacts[..k].iter().any(|other| other.finger == contact.finger) {
                self.fail("G708", &at, format!("finger \"{}\" touches twice", contact.finger), "each finger once");
            }
        }
    }

    fn contact(&mut self, list: &GraspList, at: &[PathStep; 4], contact: &ListedContact) {
        let inside = |key| [at[0], at[1], at[2], at[3], Key(key)];
        if !list.hand.fingers.contains(&contact.finger) {
            let expected = format!("one of {}", list.hand.fingers.join(", "));
            self.fail("G708", &inside("finger"), format!("\"{}\" is not a finger", contact.finger), expected);
        }
        if let Some(fault) = fault_of_name(&contact.link) {
            self.fail("V004", &inside("link"), fault, GOOD_NAME);
        }
        self.position(&inside("point_in_object"), &contact.point_in_object);
        self.direction(&inside("normal_in_object"), &contact.normal_in_object);
        for force in contact.force_in_object.into_iter().chain(contact.torsion) {
            self.within(&inside("force_in_object"), force, [-caps::SIZE, caps::SIZE]);
        }
    }

    fn per_joint(&mut self, list: &GraspList, steps: &[PathStep], n_seen: usize) {
        let n_joints = list.hand.joint_names.len();
        if n_seen != n_joints {
            let expected = format!("{n_joints}, one for each of \"joint_names\"");
            self.fail("G704", steps, format!("has {n_seen} values"), expected);
        }
    }

    fn within(&mut self, steps: &[PathStep], value: f64, [low, high]: [f64; 2]) {
        if !(low..=high).contains(&value) {
            let expected = format!("a number from {} to {}", number(low), number(high));
            self.fail("G709", steps, format!("is {}", number(value)), expected);
        }
    }

    fn position(&mut self, steps: &[PathStep], position: &[f64; 3]) {
        if position.iter().any(|x| !(x.abs() <= caps::POSITION)) {
            self.fail("G709", steps, format!("is {position:?}"), "metres");
        }
    }

    fn direction(&mut self, steps: &[PathStep], direction: &[f64; 3]) {
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
            self.fail("G705", steps, format!("has length {}", number(length)), "length 1");
        }
    }

    fn pose(&mut self, steps: &[PathStep], pose: &PoseData) {
        let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
            self.fail("G705", steps, format!("has a quaternion of length {}", number(length)), "length 1");
        } else if pose.quat_xyzw[3] < 0.0 {
            self.fail("G705", steps, "has a quaternion with w < 0".into(), "w >= 0");
        }
        self.position(steps, &pose.position);
    }
}
