//! Where to hold an object: poses in which the hand has force-closed grasps that let every finger go, and from which the turns that
//! are asked for look possible. Many poses are estimated, some looked at with all links, and from a few short searches are made.

/// Many poses, estimated.
mod estimating;
/// What a hand can really do at a pose.
pub mod evidence;
/// What would help where the start has no grasp.
pub mod hint;
/// A look with all links.
mod looking;
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
/// Where short searches are made.
mod searching;
/// Which sizes of objects fit a hand.
pub mod sizes;
/// Poses at which fingers close on the object.
mod touching;

use crate::in_hand::attempt::search::Context;
use crate::in_hand::attempt::tally::{Reason, Tally};
use crate::in_hand::effective;
use crate::settings::InHandSettings;
pub use hint::with_hint;
pub use planned::plan_placed;

use estimating::{Turns, estimated};
use looking::Looks;
use outlook::Outlook;
use probe::Probe;
use proposals::Proposals;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::Pose;
use regrasp_manipulation::failure::{Cause, Failure, FailureKind, NearestMiss};
use regrasp_manipulation::model::Model;
use regrasp_plan::plan::PoseData;
use regrasp_robot::inspect::TipReach;
use regrasp_scene::{HandView, InHandQuery};
use searching::ShortSearches;
use std::sync::atomic::AtomicUsize;
use touching::touched;

/// Postures from which it is known where fingertips reach.
const POSTURES: usize = 12_000;
/// What is added to the plans found and to the work for a rate of plans that is never zero nor infinite; the first for a pose whose searches
/// came all the way.
const PRIOR: (f64, f64) = (0.2, 4_000.0);

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
/// The answer depends on view, queries, settings and seed alone; a deadline may only cut. `told` hears now and then what was tried so far, from
/// the calling thread. Errors: no pose with a grasp was found.
pub fn place(
    view: &HandView,
    queries: &[InHandQuery],
    settings: &InHandSettings,
    (seed, n_wanted): (u64, usize),
    budget: &Budget,
    told: &(dyn Fn(&Tried) + Sync),
) -> Result<Places, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    let settings = &effective(settings).within(&view.limits);
    let model = &Model::new(view, &settings.physics);
    super::refusals::refuse_holding_nothing(model)?;
    super::refusals::refuse_too_heavy(model)?;
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
    let estimated = estimated(&asked, &proposals, &outlook, &mut rng, &mut tried);

    let winner = AtomicUsize::new(usize::MAX);
    let context = Context { model, settings, seed, budget, winner: &winner, progress: &|_| {} };
    let tally = Tally::default();
    let mut looks = Looks { context, asked: &asked, moves, places: Vec::new(), tally, tried, n_given: 0, told };
    let mut cut = looks.look_at(&estimated.best);
    let searches = ShortSearches { view, queries, settings, seed, budget, told };
    searches.first(&mut looks.places, &mut looks.tried)?;
    if looks.tried.solved == 0 && cut.is_none() {
        cut = looks.widen(&estimated, &proposals, &outlook, &mut rng);
        searches.first(&mut looks.places, &mut looks.tried)?;
    }
    if looks.places.is_empty() && cut.is_none() && !moves && model.closing_fingers() != 0 {
        let (held, ended) = touched(context, &asked, &proposals, &mut looks.tried, told);
        cut = ended.or_else(|| looks.look_at(&held));
        searches.first(&mut looks.places, &mut looks.tried)?;
    }
    if cut == Some(Interrupt::Cancelled) {
        return Err(Failure::bare(FailureKind::Interrupted, "interrupted".into(), ""));
    }
    let Looks { mut places, tally, mut tried, .. } = looks;
    if places.is_empty() {
        return Err(not_found(model, &estimated.best, (&tally, !moves), &tried, cut));
    }
    searches.again(&mut places, &mut tried)?;
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
