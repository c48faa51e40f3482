//! explore(): samples GS_n by the random loop generator and links the samples inside it (Saut 2011, sec. 4.2.2;
//! Sahbani 2007, algorithm 2).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::grasps::sample::draw_state;
use crate::in_hand::searching::visibility::link::{GraspSpace, LocalMethod, Roadmap};
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_roadmap::space::Space;
use regrasp_roadmap::visibility_prm::Outcome;

/// One step of exploration: a sample, kept if it sees no guard or joins components.
pub fn explore(search: &mut Search, roadmap: &mut Roadmap, local_method: LocalMethod) -> Result<Outcome, Stop> {
    search.check()?;
    let Some(state) = draw_state(search) else { return Ok(Outcome::Invalid) };
    let mut space = GraspSpace { search, local_method, stop: None };
    let outcome = roadmap.consider(&mut space, state);
    match space.stop {
        Some(stop) => Err(stop),
        None => {
            search.n_nodes = roadmap.nodes().len() as u64;
            Ok(outcome)
        }
    }
}

/// A roadmap of two nodes, start and goal (nodes 0 and 1), linked if they see each other.
pub fn roadmap_of(
    search: &mut Search,
    start: &GraspState,
    goal: &GraspState,
    local_method: LocalMethod,
) -> Result<Roadmap, Stop> {
    let mut roadmap = Roadmap::new();
    let (first, second) = (roadmap.add_guard(start.clone()), roadmap.add_guard(goal.clone()));
    search.n_nodes = 2;
    let mut space = GraspSpace { search, local_method, stop: None };
    if let Some(link) = space.connect(start, goal) {
        let cost = space.distance(start, goal);
        roadmap.add_edge(first, second, link, cost);
    }
    match space.stop {
        Some(stop) => Err(stop),
        None => Ok(roadmap),
    }
}
