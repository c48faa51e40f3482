//! What failed of a task of a whole robot, in its scene: the posture of the nearest miss, what meets there, hands that are missing, places
//! of exchanges, and causes with their counts.

use super::frames::{ASPECT, FOCAL, HAND, OBJECT, TOWARD, ball_about, parts};
use crate::charts::{self, svg::fixed};
use crate::page::{escape_text, hash};
use crate::render::model::linear;
use crate::render::shade::Layer;
use crate::render::text::{Anchor, Sheet};
use crate::render::{Camera, Look, Paint, Picture, PlacedSurface, Surface, png_file, render};
use crate::story::FailureStory;
use crate::story::pack::base64;
use crate::story::tessellate::tessellate;
use crate::storyboard::marks::{arrow, rope};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_scene::{Scene, State};
use std::sync::Arc;

/// A body that meets another one, by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Met {
    /// A link of the robot.
    Link(String),
    /// The object of the task.
    Object(String),
    /// Something that rests.
    Resting(String),
}

/// A hand that is not where it should be. Its fingers are as in the posture.
#[derive(Debug, Clone, PartialEq)]
pub struct MissingHand {
    /// Index in `Manipulator::hands`.
    pub hand: usize,
    /// Where its base should be.
    pub world_from_hand: Pose,
    /// Where the wrist gets, and where it should be.
    pub wrist: [Point; 2],
}

/// Places of exchanges that came to the same end.
#[derive(Debug, Clone, PartialEq)]
pub struct ExchangePlaces {
    /// To which, in words.
    pub outcome: String,
    /// Where, in the world.
    pub places: Vec<Point>,
}

/// What is drawn of a failure. Lengths in metres, in the world.
#[derive(Debug, Clone)]
pub struct RobotFailure<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Where everything rests.
    pub state: &'a State,
    /// Index of the robot.
    pub robot: usize,
    /// Its joints in the nearest miss, or at the start.
    pub joints: &'a [f64],
    /// What failed in this posture; empty where the posture is that of the start.
    pub what: String,
    /// Index of the object of the task, and where it is in this posture, at the start and at the goal.
    pub object: Option<(usize, [Pose; 3])>,
    /// The two that meet.
    pub meeting: Option<[Met; 2]>,
    /// Hands that no posture brings to where they should be.
    pub missing: Vec<MissingHand>,
    /// Places of exchanges, by outcome.
    pub exchanges: Vec<ExchangePlaces>,
    /// Message, advice and causes.
    pub failure: &'a FailureStory,
}

const WIDTH: usize = 1500;
const GAP: usize = 15;
const TEXT: f64 = 19.0;
const LINE: f64 = 27.0;
const INK: &str = "#222222";
const SOFT: &str = "#666666";
/// The two that meet.
const MET: [&str; 2] = ["#c1121f", "#7b2cbf"];
const MISSING: &str = "#c1121f";
/// By outcome of exchanges, in their order.
const PLACES: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];
/// Causes that are listed.
const MOST_CAUSES: usize = 8;
/// Lines of the message.
const MOST_LINES: usize = 3;
/// From where the whole scene is seen a second time: from above.
const FROM_ABOVE: [f64; 3] = [-0.12, 0.0, -1.0];

/// One view of the scene.
struct View {
    name: &'static str,
    toward: [f64; 3],
    ball: (Point, f64),
    /// Places of exchanges would hide what is seen from near.
    has_places: bool,
}

/// What is seen in every view.
struct Drawn {
    solid: Vec<PlacedSurface>,
    layers: Vec<Layer>,
    /// Places of exchanges.
    places: Vec<Layer>,
    /// Words at points.
    words: Vec<(String, Point)>,
    views: Vec<View>,
}

