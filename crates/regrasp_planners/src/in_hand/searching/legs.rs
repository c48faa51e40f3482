//! Legs: a query with way poses is planned pose by pose; the grasp with which one leg ends is where the next begins.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::regrasping::change::Arrival;
use crate::in_hand::searching::shorten::shorten;
use crate::in_hand::searching::{classic, gait, visibility};
use crate::settings::Method;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;

/// What is asked: all poses from start to goal, and the grasps given at the ends.
pub struct Legs<'a> {
    /// Object poses; at least two.
    pub poses: &'a [Pose],
    /// Grasp at the start, if one is given.
    pub start_grasp: Option<&'a GraspState>,
    /// Grasp at the goal, if one is given.
    pub goal_grasp: Option<&'a GraspState>,
}

impl Legs<'_> {
    /// Number of legs.
    pub fn n_legs(&self) -> usize {
        self.poses.len() - 1
    }
}

/// The motions of all legs.
#[derive(Clone)]
pub struct Solution {
    /// The motions, one leg after the other.
    pub way: Sequence,
    /// Number of motions done when each way pose is reached.
    pub steps_to_way: Vec<usize>,
}

/// One attempt at all legs. Nodes are those of all legs; `search.leg` says which one it was that failed.
pub fn plan_legs(search: &mut Search, legs: &Legs) -> Result<Solution, Stop> {
    let mut done: Option<Sequence> = None;
    let mut steps_to_way = Vec::new();
    let mut n_nodes = 0;
    for leg in 0..legs.n_legs() {
        search.begin_leg(leg, legs.poses[leg], legs.poses[leg + 1]);
        let is_last = leg + 1 == legs.n_legs();
        let from = done.as_ref().map(Sequence::end).or(legs.start_grasp).cloned();
        let found = plan_leg(search, from, if is_last { legs.goal_grasp } else { None });
        n_nodes += search.n_nodes;
        search.n_nodes = n_nodes;
        let next = found?;
        let way = match done.take() {
            Some(before) => before.then(next).expect("a leg begins in the state that it is given"),
            None => next,
        };
        if !is_last {
            steps_to_way.push(way.steps().len());
        }
        done = Some(way);
    }
    Ok(Solution { way: done.expect("there is at least one leg"), steps_to_way })
}

/// One leg: search, then shortcuts.
fn plan_leg(search: &mut Search, start: Option<GraspState>, goal: Option<&GraspState>) -> Result<Sequence, Stop> {
    let mut way = match search.settings.method {
        Method::Gait => gait::grow(search, start, goal)?,
        Method::Visibility => visibility::build(search, start, goal)?,
        Method::Classic => classic::build(search, start, goal)?,
    };
    let at_end = if goal.is_none() { Arrival::AnyPosture } else { Arrival::Exact };
    shorten(search, &mut way, at_end);
    Ok(way.with_transfers_joined())
}
