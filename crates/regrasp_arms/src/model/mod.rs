//! The robot as planning sees it: moving frames, bodies of balls, pairs of bodies that may meet.

/// Balls that cover shapes.
pub mod cover;
/// Pairs of bodies that are kept apart, and bounds of how far bodies move.
mod pairs;
/// Parts that move on their own.
mod parts;

use cover::{CoverBall, LinkCover};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_robot::coupling::LinearLimit;
use regrasp_robot::{JointKind, LinkId, Manipulator};
use std::collections::BTreeSet;
use std::ops::Range;

pub use pairs::{Pair, SpeedTerm};
pub use parts::Parts;

/// A frame that joints move: its z axis is the axis of its joint.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The frame below; none for the world.
    pub parent: Option<usize>,
    /// Columns of the rotation from the frame, at joint position zero, to its parent.
    pub rotation: [[f32; 3]; 3],
    /// Its origin in its parent.
    pub translation: [f32; 3],
    /// Coordinates of the group that drive the joint, with multipliers.
    pub terms: Vec<(usize, f32)>,
    /// Position of the joint where those are zero.
    pub offset: f32,
    /// True for a joint that slides.
    pub slides: bool,
    /// The same in double precision.
    exact: ExactFrame,
}

#[derive(Debug, Clone)]
struct ExactFrame {
    parent_from_joint: Pose,
    terms: Vec<(usize, f64)>,
    offset: f64,
}

/// A ball in the frame of its body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: [f32; 3],
    /// Radius, in metres.
    pub radius: f32,
}

/// Balls of one body that lie together.
#[derive(Debug, Clone)]
pub struct BallGroup {
    /// A ball about them, in the frame of the body.
    pub bound: Ball,
    /// Which they are, in [`ArmModel::balls`].
    pub balls: Range<usize>,
}

/// A link: rigid, with the balls that cover it.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of the link.
    pub name: String,
    /// The link; of something attached the link that it goes with.
    pub link: LinkId,
    /// Which of the attached bodies it is.
    pub attached: Option<usize>,
    /// The frame that it is fixed to; none for what does not move.
    pub frame: Option<usize>,
    /// A ball about all of its balls.
    pub bound: Ball,
    /// Its balls, in [`ArmModel::balls`].
    pub balls: Range<usize>,
    /// Groups of its balls, in [`ArmModel::groups`].
    pub groups: Range<usize>,
    /// Its shapes, placed in its frame.
    pub shapes: Vec<PlacedShape>,
    /// True where the shapes are the balls.
    pub is_exact: bool,
    /// How fast its balls' centres move at most.
    pub speed: Vec<SpeedTerm>,
}

/// A body that goes with a link, as an object in a hand does.
#[derive(Debug, Clone)]
pub struct Attached {
    /// Name.
    pub name: String,
    /// The link.
    pub link: LinkId,
    /// Its balls and shapes, in the frame of the link.
    pub cover: LinkCover,
    /// Links that it may touch.
    pub may_touch: BTreeSet<LinkId>,
}

/// A coordinate of the group that is planned for.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupCoordinate {
    /// Its index in states of the manipulator.
    pub index: usize,
    /// Name of the joint.
    pub name: String,
    /// Lowest value.
    pub lower: f64,
    /// Highest value.
    pub upper: f64,
}

/// A robot of which some coordinates are free. All others stay where a state has them.
#[derive(Debug, Clone)]
pub struct ArmModel {
    /// The free coordinates, in the order of configurations.
    pub coordinates: Vec<GroupCoordinate>,
    /// Limits of sums of free coordinates.
    pub linear_limits: Vec<LinearLimit>,
    /// Moving frames, each after its parent.
    pub frames: Vec<Frame>,
    /// Bodies with balls.
    pub bodies: Vec<Body>,
    /// Balls of all bodies.
    pub balls: Vec<Ball>,
    /// Groups of balls of all bodies.
    pub groups: Vec<BallGroup>,
    /// Pairs of bodies that have to be apart.
    pub pairs: Vec<Pair>,
    /// True where all shapes are balls.
    pub is_exact: bool,
    /// The state that the other coordinates are taken from.
    pub state: Vec<f64>,
}

/// Single precision of a vector.
fn single(v: &Vector) -> [f32; 3] {
    // Rounding of turns by right angles is no component.
    [v.x, v.y, v.z].map(|x| if x.abs() < 1e-12 { 0.0 } else { x as f32 })
}