/// The picture: the same for the same input. Up to three views, a key, and the causes with their counts.
///
/// Err with a message where the joints are not those of the robot, or there is no such robot or object.
pub fn robot_failure_picture(of: &RobotFailure) -> Result<Picture, String> {
    let drawn = drawn(of)?;
    let n = drawn.views.len();
    let width = (WIDTH - GAP * (n + 1)) / n;
    let height = if n == 2 { (width as f64 * ASPECT) as usize } else { width };
    let small = Sheet::new(1, 1).ok_or("no picture")?;
    let room = (WIDTH - 2 * GAP) as f64;
    let message = wrapped(&small, &of.failure.message, room, MOST_LINES);
    let key = key(of);
    let mut causes = cause_lines(of.failure);
    if !of.failure.advice.is_empty() {
        causes.extend(wrapped(&small, &format!("try: {}", of.failure.advice), room, MOST_LINES));
    }
    let n_lines = key.len() + message.len() + causes.len() + 1;
    let top = height + 2 * GAP + LINE as usize;
    let whole = top + (LINE * (n_lines as f64 + 0.8)) as usize;
    let mut sheet = Sheet::new(WIDTH, whole).ok_or("the picture would be too large")?;
    for (k, view) in drawn.views.iter().enumerate() {
        let focal = FOCAL * width as f64;
        let distance = view.ball.1 * focal / (0.47 * height as f64);
        let middle = [width as f64 / 2.0, height as f64 / 2.0];
        let camera = Camera::looking(&Vector::from(view.toward), &view.ball.0, distance, focal, middle);
        let look = Look {
            supersampling: 2,
            occlusion_radius: 0.03 * view.ball.1,
            shadows_within: Some(view.ball),
            outline: (width as f64 / 330.0).max(0.8),
        };
        let places = drawn.places.iter().filter(|_| view.has_places);
        let layers: Vec<Layer> = drawn.layers.iter().chain(places).cloned().collect();
        let picture = render(&drawn.solid, &layers, &camera, width, height, &look);
        let left = GAP + k * (width + GAP);
        sheet.lay(&picture, left, GAP);
        for (words, at) in &drawn.words {
            let seen = camera.see(at);
            let is_inside =
                seen.depth > 0.0 && (0.0..width as f64).contains(&seen.x) && (TEXT..height as f64).contains(&seen.y);
            if is_inside {
                sheet.write(words, left as f64 + seen.x, GAP as f64 + seen.y, TEXT, INK, Anchor::Middle);
            }
        }
        let [x, y] = [left as f64 + middle[0], (GAP + height) as f64 + TEXT];
        sheet.write(view.name, x, y, TEXT, SOFT, Anchor::Middle);
    }
    let left = GAP as f64;
    let mut y = top as f64 + 0.5 * LINE;
    for (color, words) in &key {
        if let Some(color) = color {
            sheet.disc([left + 8.0, y - 6.0], 7.0, color);
        }
        let at = if color.is_some() { left + 26.0 } else { left };
        let line = sheet.fitted(words, TEXT, room - 26.0);
        sheet.write(&line, at, y, TEXT, INK, Anchor::Start);
        y += LINE;
    }
    y += 0.5 * LINE;
    for (lines, color) in [(&message, INK), (&causes, SOFT)] {
        for line in lines {
            let line = sheet.fitted(line, TEXT, room);
            sheet.write(&line, left, y, TEXT, color, Anchor::Start);
            y += LINE;
        }
    }
    Ok(sheet.picture())
}

