//! Where to hold an object: poses in which the hand has force-closed grasps that let every finger go, and from which the turns that
//! are asked for look possible. Many poses are estimated, some looked at with all links, and from a few short searches are made.

/// What a hand can really do at a pose.
pub mod evidence;
/// What would help where the start has no grasp.
pub mod hint;
/// A quick estimate of it.
pub mod outlook;
/// Plans whose start pose the planner chooses.
mod planned;
/// Short searches.
pub mod probe;
/// Poses that are worth a look.
pub mod proposals;
/// Contacts spread over the object.
pub mod samples;
/// Which sizes of objects fit a hand.
pub mod sizes;

use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::attempt::tally::{Reason, Tally};
use crate::in_hand::effective;
use crate::settings::InHandSettings;
pub use hint::with_hint;
pub use planned::plan_placed;

use evidence::Evidence;
use outlook::Outlook;
use probe::{Probe, probe};
use proposals::Proposals;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::{Pose, frame, interpolate_pose};
use regrasp_manipulation::ends::blocked::object_blocked_by;
use regrasp_manipulation::failure::{Cause, Failure, FailureKind, NearestMiss};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::progress::Progress;
use regrasp_plan::plan::PoseData;
use regrasp_robot::inspect::TipReach;
use regrasp_scene::{HandView, InHandQuery};
use std::sync::atomic::AtomicUsize;

/// Postures from which it is known where fingertips reach.
const POSTURES: usize = 12_000;
/// Poses drawn at first.
const DRAWN: usize = 6_000;
/// Rounds in which poses are drawn near the best ones, how many of these there are, and how many are drawn near each.
const ROUNDS: (usize, usize, usize) = (3, 24, 40);
/// Poses that are looked at with all links: those that look best, and others spread over those that look worse by at most this
/// factor. By measurement on an Allegro hand, of those the estimate says little.
const LOOKED_AT: (usize, usize) = (24, 24);
const WORSE: f64 = 0.2;
/// Poses from which short searches are made, a batch at a time until in one of them some turned out well.
const PROBED: usize = 24;
const BATCH: usize = 4;
/// Poses from which every turn was found, at which no more are looked for; so many are searched from again.
const ENOUGH: usize = 2;
const AGAIN: usize = 4;
/// Times that it is searched again where no turn was found. By measurement on the left LEAP hand (cube about z by 180 degrees): after 3 times no
/// turn was found; with more, a pose from which 5 of 6 seeds have a plan within 400,000 configurations.
const TIMES_AGAIN: u64 = 12;
/// Work of a short search, and of those made again from the best poses.
const PROBE_WORK: (u64, u64) = (25_000, 60_000);
/// What is added to the plans found and to the work for a rate of plans that is never zero nor infinite; the first for a pose whose searches
/// came all the way.
const PRIOR: (f64, f64) = (0.2, 4_000.0);
/// Poses count as different from this distance on, in metres, with angles weighed by the object's radius.
const APART: f64 = 0.006;

/// A pose of the object from which the hand is expected to do what is asked.
#[derive(Debug, Clone)]
pub struct Place {
    /// The pose.
    pub world_from_object: Pose,
    /// Estimate over the poses of the turns: shares of sets of contacts that close while one finger is away, the least of all poses.
    pub outlook: f64,
    /// The same as seen with all links: the geometric mean over the poses.
    pub evidence: f64,
    /// Per query, what short searches came to; empty where none was made.
    pub probes: Vec<Probe>,
    /// Joints of a closed grasp there, in the order of `Hand::joint_names`.
    pub joints: Vec<f64>,
}

/// What was tried.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Tried {
    /// Poses estimated.
    pub poses: u64,
    /// Of those that looked best, poses at which the object is in collision with palm or obstacles.
    pub blocked: u64,
    /// Poses looked at with all links.
    pub looked_at: u64,
    /// Of these, poses with a closed grasp at the start from which a finger may lift.
    pub with_grasp: u64,
    /// Poses from which short searches were made.
    pub probed: u64,
    /// Of these, poses from which every turn was found.
    pub solved: u64,
    /// Configurations looked at.
    pub work: u64,
}

/// Poses found, best first, and what was tried.
#[derive(Debug, Clone)]
pub struct Places {
    /// The poses; at least one.
    pub places: Vec<Place>,
    /// What was tried.
    pub tried: Tried,
}

