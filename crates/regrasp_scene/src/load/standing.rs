//! Whether an object stands where a task of pick and place says: on a support, by itself, and in nothing else.

use super::motion::Bodies;
use crate::object::Object;
use crate::scene::Obstacle;
use nalgebra::{UnitQuaternion, Vector2};
use regrasp_base::Diagnostic;
use regrasp_base::toml_table::Found;
use regrasp_geometry::reference::{Clearance, ReferenceShape, distance};
use regrasp_geometry::stable::{Standing, convex_polygon, stable_poses, standing_along};
use regrasp_geometry::{Point, Pose, Shape, UnitVector, Vector};
use std::ops::Range;

/// Objects stand this near to the top of their support, in metres.
const NEAR: f64 = 1e-4;
/// The centre of mass is at least this far inside what touches, in metres: as the checker asks.
const LEAST_INSIDE: f64 = 2e-3;
/// Stable poses that tip over at a smaller angle are not offered, in radians.
const LEAST_TIPPING: f64 = 0.02;
/// Tops may be inclined by this much, in radians.
const FLAT: f64 = 1e-4;
/// Vertices of a polyhedron this much below the highest one belong to the top, in metres.
const LEVEL: f64 = 1e-5;
/// Corners of the polygon that stands for a rim.
const RIM: usize = 180;

/// What an object of a task may stand on, and in what it may not be.
pub(super) struct Ground<'a> {
    bodies: &'a Bodies<'a>,
    object: usize,
    set_down: bool,
    /// Against gravity; none where that has no direction.
    up: Option<Vector>,
}

/// The level top of a support.
struct Top {
    height: f64,
    polygon: Vec<Vector2<f64>>,
}

impl<'a> Ground<'a> {
    /// Of an object of the scene. With `set_down`, poses in which it does not stand are moved to the nearest in which it does.
    pub(super) fn of(bodies: &'a Bodies<'a>, object: usize, set_down: bool) -> Self {
        let up = bodies.gravity.in_world().map(|gravity| -gravity.normalize());
        Ground { bodies, object, set_down, up }
    }

