//! Convex shapes of links.

use crate::hand::convex_of;
use crate::robot::{LinkId, Robot};
use regrasp_base::diagnostic::Diagnostics;
use regrasp_base::{Diagnostic, Place};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, TriangleMesh};
use std::path::Path;
use std::sync::Arc;

/// Convex collision shapes of links; each mesh gets its hull once.
pub(super) struct Hulls<'a> {
    robot: &'a Robot,
    file: &'a Path,
    made: Vec<(Arc<TriangleMesh>, Shape)>,
}

impl<'a> Hulls<'a> {
    pub(super) fn new(robot: &'a Robot, file: &'a Path) -> Self {
        Hulls { robot, file, made: Vec::new() }
    }

    /// The shapes of `link`, placed in the frame that `body_from_link` leads to.
    pub(super) fn of_link(&mut self, link: LinkId, body_from_link: &Pose, found: &mut Diagnostics) -> Vec<PlacedShape> {
        let robot = self.robot;
        let link = &robot.links[link.0];
        let mut placed = Vec::new();
        for collision in &link.collision {
            match self.convex(&collision.shape) {
                Ok(shape) => {
                    placed.push(PlacedShape { parent_from_shape: body_from_link * collision.parent_from_shape, shape });
                }
                Err(error) => found.push(
                    Diagnostic::new("U210", Place::file(self.file), format!("a collision mesh has no hull: {error}"))
                        .element("link", &link.name)
                        .expected("a mesh that encloses a volume"),
                ),
            }
        }
        placed
    }

    fn convex(&mut self, shape: &Shape) -> Result<Shape, regrasp_geometry::hull::HullError> {
        let Shape::Mesh(mesh) = shape else { return convex_of(shape) };
        if let Some((_, hull)) = self.made.iter().find(|(known, _)| Arc::ptr_eq(known, mesh)) {
            return Ok(hull.clone());
        }
        let hull = convex_of(shape)?;
        self.made.push((mesh.clone(), hull.clone()));
        Ok(hull)
    }
}
