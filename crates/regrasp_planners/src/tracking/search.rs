//! The high level (Cherif 1999, sec. 5): A* over cells of the orientation space. Nodes are grasps; from each, nominal turns at
//! extreme velocities lead to sub-goals in cells that no grasp is in yet; the local planner finds out whether they do.
//!
//! Unlike Cherif 1999's: a sub-goal straight on is added; a local plan that ends elsewhere, where no grasp is, is a node too; the
//! distance left counts [`TrackingSettings::goal_weight`]; after [`TrackingSettings::patience`] sub-goals in vain the search ends.

use crate::tracking::gaiting::{Move, change_grasp};
use crate::tracking::grasp::{TrackingGrasp, turn_to};
use crate::tracking::local::{Failures, Homes, Local};
use crate::tracking::settings::{RollingFinger, TrackingMethod, TrackingSettings};
use crate::tracking::step::{Asked, Controls, Roles, Stepper};
use nalgebra::UnitQuaternion;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::contact::rolling::Touch;
use regrasp_manipulation::model::{FingerModel, Model};
use regrasp_manipulation::progress::Progress;
use regrasp_roadmap::{OpenList, Rank};
use std::collections::BTreeSet;

/// How often the grasp of one node is changed through the air. By hand.
const MOST_CHANGES: usize = 3;

/// A grasp that was reached.
pub struct Node {
    /// The grasp.
    pub grasp: TrackingGrasp,
    /// The node it was reached from.
    pub parent: Option<usize>,
    /// Motions from there.
    pub moves: Vec<Move>,
    /// How often its grasp was changed through the air to go on.
    n_changes: usize,
    /// Length of the way in orientation space.
    length: f64,
}

/// A sub-goal that has still to be tried.
struct SubGoal {
    node: usize,
    orientation: UnitQuaternion<f64>,
    is_goal: bool,
}

/// Counts of a search, as in Cherif 1999, tables 4 and 5.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Cells that sub-goals are in: the nodes of Cherif 1999's graph.
    pub nodes: u64,
    /// Sub-goals that the local planner was asked for.
    pub explored: u64,
    /// Sub-goals on the path.
    pub on_path: u64,
    /// Steps that failed, by number.
    pub failures: Failures,
    /// Searches begun anew.
    pub restarts: u64,
    /// Steps and choices of roles that were tried, [`crate::tracking::step::STEP_WORK`] each.
    pub work: u64,
}

/// Why a search ended without a path.
pub enum Ended {
    /// No sub-goal is left.
    Exhausted,
    /// The budget.
    Interrupted(Interrupt),
}

/// Cells of the orientation space: orientation vectors about the middle of the way, from where half a turn is far off.
struct Cells {
    middle: UnitQuaternion<f64>,
    edge: f64,
}

impl Cells {
    fn of(&self, orientation: &UnitQuaternion<f64>) -> [i32; 3] {
        let vector = turn_to(&self.middle, orientation);
        [0, 1, 2].map(|axis| (vector[axis] / self.edge).round() as i32)
    }
}

/// The graph of Cherif 1999, as far as it has been made.
struct Graph<'g> {
    settings: &'g TrackingSettings,
    goal: UnitQuaternion<f64>,
    cells: Cells,
    nodes: Vec<Node>,
    /// Cells that a grasp is in.
    taken: BTreeSet<[i32; 3]>,
    /// Cells that a grasp is in or may come into: the nodes of Cherif 1999's graph.
    seen: BTreeSet<[i32; 3]>,
    /// Sub-goals by the length of the way through them plus the distance from them to the goal; of equals, the first made.
    open: OpenList<SubGoal>,
    /// Sub-goals made.
    n_made: usize,
    /// The node nearest to the goal, and the angle left.
    nearest: (usize, f64),
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

