//! Better plans after the first, for as long as the budget lasts: the best so far is there at any moment.
//!
//! Each round lays a course, a way of the object through all poses of the query; gathers tracks, contacts that fingers
//! keep along parts of it, or roll along; and takes the cheapest gait on them that can be proven. The courses are the straight
//! way, that of the best plan so far, whose own contacts are then among the tracks, the same with a part made straight, and
//! ways bent at random.
//!
//! Where fingertips roll, a finger's contacts depend on where it landed and on the course, not on the other fingers. So gaits
//! along one course share tracks there too. Only soft fingertips that restrict how the object may move do not: for them a
//! round is a new search from nothing.

/// Closure of tracks.
mod closure;
/// What plans cost.
mod cost;
/// Ways of the object.
mod course;
/// The grasp at the end.
pub mod ending;
/// A first look at queries that give the start grasp.
pub mod first_look;
/// The cheapest gait along a course.
mod gaits;
/// Straight ways of fingers.
pub mod straighten;
#[cfg(test)]
mod tests;
/// Contacts kept along parts of a course.
mod track;

use crate::in_hand::attempt::poses::draw_pose;
use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::grasps::candidate::Choice;
use crate::in_hand::improving::closure::StationContacts;
use crate::in_hand::improving::cost::{figures, lower_bound, margin_cost};
use crate::in_hand::refusals::is_stuck;
use crate::in_hand::regrasping::change::CASUAL;
use crate::in_hand::searching::legs::{Legs, Solution, plan_legs};
use crate::settings::CostWeights;
use course::{Corner, Course};
use gaits::{Alone, Gaits, object_rest};
use regrasp_base::{Interrupt, Rng};
use regrasp_geometry::{Point, Pose, frame};
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::Model;
use regrasp_plan::plan::{Improvement, PlanFigures};
use regrasp_roadmap::Limits;
use straighten::straighten_relocations;
use track::{Track, covers, draw_tracks};

/// Tracks drawn per finger and course. By hand, with a look at how often a finger is left without a way.
const DRAWN: usize = 150;
/// Tracks kept per course, all fingers together.
const KEPT: usize = 96;
/// The first gait along a course may cost so many times the cheapest (weighted A*: Pohl 1970): it is found in a fraction
/// of the nodes, which matters where grasps forbid much of what fingers by themselves could do.
const GREED: f64 = 1.5;
/// Nodes that one search for a gait expands at most, greedily and exactly.
const MOST_EXPANDED: [usize; 2] = [2000, 500];
/// Gaits along one course that are tried to be proven, found greedily and exactly.
const TRIES: [usize; 2] = [30, 8];
/// Largest margin asked for on a course, in margins that the best plan keeps.
const RAISE: f64 = 2.0;

/// How a course is laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lay {
    /// Straight from pose to pose.
    Straight,
    /// Over a random pose between each two.
    Bent,
    /// As the best plan so far.
    Own,
}

/// Courses in turn. By measurement, 12 seeds of box_90x, box_180z and box_180x and 300,000 units of work: these leave 1.1, 3.8
/// and 2.5 relocations, straight ones alone 1.0, 5.5 and 4.0, bent ones alone 1.3, 3.7 and 2.7.
const LAYS: [Lay; 6] = [Lay::Straight, Lay::Bent, Lay::Bent, Lay::Own, Lay::Bent, Lay::Bent];

/// Rounds where fingertips roll, in turn. Most look at a part of the best plan: that takes little, however long the plan is.
const ROLLING_ROUNDS: [Rolling; 16] = [
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Whole(Lay::Straight),
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Part,
    Rolling::Whole(Lay::Bent),
    Rolling::Again,
];

/// One round where fingertips roll.
#[derive(Debug, Clone, Copy)]
enum Rolling {
    /// A part of the best plan, between two of its grasps.
    Part,
    /// A course from start to goal.
    Whole(Lay),
    /// Another search.
    Again,
}

/// Effort of one round.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Tracks drawn per finger.
    n_drawn: usize,
    /// Nodes that one search for a gait expands at most, greedily and exactly.
    most_expanded: [usize; 2],
    /// Gaits that are tried to be proven, found greedily and exactly.
    tries: [usize; 2],
}

