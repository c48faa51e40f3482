//! The high level (paper 003, section 5): A* over cells of the orientation space. Nodes are grasps; from each, nominal turns at
//! extreme velocities lead to sub-goals in cells that no grasp is in yet; the local planner finds out whether they do.

use super::grasp::{TrackingGrasp, turn_to};
use super::local::{Failures, Local, once};
use super::step::{Roles, Step, Stepper};
use crate::in_hand::Progress;
use nalgebra::UnitQuaternion;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::Vector;
use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

/// A grasp that was reached.
pub struct Node {
    /// The grasp.
    pub grasp: TrackingGrasp,
    /// The node it was reached from.
    pub parent: Option<usize>,
    /// Steps from there.
    pub steps: Vec<Step>,
    /// Length of the way in orientation space.
    length: f64,
}

/// A sub-goal that has still to be tried.
struct Open {
    /// Length of the way through it plus the distance from it to the goal.
    estimate: f64,
    /// Number in the order of making: breaks ties.
    number: usize,
    node: usize,
    orientation: UnitQuaternion<f64>,
    is_goal: bool,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    /// The least estimate is the greatest.
    fn cmp(&self, other: &Self) -> Ordering {
        other.estimate.total_cmp(&self.estimate).then_with(|| other.number.cmp(&self.number))
    }
}

/// Counts of a search, as in paper 003, tables 4 and 5.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Sub-goals made: the nodes of the paper's graph.
    pub nodes: u64,
    /// Sub-goals that the local planner was asked for.
    pub explored: u64,
    /// Sub-goals on the path.
    pub on_path: u64,
    /// Steps that failed, by number.
    pub failures: Failures,
    /// Searches begun anew.
    pub restarts: u64,
    /// Steps tried.
    pub work: u64,
}

/// Why a search ended without a path.
pub enum Ended {
    /// No sub-goal is left.
    Exhausted,
    /// The budget.
    Interrupted(Interrupt),
}

/// What was found: the nodes, and the last of the path, or why there is none and which came nearest.
pub struct Found {
    /// All nodes.
    pub nodes: Vec<Node>,
    /// The last node of the path.
    pub last: Result<usize, Ended>,
    /// The node nearest to the goal, and the angle left.
    pub nearest: (usize, f64),
}

impl Found {
    /// The nodes from the start to `node`.
    pub fn path_to(&self, node: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(node), |&node| self.nodes[node].parent).collect();
        path.reverse();
        path
    }
}

/// Searches from `start` to the orientation `goal`.
pub fn search(
    stepper: &mut Stepper,
    start: &TrackingGrasp,
    goal: &UnitQuaternion<f64>,
    rng: &mut Rng,
    budget: &Budget,
    counts: &mut Counts,
    progress: &dyn Fn(Progress),
) -> Found {
    let settings = stepper.settings;
    let rolling = once(settings.rolling_finger, stepper.model.n_fingers(), rng);
    // Orientation vectors are about the middle of the way: half a turn is then far off.
    let start_orientation = start.orientation();
    let middle = UnitQuaternion::from_scaled_axis(0.5 * turn_to(&start_orientation, goal)) * start_orientation;
    let cell = |orientation: &UnitQuaternion<f64>| {
        let vector = turn_to(&middle, orientation);
        [0, 1, 2].map(|axis| (vector[axis] / settings.cell).round() as i32)
    };
    let mut nodes = vec![Node { grasp: start.clone(), parent: None, steps: Vec::new(), length: 0.0 }];
    let mut taken: BTreeSet<[i32; 3]> = BTreeSet::from([cell(&start_orientation)]);
    let mut open: BinaryHeap<Open> = BinaryHeap::new();
    let mut nearest = (0, turn_to(&start_orientation, goal).norm());
    if nearest.1 <= settings.goal_tolerance {
        return Found { nodes, last: Ok(0), nearest };
    }
    expand(stepper, &nodes, 0, goal, &mut open, counts, &taken, &cell);
    while let Some(best) = open.pop() {
        if let Err(interrupt) = budget.check(counts.work) {
            return Found { nodes, last: Err(Ended::Interrupted(interrupt)), nearest };
        }
        if nodes.len() > settings.nodes {
            break;
        }
        let target = cell(&best.orientation);
        if !best.is_goal && taken.contains(&target) {
            continue;
        }
        counts.explored += 1;
        let from = &nodes[best.node];
        let before: Option<Roles> = from.steps.last().map(|step| step.roles);
        let work_before = stepper.workspace.work;
        let mut local = Local { stepper, rng, rolling, failures: &mut counts.failures };
        let planned = local.plan(&from.grasp, &best.orientation, settings.goal_tolerance, before);
        counts.work += (stepper.workspace.work - work_before).max(1);
        let Some(last) = planned.steps.last().filter(|_| planned.arrived) else { continue };
        let grasp = last.end.clone();
        let orientation = grasp.orientation();
        let way = turn_to(&from.grasp.orientation(), &orientation).norm();
        let length = from.length + way;
        let node = nodes.len();
        nodes.push(Node { grasp, parent: Some(best.node), steps: planned.steps, length });
        taken.insert(target);
        let left = turn_to(&orientation, goal).norm();
        if left < nearest.1 {
            nearest = (node, left);
        }
        let Counts { work, restarts, .. } = *counts;
        progress(Progress { nodes: nodes.len() as u64, work, restarts, angle_left: nearest.1 });
        if left <= settings.goal_tolerance {
            return Found { nodes, last: Ok(node), nearest };
        }
        expand(stepper, &nodes, node, goal, &mut open, counts, &taken, &cell);
    }
    Found { nodes, last: Err(Ended::Exhausted), nearest }
}

/// Adds the sub-goals of a node: turns at extreme velocities about the axes of the world, and the goal where it is as near.
#[expect(clippy::too_many_arguments, reason = "the state of one search")]
fn expand(
    stepper: &Stepper,
    nodes: &[Node],
    node: usize,
    goal: &UnitQuaternion<f64>,
    open: &mut BinaryHeap<Open>,
    counts: &mut Counts,
    taken: &BTreeSet<[i32; 3]>,
    cell: &impl Fn(&UnitQuaternion<f64>) -> [i32; 3],
) {
    let settings = stepper.settings;
    let turn = settings.object_velocity * settings.sub_goal_time;
    let from = nodes[node].grasp.orientation();
    let left = turn_to(&from, goal);
    let mut add = |orientation: UnitQuaternion<f64>, is_goal: bool| {
        if !is_goal && taken.contains(&cell(&orientation)) {
            return;
        }
        let estimate = nodes[node].length
            + turn_to(&from, &orientation).norm()
            + settings.goal_weight * turn_to(&orientation, goal).norm();
        open.push(Open { estimate, number: counts.nodes as usize, node, orientation, is_goal });
        counts.nodes += 1;
    };
    if left.amax() <= turn {
        add(*goal, true);
    }
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                let velocity = Vector::new(f64::from(x), f64::from(y), f64::from(z));
                if velocity != Vector::zeros() {
                    add(UnitQuaternion::from_scaled_axis(velocity * turn) * from, false);
                }
            }
        }
    }
}
