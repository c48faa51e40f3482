//! From where everything is seen best.

use super::key_frames::KeyFrame;
use super::stage::Stage;
use crate::render::raster::{NONE, Samples};
use crate::render::shade::Layer;
use crate::render::{Camera, PlacedSurface};
use regrasp_geometry::{Point, Vector};
use std::f64::consts::TAU;

/// Directions tried around the vertical, and heights over the horizon in radians.
const AROUND: usize = 16;
const HEIGHTS: [f64; 3] = [0.30, 0.52, 0.75];
/// Width of the pictures in which directions are compared, in pixels.
const TRIAL_WIDTH: usize = 120;
/// Directions, evenly spread, in which the farthest corners of a model are kept for framing.
const N_EXTREMES: usize = 40;
/// What it counts to see a contact, the whole path of a moving finger, and a tenth of the picture of obstacles, against the whole
/// picture of nothing but the object.
const CONTACT: f64 = 0.012;
const PATH: f64 = 0.03;
const OBSTACLE: f64 = 0.3;
/// Share of the picture that stays free at each side.
const BORDER: f64 = 0.04;
/// Focal length over the picture's width: a lens of about 26 degrees.
const FOCAL: f64 = 2.2;
/// The object's diameter is at least this share of the picture's height, even if parts of the hand are cut.
const LEAST_OBJECT: f64 = 0.27;

/// A ball that holds all corners of all models.
pub fn ball_around(postures: &[Vec<PlacedSurface>]) -> (Point, f64) {
    let corners: Vec<Point> = all_corners(postures).collect();
    let (low, high) = corners.iter().fold((corners[0], corners[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let center = nalgebra::center(&low, &high);
    (center, corners.iter().map(|p| (p - center).norm()).fold(1e-6, f64::max))
}

fn all_corners(postures: &[Vec<PlacedSurface>]) -> impl Iterator<Item = Point> + '_ {
    postures.iter().flatten().flat_map(|model| model.world_corners().flatten().collect::<Vec<_>>())
}

/// The camera from which most of the object, and most contacts, are seen over all frames; `layers` are what is drawn over the
/// models in every frame.
pub fn best(
    stage: &Stage,
    frames: &[KeyFrame],
    postures: &[Vec<PlacedSurface>],
    layers: &[Vec<Layer>],
    width: usize,
    height: usize,
) -> Camera {
    let marks = layers.iter().flatten().filter(|layer| layer.is_framed).flat_map(|layer| &layer.models);
    let (mut corners, mut rest) = (marks.flat_map(extremes).collect::<Vec<Point>>(), Vec::new());
    for (model, matters) in postures.iter().flat_map(|solid| solid.iter().zip(stage.matters())) {
        if matters { &mut corners } else { &mut rest }.extend(extremes(model));
    }
    let corners = Corners { n_that_matter: corners.len(), all: [corners, rest].concat() };
    let trial_height = (TRIAL_WIDTH * height).div_ceil(width.max(1)).max(1);
    let mut found: Option<(f64, Vector)> = None;
    for height_angle in HEIGHTS {
        for k in 0..AROUND {
            // Not straight at a finger or a face where hands are symmetric.
            let angle = TAU * (k as f64 + 0.35) / AROUND as f64;
            let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
            let level = libm::cos(height_angle);
            let toward = Vector::new(level * cosine, level * sine, -libm::sin(height_angle));
            let camera = framed(stage, frames, &corners, &toward, TRIAL_WIDTH, trial_height);
            let value = value_of(stage, frames, postures, &camera, trial_height);
            if found.is_none_or(|(best, _)| value > best) {
                found = Some((value, toward));
            }
        }
    }
    let toward = found.map_or_else(Vector::y, |(_, toward)| toward);
    framed(stage, frames, &corners, &toward, width, height)
}

/// The corners of a model that reach farthest in some directions: enough to frame it.
fn extremes(model: &PlacedSurface) -> Vec<Point> {
    let corners: Vec<Point> = model.world_corners().flatten().collect();
    if corners.len() <= N_EXTREMES {
        return corners;
    }
    let farthest = |k: usize| {
        let height = 1.0 - (2 * k + 1) as f64 / N_EXTREMES as f64;
        let angle = k as f64 * TAU * 0.381_966;
        let level = (1.0 - height * height).sqrt();
        let direction = Vector::new(level * libm::cos(angle), level * libm::sin(angle), height);
        let reach = |p: &&Point| direction.dot(&p.coords);
        corners.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))).copied()
    };
    (0..N_EXTREMES).filter_map(farthest).collect()
}

