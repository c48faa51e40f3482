//! What a plan file may not say.

use super::caps;
use crate::plan::{
    Asked, ContactMode, ContactState, FORMAT_VERSION, ForcePromises, Plan, PoseData, Segment, SegmentKind,
};
use regrasp_base::InputError;
use regrasp_base::diagnostic::{Diagnostics, GOOD_NAME, fault_of_name, number, printable_line};
use regrasp_base::json_place::{PathStep, diagnostic};
use std::path::Path;

/// How far a quaternion's or a normal's length may be from one.
const UNIT_TOLERANCE: f64 = 1e-9;

/// `plan`, which `text` of version `version` says, if nothing is wrong with it.
pub(super) fn validate(path: &Path, text: &str, version: u32, plan: Plan) -> Result<Plan, InputError> {
    let mut reader = Reader { path, text, version, plan: &plan, found: Diagnostics::default() };
    reader.validate(&plan);
    let found = reader.found;
    found.into_result(plan)
}

/// Where a file of version 3 has what the plan has at `steps`.
fn in_file<'a>(plan: &Plan, steps: &[PathStep<'a>]) -> Vec<PathStep<'a>> {
    use PathStep::{Index, Key};
    match steps {
        [Key(key @ ("joint_names" | "held_joints" | "fingers")), rest @ ..] => {
            [&[Key("hands"), Index(0), Key(key)], rest].concat()
        }
        [Key("segments"), Index(s), Key("moving_finger"), rest @ ..] => {
            [&[Key("segments"), Index(*s), Key("moving"), Index(0)], rest].concat()
        }
        [Key("segments"), Index(s), Key("also_moving"), Index(i)] => {
            vec![Key("segments"), Index(*s), Key("moving"), Index(i + 1)]
        }
        [Key("segments"), Index(s), Key("waypoints"), Index(w), Key(key), rest @ ..] => {
            let at = [Key("segments"), Index(*s), Key("waypoints"), Index(*w)];
            match (*key, rest) {
                ("world_from_object", _) => [&at[..], &[Key("world_from_objects"), Index(0)], rest].concat(),
                ("contacts", [Index(finger), rest @ ..]) => {
                    // Free fingers have no entry.
                    let contacts = &plan.segments[*s].waypoints[*w].contacts;
                    let before = contacts.iter().take(*finger).filter(|state| **state != ContactState::FREE).count();
                    [&at[..], &[Key("contacts"), Index(before)], rest].concat()
                }
                _ => [&at[..], &[Key(key)], rest].concat(),
            }
        }
        _ => steps.to_vec(),
    }
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    version: u32,
    plan: &'a Plan,
    found: Diagnostics,
}

