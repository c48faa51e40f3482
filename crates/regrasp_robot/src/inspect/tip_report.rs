//! How well a fingertip of a hand file is what the collision geometry of its link is.
//!
//! Nothing of the link may stand out of the declared surface where the tip may touch: it would hit the object first.

use crate::hand::{Finger, Hand};
use crate::tip::{HullSurface, TipShape};
use regrasp_geometry::collision::support::support_value;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use serde::Serialize;

/// Where a tip without a pad is compared with its link: within this angle of the line from the last joint to its centre.
const FRONT: f64 = std::f64::consts::FRAC_PI_3;
/// What stands out by less is left to the surface, in metres: half of what fingertips may press in.
pub const NEGLIGIBLE: f64 = 0.15e-3;

/// A tip and the link that carries it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TipReport {
    /// The surface that touches: `ball`, `ellipsoid`, `smooth hull` or `point`.
    pub surface: &'static str,
    /// Largest distance of the surface from the collision geometry where the tip may touch, in metres; none for sharp tips and
    /// links without geometry.
    pub error: Option<f64>,
    /// Collision geometry that stands out of the surface there by more than [`NEGLIGIBLE`].
    pub stands_out: Vec<StandsOut>,
}

/// A `<collision>` element that stands out of the declared surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StandsOut {
    /// Its index on the tip link, from 0.
    pub element: usize,
    /// How many of its faces do; one for round shapes.
    pub n_faces: usize,
    /// How far it does at most, in metres.
    pub by: f64,
    /// The point that is farthest out, in the frame of the tip link, in metres.
    pub at: [f64; 3],
}

/// A declared tip as it is compared with its link, in the frame of the link.
struct Declared<'a> {
    shape: &'a TipShape,
    center: Point,
    link_from_body: Pose,
    axis: Vector,
    cosine: f64,
}

impl Declared<'_> {
    fn of<'a>(hand: &Hand, finger: &'a Finger) -> Declared<'a> {
        let tip = &finger.tip;
        let link_from_body = hand.robot.fixed_pose_in_body(tip.link).inverse();
        let ahead = tip.center_in_body.coords.try_normalize(1e-9);
        let (axis, cosine) = match (&tip.pad, ahead) {
            (Some(pad), _) => (pad.axis_in_body.into_inner(), pad.cosine),
            (None, Some(ahead)) => (ahead, FRONT.cos()),
            (None, None) => (Vector::z(), -1.0),
        };
        Declared {
            shape: &tip.shape,
            center: link_from_body * tip.center_in_body,
            axis: link_from_body * axis,
            link_from_body,
            cosine,
        }
    }

    /// How far the surface reaches from the centre towards `n`; none for sharp tips.
    fn reach(&self, n: &Vector) -> Option<f64> {
        match self.shape {
            TipShape::Point => None,
            TipShape::Sphere { radius } => Some(*radius),
            TipShape::Ellipsoid(ellipsoid) | TipShape::Hull { surface: HullSurface::Ellipsoid(ellipsoid), .. } => {
                let n = self.link_from_body.inverse() * n;
                Some(ellipsoid.arm(&n).dot(&n))
            }
            TipShape::Hull { surface: HullSurface::Smooth(surface), .. } => {
                Some(surface.support(&(self.link_from_body.inverse() * n)))
            }
        }
    }

    /// How far `point` stands out where the tip may touch; negative or none where it does not.
    fn out(&self, point: &Point) -> Option<f64> {
        let way = point - self.center;
        // Outside a convex surface there is a direction in which the point reaches farther. Steps uphill find it.
        let mut n = way.try_normalize(1e-9)?;
        let mut best = way.dot(&n) - self.reach(&n)?;
        let mut step = 0.3;
        while step > 1e-3 {
            let aside = if n.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
            let x = n.cross(&aside).normalize();
            let y = n.cross(&x);
            let tried = [x, -x, y, -y].map(|t| (n + t * step).normalize());
            let better = tried.into_iter().filter_map(|m| Some((way.dot(&m) - self.reach(&m)?, m)));
            match better.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(out, _)| *out > best) {
                Some((out, m)) => (best, n) = (out, m),
                None => step *= 0.5,
            }
        }
        (n.dot(&self.axis) >= self.cosine).then_some(best)
    }
}