const FIXED: Effort = Effort { n_drawn: DRAWN, most_expanded: MOST_EXPANDED, tries: TRIES };
/// Where fingertips roll tracks cost far more, and more gaits are refuted. By hand.
const PART: Effort = Effort { n_drawn: 20, most_expanded: [400, 150], tries: [6, 2] };
/// For courses from start to goal.
pub const WHOLE: Effort = Effort { n_drawn: 50, most_expanded: [800, 200], tries: [10, 2] };

/// Steps of a plan that are looked at as one part, at most: mostly few, now and then more. By measurement on six scenes: parts
/// of up to 4, 8 and 12 steps made straight take 4, 13 and 90 thousand units of work for each that is found.
const FEW_STEPS: usize = 8;
const MOST_STEPS: usize = 16;
const FEW_SHARE: f64 = 0.75;

/// Share of the work that is left which one more search may take, and share of the improvement's work so far: where a clock ends
/// the improvement, much work may seem left.
const SHARE_OF_LEFT: u64 = 4;
const SHARE_OF_SPENT: u64 = 2;

/// A solution that costs no more than `first`, and what became of it. Whatever ends the search only ends the improvement.
pub fn improve(search: &mut Search, legs: &Legs, first: Solution) -> (Solution, Improvement) {
    let (model, weights) = (search.model(), &search.settings.improvement.cost);
    let figures_of_first = figures(model, weights, &first.way);
    let lower_bound = lower_bound(model, weights, legs.poses, legs.start_grasp, legs.goal_grasp);
    let mut improvement =
        Improvement { first: figures_of_first, improved: figures_of_first, lower_bound, rounds: 0, work: 0 };
    let mut best = first;
    let work_before = search.workspace.work;
    // Other tracks can stand in for a relocation that is hard to make.
    search.workspace.rrt_iterations = model.settings.rrt_iterations / CASUAL;
    while improvement.improved.cost > lower_bound {
        let mut rng = Rng::child(&search.rng, "round", improvement.rounds);
        let which = improvement.rounds as usize;
        let of_best = &improvement.improved;
        let better = search.check().and_then(|()| {
            if !model.any_rolls() {
                return round(search, legs, &best, of_best, (LAYS[which % LAYS.len()], FIXED), &mut rng);
            }
            if (0..model.n_fingers()).any(|finger| model.restricts_motion(finger)) {
                return search_again(search, legs, &improvement, &rng);
            }
            match ROLLING_ROUNDS[which % ROLLING_ROUNDS.len()] {
                Rolling::Part => part(search, legs, &best, of_best, &mut rng),
                Rolling::Whole(lay) => round(search, legs, &best, of_best, (lay, WHOLE), &mut rng),
                Rolling::Again => {
                    let spent = search.workspace.work - work_before;
                    let most = (search.work_left() / SHARE_OF_LEFT).min(spent / SHARE_OF_SPENT);
                    Ok(search_beside(search, legs, &improvement, most))
                }
            }
        });
        match better {
            Ok(Some((better, of_better))) => {
                (best, improvement.improved) = (better, of_better);
                if straighten_relocations(search, &mut best.way) {
                    improvement.improved = figures(model, weights, &best.way);
                }
            }
            Ok(None) => {}
            Err(stop) => {
                search.cut_by_time |= matches!(stop, Stop::Budget(interrupt) if interrupt != Interrupt::WorkSpent);
                break;
            }
        }
        improvement.rounds += 1;
    }
    improvement.work = search.workspace.work - work_before;
    (best, improvement)
}

/// A new search, if what it finds is better than the best so far. Err when the search is to stop.
fn search_again(
    search: &mut Search,
    legs: &Legs,
    improvement: &Improvement,
    rng: &Rng,
) -> Result<Option<(Solution, PlanFigures)>, Stop> {
    search.rng = rng.clone();
    let solution = plan_legs(search, legs)?;
    let figures = figures(search.model(), &search.settings.improvement.cost, &solution.way);
    Ok((figures.cost < improvement.improved.cost).then_some((solution, figures)))
}

/// As [`search_again`], with at most so much work.
fn search_beside(
    search: &mut Search,
    legs: &Legs,
    improvement: &Improvement,
    most_work: u64,
) -> Option<(Solution, PlanFigures)> {
    let mut beside = search.for_detour(improvement.rounds as usize, most_work);
    let solution = plan_legs(&mut beside, legs);
    search.workspace.work += beside.workspace.work;
    search.n_samples += beside.n_samples;
    let solution = solution.ok()?;
    let figures = figures(search.model(), &search.settings.improvement.cost, &solution.way);
    let is_better = figures.cost < improvement.improved.cost && !is_stuck(search.model(), solution.way.end());
    is_better.then_some((solution, figures))
}

