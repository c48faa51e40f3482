//! Key frames of a plan of a whole robot: robot, what it carries, what stands around, and the paths of its wrists.

use super::charts::joints_at;
use super::holding::{self, Step};
use crate::palette;
use crate::render::model::linear;
use crate::render::shade::Layer;
use crate::render::text::{Anchor, Sheet};
use crate::render::{Camera, Look, Paint, Picture, PlacedSurface, Surface, render};
use crate::story::tessellate::tessellate;
use crate::storyboard::marks::rope;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_plan::RobotPlan;
use regrasp_plan::robot_plan::RobotWaypoint;
use regrasp_robot::{LinkId, Manipulator};
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{Holder, Scene, State};
use std::sync::Arc;

/// How a storyboard is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotStoryboard {
    /// Number of frames, from 2 to 60.
    pub frames: usize,
    /// Width of the picture, in pixels, from 200 to 8000.
    pub width: usize,
    /// Frames in a row.
    pub columns: Option<usize>,
}

impl Default for RobotStoryboard {
    fn default() -> Self {
        RobotStoryboard { frames: 6, width: 1500, columns: None }
    }
}

/// Height of a frame over its width.
pub(super) const ASPECT: f64 = 0.82;
/// From where frames are seen: from the right, in front and above.
pub(super) const TOWARD: [f64; 3] = [-0.75, 0.5, -0.42];
/// Focal length over the picture's width.
pub(super) const FOCAL: f64 = 2.2;
/// Points of the path of a wrist.
const PATH_POINTS: usize = 60;
pub(super) const LINK: &str = "#9aa3ad";
pub(super) const HAND: &str = "#6b7683";
pub(super) const OBJECT: &str = "#e69f00";
pub(super) const RESTING: &str = "#d8c48a";
pub(super) const OBSTACLE: &str = "#b5a492";

/// A shape with its colour, on a link of the robot or in the world.
pub(super) struct Part {
    pub link: Option<usize>,
    pub frame: Pose,
    pub surface: Arc<Surface>,
    pub color: [f64; 3],
    /// Name of the link, or of the body that rests.
    pub name: String,
}

impl Part {
    /// At its place, where the links are at `poses`. Parts of one link have the same number; of bodies that rest none have.
    pub fn placed(&self, number: usize, poses: &[Pose]) -> PlacedSurface {
        PlacedSurface {
            world_from_surface: self.link.map_or(self.frame, |link| poses[link] * self.frame),
            surface: self.surface.clone(),
            paint: Paint::Plain(self.color),
            body: self.link.unwrap_or(1000 + number) as u32,
        }
    }
}

fn part(name: &str, link: Option<usize>, frame: Pose, shape: &Shape, color: &str) -> Part {
    let surface = Arc::new(Surface::of(&tessellate(shape)));
    Part { link, frame, surface, color: linear(color), name: name.to_owned() }
}

/// Everything that is drawn but the objects that are moved.
pub(super) fn parts(scene: &Scene, state: &State, robot: &Manipulator, is_moved: impl Fn(&str) -> bool) -> Vec<Part> {
    let mut parts = Vec::new();
    for (l, link) in robot.robot.links.iter().enumerate() {
        let is_hand = matches!(robot.part_of(LinkId(l)), regrasp_robot::Part::Hand(_));
        let color = if is_hand { HAND } else { LINK };
        let own = |placed: &PlacedShape| part(&link.name, Some(l), placed.parent_from_shape, &placed.shape, color);
        parts.extend(link.collision.iter().map(own));
    }
    for finger in robot.hands.iter().flat_map(|hand| &hand.hand.fingers) {
        if let Some(own) = finger.tip.own_shape() {
            let link_from_body = robot.robot.fixed_pose_in_body(finger.tip.link).inverse();
            let link = finger.tip.link.0;
            let name = &robot.robot.links[link].name;
            parts.push(part(name, Some(link), link_from_body * own.parent_from_shape, &own.shape, HAND));
        }
    }
    let fixed = scene.obstacles.iter().chain(scene.supports.iter().map(|support| &support.body));
    let still = |placed: &PlacedShape, name: &str| part(name, None, placed.parent_from_shape, &placed.shape, OBSTACLE);
    parts.extend(fixed.map(|body| still(&body.placed, &body.name)));
    for (object, pose) in scene.objects.iter().zip(&state.world_from_objects) {
        if !is_moved(&object.name) {
            parts.push(part(&object.name, None, *pose, &object.shape, RESTING));
        }
    }
    parts
}

/// A moment of the plan: joints and poses of its objects.
pub(super) struct Frame {
    pub time: f64,
    pub joints: Vec<f64>,
    pub world_from_objects: Vec<Pose>,
}

/// `n` moments, evenly spread over the time of the plan.
fn even_times(plan: &RobotPlan, n: usize) -> Vec<f64> {
    let first = plan.waypoints().next().map_or(0.0, |waypoint| waypoint.time);
    (0..n).map(|k| first + plan.duration() * k as f64 / (n - 1).max(1) as f64).collect()
}