/// How much of the object is seen, as share of the picture, with a bonus for contacts, paths and obstacles that nothing hides.
fn value_of(
    stage: &Stage,
    frames: &[KeyFrame],
    postures: &[Vec<PlacedSurface>],
    camera: &Camera,
    height: usize,
) -> f64 {
    let mut value = 0.0;
    for (frame, solid) in frames.iter().zip(postures) {
        let n_object = solid[..stage.n_object_pieces()].iter().map(|m| m.surface.corners.len()).sum::<usize>() as u32;
        let seen = Samples::of(solid, camera, TRIAL_WIDTH, height);
        let of_object = seen.triangle.iter().filter(|&&t| t != NONE && t < n_object).count();
        value += of_object as f64 / seen.triangle.len() as f64;
        let object = regrasp_geometry::Pose::from(&frame.world_from_object);
        let size = stage.object_radius;
        // True where nothing thicker than a fingertip is in front.
        let is_seen = |point: &Point| {
            let at = camera.see(point);
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < TRIAL_WIDTH as f64 && at.y < height as f64;
            inside && at.depth - 1.0 / seen.inverse_depth[at.y as usize * TRIAL_WIDTH + at.x as usize] < 0.45 * size
        };
        let contacts = frame.contacts.iter().filter(|contact| contact.holds()).filter_map(|c| c.point_in_object);
        value += CONTACT * contacts.filter(|point| is_seen(&(object * Point::from(*point)))).count() as f64;
        let on_path = frame.path.iter().filter(|point| is_seen(point)).count();
        value += PATH * on_path as f64 / frame.path.len().max(1) as f64;
        let obstacles = Samples::of(stage.obstacles(), camera, TRIAL_WIDTH, height);
        let nearer = obstacles.inverse_depth.iter().zip(&seen.inverse_depth).filter(|(a, b)| a > b).count();
        value += OBSTACLE * (nearer as f64 / seen.triangle.len() as f64).min(0.1);
    }
    value
}

/// What is to be in the picture, first what matters most.
struct Corners {
    all: Vec<Point>,
    n_that_matter: usize,
}

/// A camera that looks along `toward` and shows all corners; where the object would be too small, those that matter, and
/// where it still would be, the object in the middle.
fn framed(
    stage: &Stage,
    frames: &[KeyFrame],
    corners: &Corners,
    toward: &Vector,
    width: usize,
    height: usize,
) -> Camera {
    let middle = frames.iter().map(|frame| stage.object_center_at(frame).coords).sum::<Vector>();
    let middle = Point::from(middle / frames.len() as f64);
    let size = stage.object_radius;
    let focal = FOCAL * width as f64;
    let half = [width as f64 / 2.0, height as f64 / 2.0];
    let room = half.map(|h| 2.0 * h * (1.0 - 2.0 * BORDER));
    let farthest = focal * 2.0 * size / (LEAST_OBJECT * height as f64);
    let looking = |distance: f64| Camera::looking(toward, &middle, distance, focal, [0.0, 0.0]);
    for shown in [&corners.all[..], &corners.all[..corners.n_that_matter]] {
        // Distances, from near to far, until all is in the picture.
        let mut distance = farthest * 0.35;
        while distance < farthest {
            let camera = looking(distance);
            let [left, top, right, bottom] = bounds(&camera, shown);
            if right - left <= room[0] && bottom - top <= room[1] {
                return Camera { center: [half[0] - (left + right) / 2.0, half[1] - (top + bottom) / 2.0], ..camera };
            }
            distance *= 1.02;
        }
    }
    // Something has to be cut.
    let camera = looking(farthest);
    let around = bounds(&camera, &corners.all[..corners.n_that_matter]);
    let most = half.map(|h| (h - 1.25 * focal * size / farthest).max(0.0));
    let shift = [0, 1].map(|k| (-(around[k] + around[k + 2]) / 2.0).clamp(-most[k], most[k]));
    Camera { center: [half[0] + shift[0], half[1] + shift[1]], ..camera }
}

/// Left, top, right and bottom of what is seen of points; without bounds where one is behind the camera.
fn bounds(camera: &Camera, points: &[Point]) -> [f64; 4] {
    let nothing = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    points.iter().map(|p| camera.see(p)).fold(nothing, |b, p| match p.depth > 0.0 {
        true => [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)],
        false => [-1e9, -1e9, 1e9, 1e9],
    })
}