/// A part of the best plan between two of its grasps done in a cheaper way, if one is found. Err as of [`round`].
fn part(
    search: &mut Search,
    legs: &Legs,
    best: &Solution,
    of_best: &PlanFigures,
    rng: &mut Rng,
) -> Result<Option<(Solution, PlanFigures)>, Stop> {
    let (model, weights) = (search.model(), &search.settings.improvement.cost);
    let n_steps = best.way.steps().len();
    if n_steps == 0 {
        return Ok(None);
    }
    let [first, last] = range_within_leg(best, rng);
    let own = Solution { way: best.way.part(first..last), steps_to_way: Vec::new() };
    let (from, to) = (own.way.start().clone(), own.way.end().clone());
    // Where the planner chooses the grasp at an end, another will do.
    let keeps_start = first > 0 || legs.start_grasp.is_some();
    let keeps_goal = last < n_steps || legs.goal_grasp.is_some();
    let part = Legs {
        poses: &[from.world_from_object, to.world_from_object],
        start_grasp: keeps_start.then_some(&from),
        goal_grasp: keeps_goal.then_some(&to),
    };
    let mut of_part = figures(model, weights, &own.way);
    let ends_stuck = is_stuck(model, best.way.end());
    if ends_stuck && !keeps_goal {
        of_part.cost += STUCK_COST;
    }
    let lay = match rng.unit() {
        share if share < STRAIGHT_SHARE => Lay::Straight,
        share if share < STRAIGHT_SHARE + OWN_SHARE => Lay::Own,
        _ => Lay::Bent,
    };
    let Some((detour, _)) = round(search, &part, &own, &of_part, (lay, PART), rng)? else {
        return Ok(None);
    };
    let n_more = |n: usize| (n + detour.way.steps().len()).saturating_sub(last - first);
    let steps_to_way = best.steps_to_way.iter().map(|&n| if n >= last { n_more(n) } else { n }).collect();
    let head = if first > 0 { best.way.part(0..first).then(detour.way) } else { Some(detour.way) };
    let whole = head.and_then(|way| if last < n_steps { way.then(best.way.part(last..n_steps)) } else { Some(way) });
    let Some(way) = whole else { return Ok(None) };
    // Way poses are named by the motions before them.
    let way = if best.steps_to_way.is_empty() { way.with_transfers_joined() } else { way };
    let figures = figures(model, weights, &way);
    let is_better = match [ends_stuck, is_stuck(model, way.end())] {
        [true, false] => true,
        [false, true] => false,
        _ => figures.cost < of_best.cost,
    };
    Ok(is_better.then_some((Solution { way, steps_to_way }, figures)))
}

/// What it may cost more to end with a grasp in which a finger may lift, so that another plan can go on from there.
const STUCK_COST: f64 = 3.0;

/// Share of the parts that are tried on the straight way, and on their own; the others are on a way bent at random.
const STRAIGHT_SHARE: f64 = 0.7;
const OWN_SHARE: f64 = 0.25;

/// Some motions that follow each other without a way pose between them: the first, and one after the last.
fn range_within_leg(best: &Solution, rng: &mut Rng) -> [usize; 2] {
    let n_steps = best.way.steps().len();
    let somewhere = rng.below(n_steps);
    let begin = best.steps_to_way.iter().copied().filter(|&n| n <= somewhere).max().unwrap_or(0);
    let end = best.steps_to_way.iter().copied().filter(|&n| n > somewhere).min().unwrap_or(n_steps);
    let most = if rng.chance(FEW_SHARE) { FEW_STEPS } else { MOST_STEPS };
    let length = 1 + rng.below(most);
    let last = (somewhere + length).min(end);
    [begin.max(last.saturating_sub(length)), last]
}

