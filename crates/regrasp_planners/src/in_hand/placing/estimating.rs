//! Many poses, estimated: those worth a look.

use super::Tried;
use super::outlook::Outlook;
use super::proposals::Proposals;
use regrasp_base::Rng;
use regrasp_geometry::{Pose, frame, interpolate_pose};
use regrasp_manipulation::ends::blocked::object_blocked_by;
use regrasp_manipulation::model::Model;
use regrasp_scene::{HandView, InHandQuery};

/// Poses drawn at first.
const DRAWN: usize = 6_000;
/// Rounds in which poses are drawn near the best ones, how many of these there are, and how many are drawn near each.
const ROUNDS: (usize, usize, usize) = (3, 24, 40);
/// Poses that are looked at with all links: those that look best, and others spread over those that look worse by at most this
/// factor. By measurement on an Allegro hand, of those the estimate says little.
const LOOKED_AT: (usize, usize) = (24, 24);
const WORSE: f64 = 0.2;
/// Poses count as different from this distance on, in metres, with angles weighed by the object's radius.
const APART: f64 = 0.006;

/// Poses that are estimated.
pub struct Estimated {
    /// Those that are worth a look, best first: apart from each other, and with the object clear of palm and obstacles.
    pub best: Vec<(f64, Pose)>,
    /// Those drawn at first that are not hopeless, best first.
    drawn: Vec<(f64, Pose)>,
}

/// What is asked of a place.
pub struct Turns<'a> {
    pub view: &'a HandView<'a>,
    pub queries: &'a [InHandQuery],
}

impl Turns<'_> {
    /// Orientation at the start in the hand's frame, where the queries give it.
    pub fn rotation(&self) -> Option<nalgebra::UnitQuaternion<f64>> {
        let given = self.queries.iter().find_map(|query| query.open_start.as_ref()?.rotation)?;
        let in_world = Pose::from_parts(nalgebra::Translation3::identity(), given);
        Some(self.view.hand_from(&in_world).rotation)
    }

    /// True with the object clear of palm and obstacles at `start` and on its way.
    pub fn is_clear(&self, model: &Model, start: &Pose) -> bool {
        let is_clear = |pose: &Pose| object_blocked_by(model, pose).is_none();
        is_clear(start) && self.others(start).iter().all(is_clear)
    }

    /// Poses that the object passes after it starts at `start`, half way of every leg and at its end; all in the hand's frame.
    pub fn others(&self, start: &Pose) -> Vec<Pose> {
        let mut others = Vec::new();
        for query in self.queries {
            let poses = query.started_at(&self.view.world_from(start)).poses();
            for leg in poses.windows(2).filter(|leg| leg[0] != leg[1]) {
                others.push(self.view.hand_from(&interpolate_pose(&leg[0], &leg[1], 0.5)));
                others.push(self.view.hand_from(&leg[1]));
            }
        }
        others
    }
}

/// What the estimate says of `start`, a pose of the object in the hand's frame: the least of all poses on the way.
fn estimate(asked: &Turns, outlook: &Outlook, start: &Pose, tried: &mut Tried) -> f64 {
    tried.poses += 1;
    tried.work += 1;
    let mut worth = outlook.worth(start);
    for pose in asked.others(start) {
        if worth <= outlook.nothing() {
            break;
        }
        worth = worth.min(outlook.worth(&pose));
    }
    worth
}

