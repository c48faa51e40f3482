//! The method of Saut 2011: a visibility PRM in GS_n, components joined through GS_(n-1), paths in GS_n decomposed
//! (algorithm 1; sections 4.2.1 and 5.2).

/// Joining components of a roadmap.
mod connect;
/// Paths in GS_n cut into transfers and regrasps.
pub mod decompose;
/// Sampling GS_n.
pub mod explore;
/// Links between grasps.
pub mod link;

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::grasps::sample::draw_state_at;
use crate::in_hand::searching::visibility::connect::{TriedPairs, connect_components};
use crate::in_hand::searching::visibility::decompose::decompose;
use crate::in_hand::searching::visibility::explore::{Spares, explore, roadmap_of};
use crate::in_hand::searching::visibility::link::{Link, LocalMethod, Roadmap};
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;
use std::rc::Rc;

/// Nodes of the ends of the query.
const START: usize = 0;
const GOAL: usize = 1;

/// Looks for motions from `start` to the goal pose and `goal_grasp`; what is not given is drawn.
pub fn build(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<Sequence, Stop> {
    let (start, goal) = ends(search, start, goal_grasp)?;
    let mut roadmap = roadmap_of(search, &start, &goal, LocalMethod::GraspPath)?;
    let (mut tried, mut spares) = (TriedPairs::new(), Spares::default());
    let mut n_merges = 0;
    loop {
        while !roadmap.components().same(START, GOAL) {
            if search.rng.unit() < search.settings.baselines.alpha.value(n_merges, roadmap.nodes().len()) {
                explore(search, &mut roadmap, LocalMethod::GraspPath, &mut spares)?;
            } else {
                n_merges += 1;
                connect_components(search, &mut roadmap, &mut tried, &mut spares)?;
            }
            note_nearest(search, &roadmap);
        }
        if let Some(way) = solution(search, &mut roadmap)? {
            return Ok(way);
        }
    }
}

/// Grasps at start and goal: as given, else drawn with every n-1 fingers closed.
pub fn ends(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<(GraspState, GraspState), Stop> {
    let (start_pose, goal_pose) = (search.start, search.goal);
    let start = match start {
        Some(state) => state,
        None => draw_end(search, &start_pose)?,
    };
    search.note(&start);
    let goal = match goal_grasp {
        Some(state) => state.clone(),
        None => draw_end(search, &goal_pose)?,
    };
    Ok((start, goal))
}

fn draw_end(search: &mut Search, pose: &Pose) -> Result<GraspState, Stop> {
    loop {
        search.check()?;
        if let Some(state) = draw_state_at(search, pose) {
            return Ok(state);
        }
    }
}

/// Notes the newest node if it is joined to the start.
pub fn note_nearest(search: &mut Search, roadmap: &Roadmap) {
    let newest = roadmap.nodes().len() - 1;
    if newest > GOAL && roadmap.components().same(START, newest) {
        search.note(&roadmap.nodes()[newest].point);
    }
}

/// The motions along the cheapest path from start to goal, its paths in GS_n decomposed.
///
/// None when one could not be: that edge is then deleted, and the ends may be apart again (by measurement on a prototype).
pub fn solution(search: &mut Search, roadmap: &mut Roadmap) -> Result<Option<Sequence>, Stop> {
    let Some(path) = roadmap.path(START, GOAL) else { return Ok(None) };
    let mut way = Sequence::at(roadmap.nodes()[START].point.clone());
    for pair in path.nodes.windows(2) {
        let (edge, is_forward) = roadmap.edge_between(pair[0], pair[1]).expect("a path goes along edges");
        let (from, to) = (edge.from, edge.to);
        let link = edge.motion.clone();
        let motions = match link {
            Link::Steps(motions) => motions,
            Link::Grasp(path) => {
                let found = decompose(search, &path, &roadmap.nodes()[from].point, &roadmap.nodes()[to].point)?;
                let removed = roadmap.remove_edge_between(from, to).expect("the edge just decomposed");
                let Some(motions) = found else {
                    search.tally.add(Reason::NotDecomposed);
                    return Ok(None);
                };
                let motions = Rc::new(motions);
                roadmap.add_edge(from, to, Link::Steps(motions.clone()), removed.cost);
                motions
            }
        };
        let along = if is_forward { Sequence::clone(&motions) } else { motions.reversed() };
        way = way.then(along).expect("the motions of an edge go from exactly one of its nodes to exactly the other");
    }
    Ok(Some(way))
}