impl ArmModel {
    /// The model of `manipulator` in `state`, in which the coordinates `free` (indices in the state, rising) may change. `covers`
    /// has the cover of each link.
    ///
    /// Panics unless the state has one value per coordinate and there is one cover per link.
    pub fn new(
        manipulator: &Manipulator,
        covers: &[LinkCover],
        attached: &[Attached],
        state: &[f64],
        free: &[usize],
    ) -> Self {
        let (robot, layout) = (&manipulator.robot, &manipulator.layout);
        assert_eq!(state.len(), layout.len(), "one value per coordinate");
        assert_eq!(covers.len(), robot.links.len(), "one cover per link");
        let group_of = |index: usize| free.iter().position(|&other| other == index);
        let coordinates = free.iter().map(|&index| {
            let own = &layout.coordinates[index];
            GroupCoordinate { index, name: own.name.clone(), lower: own.lower, upper: own.upper }
        });
        let mut model = ArmModel {
            coordinates: coordinates.collect(),
            linear_limits: Vec::new(),
            frames: Vec::new(),
            bodies: Vec::new(),
            balls: Vec::new(),
            groups: Vec::new(),
            pairs: Vec::new(),
            is_exact: true,
            state: state.to_vec(),
        };
        model.take_linear_limits(&layout.linear_limits, group_of);
        // Frame of each link, and the link in it.
        let mut places: Vec<(Option<usize>, Pose)> = vec![(None, *manipulator.world_from_root()); robot.links.len()];
        let mut waiting = vec![robot.root];
        while let Some(link) = waiting.pop() {
            model.add_body(&robot.links[link.0].name, link, &covers[link.0], &places[link.0]);
            for joint in robot.joints_from(link) {
                let of_robot = &robot.joints[joint.0];
                let (frame, frame_from_link) = places[link.0];
                let frame_from_joint = frame_from_link * of_robot.parent_from_joint;
                let drive = layout.drive_of(robot, joint.0);
                let frozen = drive.as_ref().map_or(0.0, |drive| {
                    let own = drive.terms.iter().filter(|(k, _)| group_of(*k).is_none());
                    own.map(|&(k, multiplier)| multiplier * state[k]).sum::<f64>() + drive.offset
                });
                let terms: Vec<(usize, f64)> = drive.iter().flat_map(|drive| drive.terms.iter()).fold(
                    Vec::new(),
                    |mut terms, &(k, multiplier)| {
                        terms.extend(group_of(k).map(|k| (k, multiplier)));
                        terms
                    },
                );
                places[of_robot.child.0] = if terms.is_empty() {
                    let motion = if drive.is_some() { of_robot.motion(frozen) } else { Pose::identity() };
                    (frame, frame_from_joint * motion)
                } else {
                    let align = UnitQuaternion::rotation_between(&Vector3::z_axis(), &of_robot.axis)
                        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
                    let align = Pose::from_parts(nalgebra::Translation3::identity(), align);
                    let exact = ExactFrame { parent_from_joint: frame_from_joint * align, terms, offset: frozen };
                    model.add_frame(frame, exact, of_robot.kind == JointKind::Prismatic);
                    (Some(model.frames.len() - 1), align.inverse())
                };
                waiting.push(of_robot.child);
            }
        }
        for (index, body) in attached.iter().enumerate() {
            let n_before = model.bodies.len();
            model.add_body(&body.name, body.link, &body.cover, &places[body.link.0]);
            model.bodies[n_before..].iter_mut().for_each(|added| added.attached = Some(index));
        }
        model.find_speeds_and_pairs(|a: &Body, b: &Body| {
            let touches = |body: &Body, other: &Body| {
                body.attached.is_some_and(|index| attached[index].may_touch.contains(&other.link))
            };
            match (a.attached, b.attached) {
                (None, None) => manipulator.may_touch(a.link, b.link),
                (Some(_), Some(_)) => false,
                _ => touches(a, b) || touches(b, a),
            }
        });
        model
    }

    fn take_linear_limits(&mut self, limits: &[LinearLimit], group_of: impl Fn(usize) -> Option<usize>) {
        for limit in limits {
            let mut own = limit.clone();
            own.terms.clear();
            for &(k, multiplier) in &limit.terms {
                match group_of(k) {
                    Some(k) => own.terms.push((k, multiplier)),
                    None => {
                        own.lower -= multiplier * self.state[k];
                        own.upper -= multiplier * self.state[k];
                    }
                }
            }
            if !own.terms.is_empty() {
                self.linear_limits.push(own);
            }
        }
    }

