//! The checker's own forward kinematics, straight from the robot's joints, and bounds of how far things move.
//!
//! Matrices are 4 x 4 and rotations are Rodrigues' formula; nothing here asks `regrasp_robot::Chain`.

use crate::check::between::{Between, Cubic, JointBounds};
use nalgebra::{Matrix4, Rotation3, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_robot::{Hand, JointKind, LinkId, Robot};

/// A moving joint on the way from the root to a link, reduced to what forward kinematics needs.
#[derive(Debug, Clone)]
pub struct PathJoint {
    /// Index in `Robot::joints`.
    pub joint: usize,
    /// Pose of the joint frame at zero in the frame of the joint before it (the world, for the first).
    pub parent_from_joint: Matrix4<f64>,
    /// Axis, in the joint frame.
    pub axis: Vector,
    /// True for a sliding joint.
    pub slides: bool,
    /// What gives it its position.
    pub drive: Drive,
    /// Largest size of the position, for sliding joints.
    pub largest_slide: f64,
    /// How the joint moves, with `parent_from_joint`.
    motion: JointMotion,
}

/// Pose of the child frame of a joint in the parent's frame, as a function of the position `q`.
#[derive(Debug, Clone)]
enum JointMotion {
    /// `still + q along`.
    Slides { still: Matrix4<f64>, along: Matrix4<f64> },
    /// `still + sin q sine + (1 - cos q) rest`: Rodrigues' formula, with the parent's pose multiplied in.
    Turns { still: Matrix4<f64>, sine: Matrix4<f64>, rest: Matrix4<f64> },
}

impl JointMotion {
    fn new(parent_from_joint: &Matrix4<f64>, axis: &Vector, slides: bool) -> Self {
        let mut part = Matrix4::<f64>::zeros();
        if slides {
            part.fixed_view_mut::<3, 1>(0, 3).copy_from(axis);
            return JointMotion::Slides { still: *parent_from_joint, along: parent_from_joint * part };
        }
        let cross = axis.cross_matrix();
        part.fixed_view_mut::<3, 3>(0, 0).copy_from(&cross);
        let sine = parent_from_joint * part;
        part.fixed_view_mut::<3, 3>(0, 0).copy_from(&(cross * cross));
        JointMotion::Turns { still: *parent_from_joint, sine, rest: parent_from_joint * part }
    }

    fn at(&self, position: f64) -> Matrix4<f64> {
        match self {
            JointMotion::Slides { still, along } => still + along * position,
            JointMotion::Turns { still, sine, rest } => {
                let (sin, cos) = position.sin_cos();
                still + sine * sin + rest * (1.0 - cos)
            }
        }
    }
}

/// The position of a joint as a function of the joint vector: a sum of multiples of some of its entries, plus a constant.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Index in the joint vector and multiplier of each driving coordinate; none for a joint that no finger drives.
    pub terms: Vec<(usize, f64)>,
    /// The constant, with the share of driving joints that no finger moves: those rest at the allowed position nearest to zero.
    pub offset: f64,
}

impl Drive {
    /// What drives joint `id` of `robot` where `joint_names` name the joint vector.
    ///
    /// Err with a message when the joint's coupling leads nowhere.
    pub fn of(robot: &Robot, id: usize, joint_names: &[String]) -> Result<Self, String> {
        let joint = &robot.joints[id];
        let (leaders, offset) = match &joint.coupling {
            Some(coupling) => {
                (coupling.terms.iter().map(|(leader, factor)| (leader.0, *factor)).collect(), coupling.offset)
            }
            None => (vec![(id, 1.0)], 0.0),
        };
        let mut drive = Drive { terms: Vec::new(), offset };
        for (index, multiplier) in leaders {
            let leader = robot.joints.get(index).ok_or("a coupled joint follows one that does not exist")?;
            if joint.coupling.is_some() && leader.coupling.is_some() {
                return Err(format!("joint \"{}\" follows a joint that follows another", joint.name));
            }
            match joint_names.iter().position(|name| *name == leader.name) {
                Some(coordinate) => drive.terms.push((coordinate, multiplier)),
                None => {
                    let at_rest = leader.limits.map_or(0.0, |limits| 0f64.max(limits.lower).min(limits.upper));
                    drive.offset += multiplier * at_rest;
                }
            }
        }
        Ok(drive)
    }