impl<'g> Graph<'g> {
    fn new(settings: &'g TrackingSettings, start: &TrackingGrasp, goal: &UnitQuaternion<f64>) -> Self {
        let orientation = start.orientation();
        let middle = UnitQuaternion::from_scaled_axis(0.5 * turn_to(&orientation, goal)) * orientation;
        let mut graph = Graph {
            settings,
            goal: *goal,
            cells: Cells { middle, edge: settings.cell },
            nodes: Vec::new(),
            taken: BTreeSet::new(),
            seen: BTreeSet::new(),
            open: OpenList::new(),
            n_made: 0,
            nearest: (0, f64::INFINITY),
        };
        let target = graph.cells.of(&orientation);
        graph.add(Node { grasp: start.clone(), parent: None, moves: Vec::new(), n_changes: 0, length: 0.0 }, target);
        graph
    }

    /// Adds a node that was reached by planning to a sub-goal in `target`, and its sub-goals; true at the goal.
    fn add(&mut self, node: Node, target: [i32; 3]) -> bool {
        let left = turn_to(&node.grasp.orientation(), &self.goal).norm();
        let index = self.nodes.len();
        if left < self.nearest.1 {
            self.nearest = (index, left);
        }
        self.taken.insert(target);
        self.seen.insert(target);
        self.nodes.push(node);
        let is_goal = left <= self.settings.goal_tolerance;
        if !is_goal {
            self.expand(index);
        }
        is_goal
    }

    /// Adds the sub-goals of a node: turns at extreme velocities about the axes of the world, one straight to the goal, and the
    /// goal itself where it is as near: that one is tried although its cell may be taken.
    fn expand(&mut self, node: usize) {
        let turn = self.settings.object_velocity * self.settings.sub_goal_time;
        let from = self.nodes[node].grasp.orientation();
        let left = turn_to(&from, &self.goal);
        if left.amax() <= turn {
            self.open(node, &from, self.goal, true);
        }
        self.open(node, &from, UnitQuaternion::from_scaled_axis(left * (turn / left.amax()).min(1.0)) * from, false);
        for x in -1..=1 {
            for y in -1..=1 {
                for z in -1..=1 {
                    let velocity = Vector::new(f64::from(x), f64::from(y), f64::from(z));
                    if velocity != Vector::zeros() {
                        self.open(node, &from, UnitQuaternion::from_scaled_axis(velocity * turn) * from, false);
                    }
                }
            }
        }
    }

    fn open(&mut self, node: usize, from: &UnitQuaternion<f64>, orientation: UnitQuaternion<f64>, is_goal: bool) {
        let cell = self.cells.of(&orientation);
        if !is_goal && self.taken.contains(&cell) {
            return;
        }
        self.seen.insert(cell);
        let way = turn_to(from, &orientation).norm();
        let left = turn_to(&orientation, &self.goal).norm();
        let estimate = self.nodes[node].length + way + self.settings.goal_weight * left;
        self.open.push(Rank::of(estimate, self.n_made), SubGoal { node, orientation, is_goal });
        self.n_made += 1;
    }

    fn ended(self, last: Result<usize, Ended>) -> Found {
        Found { nodes: self.nodes, last, nearest: self.nearest }
    }
}

/// The finger that the object rolls on all the time: the one on which most other fingers can move while it begins to turn as
/// `turn` has it; or, where it is drawn, those more often.
fn rolling_finger(stepper: &mut Stepper, start: &TrackingGrasp, turn: &Vector, rng: &mut Rng, is_drawn: bool) -> usize {
    let n = stepper.model.n_fingers();
    let settings = stepper.settings;
    let step = turn * (settings.object_velocity * settings.time_step / turn.amax());
    let mut worth = |rolling: usize| {
        let mut along = 0.0;
        for roles in Roles::all(n, stepper.resting).filter(|roles| roles.rolling == rolling) {
            stepper.workspace.set(&start.world_from_object.to_pose(), &start.joints, &start.contacts());
            let asked = Asked { roles, turn: Some(step), rolled: Controls::default(), seconds: settings.time_step };
            if let Ok(made) = stepper.step(start, &asked) {
                let turned = turn_to(&start.orientation(), &made.end.orientation());
                along += turned.dot(turn) / (turned.norm() * turn.norm());
            }
        }
        along
    };
    let worths: Vec<f64> = (0..n).map(|finger| worth(finger).max(1e-3)).collect();
    let mut left = if is_drawn { rng.uniform(0.0, worths.iter().sum()) } else { f64::INFINITY };
    let drawn = worths.iter().position(|worth| {
        left -= worth;
        left < 0.0
    });
    drawn.unwrap_or_else(|| (0..n).max_by(|&a, &b| worths[a].total_cmp(&worths[b])).unwrap_or(0))
}