    fn add_frame(&mut self, parent: Option<usize>, exact: ExactFrame, slides: bool) {
        let rotation: Rotation3<f64> = exact.parent_from_joint.rotation.into();
        let column = |k: usize| single(&rotation.matrix().column(k).into_owned());
        self.frames.push(Frame {
            parent,
            rotation: [column(0), column(1), column(2)],
            translation: single(&exact.parent_from_joint.translation.vector),
            terms: exact.terms.iter().map(|&(k, multiplier)| (k, multiplier as f32)).collect(),
            offset: exact.offset as f32,
            slides,
            exact,
        });
    }

    fn add_body(&mut self, name: &str, link: LinkId, cover: &LinkCover, place: &(Option<usize>, Pose)) {
        if cover.balls.is_empty() {
            return;
        }
        let (frame, frame_from_link) = place;
        let moved = |ball: &CoverBall| CoverBall { center: frame_from_link * ball.center, radius: ball.radius };
        let balls: Vec<CoverBall> = cover.balls.iter().map(moved).collect();
        let (center, radius) = (frame_from_link * cover.bound.0, cover.bound.1);
        self.is_exact &= cover.is_exact;
        let first = self.balls.len();
        let ball = |center: &Point, radius: f64| Ball { center: single(&center.coords), radius: radius as f32 };
        self.balls.extend(balls.iter().map(|of_body| ball(&of_body.center, of_body.radius)));
        let about = |center: Point, radius: f64| ball(&center, radius * (1.0 + 1e-6) + 1e-7);
        let first_group = self.groups.len();
        self.groups.extend(cover.groups.iter().map(|(bound, balls)| BallGroup {
            bound: about(frame_from_link * bound.center, bound.radius),
            balls: first + balls.start..first + balls.end,
        }));
        let placed = |own: &PlacedShape| PlacedShape {
            parent_from_shape: frame_from_link * own.parent_from_shape,
            shape: own.shape.clone(),
        };
        self.bodies.push(Body {
            name: name.to_owned(),
            link,
            attached: None,
            frame: *frame,
            bound: about(center, radius),
            balls: first..self.balls.len(),
            groups: first_group..self.groups.len(),
            shapes: cover.shapes.iter().map(placed).collect(),
            is_exact: cover.is_exact,
            speed: Vec::new(),
        });
    }

    /// Number of free coordinates.
    pub fn dimension(&self) -> usize {
        self.coordinates.len()
    }

    /// The state in which the free coordinates are `configuration`.
    pub fn state_at(&self, configuration: &[f64]) -> Vec<f64> {
        let mut state = self.state.clone();
        for (coordinate, value) in self.coordinates.iter().zip(configuration) {
            state[coordinate.index] = *value;
        }
        state
    }

    /// The free coordinates of a state.
    pub fn configuration_of(&self, state: &[f64]) -> Vec<f64> {
        self.coordinates.iter().map(|coordinate| state[coordinate.index]).collect()
    }

    /// True where all limits are kept within `tolerance`.
    pub fn is_within_limits(&self, configuration: &[f64], tolerance: f64) -> bool {
        let own = self.coordinates.iter().zip(configuration);
        own.into_iter().all(|(c, &q)| q.is_finite() && q >= c.lower - tolerance && q <= c.upper + tolerance)
            && self.linear_limits.iter().all(|limit| limit.room(configuration) >= -tolerance)
    }

    /// Poses of all frames in the world, in double precision, written to `world_from_frame`.
    pub fn frame_poses(&self, configuration: &[f64], world_from_frame: &mut Vec<Pose>) {
        world_from_frame.clear();
        for frame in &self.frames {
            let exact = &frame.exact;
            let position = exact.terms.iter().map(|&(k, m)| m * configuration[k]).sum::<f64>() + exact.offset;
            let motion = if frame.slides {
                Pose::translation(0.0, 0.0, position)
            } else {
                Pose::rotation(Vector::new(0.0, 0.0, position))
            };
            let parent = frame.parent.map_or_else(Pose::identity, |parent| world_from_frame[parent]);
            world_from_frame.push(parent * exact.parent_from_joint * motion);
        }
    }
}
