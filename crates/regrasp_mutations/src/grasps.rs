//! Grasp lists broken in exactly one known way each, to test the judge of lists. Every mutant must be rejected.

use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, UnitVector, Vector};
use regrasp_grasp::list::{GraspList, ListedGrasp};
use regrasp_grasp::record::PoseData;
use regrasp_grasp::{Contact, Grip};
use regrasp_plan::check::closure::{HeldBody, certified_margin};
use regrasp_plan::check::violation::ViolationKind as Kind;
use regrasp_robot::Hand;
use regrasp_scene::{GraspScene, Object};

/// A broken list of one grasp.
#[derive(Debug, Clone)]
pub struct GraspMutant {
    /// What was done to it.
    pub name: &'static str,
    /// The broken list.
    pub list: GraspList,
    /// At least one of these must be reported; others may follow from them.
    pub expected: Vec<Kind>,
}

/// Names of all kinds of damage.
pub const KINDS: [&str; 18] = [
    "joint past its limit",
    "contact 1 mm off",
    "flipped normal",
    "wrist 2 mm in",
    "finger swapped",
    "friction above the scene's",
    "margin raised",
    "force 1 % outside its cone",
    "open posture inside the object",
    "way in through the object",
    "way in of a few millimetres",
    "unstable pose called stable",
    "hand below the support",
    "other mesh",
    "torque off",
    "joint that stands still invented",
    "joint that stands still left out",
    "joint that stands still elsewhere",
];

/// The list with only grasp `index`, broken in the way called `name`; none where this grasp cannot be broken so.
pub fn mutant(
    scene: &GraspScene,
    list: &GraspList,
    index: usize,
    name: &'static str,
    rng: &mut Rng,
) -> Option<GraspMutant> {
    let mut list = GraspList { grasps: vec![list.grasps[index].clone()], ..list.clone() };
    let (hand, object) = (scene.manipulation().hand(), scene.manipulation().object());
    let expected = match name {
        "joint past its limit" => past_limit(hand, &mut list.grasps[0], rng)?,
        "contact 1 mm off" => {
            let contact = pick(&mut list.grasps[0].contacts, rng)?;
            let shift = Vector::from(rng.direction()) * 1e-3;
            contact.point_in_object = (Vector::from(contact.point_in_object) + shift).into();
            vec![Kind::ContactOffSurface, Kind::ContactOffTip]
        }
        "flipped normal" => {
            let contact = pick(&mut list.grasps[0].contacts, rng)?;
            contact.normal_in_object = contact.normal_in_object.map(|x| -x);
            vec![Kind::ContactNormalWrong]
        }
        "wrist 2 mm in" => {
            let grasp = &mut list.grasps[0];
            let shift = Vector::from(grasp.approach.direction_in_object) * 2e-3;
            let pose = Translation3::from(shift) * Pose::from(&grasp.object_from_hand);
            grasp.object_from_hand = PoseData::from(&pose);
            vec![Kind::ContactOffTip, Kind::Collision]
        }
        "finger swapped" => {
            let contacts = &mut list.grasps[0].contacts;
            let (a, b) = (rng.below(contacts.len()), rng.below(contacts.len()));
            if a == b {
                return None;
            }
            let (first, second) = (contacts[a].finger.clone(), contacts[b].finger.clone());
            (contacts[a].finger, contacts[b].finger) = (second, first);
            vec![Kind::ContactOffTip]
        }
        "joint that stands still invented" => {
            list.hand.held_joints.insert("no_such_joint".into(), rng.uniform(-1.0, 1.0));
            vec![Kind::WrongScene]
        }
        "joint that stands still left out" => {
            list.hand.held_joints.pop_first()?;
            vec![Kind::WrongScene]
        }
        "joint that stands still elsewhere" => {
            *list.hand.held_joints.values_mut().next()? += rng.uniform(1e-6, 1e-3);
            vec![Kind::WrongScene]
        }
        "friction above the scene's" => {
            list.promises.friction = object.friction * rng.uniform(1.001, 1.2);
            vec![Kind::FrictionAboveScene]
        }
        "margin raised" => {
            let found = margin(hand, object, &list)?;
            list.grasps[0].margin = (found * rng.uniform(1.01, 1.2)).min(1.0);
            vec![Kind::PromiseBroken]
        }
        "force 1 % outside its cone" => {
            let friction = list.promises.friction;
            let contact = pick(&mut list.grasps[0].contacts, rng)?;
            let normal = Vector::from(contact.normal_in_object);
            let pressing = -normal.dot(&Vector::from(contact.force_in_object));
            let across = normal.cross(&Vector::from(rng.direction())).try_normalize(1e-6)?;
            contact.force_in_object = (across * (1.01 * friction * pressing) - normal * pressing).into();
            vec![Kind::ForceOutsideCone]
        }
        "open posture inside the object" => inside(hand, &mut list.grasps[0], rng)?,
        "way in through the object" => {
            let grasp = &mut list.grasps[0];
            let away = Vector::from(grasp.object_from_hand.position) - object.center_of_mass.coords;
            grasp.approach.direction_in_object = away.try_normalize(1e-3)?.into();
            grasp.approach.distance = away.norm().min(0.9);
            vec![Kind::Collision]
        }
        "way in of a few millimetres" => {
            list.grasps[0].approach.distance = rng.uniform(0.0, 0.019);
            vec![Kind::NoWayIn]
        }
        "unstable pose called stable" => {
            let pose = pick(&mut list.stable_poses, rng)?;
            let down = Vector::from(pose.down_in_object);
            let axis = down.cross(&Vector::from(rng.direction())).try_normalize(1e-3)?;
            let tilt = UnitQuaternion::from_scaled_axis(axis * rng.uniform(0.1, 0.3));
            let down = (tilt * down).normalize();
            pose.down_in_object = down.into();
            pose.height = corners(&object.shape)?.iter().map(|p| p.coords.dot(&down)).fold(f64::NEG_INFINITY, f64::max);
            vec![Kind::StablePoseWrong]
        }
        "hand below the support" => {
            let hand_at = Vector::from(list.grasps[0].object_from_hand.position);
            let below = |k: &usize| {
                let pose = &list.stable_poses[*k];
                Vector::from(pose.down_in_object).dot(&hand_at) > pose.height + 0.02
            };
            let which = (0..list.stable_poses.len()).find(below)?;
            list.grasps[0].stable_poses = vec![which];
            vec![Kind::StablePoseWrong]
        }
        "other mesh" => {
            let input = pick(&mut list.inputs, rng)?;
            let digit = if input.sha256.starts_with('0') { "1" } else { "0" };
            input.sha256.replace_range(..1, digit);
            vec![Kind::InputHashMismatch]
        }
        "torque off" => {
            let torque = pick(&mut list.grasps[0].joint_torques, rng)?;
            *torque += if rng.chance(0.5) { 1e-3 } else { -1e-3 };
            vec![Kind::TorqueWrong]
        }
        _ => return None,
    };
    Some(GraspMutant { name, list, expected })
}

