//! Key frames of a plan in one picture, like figures 7 to 9 of Saut 2011.

/// Which moments are shown.
pub mod key_frames;
/// Contacts, cones, forces and paths as things in space.
pub mod marks;
/// What stands before the camera.
mod stage;
mod tips;
/// From where everything is seen best.
mod view;

use crate::palette;
use crate::render::text::{Anchor, Sheet};
use crate::render::{Camera, Look, Picture, png_file, render};
use crate::story::{SceneStory, Story};
use crate::timeline;
use key_frames::{KeyFrame, key_frames};
use regrasp_geometry::Pose;
use regrasp_plan::Plan;
use stage::{Shown, Stage};

/// How a storyboard is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct StoryboardSettings {
    /// Key frames, at least 2; fewer where the plan has fewer waypoints.
    pub frames: usize,
    /// Width of the whole picture, in pixels.
    pub width: usize,
    /// Frames in a row; chosen by their number where absent.
    pub columns: Option<usize>,
    /// Samples per pixel, along each side.
    pub supersampling: usize,
    /// Draw what planner and checker keep apart, even where it is known what things look like.
    pub collision: bool,
}

impl Default for StoryboardSettings {
    fn default() -> Self {
        StoryboardSettings { frames: 6, width: 1500, columns: None, supersampling: 3, collision: false }
    }
}

/// Why there is no storyboard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StoryboardError {
    /// Frames, columns, width or samples are out of range.
    #[error("{0}")]
    Settings(String),
    /// The story has no plan, or one with other joints or fingers than its hand, or without waypoints.
    #[error("{0}")]
    Plan(String),
}

/// Height of a frame over its width.
const ASPECT: f64 = 0.78;
/// Most frames and pixels along a side: what memory holds.
const MAX_FRAMES: usize = 60;
const WIDTHS: std::ops::RangeInclusive<usize> = 120..=8000;

/// A storyboard of `plan` as PNG file: the same bytes for the same input.
///
/// Every frame is seen from the same place, which is chosen so that the object shows best. Under each stand the moment,
/// the angle by which the object has turned since the start, and what happens.
pub fn storyboard(story: &Story, settings: &StoryboardSettings) -> Result<Vec<u8>, StoryboardError> {
    Ok(png_file::encode(&storyboard_picture(story, settings)?))
}

/// The picture of [`storyboard`].
pub fn storyboard_picture(story: &Story, settings: &StoryboardSettings) -> Result<Picture, StoryboardError> {
    let (scene, plan) = (&story.scene, story.plan.as_ref());
    let plan = plan.ok_or_else(|| StoryboardError::Plan("there is no plan to show".into()))?;
    validate(scene, plan, settings)?;
    let frames = key_frames(scene, plan, settings.frames);
    let columns = settings.columns.unwrap_or_else(|| columns_for(frames.len())).clamp(1, frames.len());
    let layout = Layout::new(settings.width, columns, frames.len());
    let shown = if settings.collision { Shown::CollisionShapes } else { Shown::Visuals };
    let stage = Stage::new(scene, plan, shown).map_err(StoryboardError::Plan)?;
    let postures: Vec<_> = frames.iter().map(|frame| stage.solid(frame)).collect();
    let layers: Vec<_> = frames.iter().map(|frame| stage.layers(frame)).collect();
    let camera = view::best(&stage, &frames, &postures, &layers, layout.frame_width, layout.frame_height);
    let radius = stage.object_radius;
    let look = Look {
        supersampling: settings.supersampling,
        occlusion_radius: 0.35 * radius,
        shadows_within: Some(view::ball_around(&postures)),
        outline: (layout.frame_width as f64 / 330.0).max(0.8),
    };
    let too_large = || StoryboardError::Settings("the picture would be too large".into());
    let mut sheet = Sheet::new(settings.width, layout.height).ok_or_else(too_large)?;
    for (k, frame) in frames.iter().enumerate() {
        let picture = render(&postures[k], &layers[k], &camera, layout.frame_width, layout.frame_height, &look);
        let (x, y) = layout.corner(k);
        sheet.lay(&picture, x, y);
        draw_axes(&mut sheet, frame, &camera, &layout, k);
        caption(&mut sheet, plan, frame, &layout, k);
    }
    Ok(sheet.picture())
}

fn validate(scene: &SceneStory, plan: &Plan, settings: &StoryboardSettings) -> Result<(), StoryboardError> {
    let out_of_range = |what: &str, value: usize, range: &str| {
        Err(StoryboardError::Settings(format!("{what} is {value}; it must be {range}")))
    };
    if !(2..=MAX_FRAMES).contains(&settings.frames) {
        return out_of_range("the number of frames", settings.frames, &format!("from 2 to {MAX_FRAMES}"));
    }
    if !WIDTHS.contains(&settings.width) {
        return out_of_range("the width", settings.width, &format!("from {} to {}", WIDTHS.start(), WIDTHS.end()));
    }
    if !(1..=8).contains(&settings.supersampling) {
        return out_of_range("supersampling", settings.supersampling, "from 1 to 8");
    }
    if settings.columns == Some(0) {
        return out_of_range("the number of columns", 0, "at least 1");
    }
    if !plan.joint_names.iter().eq(scene.hand().joints.iter().map(|joint| &joint.name)) {
        return Err(StoryboardError::Plan("the plan's joints are not those of the hand".into()));
    }
    if plan.fingers.len() != scene.hand().fingers.len() {
        return Err(StoryboardError::Plan("the plan's fingers are not those of the hand".into()));
    }
    let steps = timeline::steps(plan);
    let fits = |step: &timeline::TimelineStep| {
        step.waypoint.joints.len() == plan.joint_names.len() && step.waypoint.contacts.len() == plan.fingers.len()
    };
    if steps.is_empty() || !steps.iter().all(fits) {
        return Err(StoryboardError::Plan("a waypoint of the plan has another number of joints or contacts".into()));
    }
    Ok(())
}

