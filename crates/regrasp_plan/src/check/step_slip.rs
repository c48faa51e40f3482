//! How far a contact slips in one step.

use crate::check::model::FingerModel;
use regrasp_grasp::ContactModel;

/// Slip of a finger in one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepSlip {
    /// Slide of the touching point, in metres.
    pub slide: f64,
    /// Turn about the normal of a soft fingertip times its torsion radius, in metres.
    pub twist: f64,
    /// How far the contact travels over the object, in metres.
    pub travel: f64,
}

impl StepSlip {
    /// Slide and twist together, in metres.
    pub fn slip(&self) -> f64 {
        self.slide + self.twist
    }
}

impl std::ops::AddAssign for StepSlip {
    fn add_assign(&mut self, other: Self) {
        self.slide += other.slide;
        self.twist += other.twist;
        self.travel += other.travel;
    }
}

/// The torsion radius of a soft fingertip, in metres; zero for others.
pub fn torsion_radius(finger: &FingerModel) -> f64 {
    match finger.contact {
        ContactModel::SoftFinger { torsion_radius } => torsion_radius,
        ContactModel::Point | ContactModel::Frictionless => 0.0,
    }
}