/// A course and the cheapest gait found along it, if that is better than the best so far. Err when the search is to stop
/// and nothing better was found.
pub fn round(
    search: &mut Search,
    legs: &Legs,
    best: &Solution,
    of_best: &PlanFigures,
    (lay, effort): (Lay, Effort),
    rng: &mut Rng,
) -> Result<Option<(Solution, PlanFigures)>, Stop> {
    let (model, weights) = (search.model(), &search.settings.improvement.cost);
    let course = match lay {
        Lay::Straight => straight(model, legs, rng),
        Lay::Bent => bent(search, legs, rng),
        Lay::Own => Course::of(model, best),
    };
    let own = (lay == Lay::Own).then_some(best);
    let Some((tracks, alone, goal)) = gather(search, legs, &course, own, (of_best.cost, effort.n_drawn), rng)? else {
        return Ok(None);
    };
    let contacts = StationContacts::of(model, &course, &tracks);
    let least =
        object_rest(model, &search.settings.improvement.cost, &course)[0] + alone.iter().map(Alone::least).sum::<f64>();
    let margin = margin_to_ask(model, weights, of_best, least, rng);
    let mut gaits = Gaits::new(search, &course, &tracks, &contacts, &alone, goal.as_ref(), margin);
    let mut found: Option<(Solution, PlanFigures)> = None;
    for (which, greed) in [GREED, 1.0].into_iter().enumerate() {
        let cost = found.as_ref().map_or(of_best.cost, |(_, figures)| figures.cost);
        let limits = Limits { cost, n_expanded: effort.most_expanded[which] };
        match gaits.cheapest_proven(limits, greed, effort.tries[which], rng) {
            Ok(Some(solution)) => {
                let figures = figures(model, weights, &solution.way);
                if figures.cost < cost {
                    found = Some((solution, figures));
                }
            }
            // Along this course the greedy search tells what the exact one would find out slower.
            Ok(None) if which == 0 => return Ok(None),
            Err(stop) if found.is_none() => return Err(stop),
            Ok(None) | Err(_) => {}
        }
    }
    Ok(found)
}

/// The closure margin asked for on a course along which gaits cost at least `least` without their margin: a larger one than
/// `best` keeps as often as the margin's share of what could be gained says.
fn margin_to_ask(model: &Model, weights: &CostWeights, best: &PlanFigures, least: f64, rng: &mut Rng) -> f64 {
    let share = margin_cost(model, weights, best.kept_margin) / (best.cost - least);
    let required = model.settings.closure_margin;
    if rng.chance(share.clamp(0.0, 1.0)) {
        return required.max(rng.uniform(1.0, RAISE) * best.kept_margin).min(1.0);
    }
    required
}

/// What gaits along a course are made of: the tracks of every finger, what it pays by itself, and the tracks of the goal
/// grasp if one is given.
type Tracks = (Vec<Vec<Track>>, Vec<Alone>, Option<Choice>);

/// The tracks of a course: those of the grasps given and of the plan `own` along its own course, and new ones. None as
/// soon as the fingers by themselves pay as much as `cost`.
fn gather(
    search: &mut Search,
    legs: &Legs,
    course: &Course,
    own: Option<&Solution>,
    (cost, n_drawn): (f64, usize),
    rng: &mut Rng,
) -> Result<Option<Tracks>, Stop> {
    let model = search.model();
    let n_fingers = model.n_fingers();
    let mut tracks = vec![Vec::new(); n_fingers];
    let ends = [(legs.start_grasp, 0), (legs.goal_grasp, course.poses.len() - 1)];
    let mut given = [None, None];
    for (given, (state, moment)) in given.iter_mut().zip(ends) {
        let Some(state) = state else { continue };
        let Some(choice) = push_grasp(search, course, &mut tracks, state, moment) else { return Ok(None) };
        *given = Some(choice);
    }
    let [start, goal] = given;
    if let Some(own) = own {
        push_own(search, course, &mut tracks, own);
    }
    let mut least = object_rest(model, &search.settings.improvement.cost, course)[0];
    let mut alone = Vec::with_capacity(tracks.len());
    for (finger, tracks) in tracks.iter_mut().enumerate() {
        let drawn = draw_tracks(search, course, finger, n_drawn, &mut Rng::child(rng, "tracks", finger as u64))?;
        tracks.extend(covers(course, drawn, (KEPT / n_fingers).saturating_sub(tracks.len())));
        let ends = [&start, &goal].map(|end| end.as_ref().map(|choice| choice[finger]));
        alone.push(Alone::new(course, tracks, ends, &search.settings.improvement.cost));
        least += alone[finger].least();
        if least >= cost {
            return Ok(None);
        }
    }
    Ok(Some((tracks, alone, goal)))
}