    /// Position of the joint.
    pub fn position(&self, joints: &[f64]) -> f64 {
        let products = self.terms.iter().map(|&(k, multiplier)| multiplier * joints[k]);
        products.reduce(|sum, product| sum + product).unwrap_or(0.0) + self.offset
    }

    /// The coordinate of a joint that one coordinate alone drives.
    pub fn single(&self) -> Option<usize> {
        if self.terms.len() == 1 { Some(self.terms[0].0) } else { None }
    }

    /// True when coordinate `k` moves the joint.
    pub fn is_driven_by(&self, k: usize) -> bool {
        self.terms.iter().any(|term| term.0 == k)
    }

    /// The joint's motion between two waypoints: a sum of cubics is a cubic.
    pub fn motion(&self, motion: &Between) -> Cubic {
        let mut sum = Cubic { change: 0.0, first: 0.0, last: 0.0 };
        for &(k, multiplier) in &self.terms {
            let Cubic { change, first, last } = *motion.joint(k);
            sum.change += multiplier * change;
            sum.first += multiplier * first;
            sum.last += multiplier * last;
        }
        sum
    }

    /// Largest speed and acceleration of the joint, and size of its position.
    fn bounds(&self, joints: &[JointBounds]) -> JointBounds {
        let mut sum = JointBounds { speed: 0.0, acceleration: 0.0, jerk: 0.0, size: self.offset.abs() };
        for &(k, multiplier) in &self.terms {
            let factor = multiplier.abs();
            sum.speed += factor * joints[k].speed;
            sum.acceleration += factor * joints[k].acceleration;
            sum.jerk += factor * joints[k].jerk;
            sum.size += factor * joints[k].size;
        }
        sum
    }
}

/// The moving joints from the root of the robot to a link.
#[derive(Debug, Clone)]
pub struct Path {
    /// Joints, root first.
    pub joints: Vec<PathJoint>,
    /// Pose of the link in the frame of the last moving joint's child (in the world, if nothing moves it).
    pub last_from_link: Matrix4<f64>,
}

/// A joint's axis where the joints before it have put it, in the world; once for each coordinate that drives the joint.
#[derive(Debug, Clone, Copy)]
pub struct DrivenAxis {
    /// Index, in the joint vector, of the coordinate that drives it.
    pub coordinate: usize,
    /// The joint moves this much as fast as its coordinate.
    pub multiplier: f64,
    /// True for a sliding joint.
    pub slides: bool,
    /// Unit vector along the axis.
    pub direction: Vector,
    /// A point of the axis.
    pub origin: Point,
}

impl DrivenAxis {
    /// Work of a force at `point` and a couple, per unit of the coordinate: their share of its torque.
    pub fn work(&self, force: &Vector, point: &Point, couple: &Vector) -> f64 {
        let per_joint = match self.slides {
            true => self.direction.dot(force),
            false => self.direction.dot(&((point - self.origin).cross(force) + couple)),
        };
        self.multiplier * per_joint
    }
}

/// Bounds over one step between two waypoints, whose parameter runs from 0 to 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rates {
    /// Largest speed of a point, in metres per step.
    pub speed: f64,
    /// Largest acceleration of a point, in metres per step squared.
    pub acceleration: f64,
    /// Largest change of that, in metres per step cubed.
    pub jerk: f64,
}

impl Path {
    /// The path to `link`, in a robot whose root stands at `world_from_root`.
    ///
    /// Err with a message when a joint's coupling leads nowhere.
    pub fn new(robot: &Robot, link: LinkId, world_from_root: &Pose, joint_names: &[String]) -> Result<Self, String> {
        let mut pending = world_from_root.to_homogeneous();
        let mut joints = Vec::new();
        for id in robot.joints_to(link) {
            let joint = &robot.joints[id.0];
            pending *= joint.parent_from_joint.to_homogeneous();
            if joint.kind == JointKind::Fixed {
                continue;
            }
            let slides = joint.kind == JointKind::Prismatic;
            let motion = JointMotion::new(&pending, &joint.axis, slides);
            joints.push(PathJoint {
                joint: id.0,
                parent_from_joint: pending,
                axis: joint.axis.into_inner(),
                slides,
                drive: Drive::of(robot, id.0, joint_names)?,
                largest_slide: joint.limits.map_or(0.0, |limits| limits.lower.abs().max(limits.upper.abs())),
                motion,
            });
            pending = Matrix4::identity();
        }
        Ok(Path { joints, last_from_link: pending })
    }

