//! How freely combinations of contacts let the object go where it is wanted.

use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::moving::spin::{Twist, condition, twist_between};
use arrayvec::ArrayVec;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;

/// How freely combinations of candidates let the object go where it is wanted.
#[derive(Debug)]
pub struct Freedom {
    /// The twist wanted, of length one.
    wanted: Twist,
    /// The condition of each finger with each of its candidates; none where it has none.
    rows: Vec<Vec<Option<Twist>>>,
}

impl Freedom {
    /// On the way from `here` to `target`. None where nothing restricts the object's motion.
    pub fn towards(model: &Model, options: &[Vec<Candidate>], here: &Pose, target: &Pose) -> Option<Self> {
        let wanted = twist_between(model, here, target).try_normalize(1e-9)?;
        if !(0..model.n_fingers()).any(|finger| model.restricts_motion(finger)) {
            return None;
        }
        let placement = Placement::from(here);
        let of_finger = |(finger, candidates): (usize, &Vec<Candidate>)| {
            let of = |candidate: &Candidate| {
                let contact = candidate.contact.filter(|_| model.restricts_motion(finger))?;
                condition(model, finger, &placement, &contact, &candidate.joints)
            };
            candidates.iter().map(of).collect()
        };
        Some(Freedom { wanted, rows: options.iter().enumerate().map(of_finger).collect() })
    }

    /// Share of the twist wanted that is left with these candidates.
    pub fn share(&self, choice: &Choice) -> f64 {
        let mut across: ArrayVec<Twist, MAX_FINGERS> = ArrayVec::new();
        let mut left = self.wanted;
        for row in choice.iter().zip(&self.rows).filter_map(|(&option, rows)| rows[option]) {
            let rest = across.iter().fold(row, |rest, axis| rest - axis * axis.dot(&rest));
            if let Some(axis) = rest.try_normalize(1e-6 * row.norm()) {
                left -= axis * axis.dot(&left);
                across.push(axis);
            }
        }
        left.norm()
    }
}