fn pick<'a, T>(items: &'a mut [T], rng: &mut Rng) -> Option<&'a mut T> {
    let n = items.len();
    if n == 0 { None } else { items.get_mut(rng.below(n)) }
}

/// A joint of the grasp goes a milliradian beyond a limit.
fn past_limit(hand: &Hand, grasp: &mut ListedGrasp, rng: &mut Rng) -> Option<Vec<Kind>> {
    let limits: Vec<[f64; 2]> = hand
        .fingers
        .iter()
        .flat_map(|finger| finger.chain.lower.iter().zip(&finger.chain.upper).map(|(lower, upper)| [*lower, *upper]))
        .collect();
    let k = rng.below(limits.len());
    let joints = if rng.chance(0.5) { &mut grasp.joints } else { &mut grasp.open_joints };
    let beyond = if rng.chance(0.5) { limits[k][0] - 1e-3 } else { limits[k][1] + 1e-3 };
    joints[k] = beyond;
    beyond.is_finite().then(|| vec![Kind::JointLimit])
}

/// A finger that holds opens into the object: beyond the grasp, as far as it was opened.
fn inside(hand: &Hand, grasp: &mut ListedGrasp, rng: &mut Rng) -> Option<Vec<Kind>> {
    let chosen = pick(&mut grasp.contacts, rng)?.clone();
    let finger = hand.finger_named(&chosen.finger)?.0;
    let first: usize = hand.fingers[..finger].iter().map(|finger| finger.chain.n_coordinates()).sum();
    let range = first..first + hand.fingers[finger].chain.n_coordinates();
    let ik = &hand.fingers[finger].ik;
    let inward = Pose::from(&grasp.object_from_hand).inverse() * -Vector::from(chosen.normal_in_object);
    // The finger follows its fingertip 4 mm into the object, by small steps of its Jacobian.
    let mut joints = grasp.joints[range.clone()].to_vec();
    let from = ik.tip(&joints);
    for _ in 0..200 {
        let columns = ik.tip_jacobian(&joints);
        let slope: Vec<f64> = columns.iter().map(|column| column.dot(&inward)).collect();
        let size: f64 = slope.iter().map(|x| x * x).sum();
        if !(size > 1e-9) {
            return None;
        }
        joints.iter_mut().zip(&slope).for_each(|(q, s)| *q += 1e-4 * s / size);
        if (ik.tip(&joints) - from).dot(&inward) > 4e-3 {
            grasp.open_joints[range].copy_from_slice(&joints);
            return Some(vec![Kind::Collision, Kind::JointLimit]);
        }
    }
    None
}

/// The margin that the checker finds for the only grasp of the list.
fn margin(hand: &Hand, object: &Object, list: &GraspList) -> Option<f64> {
    let grip = |contact: &regrasp_grasp::list::ListedContact| -> Option<Grip> {
        let finger = &hand.fingers[hand.finger_named(&contact.finger)?.0];
        let normal_in_object = UnitVector::new_normalize(Vector::from(contact.normal_in_object));
        let contact = Contact { point_in_object: Point::from(contact.point_in_object), normal_in_object };
        Some(Grip { contact, model: finger.tip.contact })
    };
    let grips: Option<Vec<Grip>> = list.grasps[0].contacts.iter().map(grip).collect();
    let body = HeldBody {
        center_of_mass: object.center_of_mass,
        torque_scale: object.radius,
        friction: list.promises.friction.min(object.friction),
    };
    certified_margin(&grips?, &body).map(|(margin, _)| margin)
}

/// The points that an object with corners stands on.
fn corners(shape: &Shape) -> Option<Vec<Point>> {
    match shape {
        Shape::Cuboid { half_extents: h } => {
            let sign = |k: i32, bit: i32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Some((0..8).map(|k| Point::new(h.x * sign(k, 0), h.y * sign(k, 1), h.z * sign(k, 2))).collect())
        }
        Shape::Convex(hull) => Some(hull.vertices().to_vec()),
        Shape::Mesh(mesh) => Some(mesh.vertices().to_vec()),
        _ => None,
    }
}