/// Adds the contacts of a grasp at a moment as tracks: which track each finger is on there, in exactly its joints. None where a
/// free finger is not clear.
fn push_grasp(
    search: &mut Search,
    course: &Course,
    tracks: &mut [Vec<Track>],
    state: &GraspState,
    moment: usize,
) -> Option<Choice> {
    let mut choice = Choice::new();
    for (finger, tracks) in tracks.iter_mut().enumerate() {
        let (contact, joints) = (&state.contacts[finger], &state.joints[finger]);
        if !state.holds(finger) {
            let stays = |track: &Track| track.is_free() && track.spans(moment) && track.at(moment) == joints;
            let known = tracks.iter().position(stays);
            choice.push(known.unwrap_or(tracks.len()));
            if known.is_none() {
                tracks.push(Track::free(&mut search.workspace, course, finger, joints, moment)?);
            }
            continue;
        }
        let arrives = |track: &mut Track| track.settle(moment, contact, joints);
        let known = tracks.iter_mut().position(arrives);
        choice.push(known.unwrap_or(tracks.len()));
        if known.is_none() {
            tracks.push(Track::new(&mut search.workspace, course, finger, contact, joints.clone(), moment));
        }
    }
    Some(choice)
}

/// Adds the contacts of a plan along its own course.
fn push_own(search: &mut Search, course: &Course, tracks: &mut [Vec<Track>], own: &Solution) {
    let mut moment = 0;
    for index in 0..=own.way.steps().len() {
        let state = own.way.state_before(index);
        let there = course.poses[moment..].iter().position(|pose| *pose == state.world_from_object);
        // A part of it that was made straight is no more there.
        let Some(there) = there else { continue };
        moment += there;
        for finger in 0..tracks.len() {
            if !state.holds(finger) {
                let joints = &state.joints[finger];
                let is_known = |track: &Track| track.is_free() && track.spans(moment) && track.at(moment) == joints;
                if !tracks[finger].iter().any(is_known) {
                    tracks[finger].extend(Track::free(&mut search.workspace, course, finger, joints, moment));
                }
                continue;
            }
            let contact = &state.contacts[finger];
            if !tracks[finger].iter().any(|track| track.passes(moment, contact)) {
                let joints = state.joints[finger].clone();
                tracks[finger].push(Track::new(&mut search.workspace, course, finger, contact, joints, moment));
            }
        }
    }
}

/// The straight way from pose to pose; half turns go either way round.
fn straight(model: &Model, legs: &Legs, rng: &mut Rng) -> Course {
    let mut corners = Vec::new();
    for (leg, pair) in legs.poses.windows(2).enumerate() {
        if let Some(half) = half_of_the_other_way(&pair[0], &pair[1], &model.view.object.center_of_mass)
            && rng.chance(0.5)
        {
            corners.push(Corner::station(half));
        }
        corners.push(Corner { pose: pair[1], is_station: true, is_way_pose: leg + 1 < legs.n_legs() });
    }
    Course::through(model, legs.poses[0], &corners)
}

/// Smallest angle of which the other way round is tried.
const FAR_ROUND: f64 = 2.8;

/// The pose half of the way if the object is turned the long way round; none where that is much longer.
fn half_of_the_other_way(from: &Pose, to: &Pose, center_of_mass: &Point) -> Option<Pose> {
    let turn = frame::rotation_between(from, to);
    let angle = turn.norm();
    if angle < FAR_ROUND {
        return None;
    }
    let back = -turn * ((2.0 * std::f64::consts::PI - angle) / (2.0 * angle));
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(back) * from.rotation;
    let center = nalgebra::center(&(from * center_of_mass), &(to * center_of_mass));
    let origin: Point = center - rotation * center_of_mass.coords;
    Some(Pose::from_parts(origin.coords.into(), rotation))
}

/// A way with a random pose between each two of the query.
fn bent(search: &Search, legs: &Legs, rng: &mut Rng) -> Course {
    let model = search.model();
    let mut corners = Vec::new();
    for (leg, pair) in legs.poses.windows(2).enumerate() {
        corners.push(Corner::station(draw_pose(model, &search.settings.search, &pair[0], &pair[1], rng)));
        corners.push(Corner { pose: pair[1], is_station: true, is_way_pose: leg + 1 < legs.n_legs() });
    }
    Course::through(model, legs.poses[0], &corners)
}