/// True where every fingertip reaches its place on the object when that has turned to `goal` where it is. Then fingers first go back to
/// these places (Cherif 1999, sec. 4.1.2), also in two of four searches that are begun anew; else they first change their faces.
fn can_follow(model: &Model, start: &TrackingGrasp, goal: &UnitQuaternion<f64>) -> bool {
    let Some(reach) = model.view.reach else { return true };
    let turned = Pose::from_parts(start.world_from_object.to_pose().translation, *goal);
    let away = |(touch, finger): (&Touch, &FingerModel)| (turned * touch.ball.center - finger.tip_at_rest).norm();
    start.touches.iter().zip(&model.fingers).all(|pair| away(pair) <= reach)
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
    let rolling = match settings.rolling_finger {
        RollingFinger::Any => None,
        RollingFinger::Once => {
            Some(rolling_finger(stepper, start, &turn_to(&start.orientation(), goal), rng, counts.restarts > 0))
        }
    };
    let mut graph = Graph::new(settings, start, goal);
    let nodes_before = counts.nodes;
    let keep_faces = !settings.face_changes || (counts.restarts % 4 < 2) == can_follow(stepper.model, start, goal);
    let homes = Homes::of(stepper.model, start, keep_faces, settings.range_coverage);
    if graph.nearest.1 <= settings.goal_tolerance {
        return graph.ended(Ok(0));
    }
    let mut without_gain = 0;
    while let Some((_, best)) = graph.open.pop() {
        if let Err(interrupt) = budget.check(counts.work) {
            return graph.ended(Err(Ended::Interrupted(interrupt)));
        }
        if graph.nodes.len() > settings.nodes || without_gain > settings.patience {
            break;
        }
        let target = graph.cells.of(&best.orientation);
        if !best.is_goal && graph.taken.contains(&target) {
            continue;
        }
        counts.explored += 1;
        without_gain += 1;
        let nearest_before = graph.nearest.0;
        let from = &graph.nodes[best.node];
        let before: Option<Roles> = match from.moves.last() {
            Some(Move::Step(step)) => Some(step.roles),
            _ => None,
        };
        let work_before = stepper.work;
        let mut local = Local { stepper, rng, rolling, homes: &homes, failures: &mut counts.failures };
        let planned = local.plan(&from.grasp, &best.orientation, settings.goal_tolerance, before);
        let gaits =
            !planned.arrived && settings.method == TrackingMethod::TrackingAndGaiting && from.n_changes < MOST_CHANGES;
        let changed = if gaits { change_grasp(&mut local, &from.grasp, goal) } else { None };
        graph.nodes[best.node].n_changes += usize::from(gaits);
        counts.work += stepper.work - work_before;
        let was_relocated = changed.is_some();
        let moves: Vec<Move> = changed.unwrap_or_else(|| planned.steps.into_iter().map(Move::from).collect());
        let Some(grasp) = moves.last().map(|last| last.end().clone()) else { continue };
        let target = if planned.arrived { target } else { graph.cells.of(&grasp.orientation()) };
        // A grasp with a finger elsewhere is another one in the same cell.
        if !planned.arrived && !was_relocated && graph.taken.contains(&target) {
            continue;
        }
        let from = &graph.nodes[best.node];
        let length = from.length + turn_to(&from.grasp.orientation(), &grasp.orientation()).norm();
        let is_goal = graph.add(Node { grasp, parent: Some(best.node), moves, n_changes: 0, length }, target);
        if graph.nearest.0 != nearest_before {
            without_gain = 0;
        }
        counts.nodes = nodes_before + graph.seen.len() as u64;
        progress(Progress {
            nodes: graph.nodes.len() as u64,
            work: counts.work,
            restarts: counts.restarts,
            angle_left: graph.nearest.1,
        });
        if is_goal {
            let last = graph.nodes.len() - 1;
            return graph.ended(Ok(last));
        }
    }
    graph.ended(Err(Ended::Exhausted))
}
