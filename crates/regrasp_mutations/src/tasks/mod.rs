//! Plans of pick and place, broken in one known way each. Where the plan itself says too little to be broken so, the scene changes: the table
//! is lower, ends below the object's centre of mass, or is more slippery.

/// Contacts and forces.
mod contacts;
/// Who holds, and in which order.
mod holders;
/// Motions in a hand.
mod in_hand;
/// What rests, and what goes with a hand.
mod rest;
/// Other scenes.
mod world;

use regrasp_base::Rng;
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_plan::robot_plan::{RobotPlan, RobotSegment, RobotSegmentKind};
use regrasp_scene::{PickAndPlaceQuery, Scene, State};

/// A broken plan of pick and place, with what it is judged in.
#[derive(Debug, Clone)]
pub struct TaskMutant {
    /// What was done to it.
    pub name: &'static str,
    /// The broken plan.
    pub plan: RobotPlan,
    /// The scene to judge it in, where that is what was changed.
    pub scene: Option<Scene>,
    /// Where everything rests, where that was changed.
    pub state: Option<State>,
    /// What is asked, where that was changed.
    pub query: Option<PickAndPlaceQuery>,
    /// At least one of these must be reported; others may follow from them.
    pub expected: Vec<Kind>,
}

/// All mutants that `plan`, which must be a good answer to `query`, has; places and amounts are drawn from `rng`.
///
/// Kinds of damage that the plan offers no place for are left out.
pub fn task_mutants(
    plan: &RobotPlan,
    (scene, state): (&Scene, &State),
    query: &PickAndPlaceQuery,
    rng: &mut Rng,
) -> Vec<TaskMutant> {
    let mut breeder = Breeder { plan, scene, state, query, rng, found: Vec::new() };
    breeder.break_header();
    breeder.break_holders();
    breeder.break_rest();
    breeder.break_contacts();
    breeder.break_forces();
    breeder.break_in_hand();
    breeder.break_world();
    breeder.found
}

struct Breeder<'a> {
    plan: &'a RobotPlan,
    scene: &'a Scene,
    state: &'a State,
    query: &'a PickAndPlaceQuery,
    rng: &'a mut Rng,
    found: Vec<TaskMutant>,
}

/// A number drawn evenly over the orders of magnitude from `low` to `high`.
fn log_uniform(rng: &mut Rng, low: f64, high: f64) -> f64 {
    rng.uniform(low.ln(), high.ln()).exp()
}

/// Either sign.
fn sign(rng: &mut Rng) -> f64 {
    if rng.chance(0.5) { 1.0 } else { -1.0 }
}

/// One of several; none of none.
fn one_of<T: Copy>(rng: &mut Rng, several: &[T]) -> Option<T> {
    several.get(rng.below(several.len().max(1))).copied()
}