/// Looks for up to `n_wanted` start poses of the object of `view` for `queries`, which all leave it open.
///
/// The answer depends on view, queries, settings and seed alone; a deadline may only cut. Errors: no pose with a grasp was found.
pub fn place(
    view: &HandView,
    queries: &[InHandQuery],
    settings: &InHandSettings,
    (seed, n_wanted): (u64, usize),
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Places, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    let settings = &effective(settings).within(&view.limits);
    let model = &Model::new(view, &settings.physics);
    super::refusals::refuse_holding_nothing(model)?;
    // The poses are those of a start at the origin; a query that stays there stays everywhere.
    let moves = queries.iter().any(|query| !query.stays());
    if moves {
        super::refusals::refuse_hand_that_cannot_follow(model)?;
    }
    if moves && model.n_fingers() > 2 && !settings.search.transfers_alone {
        super::refusals::refuse_impossible(model)?;
    }
    let mut rng = Rng::keyed(seed, "place", 0);
    let reach = reach_of(model, &TipReach::sample(view.hand, POSTURES, &mut rng));
    let asked = Turns { view, queries };
    let proposals = Proposals::new(model, &reach, asked.rotation());
    if proposals.is_empty() {
        return Err(Failure::bare(FailureKind::Impossible, NO_COMMON_PLACE.into(), NO_COMMON_PLACE_FIX));
    }
    let outlook = Outlook::new(model, &reach, &mut rng);
    let mut tried = Tried::default();
    let best = estimated(&asked, &proposals, &outlook, &mut rng, &mut tried);

    let winner = AtomicUsize::new(usize::MAX);
    let context = Context { model, settings, seed, budget, winner: &winner, progress };
    let look = |(index, (_, start)): &(usize, (f64, Pose))| {
        let mut search = Search::new(context, [Pose::identity(); 2], 0, u64::MAX);
        search.rng = Rng::keyed(seed, "place_evidence", *index as u64);
        search.holds_only = !moves;
        let first = Evidence::gather(&mut search, start);
        let mut worths = vec![first.worth(model)];
        if first.grasp.is_some() {
            let others = asked.others(start);
            worths.extend(others.iter().map(|pose| Evidence::gather(&mut search, pose).worth(model)));
        }
        (first.grasp, worths, search.workspace.work, search.whole_tally())
    };
    let mut places: Vec<Place> = Vec::new();
    let (mut cut, mut looked_work, mut tally) = (None, 0, Tally::default());
    let numbered: Vec<(usize, (f64, Pose))> = best.iter().copied().enumerate().collect();
    // Several poses at the same time. What one thread would not have come to, because the work is spent, does not count.
    'looks: for together in numbered.chunks(settings.n_threads.max(1)) {
        cut = budget.check(looked_work).err();
        if cut.is_some() {
            break;
        }
        for ((_, (worth, start)), (grasp, worths, work, seen)) in together.iter().zip(at_once(together, look)) {
            cut = budget.check(looked_work).err();
            if cut.is_some() {
                break 'looks;
            }
            tried.looked_at += 1;
            looked_work += work;
            tally.merge(&seen);
            let Some(grasp) = grasp else { continue };
            tried.with_grasp += 1;
            let evidence = (worths.iter().map(|worth| worth.ln()).sum::<f64>() / worths.len() as f64).exp();
            places.push(Place {
                world_from_object: view.world_from(start),
                outlook: *worth,
                evidence,
                probes: Vec::new(),
                joints: grasp.joints.iter().flatten().copied().collect(),
            });
        }
    }
    tried.work += looked_work;
    if cut == Some(Interrupt::Cancelled) {
        return Err(Failure::bare(FailureKind::Interrupted, "interrupted".into(), ""));
    }
    if places.is_empty() {
        return Err(not_found(model, &best, (&tally, !moves), &tried, cut));
    }
    // Stable: of equals the one that was estimated better stays first.
    places.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    search_from(&mut places, view, queries, (settings, seed, budget), &mut tried)?;
    places.sort_by(|a, b| b.rate().total_cmp(&a.rate()));
    places.truncate(n_wanted.max(1));
    Ok(Places { places, tried })
}

/// Where the fingertips of `model` reach, as poses are estimated with: fingers that find contacts by closing meet few of the contacts that are
/// spread over the object, and count for those nearby.
fn reach_of(model: &Model, reach: &TipReach) -> TipReach {
    reach.widened(model.closing_fingers(), (NEARBY / reach.pitch()).ceil() as usize)
}

/// How near a contact is to one of those spread over an object, in metres, about.
const NEARBY: f64 = 0.008;