impl Reader<'_> {
    fn fail(&mut self, code: &'static str, steps: &[PathStep], problem: String, expected: String) {
        // A broken writer breaks every waypoint in the same way.
        if self.found.counted_only() {
            return;
        }
        let steps = if self.version == FORMAT_VERSION { in_file(self.plan, steps) } else { steps.to_vec() };
        self.found.push(diagnostic(self.path, self.text, code, &steps, problem).expected(expected));
    }

    /// The query of a session: as many joints as the plan has, and names of its fingers.
    fn asked(&mut self, plan: &Plan, asked: &Asked) {
        use PathStep::{Index, Key};
        self.pose(&[Key("asked"), Key("start")], &asked.start);
        self.pose(&[Key("asked"), Key("goal")], &asked.goal);
        let n_joints = plan.joint_names.len();
        if asked.joints.len() != n_joints {
            let problem = format!("has {} entries", asked.joints.len());
            self.fail("C404", &[Key("asked"), Key("joints")], problem, format!("{n_joints}, as \"joint_names\""));
        }
        for (i, joint) in asked.joints.iter().enumerate() {
            self.within(&[Key("asked"), Key("joints"), Index(i)], *joint, -caps::POSITION, caps::POSITION);
        }
        for (i, name) in asked.free.iter().enumerate() {
            if !plan.fingers.contains(name) || asked.free[..i].contains(name) {
                let problem = format!("\"{}\" is no finger of the plan, or is named twice", printable_line(name));
                self.fail("C408", &[Key("asked"), Key("free"), Index(i)], problem, plan.fingers.join(", "));
            }
        }
    }

    fn validate(&mut self, plan: &Plan) {
        use PathStep::{Index, Key};
        let n_waypoints: usize = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
        for (key, seen, limit) in [
            ("joint_names", plan.joint_names.len(), caps::JOINTS),
            ("held_joints", plan.held_joints.len(), caps::JOINTS),
            ("fingers", plan.fingers.len(), caps::FINGERS),
            ("inputs", plan.inputs.len(), caps::INPUTS),
            ("way_poses", plan.way_poses.len(), caps::WAY_POSES),
            ("segments", plan.segments.len(), caps::SEGMENTS),
            ("segments", n_waypoints, caps::WAYPOINTS),
        ] {
            if seen > limit {
                self.fail("C410", &[Key(key)], format!("has {seen} entries"), format!("at most {limit}"));
                return;
            }
        }
        for (key, name) in [("hands", &plan.hand), ("objects", &plan.object), ("query", &plan.query)] {
            // Plans of version 2 name no object, and most plans no query.
            if let Some(fault) = fault_of_name(name).filter(|_| !name.is_empty()) {
                self.fail("V004", &[Key(key)], fault, GOOD_NAME.into());
            }
        }
        for (key, names) in [("joint_names", &plan.joint_names), ("fingers", &plan.fingers)] {
            if names.is_empty() {
                self.fail("C404", &[Key(key)], "is empty".into(), "at least one name".into());
            }
            for (i, name) in names.iter().enumerate() {
                if let Some(fault) = fault_of_name(name) {
                    self.fail("V004", &[Key(key), Index(i)], fault, GOOD_NAME.into());
                }
                if names[..i].contains(name) {
                    self.fail("C408", &[Key(key), Index(i)], format!("\"{name}\" is used twice"), "each once".into());
                }
            }
        }
        for (name, position) in &plan.held_joints {
            let at = [Key("held_joints"), Key(name)];
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", &at, fault, GOOD_NAME.into());
            }
            if plan.joint_names.contains(name) {
                let problem = format!("\"{name}\" is in \"joint_names\" too");
                self.fail("C408", &at, problem, "a joint that stands still".into());
            }
            self.within(&at, *position, -caps::POSITION, caps::POSITION);
        }
        for (i, input) in plan.inputs.iter().enumerate() {
            if input.sha256.len() != 64
                || !input.sha256.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
            {
                let steps = [Key("inputs"), Index(i), Key("sha256")];
                self.fail("C409", &steps, format!("is \"{}\"", input.sha256), "64 lower-case hex digits".into());
            }
        }
        let promises = &plan.promises;
        for (key, value, low, high) in [
            ("contact_tolerance", promises.contact_tolerance, 0.0, 1.0),
            ("friction", promises.friction, 0.0, 1e3),
            ("required_margin", promises.required_margin, 0.0, 1.0),
            ("kept_margin", promises.kept_margin, 0.0, 1.0),
            ("torque_scale", promises.torque_scale, 1e-9, 1e3),
            ("friction_margin", promises.friction_margin, 1.0, 1e3),
            ("slip_tolerance", promises.slip_tolerance, 0.0, 1.0),
        ] {
            self.within(&[Key("promises"), Key(key)], value, low, high);
        }
        self.motion_limits(plan);
        if let Some(forces) = &promises.forces {
            self.force_promises(plan, forces);
        }
        if let Some(tracking) = &promises.tracking {
            let inside = |key| [Key("promises"), Key("tracking"), Key(key)];
            self.within(&inside("goal_tolerance"), tracking.goal_tolerance, 0.0, std::f64::consts::PI);
            self.within(&inside("sliding_friction"), tracking.sliding_friction, 0.0, 1e3);
        }
        self.pose(&[Key("start")], &plan.start);
        self.pose(&[Key("goal")], &plan.goal);
        if let Some(asked) = &plan.asked {
            self.asked(plan, asked);
        }
        for (i, way_pose) in plan.way_poses.iter().enumerate() {
            let at = [Key("way_poses"), Index(i)];
            self.pose(&[at[0], at[1], Key("world_from_object")], &way_pose.world_from_object);
            let n_waypoints = plan.segments.get(way_pose.segment).map_or(0, |segment| segment.waypoints.len());
            if way_pose.waypoint >= n_waypoints {
                let problem = format!("is passed at segment {}, waypoint {}", way_pose.segment, way_pose.waypoint);
                self.fail("C409", &at, problem, "a waypoint that the plan has".into());
            }
        }
        if plan.segments.is_empty() {
            self.fail("C406", &[Key("segments")], "is empty".into(), "at least one segment".into());
        }
        for (i, segment) in plan.segments.iter().enumerate() {
            let at = [Key("segments"), Index(i)];
            if segment.waypoints.len() < 2 {
                let steps = [at[0], at[1], Key("waypoints")];
                let problem = format!("has {} waypoints", segment.waypoints.len());
                self.fail("C406", &steps, problem, "at least 2".into());
            }
            self.finger_of(plan, &at, segment, "moving_finger", &segment.moving_finger);
            self.finger_of(plan, &at, segment, "rolling_finger", &segment.rolling_finger);
            self.also_moving(plan, &at, segment);
            self.held_by(&at, segment);
            for (j, waypoint) in segment.waypoints.iter().enumerate() {
                self.waypoint(plan, &[at[0], at[1], Key("waypoints"), Index(j)], waypoint);
            }
        }
    }

    /// The finger that a segment names, where its kind has one.
    fn finger_of(
        &mut self,
        plan: &Plan,
        at: &[PathStep; 2],
        segment: &Segment,
        key: &'static str,
        name: &Option<String>,
    ) {
        let (kind, is_asked) = match segment.kind {
            SegmentKind::Transfer => ("transfer", false),
            SegmentKind::Regrasp => ("regrasp", key == "moving_finger"),
            SegmentKind::Tracking => ("tracking segment", true),
        };
        let steps = [at[0], at[1], PathStep::Key(key)];
        match name {
            Some(finger) if is_asked && !plan.fingers.contains(finger) => {
                let expected = format!("one of {}", plan.fingers.join(", "));
                self.fail("C408", &steps, format!("\"{finger}\" is not in \"fingers\""), expected);
            }
            Some(_) if !is_asked => {
                let expected = format!("no {}", key.replace('_', " "));
                self.fail("C408", &steps, format!("stands in a {kind}"), expected);
            }
            None if is_asked => self.fail("C408", at, format!("is a {kind} without \"{key}\""), "its name".into()),
            _ => {}
        }
    }

    /// Fingers that a tracking segment names beside its moving finger: of the plan's, each once.
    fn also_moving(&mut self, plan: &Plan, at: &[PathStep; 2], segment: &Segment) {
        for (i, finger) in segment.also_moving.iter().enumerate() {
            let steps = [at[0], at[1], PathStep::Key("also_moving"), PathStep::Index(i)];
            if segment.kind != SegmentKind::Tracking {
                let expected = "no \"also_moving\": in a tracking segment only".into();
                self.fail("C408", &steps, format!("names \"{finger}\""), expected);
            } else if !plan.fingers.contains(finger) {
                let expected = format!("one of {}", plan.fingers.join(", "));
                self.fail("C408", &steps, format!("\"{finger}\" is not in \"fingers\""), expected);
            } else if segment.moving_finger.as_ref() == Some(finger) || segment.also_moving[..i].contains(finger) {
                self.fail("C408", &steps, format!("names \"{finger}\" again"), "each finger once".into());
            }
        }
    }

    /// Who holds the object: names that can be shown, each once.
    fn held_by(&mut self, at: &[PathStep; 2], segment: &Segment) {
        let steps = [at[0], at[1], PathStep::Key("held_by")];
        if segment.held_by.len() > caps::HOLDERS {
            let problem = format!("has {} names", segment.held_by.len());
            self.fail("C410", &steps, problem, format!("at most {}", caps::HOLDERS));
            return;
        }
        for (i, name) in segment.held_by.iter().enumerate() {
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", &steps, fault, GOOD_NAME.into());
            } else if segment.held_by[..i].contains(name) {
                self.fail("C408", &steps, format!("names \"{name}\" again"), "each holder once".into());
            }
        }
    }

    fn within(&mut self, steps: &[PathStep], value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            let expected = format!("a number from {} to {}", number(low), number(high));
            self.fail("C409", steps, format!("is {}", number(value)), expected);
        }
    }

    /// A vector of one value for each joint, none larger than any that makes sense.
    fn per_joint(&mut self, plan: &Plan, steps: &[PathStep], values: &[f64], n_expected: usize) {
        if values.len() != n_expected {
            let expected = match n_expected {
                0 => "none: \"promises\" has no \"forces\"".into(),
                _ => format!("{}, one for each of \"joint_names\"", plan.joint_names.len()),
            };
            self.fail("C404", steps, format!("has {} values", values.len()), expected);
        }
        if let Some(value) = values.iter().find(|value| value.abs() > caps::SIZE) {
            let expected = format!("at most {} in size", number(caps::SIZE));
            self.fail("C409", steps, format!("holds {}", number(*value)), expected);
        }
    }

    fn motion_limits(&mut self, plan: &Plan) {
        use PathStep::Key;
        let motion = &plan.promises.motion;
        let inside = |key| [Key("promises"), Key("motion"), Key(key)];
        self.within(&inside("largest_speed"), motion.largest_speed, 1e-9, caps::SIZE);
        let limits =
            [("joint_velocities", &motion.joint_velocities), ("joint_accelerations", &motion.joint_accelerations)];
        for (key, values) in limits {
            self.per_joint(plan, &inside(key), values, plan.joint_names.len());
            if let Some(value) = values.iter().find(|value| **value <= 0.0) {
                self.fail("C409", &inside(key), format!("holds {}", number(*value)), "limits above 0".into());
            }
        }
    }

    fn force_promises(&mut self, plan: &Plan, forces: &ForcePromises) {
        use PathStep::Key;
        let inside = |key| [Key("promises"), Key("forces"), Key(key)];
        self.within(&inside("mass"), forces.mass, 0.0, caps::SIZE);
        for component in forces.gravity_in_world.into_iter().flatten() {
            self.within(&inside("gravity_in_world"), component, -1e3, 1e3);
        }
        let [least, largest] = forces.normal_force;
        self.within(&inside("normal_force"), least, 0.0, caps::SIZE);
        self.within(&inside("normal_force"), largest, least, caps::SIZE);
        let limits: Vec<f64> = forces.joint_torques.iter().map(|limit| limit.unwrap_or(0.0)).collect();
        self.per_joint(plan, &inside("joint_torques"), &limits, plan.joint_names.len());
        if let Some(limit) = limits.iter().find(|limit| **limit < 0.0) {
            let steps = inside("joint_torques");
            self.fail("C409", &steps, format!("holds {}", number(*limit)), "limits of 0 or more, or null".into());
        }
    }

    fn waypoint(&mut self, plan: &Plan, at: &[PathStep; 4], waypoint: &crate::Waypoint) {
        use PathStep::{Index, Key};
        let inside = |key| [at[0], at[1], at[2], at[3], Key(key)];
        if waypoint.joints.len() != plan.joint_names.len() {
            let problem = format!("has {} values", waypoint.joints.len());
            let expected = format!("{}, one for each of \"joint_names\"", plan.joint_names.len());
            self.fail("C404", &inside("joints"), problem, expected);
        }
        if let Some(value) = waypoint.joints.iter().find(|value| value.abs() > caps::POSITION) {
            let expected = format!("at most {} in size", caps::POSITION);
            self.fail("C409", &inside("joints"), format!("holds {}", number(*value)), expected);
        }
        self.within(&inside("time"), waypoint.time, 0.0, caps::SIZE);
        let n_joints = plan.joint_names.len();
        self.per_joint(plan, &inside("joint_velocities"), &waypoint.joint_velocities, n_joints);
        let n_torques = if plan.promises.forces.is_some() { n_joints } else { 0 };
        self.per_joint(plan, &inside("joint_torques"), &waypoint.joint_torques, n_torques);
        self.pose(&inside("world_from_object"), &waypoint.world_from_object);
        if waypoint.contacts.len() != plan.fingers.len() {
            let problem = format!("has {} entries", waypoint.contacts.len());
            let expected = format!("{}, one for each of \"fingers\"", plan.fingers.len());
            self.fail("C404", &inside("contacts"), problem, expected);
        }
        for (k, contact) in waypoint.contacts.iter().enumerate() {
            let steps = [at[0], at[1], at[2], at[3], Key("contacts"), Index(k)];
            match (contact.mode, &contact.point_in_object, &contact.normal_in_object) {
                (ContactMode::Free, None, None) => {}
                (ContactMode::Free, _, _) => {
                    self.fail("C407", &steps, "is free but has a point or normal".into(), "neither".into());
                }
                (_, Some(point), Some(normal)) => {
                    if point.iter().any(|x| x.abs() > caps::POSITION) {
                        self.fail("C409", &steps, format!("has its point at {point:?}"), "metres".into());
                    }
                    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
                    if (length - 1.0).abs() > UNIT_TOLERANCE {
                        self.fail("C405", &steps, format!("has a normal of length {length}"), "length 1".into());
                    }
                }
                _ => self.fail("C407", &steps, "holds but lacks its point or normal".into(), "both".into()),
            }
            self.contact_force(plan, &steps, contact);
            let (point, velocity) = (contact.point_in_tip, contact.relative_velocity_in_object);
            let is_tracked = point.is_some() || velocity.is_some() || contact.relative_turn_in_object.is_some();
            if contact.mode == ContactMode::Free && is_tracked {
                let problem = "is free but has a point on the tip or a relative velocity";
                self.fail("C407", &steps, problem.into(), "neither".into());
            }
            let numbers = [point, velocity, contact.relative_turn_in_object].into_iter().flatten().flatten();
            if let Some(value) = numbers.into_iter().find(|value| value.abs() > caps::POSITION) {
                self.fail("C409", &steps, format!("holds {}", number(value)), "metres, m/s or rad/s".into());
            }
        }
    }

    fn contact_force(&mut self, plan: &Plan, steps: &[PathStep], contact: &ContactState) {
        let is_loaded = contact.force_in_object.is_some() || contact.torsion.is_some();
        if contact.mode == ContactMode::Free {
            if is_loaded {
                self.fail("C407", steps, "is free but has a force or torsion".into(), "neither".into());
            }
        } else if plan.promises.forces.is_none() {
            if is_loaded {
                let problem = "has a force or torsion, but \"promises\" has no \"forces\"";
                self.fail("C407", steps, problem.into(), "neither".into());
            }
        } else if contact.force_in_object.is_none() {
            self.fail("C407", steps, "holds but lacks its force, which \"promises\" has".into(), "a force".into());
        }
        let numbers = contact.force_in_object.into_iter().flatten().chain(contact.torsion);
        if let Some(value) = numbers.into_iter().find(|value| value.abs() > caps::SIZE) {
            self.fail("C409", steps, format!("has a force of {}", number(value)), "newtons".into());
        }
    }

    fn pose(&mut self, steps: &[PathStep], pose: &PoseData) {
        let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.fail("C405", steps, format!("has a quaternion of length {length}"), "length 1".into());
        } else if pose.quat_xyzw[3] < 0.0 {
            self.fail("C405", steps, "has a quaternion with w < 0".into(), "w >= 0".into());
        }
        if pose.position.iter().any(|x| x.abs() > caps::POSITION) {
            self.fail("C409", steps, format!("has position {:?}", pose.position), "metres".into());
        }
    }
}