    /// Pose of the link in the world.
    pub fn world_from_link(&self, joints: &[f64]) -> Matrix4<f64> {
        let mut frame = Matrix4::<f64>::identity();
        for joint in &self.joints {
            frame *= joint.motion.at(joint.drive.position(joints));
        }
        frame * self.last_from_link
    }

    /// The axes of the path's joints that some coordinate drives, in the world.
    pub fn axes(&self, joints: &[f64]) -> Vec<DrivenAxis> {
        let mut frame = Matrix4::<f64>::identity();
        let mut axes = Vec::new();
        for joint in &self.joints {
            let world_from_joint = frame * joint.parent_from_joint;
            let direction = world_from_joint.transform_vector(&joint.axis);
            let origin = world_from_joint.transform_point(&Point::origin());
            for &(coordinate, multiplier) in &joint.drive.terms {
                axes.push(DrivenAxis { coordinate, multiplier, slides: joint.slides, direction, origin });
            }
            frame *= joint.motion.at(joint.drive.position(joints));
        }
        axes
    }

    /// Velocity of `center` (in the link frame) when the coordinates move with these rates.
    pub fn velocity(&self, center: &Point, joints: &[f64], rates: &[f64]) -> Vector {
        let point = self.world_from_link(joints).transform_point(center);
        let of_joint = |axis: DrivenAxis| {
            let per_joint = if axis.slides { axis.direction } else { axis.direction.cross(&(point - axis.origin)) };
            per_joint * (axis.multiplier * rates[axis.coordinate])
        };
        self.axes(joints).into_iter().map(of_joint).sum()
    }

    /// True when some joint of the path moves.
    pub fn moves(&self, joints: &[JointBounds]) -> bool {
        self.joints.iter().any(|joint| joint.drive.bounds(joints).speed > 0.0)
    }

    /// Bounds for every point within `radius` of `center` (in the link frame) while joints move within these bounds.
    ///
    /// The point is a sum of vectors, each fixed in one body. A body turned by joints of rates `r_i` and accelerations `a_i`
    /// turns such a vector of length `l` with speed at most `(sum r_i) l` and acceleration at most `((sum r_i)^2 + sum a_i) l`,
    /// because every derivative of a product of rotations by their angles is a product of matrices of norm at most one.
    pub fn rates(&self, center: &Point, radius: f64, joints: &[JointBounds]) -> Rates {
        let mut rates = Rates::default();
        let (mut turning, mut bending, mut jerking) = (0.0, 0.0, 0.0);
        for (k, joint) in self.joints.iter().enumerate() {
            let bounds = joint.drive.bounds(joints);
            let mut length = match self.joints.get(k + 1) {
                Some(next) => next.parent_from_joint.fixed_view::<3, 1>(0, 3).norm(),
                None => (self.last_from_link.transform_point(center).coords).norm() + radius,
            };
            let mut slide = JointBounds { speed: 0.0, acceleration: 0.0, jerk: 0.0, size: 0.0 };
            if joint.slides {
                length += joint.largest_slide.max(bounds.size);
                slide = bounds;
            } else {
                turning += bounds.speed;
                bending += bounds.acceleration;
                jerking += bounds.jerk;
            }
            // Derivatives of a turning vector of length one: the products are sums over all joints.
            let second = turning * turning + bending;
            let third = turning * turning * turning + 3.0 * turning * bending + jerking;
            rates.speed += turning * length + slide.speed;
            rates.acceleration += second * length + 2.0 * turning * slide.speed + slide.acceleration;
            rates.jerk += third * length + 3.0 * (second * slide.speed + turning * slide.acceleration) + slide.jerk;
        }
        rates
    }
}

/// `matrix` as a pose; its rotation part must be a rotation up to rounding.
pub fn pose_of(matrix: &Matrix4<f64>) -> Pose {
    let rotation = Rotation3::from_matrix_unchecked(matrix.fixed_view::<3, 3>(0, 0).into_owned());
    let translation: Vector = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    Pose::from_parts(Translation3::from(translation), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Where the hand's root stands, from where its base stands; joints above the base rest.
pub fn world_from_root(hand: &Hand, world_from_hand: &Pose) -> Result<Pose, String> {
    let root_from_base = Path::new(&hand.robot, hand.base, &Pose::identity(), &[])?.world_from_link(&[]);
    Ok(world_from_hand * pose_of(&root_from_base).inverse())
}