/// Makes short searches from places, best first, until some turn out well, and again from the best of these; where none was found, some
/// more times from those that seem best by then. The answer does not depend on the number of threads.
fn search_from(
    places: &mut [Place],
    view: &HandView,
    queries: &[InHandQuery],
    (settings, seed, budget): (&InHandSettings, u64, &Budget),
    tried: &mut Tried,
) -> Result<(), Failure> {
    // Several places at the same time. What one thread would not have come to, because the work is spent, does not count.
    let search = |places: &mut [&mut Place], round: u64, tried: &mut Tried| -> Result<usize, Failure> {
        // Another seed than that of the plan: what is asked is how often a plan is found.
        let seed = seed.wrapping_add(1 + round);
        let work = if round == 0 { PROBE_WORK.0 } else { PROBE_WORK.1 };
        let probe_all =
            |place: &&mut Place| probe(view, queries, &place.world_from_object, (settings, seed, budget), work);
        let mut n_searched = 0;
        for together in places.chunks_mut(settings.n_threads.max(1)) {
            if budget.check(tried.work).is_err() {
                break;
            }
            let seen = at_once(together, probe_all);
            for (place, probes) in together.iter_mut().zip(seen) {
                if budget.check(tried.work).is_err() {
                    return Ok(n_searched);
                }
                let probes = probes?;
                tried.work += probes.iter().map(|probe| probe.work).sum::<u64>();
                match place.probes.is_empty() {
                    true => place.probes = probes,
                    false => place.probes.iter_mut().zip(probes).for_each(|(known, new)| known.add(new)),
                }
                n_searched += 1;
            }
        }
        Ok(n_searched)
    };
    let n_solved = |places: &[Place]| places.iter().filter(|place| place.is_solved()).count();
    for first in (0..places.len().min(PROBED)).step_by(BATCH) {
        let last = (first + BATCH).min(places.len());
        let mut batch: Vec<&mut Place> = places[first..last].iter_mut().collect();
        tried.probed += search(&mut batch, 0, tried)? as u64;
        if n_solved(places) >= ENOUGH {
            break;
        }
    }
    for round in 1..=TIMES_AGAIN {
        places.sort_by(|a, b| b.rate().total_cmp(&a.rate()));
        let mut again: Vec<&mut Place> =
            places.iter_mut().take(AGAIN).filter(|place| !place.probes.is_empty()).collect();
        let n_searched = search(&mut again, round, tried)?;
        if n_searched == 0 || n_solved(places) > 0 || queries.iter().all(InHandQuery::stays) {
            break;
        }
    }
    tried.solved = n_solved(places) as u64;
    Ok(())
}

