//! The object that is manipulated.

use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::surface::SurfacePoint;
use regrasp_geometry::{Point, Shape, Surface};

/// Share of `edge_distance` that contacts of an observed start keep from creases at least: fingertips that slipped are where they are. By hand.
pub const OBSERVED_EDGE_SHARE: f64 = 0.25;

/// A rigid object. Its frame is the frame of its shape.
#[derive(Debug, Clone)]
pub struct Object {
    /// Name.
    pub name: String,
    /// Its shape: contacts lie on the surface of this one.
    pub shape: Shape,
    /// Its convex hull, where all but the fingertips keep away from that (`solid = "hull"`).
    pub hull: Option<Shape>,
    /// Largest distance of a point of the object from its centre of mass, in metres: the torque scale of grasp quality.
    pub radius: f64,
    /// For a mesh, what collision tests ask of it.
    pub mesh_body: Option<MeshBody>,
    /// The surface that fingertips touch.
    pub surface: Surface,
    /// Mass, in kilograms.
    pub mass: f64,
    /// Centre of mass, in the object frame.
    pub center_of_mass: Point,
    /// Coulomb friction coefficient between fingertips and object.
    pub friction: f64,
    /// Contacts keep this distance from creases of the surface, in metres.
    pub edge_distance: f64,
    /// Edges of a mesh that fold by more than this are creases, in radians.
    pub crease_angle: f64,
}

impl Object {
    /// What all but the fingertips keep away from: the shape, or its hull.
    pub fn solid(&self) -> &Shape {
        self.hull.as_ref().unwrap_or(&self.shape)
    }

    /// True when a contact at `at` keeps its distance from creases.
    #[inline]
    pub fn keeps_off_edges(&self, at: &SurfacePoint) -> bool {
        self.keeps_farther_off_edges(at, 0.0)
    }

    /// The same with `margin` more, in metres; contacts that may lie on edges may all the same.
    #[inline]
    pub fn keeps_farther_off_edges(&self, at: &SurfacePoint, margin: f64) -> bool {
        self.edge_distance <= 0.0 || self.surface.crease_distance(at) >= self.edge_distance + margin
    }

    /// True where a contact of an observed start may lie: off creases by a share of the distance ([`OBSERVED_EDGE_SHARE`]).
    pub fn may_start_at(&self, at: &SurfacePoint) -> bool {
        self.surface.crease_distance(at) >= self.least_observed_edge_distance()
    }

    /// What contacts of an observed start keep from creases at least, in metres.
    pub fn least_observed_edge_distance(&self) -> f64 {
        OBSERVED_EDGE_SHARE * self.edge_distance
    }
}
