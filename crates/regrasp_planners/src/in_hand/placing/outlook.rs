//! A quick estimate of what a hand can do with the object at a pose: which spread contacts each fingertip reaches, and how many of
//! their sets close while one finger is away. Links may be in the way: that is asked later, of few poses.

use super::samples::ContactSamples;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::ContactModel;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;
use regrasp_robot::inspect::TipReach;
use regrasp_robot::inspect::reach::{DIRECTIONS, directions};

/// Cosine of the largest angle between a contact's outward normal and the way to the finger's last joint: beyond a right angle the
/// last link would pass through the object, but directions are only told apart by 45 degrees.
const LEAST_COSINE: f64 = -0.2;
/// Share that stands for none, so that worths of poles apart can be compared.
const NONE: f64 = 1e-5;

/// Estimates poses.
#[derive(Debug)]
pub struct Outlook<'m> {
    model: &'m Model<'m>,
    reach: &'m TipReach,
    samples: ContactSamples,
    directions: [regrasp_geometry::Vector; DIRECTIONS],
}

impl<'m> Outlook<'m> {
    /// For the object and the hand of `model`.
    pub fn new(model: &'m Model<'m>, reach: &'m TipReach, rng: &mut Rng) -> Self {
        Outlook::with(model, reach, ContactSamples::draw(model, rng))
    }

    /// The same with contacts that are known.
    pub fn with(model: &'m Model<'m>, reach: &'m TipReach, samples: ContactSamples) -> Self {
        Outlook { model, reach, samples, directions: directions() }
    }

    /// Per finger, the spread contacts that its tip reaches with the object at a pose, as bits.
    fn reached(&self, hand_from_object: &Pose) -> [u64; MAX_FINGERS] {
        let placement = Placement::from(hand_from_object);
        let mut reached = [0u64; MAX_FINGERS];
        for (bit, contact) in self.samples.contacts.iter().enumerate() {
            let normal = placement.vector(&contact.normal_in_object);
            let mut outward = 0u32;
            for (index, direction) in self.directions.iter().enumerate() {
                outward |= u32::from(direction.dot(&normal) >= LEAST_COSINE) << index;
            }
            for (f, finger) in self.model.fingers.iter().enumerate() {
                let center = finger.center_over(&placement, contact);
                let from = self.reach.directions_at(&center).map_or(0, |fingers| fingers[f]);
                reached[f] |= u64::from(from & outward != 0) << bit;
            }
        }
        reached
    }

    /// How many sets of spread contacts close while each finger is away: the geometric mean over the fingers.
    pub fn worth(&self, hand_from_object: &Pose) -> f64 {
        let reached = self.reached(hand_from_object);
        let n = self.model.n_fingers();
        let is_soft = |f: usize| matches!(self.model.fingers[f].contact, ContactModel::SoftFinger { .. });
        let mut without = [0.0; MAX_FINGERS];
        let mut whole = 0.0;
        let mut add = |fingers: &[usize], share: f64| {
            whole += share;
            (0..n).filter(|f| !fingers.contains(f)).for_each(|f| without[f] += share);
        };
        for i in 0..n {
            for j in i + 1..n {
                if is_soft(i) && is_soft(j) {
                    add(&[i, j], self.samples.share_of_pairs([reached[i], reached[j]]));
                }
                for k in j + 1..n {
                    add(&[i, j, k], self.samples.share_of_triples([reached[i], reached[j], reached[k]]));
                }
            }
        }
        match self.model.may_release {
            true => (without[..n].iter().map(|share| (share + NONE).ln()).sum::<f64>() / n as f64).exp(),
            false => whole + NONE,
        }
    }

    /// The scene, prepared.
    pub fn model(&self) -> &'m Model<'m> {
        self.model
    }

    /// The worth of no grasp at all.
    pub fn nothing(&self) -> f64 {
        NONE * 1.000_001
    }
}