/// Estimates many poses.
pub fn estimated(
    asked: &Turns,
    proposals: &Proposals,
    outlook: &Outlook,
    rng: &mut Rng,
    tried: &mut Tried,
) -> Estimated {
    let mut known: Vec<(f64, Pose)> = Vec::with_capacity(DRAWN);
    for _ in 0..DRAWN {
        let pose = proposals.draw(rng);
        known.push((estimate(asked, outlook, &pose, tried), pose));
    }
    let mut drawn: Vec<(f64, Pose)> = known.iter().filter(|(worth, _)| *worth > outlook.nothing()).copied().collect();
    drawn.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (n_rounds, n_centers, n_near) = ROUNDS;
    for _ in 0..n_rounds {
        let centers = best_apart(outlook.model(), asked, &mut known, n_centers, &mut tried.blocked);
        for (_, center) in centers {
            for _ in 0..n_near {
                let pose = proposals.near(&center, rng);
                known.push((estimate(asked, outlook, &pose, tried), pose));
            }
        }
    }
    tried.blocked = 0;
    let (n_best, n_others) = LOOKED_AT;
    let mut best = best_apart(outlook.model(), asked, &mut known, n_best, &mut tried.blocked);
    let least = best.first().map_or(0.0, |(worth, _)| WORSE * worth);
    let last = best.last().map_or(0.0, |(worth, _)| *worth);
    let mut others: Vec<(f64, Pose)> =
        known.into_iter().filter(|(worth, _)| *worth >= least && *worth < last && *worth > outlook.nothing()).collect();
    rng.shuffle(&mut others);
    best.extend(others.into_iter().filter(|(_, pose)| asked.is_clear(outlook.model(), pose)).take(n_others));
    best.retain(|(worth, _)| *worth > outlook.nothing());
    Estimated { best, drawn }
}

impl Estimated {
    /// About `n` of the poses drawn at first, spread evenly over what the estimate says, best first, with the object clear of palm and obstacles.
    pub fn spread(&self, asked: &Turns, model: &Model, n: usize) -> Vec<(f64, Pose)> {
        let clear: Vec<(f64, Pose)> =
            self.drawn.iter().filter(|(_, pose)| asked.is_clear(model, pose)).copied().collect();
        let is_taken = |k: usize| k * n / clear.len() != (k + 1) * n / clear.len();
        (0..clear.len()).filter(|&k| is_taken(k)).map(|k| clear[k]).collect()
    }
}

/// `n` poses near `center`, estimated; those that are hopeless or blocked are left out.
pub fn nearby(
    asked: &Turns,
    proposals: &Proposals,
    outlook: &Outlook,
    (center, n): (&Pose, usize),
    rng: &mut Rng,
    tried: &mut Tried,
) -> Vec<(f64, Pose)> {
    let poses: Vec<Pose> = (0..n).map(|_| proposals.near(center, rng)).collect();
    let estimates = poses.into_iter().map(|pose| (estimate(asked, outlook, &pose, tried), pose));
    let hopeful: Vec<(f64, Pose)> = estimates.filter(|(worth, _)| *worth > outlook.nothing()).collect();
    hopeful.into_iter().filter(|(_, pose)| asked.is_clear(outlook.model(), pose)).collect()
}

/// The best of `known`, apart from each other and clear of palm and obstacles; those that are not are taken out.
fn best_apart(
    model: &Model,
    asked: &Turns,
    known: &mut Vec<(f64, Pose)>,
    n_wanted: usize,
    n_blocked: &mut u64,
) -> Vec<(f64, Pose)> {
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Vec<(f64, Pose)> = Vec::with_capacity(n_wanted);
    let mut blocked = Vec::new();
    for (index, (worth, pose)) in known.iter().enumerate() {
        if best.len() == n_wanted {
            break;
        }
        let is_near = |(_, other): &(f64, Pose)| frame::pose_distance(other, pose, model.turn_length()) < APART;
        if best.iter().any(is_near) {
            continue;
        }
        let is_blocked = |pose: &Pose| object_blocked_by(model, pose).is_some();
        if is_blocked(pose) || asked.others(pose).iter().any(is_blocked) {
            blocked.push(index);
        } else {
            best.push((*worth, *pose));
        }
    }
    *n_blocked += blocked.len() as u64;
    blocked.into_iter().rev().for_each(|index| {
        known.remove(index);
    });
    best
}
