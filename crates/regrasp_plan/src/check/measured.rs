//! Fingertips that are measured once for many plans: of a mesh of 12,500 faces that takes 50 ms, as long as the rest of a check.

use crate::check::tip_surface::{Smooth, TipSurface};
use regrasp_robot::TipShape;
use regrasp_robot::tip::{HullSurface, Pad, Tip};
use std::sync::{Arc, Mutex, PoisonError};

/// Smooth fingertips that were measured before, of any hands. A tip is known again by its hull, its surface and its pad, so that no plan is
/// judged by the tips of another hand.
#[derive(Debug, Default)]
pub struct MeasuredTips {
    known: Mutex<Vec<(Option<Pad>, Arc<Smooth>)>>,
}

impl MeasuredTips {
    /// The surface of `tip`: as [`TipSurface::of`].
    pub fn surface(&self, tip: &Tip) -> TipSurface {
        let TipShape::Hull { hull, surface: HullSurface::Smooth(smooth), .. } = &tip.shape else {
            return TipSurface::of(tip);
        };
        // What is behind a lock that another thread died with is whole: entries are added in one go.
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = known.iter().find(|(pad, found)| *pad == tip.pad && found.is_of(smooth, hull)) {
            return TipSurface::Smooth(found.clone());
        }
        let measured = Arc::new(Smooth::of(smooth, hull, tip.pad.as_ref()));
        known.push((tip.pad, measured.clone()));
        TipSurface::Smooth(measured)
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
        let measured = MeasuredTips::default();
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