    fn object(&self) -> &'a Object {
        &self.bodies.objects[self.object].0
    }

    /// The pose in which the object stands: `pose`, or the nearest stable one with `set_down`, with a note.
    ///
    /// Errors: it does not stand there (`P306`); it is in an obstacle, a support or another object (`P307`).
    pub(super) fn stand(&self, which: &str, pose: &Pose, span: &Range<usize>, found: &mut Found) -> Option<Pose> {
        let name = &self.object().name;
        let fail = |found: &mut Found, code: &'static str, problem: String, expected: &str, fix: String| {
            let place = found.place(span);
            let diagnostic = Diagnostic::new(code, place, problem).element("object", name);
            found.diagnostics.push(diagnostic.expected(expected).fix(fix));
            None
        };
        let Some(up) = self.up else {
            let problem = format!("stands nowhere at the {which}: gravity has no direction");
            let expected = "gravity of one direction in a scene of pick and place";
            return fail(found, "P306", problem, expected, "remove gravity = \"any\"".into());
        };
        let tops: Vec<Top> = self.bodies.supports.iter().filter_map(|support| Top::of(&support.body, &up)).collect();
        let expected =
            "a pose in which it stands on a support within 0.1 mm, its centre of mass 2 mm inside what touches";
        let mut stands = *pose;
        if !self.is_standing(pose, &up, &tops) {
            if self.any_pose(pose, &up).is_none() {
                let problem = format!("has no pose in which it stands by itself (at the {which}): it rolls");
                return fail(found, "P306", problem, expected, "choose an object that stands".into());
            }
            match self.nearest(pose, &up, &tops) {
                // Planners say so as the reason of a failure, before any search.
                None => {
                    let note =
                        format!("object \"{name}\" stands on no support at the {which}: no level top is below it");
                    found.note(span, note);
                }
                Some(nearest) => {
                    let text = as_text(&nearest);
                    let off = (nearest.translation.vector - pose.translation.vector).norm();
                    let turn = nearest.rotation.angle_to(&pose.rotation).to_degrees();
                    if !self.set_down {
                        let problem = format!(
                            "does not stand at the {which}: the nearest stable pose is {:.2} mm and {turn:.3} degrees away",
                            1e3 * off
                        );
                        let fix = format!("paste {text}, or add set_down = true to the task");
                        return fail(found, "P306", problem, expected, fix);
                    }
                    found.note(span, format!("object \"{name}\" is set down at the {which}: {text}"));
                    stands = nearest;
                }
            }
        }
        if let Some(other) = self.inside_of(&stands) {
            let problem = format!("is in \"{other}\" at the {which}");
            let expected = "a place where it touches nothing but the top of its support";
            return fail(found, "P307", problem, expected, "move one of the two".into());
        }
        Some(stands)
    }

    fn is_standing(&self, pose: &Pose, up: &Vector, tops: &[Top]) -> bool {
        let object = self.object();
        let down = pose.rotation.inverse() * -up;
        let Some(standing) = standing_along(&object.shape, &object.center_of_mass, &down) else { return false };
        let level = level_of(&standing, pose, up);
        let center = pose * object.center_of_mass;
        let is_below = |top: &&Top| top.is_below(&center, up) && (level - top.height).abs() <= NEAR;
        standing.margin(&object.center_of_mass) >= LEAST_INSIDE && tops.iter().any(|top| is_below(&top))
    }

    /// The stable pose whose direction of gravity is nearest, turned about the centre of mass.
    fn any_pose(&self, pose: &Pose, up: &Vector) -> Option<(Standing, Pose)> {
        let object = self.object();
        let down = pose.rotation.inverse() * -up;
        let poses = stable_poses(&object.shape, &object.center_of_mass, LEAST_TIPPING);
        let steady = poses.into_iter().filter(|one| one.margin(&object.center_of_mass) >= LEAST_INSIDE);
        let standing = steady.max_by(|a, b| a.down.dot(&down).total_cmp(&b.down.dot(&down)))?;
        let turn = UnitQuaternion::rotation_between(&(pose.rotation * standing.down), &-up)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&across(up), std::f64::consts::PI));
        let rotation = turn * pose.rotation;
        let center = pose * object.center_of_mass;
        let translation = center.coords - rotation * object.center_of_mass.coords;
        Some((standing, Pose::from_parts(translation.into(), rotation)))
    }

    /// That pose, moved up or down to the nearest top below the centre of mass.
    fn nearest(&self, pose: &Pose, up: &Vector, tops: &[Top]) -> Option<Pose> {
        let (standing, turned) = self.any_pose(pose, up)?;
        let level = level_of(&standing, &turned, up);
        let center = turned * self.object().center_of_mass;
        let below = tops.iter().filter(|top| top.is_below(&center, up));
        let top = below.min_by(|a, b| (a.height - level).abs().total_cmp(&(b.height - level).abs()))?;
        let shift = up * (top.height - level);
        Some(Pose::from_parts((turned.translation.vector + shift).into(), turned.rotation))
    }

    /// What the object is in: an obstacle, another object, or a support by more than 0.1 mm.
    fn inside_of(&self, pose: &Pose) -> Option<String> {
        let own = ReferenceShape::new(self.object().solid()).ok()?;
        let (center, radius) = self.object().solid().bounding_sphere();
        let meets = |shape: &Shape, at: &Pose, least: f64| {
            let (other, reach) = shape.bounding_sphere();
            if (at * other - pose * center).norm() > radius + reach {
                return false;
            }
            let Ok(other) = ReferenceShape::new(shape) else { return true };
            match distance(&own, pose, &other, at, 1e-3) {
                Clearance::SeparatedBy(_) => false,
                Clearance::Penetrating(depth) => depth > least,
                Clearance::Unresolved => true,
            }
        };
        let obstacles = self.bodies.obstacles.iter().map(|body| (body, 0.0));
        let supports = self.bodies.supports.iter().map(|support| (&support.body, NEAR));
        let fixed = obstacles.chain(supports);
        let of_body = |(body, least): (&Obstacle, f64)| {
            meets(&body.placed.shape, &body.placed.parent_from_shape, least).then(|| body.name.clone())
        };
        let others = self.bodies.objects.iter().enumerate().filter(|(index, _)| *index != self.object);
        let of_object =
            |(_, (object, at)): (usize, &(Object, Pose))| meets(object.solid(), at, 0.0).then(|| object.name.clone());
        fixed.filter_map(of_body).next().or_else(|| others.filter_map(of_object).next())
    }
}

