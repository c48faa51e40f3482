//! What is wrong with a tracking query is said before any search.

use crate::tracking::forces::{Choice, Forces};
use crate::tracking::grasp::TrackingGrasp;
use crate::tracking::range::RESTING;
use crate::tracking::settings::TrackingSettings;
use crate::tracking::start_grasp::choose_start;
use crate::tracking::step::Stepper;
use nalgebra::center;
use regrasp_geometry::hull::ConvexHull;
use regrasp_geometry::surface::Surface;
use regrasp_geometry::{Point, Shape, TriangleMesh};
use regrasp_manipulation::ends::blocked::refuse_buried_object;
use regrasp_manipulation::ends::end::End;
use regrasp_manipulation::ends::given_grasp::{Near, given_grasp_at};
use regrasp_manipulation::ends::inside::{refuse_hand_inside, refuse_palm_overlap};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::model::{Model, friction_in_words};
use regrasp_scene::{Gravity, TrackingQuery};
use std::sync::Arc;

/// A mesh may be this far inside its convex hull, as a share of the object's radius: corners that are rounded in the file dent flat
/// faces of several triangles. In metres some 0.03 mm on an object for a hand: a third of what fingertips may be off the surface.
const FLAT: f64 = 1e-3;

fn impossible(message: String, advice: &str) -> Failure {
    Failure::bare(FailureKind::Impossible, message, advice)
}

/// Refuses hands, objects and gravity that tracking is not made for (Cherif 1999, sec. 3.1: convex objects, fingertips that
/// are balls; at least two of them rest; section 8: three fingertips or more).
pub fn refuse(model: &Model, gravity: &Gravity) -> Result<(), Failure> {
    let object = &model.view.object;
    let n = model.n_fingers();
    if n < 3 {
        let message = format!("the hand has {n} fingers: tracking moves one and rests at least two");
        return Err(impossible(message, "use a hand of three fingers or more"));
    }
    let names = model.view.hand.fingers.iter().map(|finger| finger.name.as_str());
    if let Some((name, _)) = names.zip(&model.fingers).find(|(_, f)| f.tip_radius == 0.0 || f.curved.is_some()) {
        let message = format!("the tip of finger \"{name}\" is no ball: tracking rolls balls");
        return Err(impossible(message, "give the tip shape = \"sphere\" in the hand file"));
    }
    if let Shape::Mesh(mesh) = &object.shape
        && let Some(depth) = dent(mesh, FLAT * object.radius)
    {
        let message = format!("the object \"{}\" is not convex: it has a dent of {:.2} mm", object.name, 1e3 * depth);
        return Err(impossible(message, "give a convex mesh file, or turn it with an in_hand task"));
    }
    if matches!(gravity, Gravity::Any) {
        let message =
            "tracking needs the direction of gravity: forces of fingertips that slide depend on it".to_owned();
        return Err(impossible(message, "give gravity a direction"));
    }
    Ok(())
}

/// Refuses ranges of orientations (Cherif 1999, sec. 4) with a hand of which two fingers rest: they leave the object's position open.
pub fn refuse_ranges_of_few(model: &Model, settings: &TrackingSettings) -> Result<(), Failure> {
    let n = model.n_fingers();
    if !settings.range_coverage || n > RESTING {
        return Ok(());
    }
    let message = format!("range_coverage is for three fingers that rest, and of the hand's {n} fingers two rest");
    Err(impossible(message, "leave range_coverage out, or use a hand of four fingers or more"))
}

/// How far vertices and middles of edges of the mesh are inside its convex hull at most, where that is more than `allowed`, in metres;
/// how far vertices are in front of a triangle, where no hull was found. That is never less, and more where triangles are small: with less
/// than `allowed` there is no dent, and no hull is made. Hulls of many corners are a little too large.
fn dent(mesh: &TriangleMesh, allowed: f64) -> Option<f64> {
    let in_front = in_front(mesh, allowed)?;
    let hull = ConvexHull::new(mesh.vertices()).ok().map(|hull| Surface::of(&Shape::Convex(Arc::new(hull))));
    let Some(Ok(hull)) = hull else { return Some(in_front) };
    let depth = |point: &Point| -hull.signed_distance(point);
    let corners = mesh.vertices().iter().map(depth);
    let sides = mesh.triangles().iter().flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|(a, b)| a < b);
    let middles = sides.map(|(a, b)| depth(&center(&mesh.vertices()[*a as usize], &mesh.vertices()[*b as usize])));
    let deepest = corners.chain(middles).fold(0.0, f64::max);
    (deepest > allowed).then_some(deepest)
}

/// How far the first vertex that is more than `allowed` in front of the plane of a triangle is there, in metres.
fn in_front(mesh: &TriangleMesh, allowed: f64) -> Option<f64> {
    mesh.triangles().iter().find_map(|triangle| {
        let [a, b, c] = triangle.map(|index| mesh.vertices()[index as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-300)?;
        mesh.vertices().iter().map(|vertex| normal.dot(&(vertex - a))).find(|distance| *distance > allowed)
    })
}

/// The grasp at the start, and forces that hold it; one of the planner's choice by `seed` where none is given.
///
/// Errors: it collides, is out of reach, or holds nothing; none is given and none was found.
pub fn start(stepper: &Stepper, query: &TrackingQuery, seed: u64) -> Result<(TrackingGrasp, Forces), Failure> {
    let model = stepper.model;
    let pose = &query.world_from_object_start;
    refuse_buried_object(model, End::Start, pose)?;
    refuse_palm_overlap(model)?;
    refuse_hand_inside(model, pose)?;
    let invalid = |message: String, advice: &str| Failure::bare(FailureKind::StartInvalid, message, advice);
    let Some(state) = given_grasp_at(model, End::Start, pose, &query.start_grasp, Near::Rest)? else {
        return choose_start(stepper, pose, seed, 0).ok_or_else(|| {
            let message = "no grasp was found at the start that closes and whose forces balance the weight".to_owned();
            invalid(message, "move the start to where the fingers reach, or give [start] grasp = { contacts = ... }")
        });
    };
    if !state.is_held_by_all() {
        let message = "in tracking every finger holds, and the start has a free one".to_owned();
        return Err(invalid(message, "leave \"free\" out of the start's grasp"));
    }
    let grasp = TrackingGrasp::of(model, &state)
        .ok_or_else(|| invalid("a fingertip's centre is inside the object at the start".into(), "move it out"))?;
    let Ok(forces) = stepper.balanced_at_rest(&grasp, Choice::Best) else {
        let [least, largest] =
            stepper.settings.in_hand.physics.forces.map_or([0.0, f64::MAX], |forces| forces.normal_force);
        let message = format!(
            "at the start no contact forces balance the weight: friction {}, normal forces from {least} N to {largest} N",
            friction_in_words(model)
        );
        return Err(invalid(message, "choose other contacts, or allow larger forces"));
    };
    Ok((grasp, forces))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dents_are_told_from_flat_faces() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.3, 0.3, 0.3]];
        let vertices: Vec<Point> = corners.iter().map(|corner| Point::from(*corner)).collect();
        let whole =
            TriangleMesh::new(vertices[..4].to_vec(), vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        assert_eq!(dent(&whole, 1e-9), None);
        // The last corner lies below the large face, which it replaces by three.
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]];
        let dented = TriangleMesh::new(vertices, faces).unwrap();
        assert!(dent(&dented, 1e-9).unwrap() > 0.05);
    }
}