fn columns_for(frames: usize) -> usize {
    match frames {
        0..=3 => frames.max(1),
        4 | 7 | 8 => 4,
        5 | 6 | 9 => 3,
        _ => 5,
    }
}

/// Where frames and captions are, in pixels.
#[derive(Debug, Clone, PartialEq)]
struct Layout {
    columns: usize,
    frame_width: usize,
    frame_height: usize,
    gap: usize,
    text: f64,
    caption_height: usize,
    height: usize,
}

impl Layout {
    fn new(width: usize, columns: usize, frames: usize) -> Self {
        let gap = (width / 100).max(2);
        let frame_width = (width.saturating_sub(gap * (columns + 1)) / columns).max(16);
        let frame_height = (frame_width as f64 * ASPECT).round() as usize;
        let text = (frame_width as f64 / 21.0).max(9.0);
        let caption_height = (2.75 * text).round() as usize;
        let rows = frames.div_ceil(columns);
        let height = gap + rows * (frame_height + caption_height + gap);
        Layout { columns, frame_width, frame_height, gap, text, caption_height, height }
    }

    /// Upper left corner of a frame.
    fn corner(&self, k: usize) -> (usize, usize) {
        let (row, column) = (k / self.columns, k % self.columns);
        let x = self.gap + column * (self.frame_width + self.gap);
        (x, self.gap + row * (self.frame_height + self.caption_height + self.gap))
    }
}

/// Two lines under a frame: when and how far, then what happens, in the colour of the finger.
fn caption(sheet: &mut Sheet, plan: &Plan, frame: &KeyFrame, layout: &Layout, k: usize) {
    let (x, y) = layout.corner(k);
    let middle = x as f64 + layout.frame_width as f64 / 2.0;
    let width = layout.frame_width as f64;
    let first = y as f64 + layout.frame_height as f64 + 0.95 * layout.text;
    let far = match plan_turns(plan) {
        true => format!("turned {:.0}\u{b0}", frame.turned.to_degrees()),
        false => format!("moved {:.0} mm", 1e3 * frame.moved),
    };
    let moment = format!("{:.1} s, {far}", frame.time);
    let moment = sheet.fitted(&moment, layout.text, width);
    sheet.write(&moment, middle, first, layout.text, "#222222", Anchor::Middle);
    let (dot, room) = (0.28 * layout.text, 1.0 * layout.text);
    let name = frame.moving.and_then(|finger| plan.fingers.get(finger));
    let rolling = frame.rolling.and_then(|finger| plan.fingers.get(finger));
    let text = frame.text(name.map(String::as_str), rolling.map(String::as_str));
    let text = sheet.fitted(&regrasp_base::diagnostic::printable(&text), layout.text, width - room);
    let second = first + 1.25 * layout.text;
    match frame.moving {
        Some(finger) => {
            let start = middle - (sheet.text_width(&text, layout.text) + room) / 2.0;
            sheet.disc([start + dot, second - 0.33 * layout.text], dot, palette::color(finger));
            sheet.write(&text, start + room, second, layout.text, "#222222", Anchor::Start);
        }
        None => {
            sheet.write(&text, middle, second, layout.text, "#222222", Anchor::Middle);
        }
    }
}

/// True unless the object only moves along, at no moment turned by a degree.
fn plan_turns(plan: &Plan) -> bool {
    timeline::steps(plan).iter().any(|step| timeline::turned(plan, step.waypoint) > 1f64.to_radians())
}

/// The object's axes in the lower left corner of a frame.
fn draw_axes(sheet: &mut Sheet, frame: &KeyFrame, camera: &Camera, layout: &Layout, k: usize) {
    let (x, y) = layout.corner(k);
    let length = 1.25 * layout.text;
    let origin = [x as f64 + 1.9 * layout.text, y as f64 + layout.frame_height as f64 - 1.9 * layout.text];
    let rotation = Pose::from(&frame.world_from_object).rotation;
    let mut axes: Vec<(f64, usize, [f64; 2])> = (0..3)
        .map(|axis| {
            let direction = camera.axes * (rotation * stage::unit(axis));
            (direction.z, axis, [origin[0] + length * direction.x, origin[1] - length * direction.y])
        })
        .collect();
    axes.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, axis, end) in axes {
        let color = stage::AXIS_COLORS[axis];
        sheet.line(&[origin, end], 0.13 * layout.text, color);
        let letter = ["x", "y", "z"][axis];
        let seen = (end[0] - origin[0]).hypot(end[1] - origin[1]);
        if seen < 0.45 * length {
            continue; // It points at the reader; its letter would lie over others.
        }
        let place = [0, 1].map(|c| end[c] + (end[c] - origin[c]) / seen * 0.42 * layout.text);
        sheet.write(letter, place[0], place[1] + 0.24 * layout.text, 0.8 * layout.text, color, Anchor::Middle);
    }
}
