//! The scene as the checker sees it: paths to links, joint limits and fingertips, straight from the robot.

use crate::check::carried::world_from_base;
use crate::check::kinematics::{Drive, Path, world_from_root};
use crate::check::prepared::Prepared;
use crate::check::surface::SortedShape;
use crate::check::tip_surface::TipSurface;
use nalgebra::Matrix4;
use regrasp_geometry::{Point, Pose};
use regrasp_robot::hand::Finger;
use regrasp_robot::tip::Pad;
use regrasp_robot::{ContactModel, Hand, JointKind, LinkId, Robot, TipShape};
use regrasp_scene::Manipulation;
use std::collections::BTreeMap;

/// A finger with its tip; a sharp tip is a ball of radius zero.
#[derive(Debug, Clone)]
pub struct FingerModel {
    /// Name of the finger.
    pub name: String,
    /// Path to the last moving body, in whose frame [`FingerModel::center`] is.
    pub path: Path,
    /// Centre of the ball or ellipsoid that touches.
    pub center: Point,
    /// Radius of the ball, or largest half axis of the ellipsoid.
    pub radius: f64,
    /// The surface that touches.
    pub surface: TipSurface,
    /// Where it may touch; anywhere without one.
    pub pad: Option<Pad>,
    /// What it transmits where it touches.
    pub contact: ContactModel,
    /// The link that may touch the object.
    pub tip_link: LinkId,
    /// Which `<collision>` elements of it may; all where empty.
    pub tip_elements: Vec<usize>,
    /// Pose of that link in the frame of the last moving body.
    pub body_from_tip_link: Matrix4<f64>,
    /// Centre of the tip in the world when the hand is in its rest posture.
    pub center_at_rest: Point,
    /// First and one past the last index of this finger's coordinates in a joint vector.
    pub coordinates: std::ops::Range<usize>,
    /// Indices in `Robot::joints` of all moving joints on the path.
    pub moving_joints: Vec<usize>,
}

impl LimitRow {
    /// Brings the joint to `position` by the first coordinate that drives it alone.
    pub fn put(&self, joints: &mut [f64], position: f64) {
        let Some(&(k, multiplier)) = self.drive.terms.first() else { return };
        let others = self.drive.position(joints) - multiplier * joints[k];
        joints[k] = (position - others) / multiplier;
    }
}

impl DriveRow {
    /// The coordinate of the joint, unless it follows others.
    pub fn own_coordinate(&self) -> Option<usize> {
        if self.follows { None } else { self.drive.single() }
    }
}

impl FingerModel {
    /// A finger of a robot whose root stands at a pose and whose joint vector has these names.
    ///
    /// `coordinates`: the finger's own place in the joint vector; `at_rest`: the joint vector at rest. Tips are measured where `prepared`
    /// does not know them. Err with a message when the robot contradicts itself.
    pub fn new(
        robot: &Robot,
        (finger, prepared): (&Finger, &Prepared),
        (world_from_root, joint_names): (&Pose, &[String]),
        coordinates: std::ops::Range<usize>,
        at_rest: &[f64],
    ) -> Result<Self, String> {
        let mut path = Path::new(robot, finger.tip.link, world_from_root, joint_names)?;
        let body_from_tip_link = std::mem::replace(&mut path.last_from_link, Matrix4::identity());
        let center = finger.tip.center_in_body;
        Ok(FingerModel {
            name: finger.name.clone(),
            moving_joints: path.joints.iter().map(|joint| joint.joint).collect(),
            center_at_rest: path.world_from_link(at_rest).transform_point(&center),
            path,
            body_from_tip_link,
            center,
            radius: finger.tip.radius(),
            surface: prepared.surface(&finger.tip),
            pad: finger.tip.pad,
            contact: finger.tip.contact,
            tip_link: finger.tip.link,
            tip_elements: match &finger.tip.shape {
                TipShape::Hull { elements, .. } => elements.clone(),
                _ => Vec::new(),
            },
            coordinates,
        })
    }

    /// True when the `<collision>` element of the tip link with this index may touch the object.
    pub fn tip_has(&self, element: usize) -> bool {
        self.tip_elements.is_empty() || self.tip_elements.contains(&element)
    }

    /// Centre of the tip in the world.
    pub fn center_in_world(&self, joints: &[f64]) -> Point {
        self.path.world_from_link(joints).transform_point(&self.center)
    }
}

/// The limits of one joint, as a function of the coordinates that drive it.
#[derive(Debug, Clone)]
pub struct LimitRow {
    /// Name of the joint.
    pub name: String,
    /// What gives it its position.
    pub drive: Drive,
    /// Lowest position.
    pub lower: f64,
    /// Highest position.
    pub upper: f64,
}

