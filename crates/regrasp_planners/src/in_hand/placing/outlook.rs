//! A quick estimate of what a hand can do with the object at a pose: which spread contacts each fingertip reaches, and how many of
//! their sets close while one finger is away. Links may be in the way: that is asked later, of few poses.

use super::samples::ContactSamples;
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::ContactModel;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::{FingerModel, Model};
use regrasp_robot::inspect::TipReach;
use regrasp_robot::inspect::reach::{DIRECTIONS, directions};

/// Cosine of the largest angle between a contact's outward normal and the way to the finger's last joint: beyond a right angle the
/// last link would pass through the object, but directions are only told apart by 45 degrees.
const LEAST_COSINE: f64 = -0.2;
/// Share that stands for none, so that worths of poles apart can be compared.
const NONE: f64 = 1e-5;

/// Facets along each edge of a cube whose faces tell normals apart: by 5 degrees.
const FACETS: usize = 24;

/// Which facet of the cube the direction goes through.
fn facet_of(direction: &Vector) -> usize {
    let axis = direction.iamax();
    let side = usize::from(direction[axis] < 0.0);
    let along = |axis: usize, largest: f64| {
        let share = 0.5 + 0.5 * direction[axis] / largest;
        ((share * FACETS as f64) as usize).min(FACETS - 1)
    };
    let largest = direction[axis].abs().max(f64::MIN_POSITIVE);
    let (u, v) = (along((axis + 1) % 3, largest), along((axis + 2) % 3, largest));
    ((2 * axis + side) * FACETS + u) * FACETS + v
}

/// The directions through the middles of all facets, in order.
fn facets() -> impl Iterator<Item = Vector> {
    let middle = |k: usize| 2.0 * (k as f64 + 0.5) / FACETS as f64 - 1.0;
    (0..6 * FACETS * FACETS).map(move |facet| {
        let (face, u, v) = (facet / (FACETS * FACETS), facet / FACETS % FACETS, facet % FACETS);
        let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let mut direction = Vector::zeros();
        direction[axis] = sign;
        direction[(axis + 1) % 3] = middle(u);
        direction[(axis + 2) % 3] = middle(v);
        direction.normalize()
    })
}

/// Estimates poses.
#[derive(Debug)]
pub struct Outlook<'m> {
    model: &'m Model<'m>,
    reach: &'m TipReach,
    samples: ContactSamples,
    directions: [Vector; DIRECTIONS],
    /// Of fingers whose tip is no ball: from its centre to the point that touches, with the link as at rest, by [`facet_of`] the normal.
    arms: ArrayVec<Option<Vec<Vector>>, MAX_FINGERS>,
}

impl<'m> Outlook<'m> {
    /// For the object and the hand of `model`.
    pub fn new(model: &'m Model<'m>, reach: &'m TipReach, rng: &mut Rng) -> Self {
        Outlook::with(model, reach, ContactSamples::draw(model, rng))
    }

    /// The same with contacts that are known.
    pub fn with(model: &'m Model<'m>, reach: &'m TipReach, samples: ContactSamples) -> Self {
        let arms_of = |finger: &FingerModel| -> Vec<Vector> {
            facets().map(|normal| finger.arm(&finger.link_at_rest, &normal)).collect()
        };
        let arms = model.fingers.iter().map(|finger| finger.curved.map(|_| arms_of(finger))).collect();
        Outlook { model, reach, samples, directions: directions(), arms }
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
                let center = match &self.arms[f] {
                    None => finger.center_over(&placement, contact),
                    // To look the arm up is enough for the voxels of the reach.
                    Some(arms) => placement.point(&contact.point_in_object) - arms[facet_of(&normal)],
                };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_facet_is_where_its_middle_is_and_near_all_that_goes_through_it() {
        let middles: Vec<Vector> = facets().collect();
        for (facet, middle) in middles.iter().enumerate() {
            assert_eq!(facet_of(middle), facet);
        }
        let mut rng = Rng::keyed(1, "facets", 0);
        let farthest = (0..10_000).map(|_| {
            let direction = Vector::from(rng.direction());
            direction.angle(&middles[facet_of(&direction)])
        });
        assert!(farthest.fold(0.0, f64::max) < 3.5f64.to_radians());
    }
}
