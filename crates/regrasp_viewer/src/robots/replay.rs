//! What the interactive page of a robot is told: bodies, and where each is at many moments.
//!
//! Poses are stored and not computed by the page: the page needs neither the kinematics nor the couplings of the robot.

use super::RobotTelling;
use super::frames::{Frame, frames_at};
use super::holding;
use crate::story::pack::base64;
use crate::story::shapes::Shapes;
use crate::story::{MeshStory, PoseData};
use regrasp_geometry::{Pose, Shape};
use regrasp_plan::RobotPlan;
use regrasp_plan::robot_plan::RobotSegmentKind;
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{LinkId, Manipulator, Part};
use serde::Serialize;

/// Longest time between two frames, in seconds.
const FRAME: f64 = 1.0 / 30.0;
/// Most frames: a page of them stays below 8 MB.
const MOST_FRAMES: usize = 1200;

/// What a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum ReplayKind {
    /// A link of an arm or of what carries the arms.
    Link,
    /// A link of a hand.
    Hand,
    /// A link that ends in a fingertip.
    Tip,
    /// An object that the plan moves.
    Object,
    /// An object at rest.
    Resting,
    /// What objects may stand on.
    Support,
    /// What nothing may touch.
    Obstacle,
}

/// A mesh at its place in a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayPiece {
    /// Index in `meshes`.
    pub mesh: usize,
    /// Where it stands in the body.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub from_mesh: PoseData,
}

/// A body.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayBody {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: ReplayKind,
    /// What it looks like.
    pub pieces: Vec<ReplayPiece>,
    /// Its column in `poses`; none for a body that rests.
    pub column: Option<usize>,
    /// Where it stands at the start.
    #[cfg_attr(test, ts(type = "PoseData"))]
    pub pose: PoseData,
}

/// A stretch of the plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplaySegment {
    /// Kind, as plan files spell it.
    pub kind: String,
    /// From when, in seconds.
    pub start: f64,
    /// Until when.
    pub end: f64,
    /// Who holds the objects.
    pub held_by: Vec<String>,
}

/// A hand or support that holds an object in some segment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayHolder {
    /// Its name.
    pub name: String,
    /// Its colour in all charts.
    pub color: String,
}

/// A chart of the page, of which the horizontal axis is time.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayAxis {
    /// Time at the left edge and at the right edge, in seconds.
    pub times: [f64; 2],
    /// The edges as shares of the chart's width.
    pub edges: [f64; 2],
}

/// A robot's plan, ready to be shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RobotReplay {
    /// Always `regrasp-robot-replay`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Against gravity, in the world.
    pub up: [f64; 3],
    /// The time of every frame, in seconds, rising.
    pub times: Vec<f64>,
    /// Base64 of little-endian 32-bit floats: frame by frame, column by column, position and quaternion x y z w.
    pub poses: String,
    /// Number of columns.
    pub n_columns: usize,
    /// Meshes, each once.
    pub meshes: Vec<MeshStory>,
    /// All bodies.
    pub bodies: Vec<ReplayBody>,
    /// The segments of the plan.
    pub segments: Vec<ReplaySegment>,
    /// Hands of the plan, then supports.
    pub holders: Vec<ReplayHolder>,
    /// The time axis of all charts.
    pub axis: ReplayAxis,
}

/// Bodies while they are gathered.
struct Bodies {
    shapes: Shapes,
    bodies: Vec<ReplayBody>,
}

impl Bodies {
    /// Adds a body at `pose` of shapes in its frame.
    fn add(
        &mut self,
        (name, kind): (String, ReplayKind),
        pose: &Pose,
        column: Option<usize>,
        shapes: &[(Pose, Shape)],
    ) {
        let piece = |(from_mesh, shape): &(Pose, Shape)| ReplayPiece {
            mesh: self.shapes.index_of(shape),
            from_mesh: PoseData::from(from_mesh),
        };
        let pieces = shapes.iter().map(piece).collect();
        self.bodies.push(ReplayBody { name, kind, pieces, column, pose: PoseData::from(pose) });
    }
}

/// The shapes of a link in its frame, fingertips that are no collision geometry included; and what it is.
fn link_shapes(robot: &Manipulator, link: usize) -> (ReplayKind, Vec<(Pose, Shape)>) {
    let own = &robot.robot.links[link].collision;
    let mut shapes: Vec<(Pose, Shape)> =
        own.iter().map(|placed| (placed.parent_from_shape, placed.shape.clone())).collect();
    let mut kind = match robot.part_of(LinkId(link)) {
        Part::Hand(_) => ReplayKind::Hand,
        _ => ReplayKind::Link,
    };
    let fingers = robot.hands.iter().flat_map(|hand| &hand.hand.fingers);
    for finger in fingers.filter(|finger| finger.tip.link.0 == link) {
        kind = ReplayKind::Tip;
        let Some(mut tip) = finger.tip.own_shape() else { continue };
        tip.parent_from_shape = robot.robot.fixed_pose_in_body(LinkId(link)).inverse() * tip.parent_from_shape;
        if !own.iter().any(|placed| is_same_surface(placed, &tip)) {
            shapes.push((tip.parent_from_shape, tip.shape));
        }
    }
    (kind, shapes)
}

