//! Force closure with margin and certificate.
//!
//! Is the origin strictly inside the convex hull of the contact wrenches? The answer is a margin that internal forces
//! prove by substitution (see [`crate::margin`]); what is not proved is not closed.

/// Three contacts: closed form.
pub mod three;

use crate::contact::Contact;
use regrasp_geometry::{Point, Vector};

/// What closure is asked about, besides contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspFrame {
    /// Reference point of torques, in the object frame.
    pub center_of_mass: Point,
    /// Length by which torques are divided: the object's radius about its centre of mass, in metres.
    pub torque_scale: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
}

/// A proof of force closure.
#[derive(Debug, Clone, PartialEq)]
pub struct Closure {
    /// Lower bound of the Ferrari-Canny radius.
    pub margin: f64,
    /// Indices of the contacts that prove it.
    pub contacts: [usize; 3],
    /// Internal forces of those contacts, in the object frame, with normal components that sum to one.
    pub forces: [Vector; 3],
}

/// The largest margin that three of `contacts` prove; zero when no three are closed.
///
/// More contacts only enlarge the hull of wrenches, so that a margin of three is one of all (paper 000, section 3.1:
/// GS_{k+1} lies in GS_k). Sets of hard contacts of which no three are closed count as not closed: no finger of them
/// could ever be released.
pub fn closure_margin(contacts: &[Contact], frame: &GraspFrame) -> f64 {
    prove(contacts, frame).map_or(0.0, |closure| closure.margin)
}

/// The proof with the largest margin.
pub fn prove(contacts: &[Contact], frame: &GraspFrame) -> Option<Closure> {
    let n = contacts.len();
    let mut best: Option<Closure> = None;
    for i in 0..n {
        for j in i + 1..n {
            for k in j + 1..n {
                let triple = [contacts[i], contacts[j], contacts[k]];
                let Some((margin, forces)) = three::prove(&triple, frame) else { continue };
                if best.as_ref().is_none_or(|closure| margin > closure.margin) {
                    best = Some(Closure { margin, contacts: [i, j, k], forces });
                }
            }
        }
    }
    best
}