/// Times and captions of the pictures: of pick and place at most `n` of its steps, else `n` even times.
fn captions(plan: &RobotPlan, n: usize) -> Vec<Step> {
    if plan.task != PICK_AND_PLACE {
        return even_times(plan, n).into_iter().map(|time| Step { time, caption: String::new() }).collect();
    }
    let steps = holding::steps(plan);
    if steps.len() <= n {
        return steps;
    }
    // First and last are always among them.
    let chosen = (0..n).map(|k| (k * (steps.len() - 1) + (n - 1) / 2) / (n - 1).max(1));
    chosen.filter_map(|k| steps.get(k).cloned()).collect()
}

/// A step of the plan, and the link that its objects go with, by object; none where an object rests.
struct PlanStep<'p> {
    ends: [&'p RobotWaypoint; 2],
    links: Vec<Option<usize>>,
}

/// The link of the only hand or arm that holds an object.
fn carrier(scene: &Scene, robot: &Manipulator, holders: Option<&Vec<String>>) -> Option<usize> {
    let [name] = holders?.as_slice() else { return None };
    let index = scene.robots.iter().position(|own| std::ptr::eq(own, robot))?;
    let holder = scene.hand_named(name).map(Holder::Hand).or_else(|| robot.arm_named(name).map(Holder::Arm))?;
    holder.link(scene, index).map(|link| link.0)
}

/// The moments of `plan` at these times. An object that one hand holds follows it.
pub(super) fn frames_at(scene: &Scene, robot: &Manipulator, plan: &RobotPlan, times: &[f64]) -> Vec<Frame> {
    let mut steps = Vec::new();
    for segment in &plan.segments {
        let links: Vec<Option<usize>> =
            plan.objects.iter().map(|object| carrier(scene, robot, segment.held_by.get(object))).collect();
        let pairs = segment.waypoints.windows(2);
        steps.extend(pairs.map(|pair| PlanStep { ends: [&pair[0], &pair[1]], links: links.clone() }));
    }
    let (mut start, mut now) = (Vec::new(), Vec::new());
    let mut at = |&time: &f64| {
        let step = steps.iter().find(|step| step.ends[1].time >= time).or(steps.last())?;
        let [from, to] = step.ends;
        let span = to.time - from.time;
        let u = if span > 0.0 { ((time - from.time) / span).clamp(0.0, 1.0) } else { 0.0 };
        let joints = joints_at(step.ends, u);
        robot.link_poses(&from.joints, &mut start);
        robot.link_poses(&joints, &mut now);
        let ends = from.world_from_objects.iter().zip(&to.world_from_objects).zip(&step.links);
        let between = ends.map(|((a, b), link)| match link {
            Some(link) => now[*link] * start[*link].inverse() * Pose::from(a),
            None => regrasp_geometry::interpolate_pose(&Pose::from(a), &Pose::from(b), u),
        });
        Some(Frame { time, world_from_objects: between.collect(), joints })
    };
    times.iter().filter_map(&mut at).collect()
}

/// The robot of a plan.
pub(super) fn robot_of<'s>(scene: &'s Scene, plan: &RobotPlan) -> Result<&'s Manipulator, String> {
    let robot = scene.robots.iter().find(|robot| plan.robots.iter().any(|own| own.name == robot.name));
    let robot = robot.filter(|robot| robot.layout.names() == plan.joint_names());
    robot.ok_or_else(|| "the plan is of a robot that the scene does not have".to_owned())
}

