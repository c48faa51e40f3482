//! Two gait trees, from the start and from the goal, that grow until they meet.
//!
//! In place of sampling GS_n and linking (paper 000, section 4.2) the trees only ever hold what is feasible. Motions can be
//! gone backwards, so what leads from the goal leads to it.

use super::candidates::draw_pose;
use super::link::reversed;
use super::search::{Search, Stop};
use super::shorten::change_grasp;
use super::state::{GraspState, Step};
use super::tree::Tree;
use regrasp_base::Rng;
use regrasp_geometry::Pose;

/// Nodes at a common pose whose grasps are tried to be joined.
const JOINS: usize = 4;

/// Where an extension aims.
enum Target {
    /// The other end of the query.
    Aim,
    /// A pose that the other tree has reached.
    Other(usize),
    /// Some pose near the way.
    Anywhere(Pose),
}

/// Looks for a sequence of motions from `start` (or from a grasp of its own choice) to the goal pose, and there to the
/// grasp `goal_grasp` if one is asked for.
pub fn grow(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<(GraspState, Vec<Step>), Stop> {
    let (start_pose, goal_pose) = (search.start, search.goal);
    let mut trees = [
        Tree::new(search, &start_pose, &goal_pose, start.as_ref()),
        Tree::new(search, &goal_pose, &start_pose, goal_grasp),
    ];
    let mut growing = 0;
    loop {
        search.check()?;
        search.n_nodes = (trees[0].nodes.len() + trees[1].nodes.len()) as u64;
        let target = draw_target(search, &trees, growing);
        let pose = match &target {
            Target::Aim => trees[growing].aim,
            Target::Other(place) => *trees[1 - growing].places[*place].pool.world_from_object(),
            Target::Anywhere(pose) => *pose,
        };
        if let Some(node) = trees[growing].grow(search, &pose) {
            if growing == 0 {
                let state = trees[0].nodes[node].state.clone();
                search.note(&state);
            }
            if let Some(solution) = meet(search, &trees, growing, node, &target) {
                return Ok(solution);
            }
        }
        // The smaller tree grows, so that an easy end does not starve a hard one.
        growing = usize::from(trees[1].nodes.len() < trees[0].nodes.len());
        if search.rng.chance(0.2) {
            growing = 1 - growing;
        }
    }
}

fn draw_target(search: &mut Search, trees: &[Tree; 2], growing: usize) -> Target {
    let other = &trees[1 - growing];
    if !search.rng.chance(search.model().settings.goal_share) {
        return Target::Anywhere(draw_pose(search.model(), &search.start, &search.goal, &mut search.rng));
    }
    if other.places.len() > 1 && search.rng.chance(OTHER_SHARE) {
        return Target::Other(search.rng.below(other.places.len()));
    }
    Target::Aim
}

/// Share of purposeful extensions that aim at what the other tree has reached.
const OTHER_SHARE: f64 = 0.4;

/// The whole way, if `node` of the growing tree completes it.
fn meet(
    search: &mut Search,
    trees: &[Tree; 2],
    growing: usize,
    node: usize,
    target: &Target,
) -> Option<(GraspState, Vec<Step>)> {
    let (tree, other) = (&trees[growing], &trees[1 - growing]);
    let state = &tree.nodes[node].state;
    let place = match target {
        Target::Aim => 0,
        Target::Other(place) => *place,
        Target::Anywhere(_) => return None,
    };
    if state.world_from_object != *other.places[place].pool.world_from_object() {
        return None;
    }
    if place == 0 && other.root_is_free {
        return Some(in_order(growing, tree.trace(node), Vec::new(), None));
    }
    let nodes = &other.places[place].nodes;
    for _ in 0..JOINS.min(nodes.len()) {
        let there = nodes[search.rng.below(nodes.len())];
        let mut rng = Rng::child(&search.rng, "join", 0);
        search.rng.bits();
        if let Some(join) = change_grasp(search, state, &other.nodes[there].state, false, &mut rng) {
            return Some(in_order(growing, tree.trace(node), join, Some(other.trace(there))));
        }
    }
    None
}

/// From the start to the goal, whichever tree was growing: the way in the growing tree, the join, the way back in the
/// other one.
fn in_order(
    growing: usize,
    (root, mut steps): (GraspState, Vec<Step>),
    join: Vec<Step>,
    other: Option<(GraspState, Vec<Step>)>,
) -> (GraspState, Vec<Step>) {
    steps.extend(join);
    if let Some((other_root, other_steps)) = other {
        steps.extend(reversed(&other_root, &other_steps));
    }
    if growing == 0 {
        return (root, steps);
    }
    let start = steps.last().map_or_else(|| root.clone(), |step| step.end.clone());
    let back = reversed(&root, &steps);
    (start, back)
}
