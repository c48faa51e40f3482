//! A whole robot as the checker sees it: rigid bodies that joints carry, with kinematics of its own.
//!
//! Fixed joints are multiplied out. Body 0 is what no joint moves; every other body is carried by one moving joint.

use crate::check::kinematics::Drive;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_robot::{JointKind, LinkId, Manipulator, Robot};

/// A rotation and a translation.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Columns are the axes of the frame in the frame outside.
    pub rotation: Matrix3<f64>,
    /// Origin in the frame outside.
    pub origin: Vector,
}

impl Frame {
    /// Of a pose.
    pub fn of(pose: &Pose) -> Self {
        Frame { rotation: pose.rotation.to_rotation_matrix().into_inner(), origin: pose.translation.vector }
    }

    /// This frame, then the other.
    pub fn then(&self, other: &Frame) -> Frame {
        Frame { rotation: self.rotation * other.rotation, origin: self.rotation * other.origin + self.origin }
    }

    /// A point of the frame in the frame outside.
    pub fn point(&self, point: &Point) -> Point {
        Point::from(self.rotation * point.coords + self.origin)
    }

    /// A point outside in the frame.
    pub fn inverse_point(&self, point: &Point) -> Point {
        Point::from(self.rotation.tr_mul(&(point.coords - self.origin)))
    }

    /// As a pose.
    pub fn pose(&self) -> Pose {
        let rotation = Rotation3::from_matrix_unchecked(self.rotation);
        Pose::from_parts(Translation3::from(self.origin), UnitQuaternion::from_rotation_matrix(&rotation))
    }
}

/// A rigid body that a moving joint carries.
#[derive(Debug, Clone)]
pub struct Body {
    /// The body that carries the joint.
    pub parent: usize,
    /// Frame of the joint at zero in the parent's frame.
    parent_from_joint: Frame,
    /// Axis, in the joint frame.
    pub axis: Vector,
    cross: Matrix3<f64>,
    cross_squared: Matrix3<f64>,
    /// True for a sliding joint.
    pub slides: bool,
    /// What gives the joint its position.
    pub drive: Drive,
}

/// A joint with what it may do.
#[derive(Debug, Clone)]
pub struct JointRow {
    /// Name.
    pub name: String,
    /// What gives it its position.
    pub drive: Drive,
    /// True for one that follows others.
    pub follows: bool,
    /// True for one that slides.
    pub slides: bool,
    /// Lowest and highest position, where it has limits.
    pub limits: Option<[f64; 2]>,
    /// Highest speed, where the robot file has one.
    pub velocity: Option<f64>,
}

/// A robot with its root in the world.
#[derive(Debug, Clone)]
pub struct Tree {
    world_from_root: Frame,
    /// Bodies but the first, each after its parent: body `k + 1` is `bodies[k]`.
    bodies: Vec<Body>,
    /// By link: its body, and its frame in the body's frame.
    links: Vec<(usize, Frame)>,
    /// All joints that move.
    pub rows: Vec<JointRow>,
}