/// Compares the tip of `finger` with the collision geometry of its link.
pub fn tip_report(hand: &Hand, finger: &Finger) -> TipReport {
    let declared = Declared::of(hand, finger);
    let surface = match &finger.tip.shape {
        TipShape::Point => "point",
        TipShape::Sphere { .. } => "ball",
        TipShape::Ellipsoid(_) | TipShape::Hull { surface: HullSurface::Ellipsoid(_), .. } => "ellipsoid",
        TipShape::Hull { surface: HullSurface::Smooth(_), .. } => "smooth hull",
    };
    let mut report = TipReport { surface, error: None, stands_out: Vec::new() };
    if let TipShape::Point = finger.tip.shape {
        return report;
    }
    let elements = &hand.robot.links[finger.tip.link.0].collision;
    let is_tip = |element: &usize| match &finger.tip.shape {
        TipShape::Hull { elements, .. } => elements.is_empty() || elements.contains(element),
        _ => false,
    };
    for (element, placed) in elements.iter().enumerate().filter(|(element, _)| !is_tip(element)) {
        let (points, faces) = surface_of(&placed.shape);
        let out: Vec<f64> = points
            .iter()
            .map(|point| declared.out(&(placed.parent_from_shape * point)).unwrap_or(f64::NEG_INFINITY))
            .collect();
        let Some(farthest) = (0..points.len()).max_by(|&a, &b| out[a].total_cmp(&out[b])) else { continue };
        if out[farthest] > NEGLIGIBLE {
            let stands = |face: &&[u32; 3]| face.iter().any(|&corner| out[corner as usize] > NEGLIGIBLE);
            report.stands_out.push(StandsOut {
                element,
                n_faces: faces.iter().filter(stands).count().max(1),
                by: out[farthest],
                at: (placed.parent_from_shape * points[farthest]).coords.into(),
            });
        }
    }
    report.error = match &finger.tip.shape {
        TipShape::Hull { misfit, .. } => Some(*misfit),
        _ => difference(&declared, elements),
    };
    report
}

/// Largest difference of the support functions of the link and its tip, where the tip may touch.
fn difference(declared: &Declared, elements: &[PlacedShape]) -> Option<f64> {
    let reach = |n: &Vector| {
        elements
            .iter()
            .map(|placed| {
                let own = placed.parent_from_shape.rotation.inverse() * n;
                let at = placed.parent_from_shape.translation.vector - declared.center.coords;
                at.dot(n) + support_value(&placed.shape, &own, &mut 0)
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let within = crate::tip::spiral(2000).filter(|n| n.dot(&declared.axis) >= declared.cosine);
    let differences = within.filter_map(|n| Some((reach(&n) - declared.reach(&n)?).abs()));
    differences.reduce(f64::max).filter(|largest| largest.is_finite())
}

/// Points that say where a shape ends, and its faces; round shapes have points only.
fn surface_of(shape: &Shape) -> (Vec<Point>, Vec<[u32; 3]>) {
    match shape {
        Shape::Mesh(mesh) => (mesh.vertices().to_vec(), mesh.triangles().to_vec()),
        Shape::Convex(hull) => (hull.vertices().to_vec(), hull.triangles().to_vec()),
        Shape::Cuboid { half_extents: h } => {
            let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corners = (0..8).map(|k| Point::new(sign(k, 0) * h.x, sign(k, 1) * h.y, sign(k, 2) * h.z)).collect();
            let faces = [
                [0, 1, 3],
                [0, 3, 2],
                [4, 5, 7],
                [4, 7, 6],
                [0, 1, 5],
                [0, 5, 4],
                [2, 3, 7],
                [2, 7, 6],
                [0, 2, 6],
                [0, 6, 4],
                [1, 3, 7],
                [1, 7, 5],
            ];
            (corners, faces.to_vec())
        }
        shape => (crate::import::hull_tip::corners_of(shape), Vec::new()),
    }
}
