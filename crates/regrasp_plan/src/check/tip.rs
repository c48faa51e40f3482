//! With which point a fingertip touches, and whether it may.

use crate::check::model::FingerModel;
use crate::check::tip_surface::TipSurface;
use crate::plan::Waypoint;
use nalgebra::Matrix3;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_robot::tip::Pad;

/// Where the tip's outward normal may miss the pad, in radians: rounding.
const PAD_TOLERANCE: f64 = 1e-9;

impl FingerModel {
    /// The point of the tip that has this outward normal, a unit vector; both in the frame of the last moving body.
    pub fn point_facing(&self, outward: &Vector) -> Point {
        match &self.surface {
            TipSurface::Ball => self.center + outward * self.radius,
            // On the unit sphere that the ellipsoid is the image of, normals transform by the inverse transpose.
            TipSurface::Ellipsoid { radii, link_from_axes, .. } => {
                let on_sphere = radii.component_mul(&link_from_axes.tr_mul(outward)).normalize();
                self.center + link_from_axes * radii.component_mul(&on_sphere)
            }
            TipSurface::Smooth(smooth) => self.center + smooth.point(outward),
        }
    }

    /// Radius of the ball, or largest half axis of the ellipsoid, or of a ball inside the smooth hull.
    pub fn ball_radius(&self) -> f64 {
        match &self.surface {
            TipSurface::Smooth(smooth) => smooth.inner_radius(),
            TipSurface::Ball | TipSurface::Ellipsoid { .. } => self.radius,
        }
    }

    /// The point of the tip that faces the outward normal `normal` of the object, both in the world.
    pub fn touching_in_world(&self, joints: &[f64], normal: &Vector) -> Point {
        match &self.surface {
            TipSurface::Ball => self.center_in_world(joints) - normal * self.radius,
            TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => {
                let link = self.path.world_from_link(joints);
                link.transform_point(&self.point_facing(&-link.fixed_view::<3, 3>(0, 0).tr_mul(normal)))
            }
        }
    }

    /// From a contact with the outward normal `normal` to the centre of the tip that touches there with the link as it stands at
    /// `waypoint`, both in the object frame.
    pub fn center_from_contact(&self, waypoint: &Waypoint, normal: &Vector) -> Vector {
        match &self.surface {
            TipSurface::Ball => normal * self.radius,
            TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => {
                let pose = Pose::from(&waypoint.world_from_object);
                let touching = self.touching_in_world(&waypoint.joints, &(pose * normal));
                pose.inverse() * (self.center_in_world(&waypoint.joints) - touching)
            }
        }
    }

    /// How far the hull that the surface stands for reaches beyond it (or less far) towards the outward normal `normal` of
    /// the object, in the world; zero for tips that are no hulls.
    pub fn misfit(&self, joints: &[f64], normal: &Vector) -> f64 {
        let hull = match &self.surface {
            TipSurface::Ball | TipSurface::Ellipsoid { hull: None, .. } => return 0.0,
            TipSurface::Ellipsoid { hull: Some(hull), .. } => Some(hull),
            TipSurface::Smooth(_) => None,
        };
        let link = self.path.world_from_link(joints);
        let outward = -link.fixed_view::<3, 3>(0, 0).tr_mul(normal);
        let hull = match (&self.surface, hull) {
            (_, Some(hull)) => hull,
            (TipSurface::Smooth(smooth), None) => return smooth.misfit(&outward),
            _ => return 0.0,
        };
        let farthest = hull.vertices().iter().map(|p| p.coords.dot(&outward)).fold(f64::NEG_INFINITY, f64::max);
        (farthest - (self.point_facing(&outward) - self.center).dot(&outward)).abs()
    }

    /// Angle between the tip's outward normal towards the outward normal `normal` of the object, in the world, and the pad's
    /// axis, and the largest allowed, in radians; none when the tip may touch anywhere, or the angle is allowed.
    pub fn off_pad(&self, joints: &[f64], normal: &Vector) -> Option<(f64, f64)> {
        let link = self.path.world_from_link(joints);
        self.faces_off_pad(&-link.fixed_view::<3, 3>(0, 0).tr_mul(normal))
    }

    /// The same for the tip's outward normal where it touches, in the frame of the last moving body.
    pub fn faces_off_pad(&self, outward: &Vector) -> Option<(f64, f64)> {
        let Pad { axis_in_body, cosine } = self.pad.as_ref()?;
        let (angle, allowed) = (outward.angle(axis_in_body), cosine.clamp(-1.0, 1.0).acos());
        (angle > allowed + PAD_TOLERANCE).then_some((angle, allowed))
    }

    /// The tip's own surface about its centre, and its rotation in the frame of the last moving body; none for sharp tips, and
    /// for hulls, which are the link's collision geometry.
    pub fn own_shape(&self) -> Option<(Shape, Matrix3<f64>)> {
        match &self.surface {
            TipSurface::Ball if self.radius > 0.0 => Some((Shape::Sphere { radius: self.radius }, Matrix3::identity())),
            TipSurface::Ellipsoid { radii, link_from_axes, hull: None } => {
                Some((Shape::Ellipsoid { radii: *radii }, *link_from_axes))
            }
            TipSurface::Ball | TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => None,
        }
    }
}