impl Tree {
    /// Reads a robot whose joint vector has these names.
    ///
    /// Err with a message where the robot contradicts itself, or a joint has no coordinate.
    pub fn new(robot: &Robot, world_from_root: &Pose, joint_names: &[String]) -> Result<Self, String> {
        let mut tree = Tree {
            world_from_root: Frame::of(world_from_root),
            bodies: Vec::new(),
            links: vec![(usize::MAX, Frame::of(&Pose::identity())); robot.links.len()],
            rows: Vec::new(),
        };
        tree.links[robot.root.0].0 = 0;
        let mut waiting = vec![robot.root];
        while let Some(link) = waiting.pop() {
            let (body, body_from_link) = tree.links[link.0];
            for (id, joint) in robot.joints.iter().enumerate().filter(|(_, joint)| joint.parent == link) {
                let joint_in_body = body_from_link.then(&Frame::of(&joint.parent_from_joint));
                waiting.push(joint.child);
                if joint.kind == JointKind::Fixed {
                    tree.links[joint.child.0] = (body, joint_in_body);
                    continue;
                }
                let axis = joint.axis.into_inner();
                let cross = axis.cross_matrix();
                let drive = Drive::of(robot, id, joint_names)?;
                let slides = joint.kind == JointKind::Prismatic;
                let bounded = matches!(joint.kind, JointKind::Revolute | JointKind::Prismatic);
                tree.rows.push(JointRow {
                    name: joint.name.clone(),
                    drive: drive.clone(),
                    follows: joint.coupling.is_some(),
                    slides,
                    limits: joint.limits.filter(|_| bounded).map(|limits| [limits.lower, limits.upper]),
                    velocity: joint.limits.and_then(|limits| limits.velocity),
                });
                tree.bodies.push(Body {
                    parent: body,
                    parent_from_joint: joint_in_body,
                    axis,
                    cross,
                    cross_squared: cross * cross,
                    slides,
                    drive,
                });
                tree.links[joint.child.0] = (tree.bodies.len(), Frame::of(&Pose::identity()));
            }
        }
        match tree.links.iter().position(|(body, _)| *body == usize::MAX) {
            Some(link) => Err(format!("link \"{}\" hangs on nothing", robot.links[link].name)),
            None => Ok(tree),
        }
    }

    /// Reads the robot of a scene. Its joint vector must have a value for every joint that moves on its own.
    pub fn of(robot: &Manipulator, joint_names: &[String]) -> Result<Self, String> {
        let tree = Tree::new(&robot.robot, robot.world_from_root(), joint_names)?;
        let unmoved = robot.robot.joints.iter().find(|joint| {
            let is_own = joint.kind != JointKind::Fixed && joint.coupling.is_none();
            is_own && !joint_names.contains(&joint.name)
        });
        match unmoved {
            Some(joint) => Err(format!("the plan has no values for joint \"{}\"", joint.name)),
            None => Ok(tree),
        }
    }

    /// Number of bodies.
    pub fn n_bodies(&self) -> usize {
        self.bodies.len() + 1
    }

    /// The body that the joint carries; none for the one that nothing moves.
    pub fn body(&self, index: usize) -> Option<&Body> {
        index.checked_sub(1).map(|k| &self.bodies[k])
    }

    /// The body of a link, and the link's frame in it.
    pub fn link(&self, link: LinkId) -> &(usize, Frame) {
        &self.links[link.0]
    }

    /// Bodies from `body` to the one that nothing moves, which is left out.
    pub fn chain(&self, body: usize) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut at = body;
        while let Some(inner) = self.body(at) {
            chain.push(at);
            at = inner.parent;
        }
        chain
    }

    /// Frames of all bodies in the world, and of the joints that carry them (axis and origin are what counts of those).
    pub fn frames(&self, joints: &[f64], frames: &mut Vec<Frame>, axes: &mut Vec<Frame>) {
        frames.clear();
        axes.clear();
        frames.push(self.world_from_root);
        axes.push(self.world_from_root);
        for body in &self.bodies {
            let at_zero = frames[body.parent].then(&body.parent_from_joint);
            let position = body.drive.position(joints);
            axes.push(at_zero);
            frames.push(if body.slides {
                Frame { rotation: at_zero.rotation, origin: at_zero.origin + at_zero.rotation * (body.axis * position) }
            } else {
                let (sine, cosine) = position.sin_cos();
                let turn = Matrix3::identity() + body.cross * sine + body.cross_squared * (1.0 - cosine);
                Frame { rotation: at_zero.rotation * turn, origin: at_zero.origin }
            });
        }
    }

    /// Pose of a link in the world.
    pub fn world_from_link(&self, link: LinkId, joints: &[f64]) -> Pose {
        let (mut frames, mut axes) = (Vec::new(), Vec::new());
        self.frames(joints, &mut frames, &mut axes);
        let (body, body_from_link) = self.link(link);
        frames[*body].then(body_from_link).pose()
    }
}
