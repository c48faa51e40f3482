//! Why attempts failed: counted on the way, told when no plan is found.

use crate::in_hand::attempt::release::Held;
use regrasp_geometry::Pose;
use regrasp_manipulation::failure::Cause;
use regrasp_manipulation::forces::limits::Unbalanced;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::{Model, Pair};
use regrasp_manipulation::workspace::tried::Tried;

/// A reason for which an attempt of the search failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// No contact was found that a finger reaches, clear of object, palm and obstacles.
    NoContact(usize),
    /// The contacts found make no closed grasp with a finger that may let go.
    NotClosed,
    /// The same where the object is only to be held, so that no finger needs to let go.
    NotHeld,
    /// A closed grasp was found, but the fingers find no free way to it in any order.
    NoWayOver,
    /// A closed grasp was found and some finger may move to it, but then no order remains in which the others always hold the object.
    NoOrder,
    /// A closed grasp was found that this finger has to leave its contact for, but the others do not hold without it.
    Bound(usize),
    /// A transfer stopped at once: a finger reaches no farther.
    OutOfReach,
    /// A transfer stopped at once: this pair of bodies was too near.
    TooNear(Pair),
    /// Between two grasps a contact would have to cross an edge of the object.
    Crease,
    /// A transfer stopped short of the goal: soft fingertips would have to turn about their contacts' normals.
    WouldTurn,
    /// There are no contact forces that balance the weight.
    NoForces(Unbalanced),
    /// A path in GS_n could not be cut into transfers and regrasps.
    NotDecomposed,
}

/// Grasps looked at in which a finger holds, and what the others would do without it.
#[derive(Debug, Clone, Default)]
struct Release {
    seen: Held,
    /// Pose of the object where the margin of the others was largest.
    best_at: Option<Pose>,
}

impl Release {
    fn add(&mut self, seen: &Held, at: Option<Pose>) {
        if seen.n_grasps > 0 && (self.best_at.is_none() || seen.best > self.seen.best) {
            self.best_at = at;
        }
        self.seen.add(seen);
    }
}

/// Share of all failures from which on what is behind them is worth a change of the task.
pub const OFTEN: f64 = 1.0 / 3.0;

/// Joints that are named at most.
const MOST_NAMED: usize = 4;

/// Counts per reason.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    counts: std::collections::BTreeMap<Reason, u64>,
    releases: [Release; MAX_FINGERS],
    /// The smallest turn about a contact normal for want of which a transfer stopped short of the goal, in radians.
    least_turn: Option<f64>,
    /// What was in the way of contacts.
    pub tried: Tried,
}

impl Tally {
    /// One more failure for `reason`.
    pub fn add(&mut self, reason: Reason) {
        *self.counts.entry(reason).or_default() += 1;
    }

    /// So many more failures for `reason`.
    pub fn add_many(&mut self, reason: Reason, count: u64) {
        *self.counts.entry(reason).or_default() += count;
    }

    /// How many failures there were for `reason`.
    pub fn count(&self, reason: Reason) -> u64 {
        self.counts.get(&reason).copied().unwrap_or(0)
    }

    /// The joints that are too weak to hold the object, in words, those that fail most often first; None unless they are [`OFTEN`] the
    /// cause.
    pub fn weak_joints(&self, model: &Model) -> Option<String> {
        let mut weak: Vec<(u64, usize, usize)> = Vec::new();
        for (reason, &count) in &self.counts {
            if let Reason::NoForces(Unbalanced::TooWeak(finger, joint)) = *reason {
                weak.push((count, finger, joint));
            }
        }
        weak.sort_by_key(|&(count, finger, joint)| (std::cmp::Reverse(count), finger, joint));
        let n_weak: u64 = weak.iter().map(|(count, ..)| count).sum();
        let total: u64 = self.counts.values().sum();
        let &(_, finger, joint) = weak.first().filter(|_| n_weak as f64 >= OFTEN * total as f64)?;
        let names: Vec<String> = weak
            .iter()
            .take(MOST_NAMED)
            .map(|&(_, finger, joint)| format!("\"{}\"", model.view.hand.fingers[finger].chain.names[joint]))
            .collect();
        Some(format!(
            "{}; the effort limits in the URDF say how strong joints are: {}",
            Unbalanced::TooWeak(finger, joint).in_words(model),
            names.join(", ")
        ))
    }

    /// One more transfer that stopped short of the goal because fingertips would have to turn by `turn` about a contact normal.
    pub fn note_turn(&mut self, turn: f64) {
        self.add(Reason::WouldTurn);
        self.least_turn = Some(self.least_turn.map_or(turn, |least| least.min(turn)));
    }

    /// What was seen of letting `finger` go.
    pub fn release(&self, finger: usize) -> &Held {
        &self.releases[finger].seen
    }

