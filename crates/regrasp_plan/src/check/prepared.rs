//! Shapes and fingertips that are prepared once for many plans. A hand whose fingertips are meshes of 12,500 faces takes 0.2 s for that, and
//! the rest of a check less.

use crate::check::tip_surface::{Smooth, TipSurface};
use regrasp_geometry::hull::HullError;
use regrasp_geometry::reference::ReferenceShape;
use regrasp_geometry::{Shape, TriangleMesh};
use regrasp_robot::TipShape;
use regrasp_robot::hand::convex_of;
use regrasp_robot::tip::{HullSurface, Pad, Tip};
use std::sync::{Arc, Mutex, PoisonError};

/// What was prepared before, of any scenes. Hulls and meshes are known again by being the very same, a fingertip also by its surface and its
/// pad, so that no plan is judged by the shapes of another scene.
#[derive(Default)]
pub struct Prepared {
    tips: Mutex<Vec<(Option<Pad>, Arc<Smooth>)>>,
    shapes: Mutex<Vec<(Shape, Arc<ReferenceShape>)>>,
    hulls: Mutex<Vec<(Arc<TriangleMesh>, Shape)>>,
}

/// Most hulls, meshes and fingertips that are kept, of each: far more than scenes have.
const MOST: usize = 2000;

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").finish_non_exhaustive()
    }
}

impl Prepared {
    /// The surface of `tip`: as [`TipSurface::of`].
    pub fn surface(&self, tip: &Tip) -> TipSurface {
        let TipShape::Hull { hull, surface: HullSurface::Smooth(smooth), .. } = &tip.shape else {
            return TipSurface::of(tip);
        };
        // What is behind a lock that another thread died with is whole: entries are added in one go.
        let mut known = self.tips.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = known.iter().find(|(pad, found)| *pad == tip.pad && found.is_of(smooth, hull)) {
            return TipSurface::Smooth(found.clone());
        }
        let measured = Arc::new(Smooth::of(smooth, hull, tip.pad.as_ref()));
        if known.len() < MOST {
            known.push((tip.pad, measured.clone()));
        }
        TipSurface::Smooth(measured)
    }

    /// The convex shape that stands for `shape` in a hand: as [`convex_of`].
    pub fn convex(&self, shape: &Shape) -> Result<Shape, HullError> {
        let Shape::Mesh(mesh) = shape else { return convex_of(shape) };
        let mut known = self.hulls.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = known.iter().find(|(known, _)| Arc::ptr_eq(known, mesh)) {
            return Ok(found.clone());
        }
        let hull = convex_of(shape)?;
        if known.len() < MOST {
            known.push((mesh.clone(), hull.clone()));
        }
        Ok(hull)
    }

    /// `shape`, ready to be asked for distances. Err with a message when it cannot be used for queries.
    pub fn shape(&self, shape: &Shape) -> Result<Arc<ReferenceShape>, String> {
        let is_it = |known: &Shape| match (known, shape) {
            (Shape::Convex(known), Shape::Convex(asked)) => Arc::ptr_eq(known, asked),
            (Shape::Mesh(known), Shape::Mesh(asked)) => Arc::ptr_eq(known, asked),
            _ => false,
        };
        let mut known = self.shapes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = known.iter().find(|(known, _)| is_it(known)) {
            return Ok(found.clone());
        }
        let prepared = Arc::new(ReferenceShape::new(shape).map_err(|error| error.to_string())?);
        // Others take no time.
        if matches!(shape, Shape::Convex(_) | Shape::Mesh(_)) && known.len() < MOST {
            known.push((shape.clone(), prepared.clone()));
        }
        Ok(prepared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::{ConvexHull, Point, Vector};
    use regrasp_robot::tip::smooth_hull::SmoothHull;
    use regrasp_robot::{ContactModel, LinkId};

    fn hull(length: f64) -> Arc<ConvexHull> {
        let corner = |k: u32, bit: u32, half: f64| if k & (1 << bit) == 0 { -half } else { half };
        let corners: Vec<Point> =
            (0..8).map(|k| Point::new(corner(k, 0, 0.01), corner(k, 1, 0.008), corner(k, 2, length))).collect();
        ConvexHull::new(&corners).unwrap().into()
    }

    fn tip(hull: &Arc<ConvexHull>, surface: &Arc<SmoothHull>, pad: Option<Pad>) -> Tip {
        let surface = HullSurface::Smooth(surface.clone());
        Tip {
            link: LinkId(0),
            shape: TipShape::Hull { hull: hull.clone(), surface, misfit: 0.0, elements: Vec::new() },
            center_in_body: Point::origin(),
            pad,
            contact: ContactModel::Point,
        }
    }

    #[test]
    fn shapes_are_prepared_once_and_never_mistaken() {
        let [short, long, same_again] = [0.012, 0.02, 0.012].map(|length| Shape::Convex(hull(length)));
        let ball = Shape::Sphere { radius: 0.01 };
        let prepared = Prepared::default();
        let of = |shape: &Shape| prepared.shape(shape).unwrap();
        let shapes = [&short, &long, &same_again, &ball];
        let first = shapes.map(of);
        for (k, shape) in shapes.into_iter().enumerate() {
            assert_eq!(Arc::ptr_eq(&of(shape), &first[k]), k < 3);
            assert!(first[..k].iter().all(|other| !Arc::ptr_eq(other, &first[k])), "{k}");
        }
    }

    #[test]
    fn hulls_of_meshes_are_made_once() {
        let corners = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]].map(Point::from);
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = || Shape::Mesh(TriangleMesh::new(corners.to_vec(), faces.to_vec()).unwrap().into());
        let (one, other) = (mesh(), mesh());
        let prepared = Prepared::default();
        let of = |shape: &Shape| match prepared.convex(shape).unwrap() {
            Shape::Convex(hull) => hull,
            other => panic!("{other:?}"),
        };
        let hulls = [of(&one), of(&other), of(&one)];
        assert!(Arc::ptr_eq(&hulls[0], &hulls[2]) && !Arc::ptr_eq(&hulls[0], &hulls[1]));
        assert_eq!(Shape::Convex(hulls[0].clone()), convex_of(&one).unwrap());
    }

    #[test]
    fn tips_are_measured_once_and_never_mistaken() {
        let pad = Pad { axis_in_body: Vector::z_axis(), cosine: 0.5 };
        let (short, long) = (hull(0.012), hull(0.02));
        let same_again = hull(0.012);
        let [near_short, near_long] = [&short, &long].map(|hull| Arc::new(SmoothHull::near(hull, None).unwrap().0));
        let tips = [
            tip(&short, &near_short, None),
            tip(&long, &near_long, None),
            tip(&short, &near_short, Some(pad)),
            tip(&same_again, &near_short, None),
            tip(&short, &near_long, None),
        ];
        let measured = Prepared::default();
        let of = |tip: &Tip| match measured.surface(tip) {
            TipSurface::Smooth(smooth) => smooth,
            other => panic!("{other:?}"),
        };
        let first: Vec<Arc<Smooth>> = tips.iter().map(of).collect();
        for (k, (tip, found)) in tips.iter().zip(&first).enumerate() {
            assert!(Arc::ptr_eq(&of(tip), found), "{k}");
            assert!(first[..k].iter().all(|other| !Arc::ptr_eq(other, found)), "{k}");
            assert_eq!(format!("{:?}", TipSurface::of(tip)), format!("{:?}", TipSurface::Smooth(found.clone())), "{k}");
        }
    }
}
