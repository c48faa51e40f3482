//! A graph in which fingertips roll (Sahbani 2007, sec. IV-C and IV-D).
//!
//! Where fingertips roll to depends on the way that they came. So a graph of a few contacts that all places share, as where contacts
//! stay, would hold no two grasps that a transfer joins. Instead some grasps of every place are hubs: each is rolled to all places nearby that
//! it reaches, and ends there at contacts of its own. Relocations then lead from where other hubs have rolled to the hub of the place. A
//! way from one place to another is mostly two transfers with one grasp: back to its hub, and on to the other place.
//!
//! All of it is proven, and kept with forces and times. The paper's graph keeps paths that every query has to make motions of.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::moving::transfer::transfer;
use crate::in_hand::regrasping::change::{Arrival, change_grasp_over, whole_transfer};
use crate::in_hand::roadmap::graph::Leg;
use crate::in_hand::roadmap::grasps::apart;
use crate::in_hand::roadmap::stage::{AtPlace, Found, Origin};
use crate::in_hand::roadmap::track::{legs_of_pieces, pieces_of};
use crate::in_hand::searching::gait;
use crate::in_hand::searching::shorten::shorten;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;
use std::collections::BTreeSet;

/// Grasps of a place of which those become hubs that get farthest on the way to places nearby.
const CANDIDATES: usize = 32;
/// Places that all are tried with before the worse half is given up, as often as needed.
const TRIALS: usize = 4;
/// Grasps of other hubs at a place that are joined to its hub.
const JOINED: usize = 4;
/// Nearest places to whose hub a way is looked for as one looks for a plan.
const LINKED: usize = 4;
/// Configurations that such a way may cost: some times as many as usual single queries take.
const LINK_WORK: u64 = 10_000;
/// Grasps of other hubs that are tried for that, those most similar to the hub first.
const TRIED: usize = 12;

/// Hubs of a place, at most `n_hubs`, rolled to the places `near` it.
pub(super) fn rolled(search: &mut Search, at: &AtPlace, near: &[u32], n_hubs: usize) -> Result<Vec<Found>, Stop> {
    let pose_of = |place: u32| at.graph.places[place as usize];
    let mut nodes = at.nodes().to_vec();
    search.rng.shuffle(&mut nodes);
    let mut candidates: Vec<(f64, u32, GraspState)> =
        nodes.into_iter().take(CANDIDATES).map(|node| (0.0, node, at.graph.state(node as usize))).collect();
    let mut trials = near.to_vec();
    search.rng.shuffle(&mut trials);
    let mut trials = trials.as_slice();
    while candidates.len() > n_hubs && !trials.is_empty() {
        let (now, later) = trials.split_at(TRIALS.min(trials.len()));
        for (reached, _, state) in &mut candidates {
            search.check()?;
            *reached += now.iter().map(|&place| share_of_way(search, state, &pose_of(place))).sum::<f64>();
        }
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        candidates.truncate((candidates.len() / 2).max(n_hubs));
        trials = later;
    }
    candidates.truncate(n_hubs);
    let mut found = Vec::new();
    for (_, node, state) in &candidates {
        for &place in near {
            search.check()?;
            let Some(way) = whole_transfer(search, state, &pose_of(place)) else { continue };
            let legs = legs_with_forces(search, at, &way, place);
            found.extend(legs.map(|legs| Found { origin: Origin::Node(*node), legs }));
        }
    }
    Ok(found)
}

/// Share of the way to a pose that a grasp rolls.
fn share_of_way(search: &mut Search, state: &GraspState, goal: &Pose) -> f64 {
    transfer(&mut search.workspace, state, goal, &mut Vec::new())
}

/// At a place, relocations from grasps that other hubs have rolled to there to its own hubs; between these; and motions to a hub of some
/// of the places `near` it.
pub(super) fn joined(search: &mut Search, at: &AtPlace, near: &[u32]) -> Result<Vec<Found>, Stop> {
    let transfers = || at.graph.edges.iter().filter(|edge| edge.passage.is_transfer());
    let place_of = |node: u32| at.graph.nodes[node as usize].place;
    let here = at.place as u32;
    let hubs: BTreeSet<u32> = transfers().map(|edge| edge.from).filter(|&node| place_of(node) == here).collect();
    let rolled: BTreeSet<u32> = transfers().map(|edge| edge.to).filter(|&node| place_of(node) == here).collect();
    let model = search.model();
    let state_of = |node: u32| at.graph.state(node as usize);
    let mut pool = Pool::new(&at.pose, &at.pose, model.n_fingers());
    let mut found = Vec::new();
    for &hub in &hubs {
        let goal = state_of(hub);
        let far = |grasp: &GraspState| -> f64 {
            goal.contacts.iter().zip(&grasp.contacts).map(|(a, b)| apart(model, a, b)).sum()
        };
        // Of two hubs of the place the second is changed into the first.
        let others = rolled.iter().chain(hubs.iter().filter(|&&other| other > hub));
        let mut others: Vec<(f64, u32, GraspState)> =
            others.map(|&node| (node, state_of(node))).map(|(node, state)| (far(&state), node, state)).collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut n_joined = 0;
        for (_, node, state) in others.into_iter().take(TRIED) {
            search.check()?;
            let mut rng = Rng::child(&search.rng, "joined", u64::from(node));
            let way = change_grasp_over(search, &Sequence::at(state), &goal, &mut pool, &mut rng);
            let legs = way.and_then(|way| legs_with_forces(search, at, &way, here));
            let Some(legs) = legs else { continue };
            found.push(Found { origin: Origin::Node(node), legs });
            n_joined += 1;
            if n_joined == JOINED {
                break;
            }
        }
    }
    let Some(&hub) = hubs.first() else { return Ok(found) };
    for (index, &other) in near.iter().take(LINKED).enumerate() {
        let Some(to) = transfers().map(|edge| edge.from).find(|&node| place_of(node) == other) else { continue };
        let goal = state_of(to);
        let mut own = search.for_detour(LINKED * at.place + index, LINK_WORK);
        own.begin_leg(0, at.pose, goal.world_from_object);
        let way = match gait::grow(&mut own, Some(state_of(hub)), Some(&goal)) {
            Err(Stop::Restart) => None,
            way => Some(way?),
        };
        if let Some(mut way) = way {
            shorten(&mut own, &mut way, Arrival::Exact);
            let legs = legs_with_forces(&own, at, &way, other);
            found.extend(legs.map(|legs| Found { origin: Origin::Node(hub), legs }));
        }
        search.workspace.work += own.workspace.work;
    }
    Ok(found)
}

/// The motions of `way`, which ends at place `to`, with forces and times, if there are forces at every moment.
fn legs_with_forces(search: &Search, at: &AtPlace, way: &Sequence, to: u32) -> Option<Vec<Leg>> {
    let pieces = pieces_of(search.model(), way).ok()?;
    let end = at.graph.places[to as usize];
    legs_of_pieces(&at.graph.footholds, way, &pieces, |pose| (*pose == end).then_some(to))
}