/// A storyboard of `plan`: the same picture for the same input.
///
/// Err with a message where the plan has no motion or is of another robot, or the settings make no sense.
pub fn robot_storyboard(
    scene: &Scene,
    state: &State,
    plan: &RobotPlan,
    settings: &RobotStoryboard,
) -> Result<Picture, String> {
    if !(2..=60).contains(&settings.frames) || !(200..=8000).contains(&settings.width) || settings.columns == Some(0) {
        return Err("a storyboard has 2 to 60 frames, at least one in a row, and is 200 to 8000 pixels wide".into());
    }
    let robot = robot_of(scene, plan)?;
    if plan.segments.iter().all(|segment| segment.waypoints.len() < 2) {
        return Err("the plan has no motion".into());
    }
    let carried: Vec<Arc<Surface>> = (plan.objects.iter())
        .filter_map(|name| scene.object_named(name))
        .map(|object| Arc::new(Surface::of(&tessellate(&scene.objects[object].shape))))
        .collect();
    let parts = parts(scene, state, robot, |name| plan.objects.iter().any(|object| object == name));
    let mut poses = Vec::new();
    let mut solid = |frame: &Frame| -> Vec<PlacedSurface> {
        robot.link_poses(&frame.joints, &mut poses);
        let objects = carried.iter().zip(&frame.world_from_objects).enumerate();
        let objects = objects.map(|(k, (surface, pose))| PlacedSurface {
            world_from_surface: *pose,
            surface: surface.clone(),
            paint: Paint::Plain(linear(OBJECT)),
            body: 100_000 + k as u32,
        });
        parts.iter().enumerate().map(|(k, part)| part.placed(k, &poses)).chain(objects).collect()
    };
    let steps = captions(plan, settings.frames);
    let n_frames = steps.len();
    let times: Vec<f64> = steps.iter().map(|step| step.time).collect();
    let frames = frames_at(scene, robot, plan, &times);
    let on_way = frames_at(scene, robot, plan, &even_times(plan, PATH_POINTS));
    let postures: Vec<Vec<PlacedSurface>> = frames.iter().map(&mut solid).collect();
    // In pick and place the view keeps to what moves: hands and object are what matters.
    let is_in_view: Vec<bool> = (parts.iter())
        .map(|part| {
            part.link
                .is_some_and(|link| plan.task != PICK_AND_PLACE || !robot.coordinates_above(LinkId(link)).is_empty())
        })
        .collect();
    let (center, radius) = robot_ball(robot, &on_way, &postures, &is_in_view);
    let columns = settings.columns.unwrap_or(3.min(n_frames)).min(n_frames);
    let gap = (settings.width / 100).max(2);
    let width = (settings.width.saturating_sub(gap * (columns + 1)) / columns).max(16);
    let height = (width as f64 * ASPECT) as usize;
    let text = (width as f64 / 24.0).max(9.0);
    let caption = (1.6 * text) as usize;
    let rows = n_frames.div_ceil(columns);
    let whole = gap + rows * (height + caption + gap);
    let mut sheet = Sheet::new(settings.width, whole).ok_or("the picture would be too large")?;
    let focal = FOCAL * width as f64;
    let distance = radius * focal / (0.47 * height as f64);
    let middle = [width as f64 / 2.0, height as f64 / 2.0];
    let camera = Camera::looking(&Vector::from(TOWARD), &center, distance, focal, middle);
    let look = Look {
        supersampling: 2,
        occlusion_radius: 0.03 * radius,
        shadows_within: Some((center, radius)),
        outline: (width as f64 / 330.0).max(0.8),
    };
    let paths = wrist_paths(robot, &on_way, 0.01 * radius);
    for (k, (frame, posture)) in frames.iter().zip(&postures).enumerate() {
        let picture = render(posture, &paths, &camera, width, height, &look);
        let (x, y) = (gap + (k % columns) * (width + gap), gap + (k / columns) * (height + caption + gap));
        sheet.lay(&picture, x, y);
        let line = format!("{:.2} s  {}", frame.time, steps[k].caption);
        let at = [x as f64 + width as f64 / 2.0, (y + height) as f64 + 1.1 * text];
        sheet.write(line.trim_end(), at[0], at[1], text, "#222222", Anchor::Middle);
    }
    Ok(sheet.picture())
}

/// A ball that holds the robot and what it carries in all frames, and the paths of its wrists.
fn robot_ball(
    robot: &Manipulator,
    moments: &[Frame],
    postures: &[Vec<PlacedSurface>],
    is_in_view: &[bool],
) -> (Point, f64) {
    let of_robot = |posture: &Vec<PlacedSurface>| -> Vec<Point> {
        let own = posture.iter().enumerate().filter(|(k, _)| is_in_view.get(*k).is_none_or(|part| *part));
        own.flat_map(|(_, model)| model.world_corners().flatten().collect::<Vec<Point>>()).collect()
    };
    let mut points: Vec<Point> = postures.iter().flat_map(of_robot).collect();
    points.extend(moments.iter().flat_map(|frame| wrists(robot, &frame.joints)));
    ball_about(&points)
}

/// A ball that holds points.
pub(super) fn ball_about(points: &[Point]) -> (Point, f64) {
    let first = points.first().copied().unwrap_or_else(Point::origin);
    let (low, high) = points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    let center = nalgebra::center(&low, &high);
    (center, points.iter().map(|p| (p - center).norm()).fold(1e-3, f64::max))
}

/// Where the mount links of all arms are.
fn wrists(robot: &Manipulator, joints: &[f64]) -> Vec<Point> {
    let mut poses = Vec::new();
    robot.link_poses(joints, &mut poses);
    robot.arms.iter().map(|arm| Point::from(poses[arm.mount.0].translation.vector)).collect()
}

/// The swept path of every wrist, over everything else.
fn wrist_paths(robot: &Manipulator, moments: &[Frame], radius: f64) -> Vec<Layer> {
    let places: Vec<Vec<Point>> = moments.iter().map(|frame| wrists(robot, &frame.joints)).collect();
    let path = |arm: usize| {
        let points: Vec<Point> = places.iter().map(|at| at[arm]).collect();
        let models = rope(&points, radius, linear(palette::color(arm)), 200_000 + arm as u32);
        Layer { models, in_front: 0.95, hidden: 0.35, is_framed: true }
    };
    (0..robot.arms.len()).map(path).collect()
}
