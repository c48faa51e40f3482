//! Solids as MuJoCo collides with them: a convex shape, or convex parts of a mesh.

use super::geom::{CONVEX_WITHIN, is_hollowed};
use regrasp_geometry::Shape;
use regrasp_geometry::parts::{Clear, PartSettings, Parts, convex_parts_clear_of};
use regrasp_scene::Object;
use std::sync::Arc;

/// How finely an object is cut. By hand: the bulb needs three parts.
const PARTS: PartSettings = PartSettings { max_parts: 16, excess: CONVEX_WITHIN, least_gain: 1e-3 };
/// Of objects that hands take from anywhere: parts that stand out by millimetres where a fingertip touches turn the grasp into another.
const FINE_PARTS: PartSettings = PartSettings { max_parts: 160, excess: 0.2 * CONVEX_WITHIN, least_gain: 1e-4 };
/// Of lists of grasps: what matters is where the grasps are, and that is cut on (`ObjectSolid::of_list`).
const LIST_PARTS: PartSettings = PartSettings { max_parts: 160, excess: CONVEX_WITHIN, least_gain: 1e-4 };

const HULL: &str = "MuJoCo collides with its convex hull";

/// What the object collides with.
pub(super) struct ObjectSolid {
    /// Convex shapes in the object's frame; at least one.
    pub parts: Vec<Shape>,
    /// Where they differ from the object, if they do.
    pub note: Option<String>,
}

impl ObjectSolid {
    /// Of `object`: parts of a mesh that is a closed solid and not convex, else the shape itself.
    pub fn of(object: &Object) -> Self {
        ObjectSolid::cut(object, &PARTS, &[])
    }

    /// As [`ObjectSolid::of`], cut finer, and more so where a part would cover one of the points `clear` outside of the object.
    pub fn finely(object: &Object, clear: &[Clear]) -> Self {
        ObjectSolid::cut(object, &FINE_PARTS, clear)
    }

    /// As [`ObjectSolid::finely`], where many grasps are tried and every part costs time: coarse away from the points `clear`.
    pub fn of_list(object: &Object, clear: &[Clear]) -> Self {
        ObjectSolid::cut(object, &LIST_PARTS, clear)
    }

    fn cut(object: &Object, settings: &PartSettings, clear: &[Clear]) -> Self {
        // Where the scene replaces the object by its hull, the planner kept links away from it.
        match object.hull {
            Some(_) if is_hollowed(&object.shape) => ObjectSolid::whole(&object.shape, Some(HULL)),
            _ => ObjectSolid::cut_shape(&object.shape, settings, clear),
        }
    }

    /// Of any shape.
    pub fn of_shape(shape: &Shape) -> Self {
        ObjectSolid::cut_shape(shape, &PARTS, &[])
    }

    fn cut_shape(shape: &Shape, settings: &PartSettings, clear: &[Clear]) -> Self {
        if !is_hollowed(shape) {
            return ObjectSolid::whole(shape, None);
        }
        let Shape::Mesh(mesh) = shape else { return ObjectSolid::whole(shape, None) };
        match convex_parts_clear_of(mesh, settings, clear) {
            Some(parts) => ObjectSolid {
                note: Some(note(&parts)),
                parts: parts.hulls.into_iter().map(|hull| Shape::Convex(Arc::new(hull))).collect(),
            },
            None => ObjectSolid::whole(shape, Some(HULL)),
        }
    }

    fn whole(shape: &Shape, note: Option<&str>) -> Self {
        ObjectSolid { parts: vec![shape.clone()], note: note.map(str::to_owned) }
    }
}

/// How parts differ from their solid.
fn note(parts: &Parts) -> String {
    let (n, excess) = (parts.hulls.len(), 100.0 * parts.excess);
    let left = match parts.covered {
        0 => String::new(),
        k => format!("; in {k} places they reach too near to fingertips or links"),
    };
    format!("MuJoCo collides with {n} convex parts, which exceed it by {excess:.1} % of its volume{left}")
}
