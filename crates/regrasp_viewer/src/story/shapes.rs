//! Shapes of a scene as packed meshes, each once.

use super::pack::pack;
use super::simplify::simplify;
use super::tessellate::{Triangles, tessellate};
use regrasp_geometry::Shape;
use regrasp_robot::hand::convex_of;
use regrasp_robot::{ResolveOptions, VisualGeometry};
use std::sync::Arc;

/// Most triangles in a page, each mesh counted once: less than 3 MB of text.
const MOST_TRIANGLES: usize = 120_000;

/// Shapes, each once.
#[derive(Default)]
pub(crate) struct Shapes {
    shapes: Vec<Shape>,
    /// Shapes of links and the index of the hull of each.
    hulls: Vec<(Shape, usize)>,
}

impl Shapes {
    /// The index of `shape`.
    pub(crate) fn index_of(&mut self, shape: &Shape) -> usize {
        self.shapes.iter().position(|known| known == shape).unwrap_or_else(|| {
            self.shapes.push(shape.clone());
            self.shapes.len() - 1
        })
    }

    /// The convex shape that stands for `shape` in the hand.
    pub(crate) fn hull_of(&mut self, shape: &Shape) -> usize {
        if let Some((_, index)) = self.hulls.iter().find(|(known, _)| known == shape) {
            return *index;
        }
        // A mesh without a hull is refused when a hand is loaded; links that belong to no hand may have one.
        let hull = convex_of(shape).unwrap_or_else(|_| shape.clone());
        let index = self.index_of(&hull);
        self.hulls.push((shape.clone(), index));
        index
    }

    /// The mesh of what something looks like.
    pub(crate) fn visual(&mut self, geometry: &VisualGeometry, packages: &ResolveOptions) -> Result<usize, String> {
        let shape = match geometry {
            VisualGeometry::Shape(shape) => shape.clone(),
            VisualGeometry::Unreadable(problem) => return Err(problem.clone()),
            VisualGeometry::Mesh(mesh) => {
                let read = mesh.load(packages).map_err(|error| {
                    let problem = error.diagnostics.first().map_or_else(String::new, |first| first.problem.clone());
                    format!("{}: {problem}", mesh.name)
                });
                Shape::Mesh(Arc::new(read?))
            }
        };
        Ok(self.index_of(&shape))
    }

    /// All of them as packed meshes of no more than [`MOST_TRIANGLES`] in all; a remark when some have fewer than they had.
    pub(crate) fn packed(&self, notes: &mut Vec<(String, String)>) -> Vec<super::MeshStory> {
        let drawn: Vec<Triangles> = self.shapes.iter().map(tessellate).collect();
        let sizes: Vec<usize> = drawn.iter().map(|triangles| triangles.triangles.len()).collect();
        let most = most_each(&sizes, MOST_TRIANGLES);
        let n_cut = sizes.iter().filter(|&&size| size > most).count();
        if n_cut > 0 {
            let total: usize = sizes.iter().sum();
            let value = format!("{n_cut} of {} drawn with at most {most} triangles; {total} in the files", sizes.len());
            notes.push(("Meshes".into(), value));
        }
        let packed = |triangles| {
            let Triangles { vertices, triangles, smooth_below } = simplify(triangles, most);
            pack(&vertices, &triangles, smooth_below)
        };
        drawn.into_iter().map(packed).collect()
    }
}

/// The largest size that every mesh may have so that all together have at most `total`.
fn most_each(sizes: &[usize], total: usize) -> usize {
    let mut sorted = sizes.to_vec();
    sorted.sort_unstable();
    let mut left = total;
    for (i, &size) in sorted.iter().enumerate() {
        let each = left / (sorted.len() - i);
        if size > each {
            return each;
        }
        left -= size;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_meshes_are_cut_first() {
        assert_eq!(most_each(&[], 10), 10);
        assert_eq!(most_each(&[3, 4], 10), 10);
        assert_eq!(most_each(&[3, 40], 10), 7);
        assert_eq!(most_each(&[3, 40, 50], 11), 4);
    }
}
