//! What links look like. For pictures only: nothing here is an error or a note, and no mesh file is opened.

use super::geometry::{SHAPES, read_origin, read_primitive};
use crate::import::resolve::{ResolveOptions, resolve};
use crate::import::xml::{Reader, child, children};
use crate::robot::{Visual, VisualGeometry, VisualMesh};
use regrasp_base::diagnostic::Lines;
use regrasp_base::{Diagnostic, InputError, Place, files};
use regrasp_geometry::{TriangleMesh, Vector};
use roxmltree::Node;
use std::path::Path;

/// The visual elements of the link at `node` of the robot file `model`.
pub(super) fn read_visuals(model: &Path, lines: &Lines, node: Node, link: &str) -> Vec<Visual> {
    children(node, "visual").filter_map(|visual| read_visual(model, lines, visual, link)).collect()
}

/// None for an element without a pose or a geometry that could be placed.
fn read_visual(model: &Path, lines: &Lines, visual: Node, link: &str) -> Option<Visual> {
    let element = ("link", link);
    // What is found wrong here stays here.
    let mut reader = Reader::new(model, lines, true);
    let parent_from_visual = read_origin(&mut reader, visual, element)?;
    let geometry = child(visual, "geometry")?;
    let known = geometry.children().find(|c| c.is_element() && SHAPES.contains(&c.tag_name().name()));
    let unreadable = || VisualGeometry::Unreadable("visual geometry that is not understood".into());
    let geometry = match known {
        Some(node) if node.has_tag_name("mesh") => read_mesh(&mut reader, model, node, link),
        Some(node) => read_primitive(&mut reader, node, element).map(VisualGeometry::Shape),
        None => None,
    };
    Some(Visual { parent_from_visual, geometry: geometry.unwrap_or_else(unreadable) })
}

fn read_mesh(reader: &mut Reader, model: &Path, node: Node, link: &str) -> Option<VisualGeometry> {
    let scale = Vector::from(reader.numbers(node, "scale", Some([1.0; 3]), ("link", link))?);
    let name = node.attribute("filename")?.to_owned();
    let is_usable = scale.iter().all(|factor| *factor != 0.0);
    is_usable.then(|| VisualGeometry::Mesh(VisualMesh { name, model: model.to_owned(), scale }))
}

impl VisualMesh {
    /// Reads the file, looked for as collision meshes are, and scales it.
    ///
    /// Errors: not found or not allowed (`U10x`), not readable (`F00x`, `M2xx`), no mesh left by the scale (`U152`).
    pub fn load(&self, options: &ResolveOptions) -> Result<TriangleMesh, InputError> {
        let place = Place::file(&self.model);
        let found = resolve(&self.name, &self.model, place.clone(), options)?;
        let mesh = regrasp_geometry::import::read_mesh(&found.path, &files::read(&found.path)?)?;
        mesh.scaled(self.scale).map_err(|error| {
            let problem = format!("\"{}\" cannot be scaled by {:?}: {error}", self.name, self.scale);
            Diagnostic::new("U152", place, problem).into()
        })
    }
}
