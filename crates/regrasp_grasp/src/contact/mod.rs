//! Contacts of fingertips on the object, and what they transmit.
//!
//! One file per contact model, with the same functions: `depth` of a force in its cone, `support` of the cone.

/// Point with Coulomb friction: the exact second-order cone.
pub mod friction_cone;
/// Frictionless point.
pub mod frictionless;
/// Contacts that roll, slide and twist: modes, Montana's equations, polyhedra.
pub mod kinematics;
/// Balls that roll on surfaces.
pub mod rolling;
/// Ellipsoids, and other curved tips that are no balls, that roll.
pub mod rolling_ellipsoid;
/// Soft finger with elliptic torsion.
pub mod soft_finger;

pub use regrasp_robot::ContactModel;

use regrasp_geometry::{Point, UnitVector, Vector};

/// A contact on the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Where, in the object frame.
    pub point_in_object: Point,
    /// Outward normal of the object there, in the object frame.
    pub normal_in_object: UnitVector,
}

/// A contact with what its fingertip transmits there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Where.
    pub contact: Contact,
    /// What.
    pub model: ContactModel,
}

/// What a fingertip exerts on the object, in the object frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce {
    /// Force, in newtons.
    pub force: Vector,
    /// Moment about the outward normal, in newton metres.
    pub torsion: f64,
}

/// A contact force in the coordinates of its cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Components {
    /// Along the inward normal.
    pub normal: f64,
    /// Across the normal.
    pub tangential: Vector,
    /// Moment about the normal over the torsion radius: newtons, as the others.
    pub torsion: f64,
}

/// What a unit of each of [`Components`] counts for.
pub type Directions = Components;

impl Grip {
    /// The model with this friction coefficient: without friction a fingertip only pushes.
    #[inline]
    pub fn model_at(&self, friction: f64) -> ContactModel {
        if friction > 0.0 { self.model } else { ContactModel::Frictionless }
    }

    /// The torsion radius, in metres; zero for points.
    #[inline]
    pub fn torsion_radius(&self) -> f64 {
        match self.model {
            ContactModel::SoftFinger { torsion_radius } => torsion_radius,
            ContactModel::Frictionless | ContactModel::Point => 0.0,
        }
    }

    /// Coordinates of `exerted`; what the model cannot transmit is left out.
    pub fn components(&self, exerted: &ContactForce, friction: f64) -> Components {
        let normal = friction_cone::normal_force(&exerted.force, &self.contact.normal_in_object);
        let tangential = exerted.force + self.contact.normal_in_object.into_inner() * normal;
        match self.model_at(friction) {
            ContactModel::Frictionless => Components { normal, tangential: Vector::zeros(), torsion: 0.0 },
            ContactModel::Point => Components { normal, tangential, torsion: 0.0 },
            ContactModel::SoftFinger { torsion_radius } => {
                Components { normal, tangential, torsion: exerted.torsion / torsion_radius }
            }
        }
    }

    /// The force with these coordinates.
    pub fn force(&self, components: &Components) -> ContactForce {
        ContactForce {
            force: components.tangential - self.contact.normal_in_object.into_inner() * components.normal,
            torsion: components.torsion * self.torsion_radius(),
        }
    }

    /// Distance of a force from the boundary of its cone, positive inside.
    pub fn depth(&self, components: &Components, friction: f64) -> f64 {
        match self.model_at(friction) {
            ContactModel::Frictionless => frictionless::depth(components),
            // Without torsion the two cones are the same.
            ContactModel::Point | ContactModel::SoftFinger { .. } => soft_finger::depth(components, friction),
        }
    }

    /// Largest value of `pull . force + twist * moment about the outward normal` over what the fingertip can exert with
    /// a normal force of one.
    pub fn support(&self, pull: &Vector, twist: f64, friction: f64) -> f64 {
        let normal = friction_cone::normal_force(pull, &self.contact.normal_in_object);
        let tangential = pull + self.contact.normal_in_object.into_inner() * normal;
        let directions = Directions { normal, tangential, torsion: twist * self.torsion_radius() };
        match self.model_at(friction) {
            ContactModel::Frictionless => frictionless::support(&directions),
            ContactModel::Point | ContactModel::SoftFinger { .. } => soft_finger::support(&directions, friction),
        }
    }
}