/// What `look` says of every item, in their order; each is looked at by a thread of its own.
fn at_once<I: Sync, T: Send>(items: &[I], look: impl Fn(&I) -> T + Sync) -> Vec<T> {
    let [first, others @ ..] = items else { return Vec::new() };
    std::thread::scope(|scope| {
        let others: Vec<_> = others.iter().map(|item| scope.spawn(|| look(item))).collect();
        let mut seen = vec![look(first)];
        for other in others {
            seen.push(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        seen
    })
}

impl Place {
    /// True when short searches found every turn.
    pub fn is_solved(&self) -> bool {
        !self.probes.is_empty() && self.probes.iter().all(Probe::is_solved)
    }

    /// Plans found per work, of the turn for which they are fewest; 0 where nobody searched. Searches without a plan count the more the farther
    /// they came, and the less the more there were.
    fn rate(&self) -> f64 {
        let (solved, work) = PRIOR;
        let prior = |probe: &Probe| match probe.n_solved {
            0 => solved * probe.mean_way().powi(2),
            _ => solved,
        };
        let rate = |probe: &Probe| (f64::from(probe.n_solved) + prior(probe)) / (probe.work as f64 + work);
        self.probes.iter().map(rate).reduce(f64::min).unwrap_or(0.0)
    }
}

/// What is asked of a place.
struct Turns<'a> {
    view: &'a HandView<'a>,
    queries: &'a [InHandQuery],
}

impl Turns<'_> {
    /// Orientation at the start in the hand's frame, where the queries give it.
    fn rotation(&self) -> Option<nalgebra::UnitQuaternion<f64>> {
        let given = self.queries.iter().find_map(|query| query.open_start.as_ref()?.rotation)?;
        let in_world = Pose::from_parts(nalgebra::Translation3::identity(), given);
        Some(self.view.hand_from(&in_world).rotation)
    }

    /// Poses that the object passes after it starts at `start`, half way of every leg and at its end; all in the hand's frame.
    fn others(&self, start: &Pose) -> Vec<Pose> {
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

/// Estimates many poses; those that look best, apart from each other and with the object clear of palm and obstacles, best first.
fn estimated(
    asked: &Turns,
    proposals: &Proposals,
    outlook: &Outlook,
    rng: &mut Rng,
    tried: &mut Tried,
) -> Vec<(f64, Pose)> {
    let estimate = |start: &Pose, tried: &mut Tried| {
        tried.poses += 1;
        let mut worth = outlook.worth(start);
        for pose in asked.others(start) {
            if worth <= outlook.nothing() {
                break;
            }
            worth = worth.min(outlook.worth(&pose));
        }
        worth
    };
    let mut known: Vec<(f64, Pose)> = Vec::with_capacity(DRAWN);
    for _ in 0..DRAWN {
        let pose = proposals.draw(rng);
        known.push((estimate(&pose, tried), pose));
    }
    let (n_rounds, n_centers, n_near) = ROUNDS;
    for _ in 0..n_rounds {
        let centers = best_apart(outlook.model(), asked, &mut known, n_centers, &mut tried.blocked);
        for (_, center) in centers {
            for _ in 0..n_near {
                let pose = proposals.near(&center, rng);
                known.push((estimate(&pose, tried), pose));
            }
        }
    }
    tried.blocked = 0;
    tried.work += tried.poses;
    let (n_best, n_others) = LOOKED_AT;
    let mut best = best_apart(outlook.model(), asked, &mut known, n_best, &mut tried.blocked);
    let least = best.first().map_or(0.0, |(worth, _)| WORSE * worth);
    let last = best.last().map_or(0.0, |(worth, _)| *worth);
    let mut others: Vec<(f64, Pose)> =
        known.into_iter().filter(|(worth, _)| *worth >= least && *worth < last && *worth > outlook.nothing()).collect();
    rng.shuffle(&mut others);
    let clear = others.into_iter().filter(|(_, pose)| {
        let is_clear = |pose: &Pose| object_blocked_by(outlook.model(), pose).is_none();
        is_clear(pose) && asked.others(pose).iter().all(is_clear)
    });
    best.extend(clear.take(n_others));
    best.retain(|(worth, _)| *worth > outlook.nothing());
    best
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

/// Why no place was found: the causes, and the pose that looked best.
fn not_found(
    model: &Model,
    best: &[(f64, Pose)],
    (tally, holds_only): (&Tally, bool),
    tried: &Tried,
    cut: Option<Interrupt>,
) -> Failure {
    let wanted = if holds_only { "" } else { " and a finger may lift" };
    let mut causes = tally.causes(model);
    if tried.blocked > 0 {
        let reason = "the object is in collision with palm or obstacles at the start or on its way".to_owned();
        causes.push(Cause { reason, count: tried.blocked, share: 0.0 });
    }
    let total: u64 = causes.iter().map(|cause| cause.count).sum();
    causes.iter_mut().for_each(|cause| cause.share = cause.count as f64 / total.max(1) as f64);
    causes.sort_by_key(|cause| std::cmp::Reverse(cause.count));
    let object = model.view.object;
    let message = format!(
        "found no pose of \"{}\" (farthest point {:.0} mm from its centre of mass) in which the hand holds it{wanted}: \
         of {} poses estimated {} were looked at with all links{}",
        object.name,
        1e3 * object.radius,
        tried.poses,
        tried.looked_at,
        model
            .view
            .hand
            .fingers
            .iter()
            .zip(0..)
            .map(|(finger, f)| {
                let n = tally.count(Reason::NoContact(f));
                let in_the_way =
                    || tally.tried.most_in_the_way(model, f).map_or(String::new(), |told| format!(" ({told})"));
                match n {
                    0 => String::new(),
                    n => format!("; \"{}\" found no contact at {n} of them{}", finger.name, in_the_way()),
                }
            })
            .collect::<String>(),
    );
    let nearest_miss = best.first().map(|(_, pose)| {
        Box::new(NearestMiss {
            world_from_object: PoseData::from(&model.view.world_from(pose)),
            angle_left: 0.0,
            distance_left: 0.0,
            joints: model.view.hand.fingers.iter().flat_map(|finger| finger.rest.iter().copied()).collect(),
        })
    });
    let kind = cut.map_or(FailureKind::StartInvalid, FailureKind::from);
    let advice = "scale the object to the sizes that regrasp inspect names for the hand, raise the friction, or use soft fingertips";
    Failure { causes, nearest_miss, ..Failure::bare(kind, message, advice) }
}

const NO_COMMON_PLACE: &str = "no two fingertips of the hand reach a place in common: nothing can be held between them";
const NO_COMMON_PLACE_FIX: &str =
    "look at the regions that regrasp inspect prints; correct joint limits and tips in the hand file";