/// What is seen of a failure.
fn drawn(of: &RobotFailure) -> Result<Drawn, String> {
    let robot = of.scene.robots.get(of.robot).ok_or("the scene has no such robot")?;
    if of.joints.len() != robot.layout.len() {
        return Err(format!("the posture has {} joints, and the robot {}", of.joints.len(), robot.layout.len()));
    }
    let object = match &of.object {
        Some((index, poses)) => Some((of.scene.objects.get(*index).ok_or("the scene has no such object")?, poses)),
        None => None,
    };
    let is_object = |name: &str| object.as_ref().is_some_and(|(object, _)| object.name == name);
    let parts = parts(of.scene, of.state, robot, is_object);
    let mut poses = Vec::new();
    robot.link_poses(of.joints, &mut poses);
    let mut solid: Vec<PlacedSurface> = parts.iter().enumerate().map(|(k, part)| part.placed(k, &poses)).collect();
    let mut in_view: Vec<Point> = Vec::new();
    for (part, placed) in parts.iter().zip(&solid) {
        if part.link.is_some_and(|link| !robot.coordinates_above(regrasp_robot::LinkId(link)).is_empty()) {
            in_view.extend(placed.world_corners().flatten());
        }
    }
    let mut words = Vec::new();
    let mut layers = Vec::new();
    if let Some((object, [here, start, goal])) = &object {
        let surface = Arc::new(Surface::of(&tessellate(&object.shape)));
        let placed = |pose: &Pose, body: u32| PlacedSurface {
            world_from_surface: *pose,
            surface: surface.clone(),
            paint: Paint::Plain(linear(OBJECT)),
            body,
        };
        solid.push(placed(here, 100_000));
        for (k, (name, pose)) in [("start", start), ("goal", goal)].into_iter().enumerate() {
            let ghost = placed(pose, 100_001 + k as u32);
            let up = ghost.world_corners().flatten().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
            let middle = pose * object.center_of_mass;
            words.push((name.to_owned(), Point::new(middle.x, middle.y, up + 0.03)));
            in_view.extend(ghost.world_corners().flatten());
            layers.push(Layer { models: vec![ghost], in_front: 0.5, hidden: 0.15, is_framed: true });
        }
        in_view.extend(solid[solid.len() - 1].world_corners().flatten());
    }
    // The two that meet are painted, and shown through what hides them.
    let is_met = |met: &Met, k: usize| match (met, parts.get(k)) {
        (Met::Link(name), Some(part)) => part.link.is_some() && part.name == *name,
        (Met::Resting(name), Some(part)) => part.link.is_none() && part.name == *name,
        // An object that rests is drawn as the object of the task where it is that.
        (Met::Object(name) | Met::Resting(name), None) => is_object(name),
        _ => false,
    };
    let mut near: Option<(Point, f64)> = None;
    for (met, color) in of.meeting.iter().flatten().zip(MET) {
        let mut marked = Vec::new();
        for (_, surface) in solid.iter_mut().enumerate().filter(|(k, _)| is_met(met, *k)) {
            surface.paint = Paint::Plain(linear(color));
            marked.push(surface.clone());
        }
        let corners: Vec<Point> =
            marked.iter().flat_map(|model| model.world_corners().flatten().collect::<Vec<_>>()).collect();
        let ball = ball_about(&corners);
        // Seen from near is the smaller one.
        if !corners.is_empty() && near.as_ref().is_none_or(|near| ball.1 < near.1) {
            near = Some(ball);
        }
        layers.push(Layer { models: marked, in_front: 0.0, hidden: 0.35, is_framed: true });
    }
    let mut near_points = Vec::new();
    for missing in &of.missing {
        let base = robot.hands.get(missing.hand).ok_or("the robot has no such hand")?.hand.base.0;
        let moved = missing.world_from_hand * poses[base].inverse();
        let own = |part: &&super::frames::Part| {
            let of_hand =
                |link: usize| robot.part_of(regrasp_robot::LinkId(link)) == regrasp_robot::Part::Hand(missing.hand);
            part.link.is_some_and(of_hand)
        };
        let ghosts: Vec<PlacedSurface> = parts
            .iter()
            .filter(own)
            .map(|part| {
                let mut ghost = part.placed(0, &poses);
                ghost.world_from_surface = moved * ghost.world_from_surface;
                ghost.paint = Paint::Plain(linear(HAND));
                ghost
            })
            .collect();
        near_points.extend(ghosts.iter().flat_map(|ghost| ghost.world_corners().flatten().collect::<Vec<_>>()));
        near_points.extend(missing.wrist);
        layers.push(Layer { models: ghosts, in_front: 0.55, hidden: 0.3, is_framed: true });
        let far = (missing.wrist[1] - missing.wrist[0]).norm();
        if let Some(model) = arrow(&missing.wrist[0], &missing.wrist[1], 0.012, linear(MISSING), 300_000) {
            layers.push(Layer { models: vec![model], in_front: 1.0, hidden: 0.6, is_framed: true });
            let middle = nalgebra::center(&missing.wrist[0], &missing.wrist[1]);
            words.push((format!("{} m", fixed(far, 3)), middle + Vector::new(0.0, 0.0, 0.05)));
        }
    }
    in_view.extend(&near_points);
    let mut places = Vec::new();
    for (k, same) in of.exchanges.iter().enumerate() {
        let ball = Arc::new(Surface::of(&tessellate(&Shape::Sphere { radius: 0.014 })));
        let color = linear(PLACES[k % PLACES.len()]);
        let models = same.places.iter().map(|at| PlacedSurface {
            world_from_surface: Pose::from_parts(Translation3::from(at.coords), UnitQuaternion::identity()),
            surface: ball.clone(),
            paint: Paint::Plain(color),
            body: 400_000 + k as u32,
        });
        places.push(Layer { models: models.collect(), in_front: 1.0, hidden: 0.5, is_framed: true });
        in_view.extend(&same.places);
    }
    if let Some((_, [_, start, goal])) = &object {
        let ends = [start, goal].map(|pose| Point::from(pose.translation.vector));
        layers.push(Layer {
            models: rope(&ends, 0.004, linear(OBJECT), 500_000),
            in_front: 0.5,
            hidden: 0.2,
            is_framed: true,
        });
    }
    let whole = ball_about(&in_view);
    let mut views =
        vec![View { name: "from the right, in front and above", toward: TOWARD, ball: whole, has_places: true }];
    if !near_points.is_empty() {
        near = Some(ball_about(&near_points));
    }
    if let Some((center, radius)) = near {
        views.push(View {
            name: "from near",
            toward: TOWARD,
            ball: (center, (1.5 * radius).max(0.08)),
            has_places: false,
        });
    }
    if near.is_none() || of.exchanges.iter().any(|places| !places.places.is_empty()) {
        views.push(View { name: "from above", toward: FROM_ABOVE, ball: whole, has_places: true });
    }
    Ok(Drawn { solid, layers, places, words, views })
}

