//! Force closure with margin and certificate.
//!
//! Is the origin strictly inside the convex hull of the contact wrenches? The answer is a margin that internal forces
//! prove by substitution (see [`crate::margin`]), or a direction in which the contacts do little or no work; what is not
//! proved is not closed.

/// Any number of contacts of any models.
pub mod general;
/// Three point contacts with friction: closed form.
pub mod three;

use crate::contact::{ContactForce, ContactModel, Grip};
use regrasp_geometry::Point;

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
    pub contacts: Vec<usize>,
    /// Internal forces of those contacts, of any common scale.
    pub forces: Vec<ContactForce>,
}

/// A proof that the Ferrari-Canny radius is at most `support`; with a `support` of zero or less, that the grasp is not
/// closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Direction of wrenches (force; torque over the torque scale), of unit length.
    pub direction: [f64; 6],
    /// Largest work along it of contact forces whose normal components sum to one.
    pub support: f64,
}

/// What was found out.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Closed with a margin.
    Closed(Closure),
    /// Not proved to be closed, with the best direction found to the contrary.
    NotProved(Separation),
}

impl Verdict {
    /// The margin proved; zero where none is.
    pub fn margin(&self) -> f64 {
        match self {
            Verdict::Closed(closure) => closure.margin,
            Verdict::NotProved(_) => 0.0,
        }
    }
}

/// False for contacts that cannot be closed wherever they are: they have fewer than seven force coordinates, so that
/// forces that balance would span less than the six dimensions of wrenches. True says nothing.
pub fn may_close(models: &[ContactModel], friction: f64) -> bool {
    let width = |model: &ContactModel| match model {
        ContactModel::Point if friction > 0.0 => 3,
        ContactModel::SoftFinger { .. } if friction > 0.0 => 4,
        _ => 1,
    };
    models.iter().map(width).sum::<usize>() >= 7
}

/// The margin of [`prove`]; zero when closure is not proved. Of three points with friction it is that of [`three`].
pub fn closure_margin(grips: &[Grip], frame: &GraspFrame, enough: f64) -> f64 {
    match grips {
        [a, b, c] if grips.iter().all(|grip| grip.model == ContactModel::Point) => {
            three::prove(&[a.contact, b.contact, c.contact], frame).map_or(0.0, |(margin, _)| margin)
        }
        _ => prove(grips, frame, enough).margin(),
    }
}

/// The proof with the largest margin of pairs with a soft finger and of triples as points; where that is below `enough`,
/// of all contacts together as well. Above `enough` no margin is followed further up.
///
/// More contacts only enlarge the hull of wrenches, and so does torsion: a margin of some is one of all (Saut 2011,
/// sec. 3.1: GS_{k+1} lies in GS_k).
pub fn prove(grips: &[Grip], frame: &GraspFrame, enough: f64) -> Verdict {
    match prove_by_few(grips, frame, enough) {
        Some(few) if few.margin >= enough => Verdict::Closed(few),
        Some(few) => match general::prove(grips, frame, enough) {
            Verdict::Closed(all) if all.margin > few.margin => Verdict::Closed(all),
            _ => Verdict::Closed(few),
        },
        None => general::prove(grips, frame, enough),
    }
}

/// The proof with the largest margin of two or three contacts out of more.
fn prove_by_few(grips: &[Grip], frame: &GraspFrame, enough: f64) -> Option<Closure> {
    let mut best: Option<Closure> = None;
    let mut offer = |margin: f64, contacts: &[usize], forces: &[ContactForce]| {
        if best.as_ref().is_none_or(|known| margin > known.margin) {
            best = Some(Closure { margin, contacts: contacts.to_vec(), forces: forces.to_vec() });
        }
    };
    let n = grips.len();
    let is_soft = |i: usize| matches!(grips[i].model, ContactModel::SoftFinger { .. });
    let rubs = |i: usize| grips[i].model_at(frame.friction) != ContactModel::Frictionless;
    // Of two contacts the pair is all.
    for (i, j) in (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).filter(|_| n > 2) {
        // One torsion is enough: about the line of the two nothing else turns.
        if !(rubs(i) && rubs(j) && (is_soft(i) || is_soft(j))) {
            continue;
        }
        if let Verdict::Closed(pair) = general::prove(&[grips[i], grips[j]], frame, enough) {
            offer(pair.margin, &[i, j], &pair.forces);
        }
    }
    for i in (0..n).filter(|&i| rubs(i)) {
        for j in (i + 1..n).filter(|&j| rubs(j)) {
            for k in (j + 1..n).filter(|&k| rubs(k)) {
                let triple = [i, j, k].map(|f| grips[f].contact);
                if let Some((margin, forces)) = three::prove(&triple, frame) {
                    offer(margin, &[i, j, k], &forces.map(|force| ContactForce { force, torsion: 0.0 }));
                }
            }
        }
    }
    best
}