/// How high the plane is on which an object stands that has this pose.
fn level_of(standing: &Standing, pose: &Pose, up: &Vector) -> f64 {
    pose.translation.vector.dot(up) - standing.height
}

/// Some axis across a direction.
fn across(direction: &Vector) -> UnitVector {
    regrasp_geometry::frame::tangents(&UnitVector::new_unchecked(*direction)).0
}

/// A pose as keys of a scene file.
fn as_text(pose: &Pose) -> String {
    let list = |values: &[f64]| values.iter().map(|value| rounded(*value)).collect::<Vec<_>>().join(", ");
    let q = pose.rotation.coords * if pose.rotation.w < 0.0 { -1.0 } else { 1.0 };
    let (position, rotation) = (list(pose.translation.vector.as_slice()), list(q.as_slice()));
    format!("position = [{position}], quat_xyzw = [{rotation}]")
}

fn rounded(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

impl Top {
    /// None where the support has no level top.
    fn of(body: &Obstacle, up: &Vector) -> Option<Self> {
        let pose = &body.placed.parent_from_shape;
        let points: Vec<Point> = match &body.placed.shape {
            Shape::Cuboid { half_extents: h } => {
                let ends = (0..3).flat_map(|k| [(k, 1.0), (k, -1.0)]);
                let (k, side) = ends.into_iter().find(|(k, side)| (pose * Vector::ith(*k, *side)).angle(up) <= FLAT)?;
                let corner = |m: u8| Point::from(Vector::from_fn(|i, _| if m >> i & 1 == 1 { h[i] } else { -h[i] }));
                (0..8).map(corner).filter(|p| p[k] * side > 0.0).map(|p| pose * p).collect()
            }
            Shape::Cylinder { half_length, radius } => {
                let side = [1.0, -1.0].into_iter().find(|side| (pose * (Vector::z() * *side)).angle(up) <= FLAT)?;
                let rim = |k: usize| {
                    let (sine, cosine) = (std::f64::consts::TAU * k as f64 / RIM as f64).sin_cos();
                    pose * Point::new(radius * cosine, radius * sine, side * half_length)
                };
                (0..RIM).map(rim).collect()
            }
            Shape::Convex(hull) => hull.vertices().iter().map(|p| pose * p).collect(),
            Shape::Mesh(mesh) => mesh.vertices().iter().map(|p| pose * p).collect(),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => return None,
        };
        let height = points.iter().map(|p| p.coords.dot(up)).fold(f64::NEG_INFINITY, f64::max);
        let is_polyhedron = matches!(body.placed.shape, Shape::Convex(_) | Shape::Mesh(_));
        let high = points.iter().filter(|p| !is_polyhedron || p.coords.dot(up) >= height - LEVEL);
        let polygon = convex_polygon(high.map(|p| flat(p, up)).collect());
        (polygon.len() >= 3).then_some(Top { height, polygon })
    }

    /// True where a point is over the top.
    fn is_below(&self, point: &Point, up: &Vector) -> bool {
        let point = flat(point, up);
        let n = self.polygon.len();
        (0..n).all(|k| (self.polygon[(k + 1) % n] - self.polygon[k]).perp(&(point - self.polygon[k])) >= 0.0)
    }
}

fn flat(point: &Point, up: &Vector) -> Vector2<f64> {
    let (x, y) = regrasp_geometry::frame::tangents(&UnitVector::new_unchecked(*up));
    Vector2::new(point.coords.dot(&x), point.coords.dot(&y))
}
