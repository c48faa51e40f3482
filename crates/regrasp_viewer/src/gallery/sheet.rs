//! Grasps of a list in one picture: hand, object and contacts, drawn by the software renderer.

use crate::palette;
use crate::render::model::{linear, mixed};
use crate::render::shade::Layer;
use crate::render::text::{Anchor, Sheet};
use crate::render::{Camera, Look, Paint, PlacedSurface, Surface, png_file, render};
use crate::story::tessellate::tessellate;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_plan::grasps::{GraspList, ListedGrasp};
use regrasp_robot::Hand;
use regrasp_scene::GraspScene;
use std::sync::Arc;

/// Most pictures, and widths of the sheet in pixels: what memory holds.
const MOST: usize = 60;
/// See [`MOST`].
const WIDTHS: std::ops::RangeInclusive<usize> = 120..=8000;
/// Height of a picture over its width.
const ASPECT: f64 = 0.9;
/// Focal length over the width of a picture.
const FOCAL: f64 = 1.8;
/// Share of a picture that stays free on each side.
const BORDER: f64 = 0.04;
/// Sides from which a grasp may be seen.
const AROUND: usize = 8;
/// Radius of a contact's ball, as a share of the object's radius.
const CONTACT: f64 = 0.035;
const OBJECT: &str = "#d9b986";
const PALM: &str = "#c3c7cc";
const LINK: &str = "#d9dbde";
const INK: &str = "#222222";

/// How a sheet of grasps is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetSettings {
    /// Grasps that are shown: evenly chosen from the list.
    pub grasps: usize,
    /// Width of the whole picture, in pixels.
    pub width: usize,
    /// Pictures in a row; chosen by their number where absent.
    pub columns: Option<usize>,
    /// Samples per pixel, along each side.
    pub supersampling: usize,
}

/// A PNG file of grasps of `list`: the same bytes for the same input. Each is seen from the side that shows its contacts best.
///
/// Errors: which setting is out of range, in words.
pub fn png(scene: &GraspScene, list: &GraspList, settings: &SheetSettings) -> Result<Vec<u8>, String> {
    if !(1..=MOST).contains(&settings.grasps) {
        return Err(format!("the number of frames is {}; it must be from 1 to {MOST}", settings.grasps));
    }
    if !WIDTHS.contains(&settings.width) || !(1..=8).contains(&settings.supersampling) || settings.columns == Some(0) {
        return Err(format!(
            "the width is {}; it must be from {} to {}, with at least one column",
            settings.width,
            WIDTHS.start(),
            WIDTHS.end()
        ));
    }
    let n = settings.grasps.min(list.grasps.len());
    if n == 0 {
        return Err("the list has no grasp to show".into());
    }
    let columns = settings.columns.unwrap_or_else(|| (n as f64).sqrt().ceil() as usize).clamp(1, n);
    let gap = (settings.width / 100).max(2);
    let width = (settings.width.saturating_sub(gap * (columns + 1)) / columns).max(16);
    let height = (width as f64 * ASPECT).round() as usize;
    let text = (width as f64 / 21.0).max(9.0);
    let caption = (1.6 * text).round() as usize;
    let rows = n.div_ceil(columns);
    let mut sheet =
        Sheet::new(settings.width, gap + rows * (height + caption + gap)).ok_or("the picture is too large")?;
    let cast = Cast::new(scene);
    for k in 0..n {
        let index = k * list.grasps.len() / n;
        let grasp = &list.grasps[index];
        let (x, y) = (gap + k % columns * (width + gap), gap + k / columns * (height + caption + gap));
        let (solid, contacts) = cast.of(grasp, list);
        let look = Look {
            supersampling: settings.supersampling,
            occlusion_radius: 0.35 * cast.radius,
            shadows_within: Some((cast.center, 4.0 * cast.radius)),
            outline: (width as f64 / 330.0).max(0.8),
        };
        let layers = [Layer { models: contacts, in_front: 1.0, hidden: 0.45, is_framed: true }];
        let camera = camera(&solid, &cast.toward(grasp), &cast.center, width, height);
        sheet.lay(&render(&solid, &layers, &camera, width, height, &look), x, y);
        let line =
            format!("{index}: margin {:.3}, score {:.2}, {} fingers", grasp.margin, grasp.score, grasp.contacts.len());
        let line = sheet.fitted(&line, text, width as f64);
        let (middle, below) = (x as f64 + 0.5 * width as f64, (y + height) as f64 + text);
        sheet.write(&line, middle, below, text, INK, Anchor::Middle);
    }
    Ok(png_file::encode(&sheet.picture()))
}

/// Hand and object with their surfaces made once.
struct Cast<'a> {
    hand: &'a Hand,
    object: Arc<Surface>,
    palm: Vec<(Pose, Arc<Surface>)>,
    /// By finger: which link carries the shape, its pose there, its surface.
    fingers: Vec<Vec<(usize, Pose, Arc<Surface>)>>,
    ball: Arc<Surface>,
    center: Point,
    radius: f64,
}