    /// Adds another tally.
    pub fn merge(&mut self, other: &Tally) {
        for (&reason, count) in &other.counts {
            *self.counts.entry(reason).or_default() += count;
        }
        self.least_turn = [self.least_turn, other.least_turn].into_iter().flatten().min_by(f64::total_cmp);
        self.tried.merge(&other.tried);
        for (release, more) in self.releases.iter_mut().zip(&other.releases) {
            release.add(&more.seen, more.best_at);
        }
    }

    /// Takes note of the grasps that were looked at with the object at `world_from_object`.
    pub fn note_releases(&mut self, seen: &[Held], world_from_object: &Pose) {
        for (release, seen) in self.releases.iter_mut().zip(seen) {
            release.add(seen, Some(*world_from_object));
        }
    }

    /// The fingers that could let go nowhere, in words; None where every finger could somewhere, or none was asked about.
    pub fn bound_fingers(&self, model: &Model) -> Option<String> {
        let required = model.settings.closure_margin;
        let bound: Vec<String> = (0..model.n_fingers())
            .filter_map(|finger| {
                let Release { seen, best_at } = &self.releases[finger];
                let at = best_at.as_ref().filter(|_| seen.n_held == 0)?;
                let (name, p) = (&model.view.hand.fingers[finger].name, at.translation.vector);
                Some(format!(
                    "\"{name}\" (the others hold in none of {} closed grasps; nearest: margin {:.4} of {required}, with \
                     the object at [{:.4}, {:.4}, {:.4}] m, turned by {:.1} degrees)",
                    seen.n_grasps,
                    seen.best,
                    p.x,
                    p.y,
                    p.z,
                    at.rotation.angle().to_degrees()
                ))
            })
            .collect();
        (!bound.is_empty()).then(|| format!("fingers that can never lift: {}", bound.join(", ")))
    }

    /// The causes in words, commonest first.
    pub fn causes(&self, model: &Model) -> Vec<Cause> {
        let total: u64 = self.counts.values().sum();
        let finger_name = |f: usize| model.view.hand.fingers[f].name.as_str();
        let mut causes: Vec<Cause> = self
            .counts
            .iter()
            .map(|(&reason, &count)| Cause {
                reason: match reason {
                    Reason::NoContact(f) => format!("finger \"{}\" found no contact within its reach", finger_name(f)),
                    Reason::NotClosed => "found no grasp that still holds the object after one finger lifts".into(),
                    Reason::NotHeld => "found no grasp that holds the object".into(),
                    Reason::NoWayOver => "found no collision-free path for the fingers to the next grasp".into(),
                    Reason::NoOrder => {
                        "found no order of moving the fingers in which the others always hold the object".into()
                    }
                    Reason::Bound(f) => {
                        format!(
                            "finger \"{}\" cannot lift: the other fingers would not hold the object",
                            finger_name(f)
                        )
                    }
                    Reason::OutOfReach => "a finger reached the end of its workspace while the object moved".into(),
                    Reason::Crease => "a contact would have to cross an edge of the object".into(),
                    Reason::WouldTurn => format!(
                        "soft fingertips would have to turn about their contact normals, by {:.2} degrees at least",
                        self.least_turn.unwrap_or(0.0).to_degrees()
                    ),
                    Reason::NoForces(unbalanced) => unbalanced.in_words(model),
                    Reason::NotDecomposed => {
                        "a path in GS_n could not be decomposed into transfers and regrasps".into()
                    }
                    Reason::TooNear(pair) => {
                        format!(
                            "\"{}\" comes too close to \"{}\"",
                            model.bodies[pair.a].name, model.bodies[pair.b].name
                        )
                    }
                },
                count,
                share: count as f64 / total as f64,
            })
            .collect();
        causes.sort_by_key(|cause| std::cmp::Reverse(cause.count));
        causes
    }

    /// Counts by reason, without names of bodies: for statistics.
    pub fn counts(&self) -> std::collections::BTreeMap<String, u64> {
        let mut counts = std::collections::BTreeMap::new();
        for (reason, count) in &self.counts {
            let key = match reason {
                Reason::NoContact(_) => "no_contact",
                Reason::NotClosed => "not_closed",
                Reason::NotHeld => "not_held",
                Reason::NoWayOver => "no_way_over",
                Reason::NoOrder => "no_order",
                Reason::Bound(_) => "not_released",
                Reason::OutOfReach => "out_of_reach",
                Reason::TooNear(_) => "too_near",
                Reason::Crease => "crease",
                Reason::WouldTurn => "would_turn",
                Reason::NoForces(_) => "no_forces",
                Reason::NotDecomposed => "not_decomposed",
            };
            *counts.entry(key.to_owned()).or_default() += count;
        }
        counts
    }
}