/// How fast a joint may go and what its drive can do.
#[derive(Debug, Clone)]
pub struct DriveRow {
    /// Name of the joint.
    pub name: String,
    /// What gives it its position: its own coordinate, unless it follows others.
    pub drive: Drive,
    /// True for a joint that follows another: it has no drive of its own.
    pub follows: bool,
    /// Highest speed, in rad/s or m/s, where the robot says one.
    pub velocity: Option<f64>,
    /// Highest torque or force, in N m or N, where the robot says one.
    pub effort: Option<f64>,
}

/// Everything about the hand that is not a shape.
#[derive(Debug, Clone)]
pub struct CheckedHand {
    /// Names of the coordinates of a joint vector.
    pub joint_names: Vec<String>,
    /// Where its other independent joints stand; none for a hand that a robot carries.
    pub held_joints: BTreeMap<String, f64>,
    /// True where the coordinate slides.
    pub slides: Vec<bool>,
    /// Fingers, in the order of the hand.
    pub fingers: Vec<FingerModel>,
    /// Limits of all joints that have some.
    pub limits: Vec<LimitRow>,
    /// What the joints that move with the joint vector can do.
    pub drives: Vec<DriveRow>,
    /// Where the robot's root stands.
    pub world_from_root: Pose,
    /// The object's shape, ready to be asked for what is near.
    pub shape: SortedShape,
}

impl CheckedHand {
    /// Reads the hand of `scene`. Err with a message when the hand contradicts itself.
    pub fn new(task: &Manipulation) -> Result<Self, String> {
        Self::with(task, &Prepared::default())
    }

    /// The same, with fingertips that may be measured already.
    pub fn with(task: &Manipulation, prepared: &Prepared) -> Result<Self, String> {
        let hand = task.hand();
        let robot = &hand.robot;
        let joint_names = hand.joint_names();
        let world_from_root = world_from_root(hand, &world_from_base(task)?)?;
        let mut fingers = Vec::new();
        let mut first = 0;
        let at_rest: Vec<f64> = hand.fingers.iter().flat_map(|finger| finger.rest.iter().copied()).collect();
        for finger in &hand.fingers {
            let coordinates = first..first + finger.chain.n_coordinates();
            first = coordinates.end;
            fingers.push(FingerModel::new(
                robot,
                (finger, prepared),
                (&world_from_root, &joint_names),
                coordinates,
                &at_rest,
            )?);
        }
        let mut slides = Vec::new();
        for name in &joint_names {
            let id = robot.joint_named(name).ok_or_else(|| format!("the robot has no joint \"{name}\""))?;
            slides.push(robot.joints[id.0].kind == JointKind::Prismatic);
        }
        let (limits, drives) = joint_rows(task, &joint_names)?;
        let shape = SortedShape::of(&task.object().shape);
        let held_joints = match task.scene.hands[task.hand_index].carrier {
            Some(_) => BTreeMap::new(),
            None => held_joints(hand, &joint_names),
        };
        Ok(CheckedHand { held_joints, slides, limits, drives, joint_names, fingers, world_from_root, shape })
    }
}

/// Joints that are driven and not by the joint vector, and where the robot has them.
fn held_joints(hand: &Hand, joint_names: &[String]) -> BTreeMap<String, f64> {
    let mut held = BTreeMap::new();
    for (index, joint) in hand.robot.joints.iter().enumerate() {
        if joint.kind == JointKind::Fixed || joint.coupling.is_some() || joint_names.contains(&joint.name) {
            continue;
        }
        let mut position = joint.limits.map_or(0.0, |limits| limits.lower.max(0.0).min(limits.upper));
        if let Some((_, stated)) = hand.held.iter().find(|(id, _)| id.0 == index) {
            position += stated;
        }
        held.insert(joint.name.clone(), position);
    }
    held
}

fn joint_rows(task: &Manipulation, joint_names: &[String]) -> Result<(Vec<LimitRow>, Vec<DriveRow>), String> {
    let robot = &task.hand().robot;
    let (mut rows, mut drives) = (Vec::new(), Vec::new());
    for (i, joint) in robot.joints.iter().enumerate() {
        let drive = Drive::of(robot, i, joint_names)?;
        if drive.terms.is_empty() {
            continue;
        }
        drives.push(DriveRow {
            name: joint.name.clone(),
            drive: drive.clone(),
            follows: joint.coupling.is_some(),
            velocity: joint.limits.and_then(|limits| limits.velocity),
            effort: joint.limits.and_then(|limits| limits.effort),
        });
        let bounded = matches!(joint.kind, JointKind::Revolute | JointKind::Prismatic);
        if let (true, Some(limits)) = (bounded, &joint.limits) {
            rows.push(LimitRow { name: joint.name.clone(), drive, lower: limits.lower, upper: limits.upper });
        }
    }
    Ok((rows, drives))
}