/// Colours and what they mean; first, without a colour, what failed.
fn key(of: &RobotFailure) -> Vec<(Option<&'static str>, String)> {
    let what = if of.what.is_empty() { "the robot and the object at the start".to_owned() } else { of.what.clone() };
    let mut key = vec![(None, what)];
    for (met, color) in of.meeting.iter().flatten().zip(MET) {
        let (Met::Link(name) | Met::Object(name) | Met::Resting(name)) = met;
        let kind = match met {
            Met::Link(_) => "link of the robot",
            Met::Object(_) => "the object",
            Met::Resting(_) => "at rest",
        };
        key.push((Some(color), format!("\"{name}\" ({kind})")));
    }
    for missing in &of.missing {
        let far = (missing.wrist[1] - missing.wrist[0]).norm();
        let words = format!("the hand should be where it is shown pale; the wrist gets to within {} m", fixed(far, 3));
        key.push((Some(MISSING), words));
    }
    for (k, places) in of.exchanges.iter().enumerate().filter(|(_, places)| !places.places.is_empty()) {
        let words = format!("places of the exchange: {} ({})", places.outcome, places.places.len());
        key.push((Some(PLACES[k % PLACES.len()]), words));
    }
    key
}

/// The commonest causes, one a line.
fn cause_lines(failure: &FailureStory) -> Vec<String> {
    let line = |cause: &crate::story::CauseStory| format!("{} x  {}", cause.count, cause.reason);
    let mut lines: Vec<String> = failure.causes.iter().take(MOST_CAUSES).map(line).collect();
    if failure.causes.len() > MOST_CAUSES {
        lines.push(format!("and {} more", failure.causes.len() - MOST_CAUSES));
    }
    lines
}

/// `text` in lines that fit; what does not fit into the last one is cut.
fn wrapped(sheet: &Sheet, text: &str, room: f64, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        let longer = if lines[last].is_empty() { word.to_owned() } else { format!("{} {word}", lines[last]) };
        if lines.len() < most && !lines[last].is_empty() && sheet.text_width(&longer, TEXT) > room {
            lines.push(word.to_owned());
        } else {
            lines[last] = longer;
        }
    }
    lines
}

/// One HTML file that opens from disk, fetches nothing and runs nothing: the picture, the causes as bars, facts. The same input gives the
/// same bytes.
///
/// Err as [`robot_failure_picture`].
pub fn robot_failure_page(of: &RobotFailure, facts: &[(String, String)], title: &str) -> Result<String, String> {
    let picture = base64(&png_file::encode(&robot_failure_picture(of)?));
    let style = crate::page::embedded(super::STYLE, "style");
    let policy =
        format!("default-src 'none'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'", hash(&style));
    let title = escape_text(title);
    let chart = charts::causes(of.failure)
        .map_or_else(String::new, |chart| format!("<figure class=\"card\">{chart}</figure>\n"));
    let row = |(label, value): &(String, String)| {
        format!("<tr><th>{}</th><td>{}</td></tr>\n", escape_text(label), escape_text(value))
    };
    let rows: String = facts.iter().map(row).collect();
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n\
         <header class=\"top\"><h1>{title}</h1><span class=\"verdict bad\"><strong>NO PLAN</strong></span></header>\n\
         <main>\n<div class=\"right\">\n<figure class=\"card\"><img alt=\"What failed, in the scene\" \
         src=\"data:image/png;base64,{picture}\"></figure>\n{chart}<section class=\"card facts\"><table>\n{rows}</table></section>\n\
         </div>\n</main>\n</body>\n</html>\n"
    ))
}