impl<'a> Cast<'a> {
    fn new(scene: &'a GraspScene) -> Self {
        let task = scene.manipulation();
        let (hand, object) = (task.hand(), task.object());
        let surface = |shape: &Shape| Arc::new(Surface::of(&tessellate(shape)));
        let (low, high) = object.shape.bounds();
        let palm = hand.palm.iter().map(|part| (part.placed.parent_from_shape, surface(&part.placed.shape)));
        let fingers = hand.fingers.iter().map(|finger| {
            let parts = finger.shapes.iter();
            let mut all: Vec<_> =
                parts.map(|part| (part.body, part.placed.parent_from_shape, surface(&part.placed.shape))).collect();
            if let Some(own) = finger.tip.own_shape() {
                all.push((finger.chain.joints.len() - 1, own.parent_from_shape, surface(&own.shape)));
            }
            all
        });
        let radius = 0.5 * (high - low).norm();
        Cast {
            object: surface(&object.shape),
            palm: palm.collect(),
            fingers: fingers.collect(),
            ball: surface(&Shape::Sphere { radius: CONTACT * radius }),
            center: nalgebra::center(&low, &high),
            radius,
            hand,
        }
    }

    /// What stands before the camera, in the object frame: object and hand; contacts.
    fn of(&self, grasp: &ListedGrasp, list: &GraspList) -> (Vec<PlacedSurface>, Vec<PlacedSurface>) {
        let placed = |world_from_surface: Pose, surface: &Arc<Surface>, color: [f64; 3], body: u32| PlacedSurface {
            world_from_surface,
            surface: Arc::clone(surface),
            paint: Paint::Plain(color),
            body,
        };
        let object_from_hand = Pose::from(&grasp.object_from_hand);
        let mut solid = vec![placed(Pose::identity(), &self.object, linear(OBJECT), 0)];
        solid.extend(self.palm.iter().map(|(pose, part)| placed(object_from_hand * pose, part, linear(PALM), 1)));
        let (mut first, mut body) = (0, 2);
        for (f, (finger, parts)) in self.hand.fingers.iter().zip(&self.fingers).enumerate() {
            let end = first + finger.chain.n_coordinates();
            let Some(joints) = grasp.joints.get(first..end) else { break };
            first = end;
            let mut links = Vec::new();
            finger.chain.forward(joints, &mut links);
            let color = mixed(linear(LINK), linear(palette::color(f)), 0.35);
            for (link, pose, part) in parts {
                let Some(carrier) = links.get(*link) else { continue };
                solid.push(placed(object_from_hand * carrier * pose, part, color, body + *link as u32));
            }
            body += links.len() as u32;
        }
        let contacts = grasp.contacts.iter().map(|contact| {
            let [x, y, z] = contact.point_in_object;
            let number = list.hand.fingers.iter().position(|finger| *finger == contact.finger).unwrap_or(0);
            placed(Pose::translation(x, y, z), &self.ball, linear(palette::color(number)), u32::MAX)
        });
        (solid, contacts.collect())
    }

    /// The line of sight that shows most contacts, and the hand beside the object.
    fn toward(&self, grasp: &ListedGrasp) -> Vector {
        let hand = Pose::from(&grasp.object_from_hand) * Point::origin() - self.center;
        let hand = hand.try_normalize(1e-9).unwrap_or_else(Vector::z);
        let direction = |k: usize| {
            let angle = std::f64::consts::TAU * (k as f64 + 0.35) / AROUND as f64;
            Vector::new(libm::cos(angle), libm::sin(angle), -0.45).normalize()
        };
        let value = |toward: &Vector| {
            let facing = |normal: [f64; 3]| (-Vector::from(normal).dot(toward)).max(0.0);
            let seen: f64 = grasp.contacts.iter().map(|contact| facing(contact.normal_in_object)).sum();
            seen - 2.0 * (-hand.dot(toward)).max(0.0)
        };
        let best = (0..AROUND).map(direction).reduce(|best, one| if value(&one) > value(&best) { one } else { best });
        best.unwrap_or_else(Vector::y)
    }
}

/// A camera that looks along `toward` and shows all of `solid`.
fn camera(solid: &[PlacedSurface], toward: &Vector, middle: &Point, width: usize, height: usize) -> Camera {
    let corners: Vec<Point> = solid.iter().flat_map(|model| model.world_corners().flatten()).collect();
    let size = corners.iter().map(|corner| (corner - middle).norm()).fold(1e-6, f64::max);
    let focal = FOCAL * width as f64;
    let half = [width as f64 / 2.0, height as f64 / 2.0];
    let mut distance = 1.5 * size;
    loop {
        let camera = Camera::looking(toward, middle, distance, focal, [0.0, 0.0]);
        let nothing = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let [left, top, right, bottom] = corners
            .iter()
            .map(|corner| camera.see(corner))
            .fold(nothing, |b, seen| [b[0].min(seen.x), b[1].min(seen.y), b[2].max(seen.x), b[3].max(seen.y)]);
        let fits = [right - left, bottom - top]
            .iter()
            .zip(half)
            .all(|(size, half)| *size <= 2.0 * half * (1.0 - 2.0 * BORDER));
        if fits || distance > 20.0 * size {
            let center = [half[0] - 0.5 * (left + right), half[1] - 0.5 * (top + bottom)];
            return Camera { center, ..camera };
        }
        distance *= 1.04;
    }
}