impl Breeder<'_> {
    fn push(
        &mut self,
        name: &'static str,
        expected: &[Kind],
        change: impl FnOnce(&mut TaskMutant, &mut Rng) -> Option<()>,
    ) {
        let plan = self.plan.clone();
        let mut mutant = TaskMutant { name, plan, scene: None, state: None, query: None, expected: expected.to_vec() };
        if change(&mut mutant, self.rng).is_some() {
            self.found.push(mutant);
        }
    }

    fn add(
        &mut self,
        name: &'static str,
        expected: &[Kind],
        damage: impl FnOnce(&mut RobotPlan, &mut Rng) -> Option<()>,
    ) {
        self.push(name, expected, |mutant, rng| damage(&mut mutant.plan, rng));
    }

    /// Who holds the object in a segment.
    fn holders(&self, segment: &RobotSegment) -> Vec<String> {
        self.plan.objects.first().and_then(|object| segment.held_by.get(object)).cloned().unwrap_or_default()
    }

    fn is_hand(&self, name: &str) -> bool {
        self.plan.hands.iter().any(|hand| hand.name == name)
    }

    /// Hands that hold in a segment; none in a transfer or regrasp, which is broken in ways of its own (`in_hand`).
    fn hands_in(&self, s: usize) -> Vec<String> {
        let segment = self.plan.segments.get(s).filter(|segment| !segment.kind.is_in_hand());
        let names = segment.map_or(Vec::new(), |segment| self.holders(segment));
        names.into_iter().filter(|name| self.is_hand(name)).collect()
    }

    /// Segments that fulfil a condition.
    fn segments(&self, is_such: impl Fn(usize) -> bool) -> Vec<usize> {
        (0..self.plan.segments.len()).filter(|s| is_such(*s)).collect()
    }

    fn kind(&self, s: usize) -> RobotSegmentKind {
        self.plan.segments[s].kind
    }

    /// Carries in which one hand moves the object.
    fn moving_carries(&self) -> Vec<usize> {
        self.segments(|s| self.kind(s) == RobotSegmentKind::Carry && self.holders(&self.plan.segments[s]).len() == 1)
    }

    /// Moments of rest in which two hands hold.
    fn exchanges(&self) -> Vec<usize> {
        self.segments(|s| self.hands_in(s).len() == 2)
    }

    fn break_header(&mut self) {
        self.add("another file", &[Kind::InputHashMismatch], |plan, rng| {
            let k = rng.below(plan.inputs.len());
            plan.inputs[k].sha256 = format!("{:064x}", rng.below(usize::MAX));
            Some(())
        });
        self.add("an answer to another task", &[Kind::WrongScene], |plan, _| {
            plan.query.push('x');
            Some(())
        });
        self.add("another object", &[Kind::WrongScene], |plan, _| {
            plan.objects[0].push('x');
            Some(())
        });
        self.add("a hand without one of its fingers", &[Kind::WrongScene], |plan, rng| {
            let hand = rng.below(plan.hands.len());
            plan.hands[hand].fingers.pop().map(|_| ())
        });
        self.add("no promises of holding", &[Kind::PromiseBroken], |plan, _| plan.promises.holding.take().map(|_| ()));
        self.add("contact tolerance above what is accepted", &[Kind::PromiseBroken], |plan, rng| {
            plan.promises.holding.as_mut()?.contact_tolerance = log_uniform(rng, 5.01e-4, 0.1);
            Some(())
        });
        let asked = self.scene.limits.friction_margin.unwrap_or(1.5);
        self.add("friction margin below what is asked for", &[Kind::FrictionMarginTooSmall], |plan, rng| {
            plan.promises.holding.as_mut()?.friction_margin = asked * rng.uniform(0.5, 0.999);
            Some(())
        });
        self.add("another torque scale", &[Kind::PromiseBroken], |plan, rng| {
            plan.promises.holding.as_mut()?.torque_scale *= 1.0 + sign(rng) * log_uniform(rng, 1e-6, 0.5);
            Some(())
        });
        let limit = self.scene.limits.normal_force;
        self.add("normal force promised above the scene's", &[Kind::LimitExceeded], |plan, rng| {
            plan.promises.holding.as_mut()?.normal_force[1] = limit * log_uniform(rng, 1.001, 100.0);
            Some(())
        });
        self.add("closure margin promised that is not kept", &[Kind::ClosureLost], |plan, rng| {
            plan.promises.holding.as_mut()?.required_margin = rng.uniform(0.8, 2.0);
            Some(())
        });
        self.add("a number that is none", &[Kind::NotANumber], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let joints = &mut plan.segments[s].waypoints[0].joints;
            let k = rng.below(joints.len());
            joints[k] = f64::NAN;
            Some(())
        });
        let n_joints = self.query.start.len();
        for (name, kind, is_start) in
            [("start elsewhere", Kind::StartMismatch, true), ("end elsewhere", Kind::GoalMismatch, false)]
        {
            self.push(name, &[kind], |mutant, rng| {
                let mut query = self.query.clone();
                let joints = if is_start { &mut query.start } else { &mut query.end };
                joints[rng.below(n_joints)] += sign(rng) * log_uniform(rng, 1.1e-6, 0.1);
                mutant.query = Some(query);
                Some(())
            });
        }
        for (name, kind, is_start) in [
            ("object asked for elsewhere at the start", Kind::StartMismatch, true),
            ("object asked for elsewhere at the goal", Kind::GoalMismatch, false),
        ] {
            self.push(name, &[kind], |mutant, rng| {
                let mut query = self.query.clone();
                let pose =
                    if is_start { &mut query.world_from_object_start } else { &mut query.world_from_object_goal };
                pose.translation.vector +=
                    regrasp_geometry::Vector::from(rng.direction()) * log_uniform(rng, 1.1e-6, 0.1);
                mutant.query = Some(query);
                Some(())
            });
        }
        self.add("one percent too fast", &[Kind::JointTooFast], |plan, _| {
            let speed = largest_speed(plan)?;
            for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
                waypoint.time *= speed / 1.01;
                waypoint.joint_velocities.iter_mut().for_each(|velocity| *velocity *= 1.01 / speed);
            }
            Some(())
        });
        self.add("a segment that does not move at its own time", &[Kind::TimeOrder], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len() - 1);
            waypoints[w + 1].time = waypoints[w].time;
            Some(())
        });
        self.add("two segments in another order", &[Kind::SegmentsDoNotMeet, Kind::TimeOrder], |plan, rng| {
            let s = rng.below(plan.segments.len() - 1);
            plan.segments.swap(s, s + 1);
            Some(())
        });
    }
}

/// The largest speed of any joint, as a share of what is promised.
fn largest_speed(plan: &RobotPlan) -> Option<f64> {
    use regrasp_plan::check::robots::motion::RobotStep;
    let steps = plan.segments.iter().flat_map(|segment| segment.waypoints.windows(2));
    let largest = |pair: &[regrasp_plan::robot_plan::RobotWaypoint]| {
        let step = RobotStep::new(&pair[0], &pair[1]);
        let share = |k: usize| step.cubic(k).largest_slope() / step.span / plan.promises.joint_velocities[k];
        (0..step.n_joints()).map(share).fold(0.0, f64::max)
    };
    Some(steps.map(largest).fold(0.0, f64::max)).filter(|speed| *speed > 0.0)
}
