//! explore(): samples GS_n by the random loop generator and links the samples inside it (Saut 2011, sec. 4.2.2;
//! Sahbani 2007, algorithm 2).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::grasps::sample::draw_state;
use crate::in_hand::searching::visibility::link::{GraspSpace, Link, LocalMethod, Roadmap};
use regrasp_base::Rng;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_roadmap::space::Space;

/// Grasps that one component sees: the roadmap does not keep them, but each may be where that component is joined to others.
#[derive(Debug, Default)]
pub struct Spares {
    spares: Vec<Spare>,
}

/// One of them.
#[derive(Debug)]
pub struct Spare {
    /// The grasp.
    pub state: GraspState,
    /// The guard that sees it.
    pub guard: usize,
    /// From the grasp to the guard.
    pub link: Link,
}

/// Most grasps remembered; the oldest are forgotten first.
const MOST_SPARES: usize = 1000;

impl Spares {
    /// Any of them, which is then forgotten.
    pub fn draw(&mut self, rng: &mut Rng) -> Option<Spare> {
        if self.spares.is_empty() {
            return None;
        }
        Some(self.spares.swap_remove(rng.below(self.spares.len())))
    }

    fn keep(&mut self, spare: Spare) {
        if self.spares.len() == MOST_SPARES {
            self.spares.remove(0);
        }
        self.spares.push(spare);
    }
}

/// One step of exploration: a grasp, kept if it sees no guard or joins components, else spared. Poses are drawn until one has
/// a grasp, so that alpha weighs grasps against connections, as in both papers, whatever share of poses has none.
pub fn explore(
    search: &mut Search,
    roadmap: &mut Roadmap,
    local_method: LocalMethod,
    spares: &mut Spares,
) -> Result<(), Stop> {
    let state = loop {
        search.check()?;
        if let Some(state) = draw_state(search) {
            break state;
        }
    };
    let mut space = GraspSpace { search, local_method, stop: None };
    let mut seen = roadmap.guards_seen(&mut space, &state);
    if let Some(stop) = space.stop {
        return Err(stop);
    }
    match (seen.len(), seen.pop()) {
        (1, Some((guard, link))) => spares.keep(Spare { state, guard, link }),
        (_, None) => {
            roadmap.add_guard(state);
        }
        (_, Some(last)) => {
            seen.push(last);
            roadmap.add_linked(&space, state, seen);
        }
    }
    search.n_nodes = roadmap.nodes().len() as u64;
    Ok(())
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
