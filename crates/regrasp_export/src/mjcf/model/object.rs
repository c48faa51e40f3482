//! The object as MuJoCo collides with it: a convex shape, or convex parts of a mesh.

use regrasp_geometry::mass::solid_properties;
use regrasp_geometry::parts::{PartSettings, convex_parts};
use regrasp_geometry::{ConvexHull, Shape};
use regrasp_scene::Object;
use std::sync::Arc;

/// A mesh whose hull has this much more volume is not convex.
const CONVEX_WITHIN: f64 = 0.01;
/// How finely an object is cut. By hand: the bulb needs three parts.
const PARTS: PartSettings = PartSettings { max_parts: 16, excess: CONVEX_WITHIN };

/// What the object collides with.
pub(super) struct ObjectShape {
    /// Convex shapes in the object's frame; at least one.
    pub parts: Vec<Shape>,
    /// Where they differ from the object, if they do.
    pub note: Option<String>,
}

impl ObjectShape {
    /// Of `object`: parts of a mesh that is a closed solid and not convex, else the shape itself.
    pub fn of(object: &Object) -> Self {
        let whole =
            |note: Option<&str>| ObjectShape { parts: vec![object.shape.clone()], note: note.map(str::to_owned) };
        if !is_hollowed(&object.shape) {
            return whole(None);
        }
        let Shape::Mesh(mesh) = &object.shape else { return whole(None) };
        // Where the scene replaces the object by its hull, the planner kept links away from it.
        match convex_parts(mesh, &PARTS).filter(|_| object.hull.is_none()) {
            Some(parts) => ObjectShape {
                note: Some(format!(
                    "MuJoCo collides with {} convex parts, which exceed it by {:.1} % of its volume",
                    parts.hulls.len(),
                    100.0 * parts.excess
                )),
                parts: parts.hulls.into_iter().map(|hull| Shape::Convex(Arc::new(hull))).collect(),
            },
            None => whole(Some("MuJoCo collides with its convex hull")),
        }
    }
}

/// Names of the geoms of the parts: `object`, then `object:1` and so on.
pub(super) fn object_names(object: &ObjectShape) -> Vec<String> {
    let name = |k: usize| if k == 0 { "object".to_owned() } else { format!("object:{k}") };
    (0..object.parts.len()).map(name).collect()
}

/// True for a mesh that is not convex, or no closed solid.
pub(super) fn is_hollowed(shape: &Shape) -> bool {
    let Shape::Mesh(mesh) = shape else { return false };
    let (Ok(solid), Ok(hull)) = (solid_properties(shape), ConvexHull::new(mesh.vertices())) else { return true };
    solid_properties(&Shape::Convex(Arc::new(hull)))
        .is_ok_and(|hull| hull.volume > solid.volume * (1.0 + CONVEX_WITHIN))
}