/// Times of the frames: all waypoints, and in between at most [`FRAME`] apart.
fn times_of(plan: &RobotPlan) -> Vec<f64> {
    let frame = FRAME.max(plan.duration() / MOST_FRAMES as f64);
    let mut times: Vec<f64> = Vec::new();
    for pair in plan.segments.iter().flat_map(|segment| segment.waypoints.windows(2)) {
        let (from, until) = (pair[0].time, pair[1].time);
        let n = ((until - from) / frame).ceil().max(1.0) as usize;
        times.extend((0..=n).map(|k| from + (until - from) * k as f64 / n as f64));
    }
    times.sort_by(f64::total_cmp);
    // Waypoints closer than a quarter of a frame tell the eye nothing.
    let mut kept: Vec<f64> = Vec::new();
    for time in times {
        if kept.last().is_none_or(|last| time - last > 0.25 * frame) {
            kept.push(time);
        }
    }
    kept
}

impl RobotReplay {
    /// What the page of a plan is told.
    ///
    /// Err with a message where the plan is of a robot that the scene does not have, or does not move.
    pub fn of(telling: &RobotTelling) -> Result<Self, String> {
        let RobotTelling { scene, state, plan, .. } = telling;
        let robot = super::frames::robot_of(scene, plan)?;
        let frames = frames_at(scene, robot, plan, &times_of(plan));
        let first = frames.first().ok_or("the plan has no motion")?;
        let mut poses = Vec::new();
        robot.link_poses(&first.joints, &mut poses);
        let mut bodies = Bodies { shapes: Shapes::default(), bodies: Vec::new() };
        let mut moving_links = Vec::new();
        for (link, pose) in poses.iter().enumerate() {
            let (kind, shapes) = link_shapes(robot, link);
            if shapes.is_empty() {
                continue;
            }
            let moves = !robot.coordinates_above(LinkId(link)).is_empty();
            let column = moves.then_some(moving_links.len());
            if moves {
                moving_links.push(link);
            }
            bodies.add((robot.robot.links[link].name.clone(), kind), pose, column, &shapes);
        }
        for (k, name) in plan.objects.iter().enumerate() {
            let object = scene.object_named(name).ok_or_else(|| format!("the scene has no object \"{name}\""))?;
            let shapes = [(Pose::identity(), scene.objects[object].shape.clone())];
            let column = Some(moving_links.len() + k);
            bodies.add((name.clone(), ReplayKind::Object), &first.world_from_objects[k], column, &shapes);
        }
        let resting = scene.objects.iter().zip(&state.world_from_objects);
        for (object, pose) in resting.filter(|(object, _)| !plan.objects.contains(&object.name)) {
            let shapes = [(Pose::identity(), object.shape.clone())];
            bodies.add((object.name.clone(), ReplayKind::Resting), pose, None, &shapes);
        }
        let supports = scene.supports.iter().map(|support| (&support.body, ReplayKind::Support));
        for (body, kind) in supports.chain(scene.obstacles.iter().map(|body| (body, ReplayKind::Obstacle))) {
            let shapes = [(body.placed.parent_from_shape, body.placed.shape.clone())];
            bodies.add((body.name.clone(), kind), &Pose::identity(), None, &shapes);
        }
        let (packed, n_columns) = pack_poses(robot, &frames, &moving_links);
        let Bodies { shapes, bodies } = bodies;
        let up = scene.gravity().in_world().and_then(|gravity| (-gravity).try_normalize(1e-9));
        Ok(RobotReplay {
            format: "regrasp-robot-replay".into(),
            version: 1,
            up: up.map_or([0.0, 0.0, 1.0], Into::into),
            times: frames.iter().map(|frame| frame.time).collect(),
            poses: packed,
            n_columns,
            meshes: shapes.packed(&mut Vec::new()),
            bodies,
            segments: plan.segments.iter().map(segment_of).collect(),
            holders: holders_of(plan),
            axis: axis_of(plan),
        })
    }
}

fn pack_poses(robot: &Manipulator, frames: &[Frame], moving_links: &[usize]) -> (String, usize) {
    let (mut bytes, mut poses, mut n_columns) = (Vec::new(), Vec::new(), moving_links.len());
    for frame in frames {
        robot.link_poses(&frame.joints, &mut poses);
        n_columns = moving_links.len() + frame.world_from_objects.len();
        for pose in moving_links.iter().map(|&link| &poses[link]).chain(&frame.world_from_objects) {
            let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
            bytes.extend(numbers.flat_map(|value| (*value as f32).to_le_bytes()));
        }
    }
    (base64(&bytes), n_columns)
}

fn segment_of(segment: &regrasp_plan::robot_plan::RobotSegment) -> ReplaySegment {
    let [start, end] = holding::span(segment);
    ReplaySegment {
        kind: kind_name(segment.kind).into(),
        start,
        end,
        held_by: segment.held_by.values().flatten().cloned().collect(),
    }
}

fn holders_of(plan: &RobotPlan) -> Vec<ReplayHolder> {
    let rows = holding::rows(plan);
    let holder =
        |(k, row): (usize, &holding::Holding)| ReplayHolder { name: row.name.clone(), color: row.color(k).into() };
    rows.iter().enumerate().map(holder).collect()
}

/// As plan files spell it.
pub(super) fn kind_name(kind: RobotSegmentKind) -> &'static str {
    match kind {
        RobotSegmentKind::Transit => "transit",
        RobotSegmentKind::Carry => "carry",
        RobotSegmentKind::Approach => "approach",
        RobotSegmentKind::Grasp => "grasp",
        RobotSegmentKind::Release => "release",
        RobotSegmentKind::Retreat => "retreat",
        RobotSegmentKind::Transfer => "transfer",
        RobotSegmentKind::Regrasp => "regrasp",
    }
}

fn axis_of(plan: &RobotPlan) -> ReplayAxis {
    use crate::charts::time_axis::{LEFT, RIGHT, SHEET};
    let first = plan.waypoints().next().map_or(0.0, |waypoint| waypoint.time);
    ReplayAxis { times: [first, first + plan.duration()], edges: [LEFT / SHEET, RIGHT / SHEET] }
}
