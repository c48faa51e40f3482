//! Plans of whole robots, broken in one known way each. Where the plan itself says too little to be broken so, the scene changes:
//! a lamp stands where the elbow passes, a joint has a limit where it goes.

use regrasp_base::Rng;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_plan::check::robots::items::{Floors, Items, Owner};
use regrasp_plan::check::robots::motion::RobotStep;
use regrasp_plan::check::robots::question::Question;
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_plan::plan::{ContactMode, PoseData};
use regrasp_plan::robot_plan::{RobotContact, RobotPlan, RobotSegment, RobotWaypoint};
use regrasp_robot::Robot;
use regrasp_scene::{MotionGoal, MotionQuery, Obstacle, Scene, State};
use std::sync::Arc;

/// A broken plan of a whole robot, with what it is judged in.
#[derive(Debug, Clone)]
pub struct RobotMutant {
    /// What was done to it.
    pub name: &'static str,
    /// The broken plan.
    pub plan: RobotPlan,
    /// The scene to judge it in, where that is what was changed.
    pub scene: Option<Scene>,
    /// Where everything rests, where that was changed.
    pub state: Option<State>,
    /// What is asked, where that was changed.
    pub query: Option<MotionQuery>,
    /// At least one of these must be reported; others may follow from them.
    pub expected: Vec<Kind>,
}

/// All mutants that `plan`, which must be a good answer to `query`, has; places and amounts are drawn from `rng`.
///
/// Kinds of damage that the plan offers no place for are left out. Panics if the checker cannot read the plan.
pub fn robot_mutants(
    plan: &RobotPlan,
    (scene, state): (&Scene, &State),
    query: &MotionQuery,
    rng: &mut Rng,
) -> Vec<RobotMutant> {
    let mut question = Question::new(scene, Some(query), plan).expect("a good plan was checked in this scene");
    let first = plan.waypoints().next().expect("a good plan has waypoints");
    let held: Vec<Pose> = first.world_from_objects.iter().map(Pose::from).collect();
    question.take_hold(&first.joints, &held);
    let mut breeder = Breeder { plan, scene, state, query, question: &question, rng, found: Vec::new() };
    breeder.break_header();
    breeder.break_ends();
    breeder.break_times();
    breeder.break_limits();
    breeder.break_couplings();
    breeder.break_carried();
    breeder.break_room();
    breeder.found
}

struct Breeder<'a> {
    plan: &'a RobotPlan,
    scene: &'a Scene,
    state: &'a State,
    query: &'a MotionQuery,
    question: &'a Question<'a>,
    rng: &'a mut Rng,
    found: Vec<RobotMutant>,
}

/// A number drawn evenly over the orders of magnitude from `low` to `high`.
fn log_uniform(rng: &mut Rng, low: f64, high: f64) -> f64 {
    rng.uniform(low.ln(), high.ln()).exp()
}

/// A random waypoint.
fn any_waypoint<'p>(plan: &'p mut RobotPlan, rng: &mut Rng) -> &'p mut RobotWaypoint {
    let s = rng.below(plan.segments.len());
    let waypoints = &mut plan.segments[s].waypoints;
    let w = rng.below(waypoints.len());
    &mut waypoints[w]
}

/// Either sign.
fn sign(rng: &mut Rng) -> f64 {
    if rng.chance(0.5) { 1.0 } else { -1.0 }
}

impl Breeder<'_> {
    fn push(
        &mut self,
        name: &'static str,
        expected: &[Kind],
        change: impl FnOnce(&mut RobotMutant, &mut Rng) -> Option<()>,
    ) {
        let plan = self.plan.clone();
        let mut mutant = RobotMutant { name, plan, scene: None, state: None, query: None, expected: expected.to_vec() };
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

    fn break_header(&mut self) {
        self.add("joint that stands still invented", &[Kind::WrongScene], |plan, rng| {
            let held = &mut plan.robots[0].held_joints;
            held.insert("no_such_joint".into(), rng.uniform(-1.0, 1.0)).is_none().then_some(())
        });
        self.add("joint that stands still left out", &[Kind::WrongScene], |plan, _| {
            plan.robots[0].held_joints.pop_first().map(|_| ())
        });
        self.add("joint that stands still elsewhere", &[Kind::WrongScene], |plan, rng| {
            *plan.robots[0].held_joints.values_mut().next()? += rng.uniform(1e-6, 1e-3);
            Some(())
        });
        self.add("another file", &[Kind::InputHashMismatch], |plan, rng| {
            let k = rng.below(plan.inputs.len());
            plan.inputs[k].sha256 = format!("{:064x}", rng.below(usize::MAX));
            Some(())
        });
        self.add("a file left out", &[Kind::InputHashMismatch], |plan, rng| {
            plan.inputs.remove(rng.below(plan.inputs.len()));
            Some(())
        });
        self.add("another robot", &[Kind::WrongScene], |plan, _| {
            plan.robots[0].name.push('x');
            Some(())
        });
        self.add("joints in another order", &[Kind::WrongScene], |plan, rng| {
            let names = &mut plan.robots[0].joint_names;
            let k = rng.below(names.len() - 1);
            names.swap(k, k + 1);
            Some(())
        });
        self.add("an answer to another task", &[Kind::WrongScene], |plan, _| {
            plan.query.push('x');
            Some(())
        });
        self.add("a number that is none", &[Kind::NotANumber], |plan, rng| {
            let joints = &mut any_waypoint(plan, rng).joints;
            let k = rng.below(joints.len());
            joints[k] = f64::NAN;
            Some(())
        });
        self.add("contacts that are not judged", &[Kind::WrongContactMode], |plan, rng| {
            let (hand, object) = (plan.hands.first()?.name.clone(), plan.objects.first()?.clone());
            let finger = plan.hands[0].fingers.first()?.clone();
            let (point_in_object, normal_in_object) = ([0.0; 3], [0.0, 0.0, 1.0]);
            let contact = RobotContact {
                hand,
                finger,
                object,
                mode: ContactMode::Fixed,
                point_in_object,
                normal_in_object,
                force_in_object: None,
                torsion: None,
            };
            any_waypoint(plan, rng).contacts.push(contact);
            Some(())
        });
        let velocities = self.question.joint_names.clone();
        self.add("joint velocity promised above the robot's", &[Kind::LimitExceeded], |plan, rng| {
            let k = rng.below(velocities.len());
            plan.promises.joint_velocities[k] *= log_uniform(rng, 1.001, 1e6);
            Some(())
        });
        let limit = self.scene.limits.joint_acceleration;
        self.add("joint acceleration promised above the scene's", &[Kind::LimitExceeded], |plan, rng| {
            let k = rng.below(plan.promises.joint_accelerations.len());
            plan.promises.joint_accelerations[k] = limit * log_uniform(rng, 1.001, 1e6);
            Some(())
        });
    }

    fn break_ends(&mut self) {
        let n_joints = self.question.joint_names.len();
        self.add("start elsewhere", &[Kind::StartMismatch], |plan, rng| {
            let shift = sign(rng) * log_uniform(rng, 1.1e-6, 0.1);
            plan.segments[0].waypoints[0].joints[rng.below(n_joints)] += shift;
            Some(())
        });
        self.add("goal elsewhere", &[Kind::GoalMismatch], |plan, rng| {
            let shift = sign(rng) * log_uniform(rng, 1.1e-6, 0.1);
            plan.segments.last_mut()?.waypoints.last_mut()?.joints[rng.below(n_joints)] += shift;
            Some(())
        });
        self.push("goal asked for elsewhere", &[Kind::GoalMismatch], |mutant, rng| {
            let mut query = self.query.clone();
            match &mut query.goal {
                MotionGoal::Joints(joints) => joints[rng.below(n_joints)] += sign(rng) * log_uniform(rng, 1.1e-6, 0.1),
                MotionGoal::Wrists(wrists) => {
                    let k = rng.below(wrists.len());
                    let shift = Vector::from(rng.direction()) * log_uniform(rng, 1.1e-6, 0.1);
                    wrists[k].world_from_mount.translation.vector += shift;
                }
            }
            mutant.query = Some(query);
            Some(())
        });
        self.add("plan cut short", &[Kind::GoalMismatch], |plan, _| {
            let last = plan.segments.last_mut()?;
            let end = last.waypoints.last()?.joints.clone();
            last.waypoints.pop();
            let moved = last.waypoints.last()?.joints.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            (last.waypoints.len() >= 2 && moved > 1e-5).then_some(())
        });
        self.add("segments that do not meet", &[Kind::SegmentsDoNotMeet], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let w = 1 + rng.below(plan.segments[s].waypoints.len().checked_sub(2).filter(|n| *n > 0)?);
            let segment = &mut plan.segments[s];
            let mut rest = segment.waypoints[w..].to_vec();
            segment.waypoints.truncate(w + 1);
            rest[0].joints[rng.below(n_joints)] += sign(rng) * log_uniform(rng, 1.1e-9, 0.1);
            let second = RobotSegment { waypoints: rest, ..segment.clone() };
            plan.segments.insert(s + 1, second);
            Some(())
        });
    }

    fn break_times(&mut self) {
        self.add("time that stands still", &[Kind::TimeOrder], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len() - 1);
            waypoints[w + 1].time = waypoints[w].time;
            Some(())
        });
        self.add("time that runs backward", &[Kind::TimeOrder], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let waypoints = &mut plan.segments[s].waypoints;
            let w = rng.below(waypoints.len() - 1);
            let (a, b) = (waypoints[w].time, waypoints[w + 1].time);
            (waypoints[w].time, waypoints[w + 1].time) = (b, a);
            Some(())
        });
        self.add("a joint that moves at an end", &[Kind::VelocityInconsistent], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let waypoints = &mut plan.segments[s].waypoints;
            let w = if rng.chance(0.5) { 0 } else { waypoints.len() - 1 };
            let k = rng.below(waypoints[w].joint_velocities.len());
            waypoints[w].joint_velocities[k] += sign(rng) * log_uniform(rng, 1.1e-6, 1.0);
            Some(())
        });
        let [speed, acceleration] = self.largest_shares();
        // Time runs faster by `factor`: speeds grow with it, accelerations with its square.
        let hasten = |plan: &mut RobotPlan, factor: f64| {
            for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
                waypoint.time /= factor;
                waypoint.joint_velocities.iter_mut().for_each(|velocity| *velocity *= factor);
            }
        };
        self.add("one percent too fast", &[Kind::JointTooFast], |plan, _| {
            hasten(plan, 1.01 / speed);
            (speed > 0.0).then_some(())
        });
        self.add("one percent too much acceleration", &[Kind::JointAcceleration], |plan, _| {
            hasten(plan, (1.01 / acceleration).sqrt());
            (acceleration > 0.0).then_some(())
        });
        self.add("acceleration promised below the motion's", &[Kind::JointAcceleration], |plan, rng| {
            let share = acceleration * rng.uniform(0.5, 0.99);
            plan.promises.joint_accelerations.iter_mut().for_each(|limit| *limit *= share);
            (acceleration > 0.0).then_some(())
        });
        self.add("velocity promised below the motion's", &[Kind::JointTooFast], |plan, rng| {
            let share = speed * rng.uniform(0.5, 0.99);
            plan.promises.joint_velocities.iter_mut().for_each(|limit| *limit *= share);
            (speed > 0.0).then_some(())
        });
    }

    /// Steps between waypoints.
    fn steps(&self) -> Vec<RobotStep<'_>> {
        let segments = self.plan.segments.iter();
        segments
            .flat_map(|segment| segment.waypoints.windows(2).map(|pair| RobotStep::new(&pair[0], &pair[1])))
            .collect()
    }

    /// Largest speed and acceleration of any joint, as shares of what is promised.
    fn largest_shares(&self) -> [f64; 2] {
        let promises = &self.plan.promises;
        let (mut speed, mut acceleration) = (0.0f64, 0.0f64);
        for step in self.steps() {
            for k in 0..step.n_joints() {
                speed = speed.max(step.cubic(k).largest_slope() / step.span / promises.joint_velocities[k]);
                let bend = step.cubic(k).largest_bend() / (step.span * step.span);
                acceleration = acceleration.max(bend / promises.joint_accelerations[k]);
            }
        }
        [speed, acceleration]
    }

    /// The scene with another robot of the same joints and links.
    fn with_robot(&self, change: impl FnOnce(&mut Robot)) -> Scene {
        let mut scene = self.scene.clone();
        let robot = &mut scene.robots[self.query.robot];
        let mut changed = (*robot.robot).clone();
        change(&mut changed);
        robot.robot = Arc::new(changed);
        scene
    }

    /// Lowest and highest position of a joint along the plan, by its row in the checker's tree.
    fn range_of(&self, row: usize) -> [f64; 2] {
        let drive = &self.question.tree.rows[row].drive;
        self.steps().iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], step| {
            let start = step.start_of(drive);
            let range = step.of_drive(drive).range();
            [low.min(start + range[0]), high.max(start + range[1])]
        })
    }

    fn break_limits(&mut self) {
        let n_joints = self.question.joint_names.len();
        let limits = |follows: bool| -> Vec<usize> {
            let rows = self.question.tree.rows.iter().enumerate();
            rows.filter(|(_, row)| row.limits.is_some() && row.follows == follows).map(|(index, _)| index).collect()
        };
        let (own, following) = (limits(false), limits(true));
        self.add("joint past its limit at a waypoint", &[Kind::JointLimit], |plan, rng| {
            let row = &self.question.tree.rows[*own.get(rng.below(own.len().max(1)))?];
            let (k, [_, upper]) = (row.drive.single()?, row.limits?);
            any_waypoint(plan, rng).joints[k] = upper + log_uniform(rng, 1.1e-9, 0.2);
            (k < n_joints).then_some(())
        });
        for (name, rows) in
            [("joint past its limit between waypoints", own), ("follower past its limit between waypoints", following)]
        {
            let Some(&row) = rows.get(self.rng.below(rows.len().max(1))) else { continue };
            let [low, high] = self.range_of(row);
            let joint_name = self.question.tree.rows[row].name.clone();
            let inside = log_uniform(self.rng, 1.1e-9, 1e-3);
            let scene = self.with_robot(|robot| {
                let joint =
                    robot.joints.iter_mut().find(|joint| joint.name == joint_name).expect("a joint of the robot");
                let limits = joint.limits.as_mut().expect("a joint with limits");
                if limits.upper > -limits.lower { limits.upper = high - inside } else { limits.lower = low + inside }
            });
            self.push(name, &[Kind::JointLimit], |mutant, _| {
                mutant.scene = Some(scene);
                Some(())
            });
        }
    }

    fn break_couplings(&mut self) {
        let rows = &self.question.tree.rows;
        let followers: Vec<usize> = (0..rows.len()).filter(|&row| rows[row].follows).collect();
        let Some(&row) = followers.get(self.rng.below(followers.len().max(1))) else { return };
        let (name, drive) = (rows[row].name.clone(), rows[row].drive.clone());
        let speeds =
            self.steps().iter().map(|step| step.of_drive(&drive).largest_slope() / step.span).collect::<Vec<f64>>();
        let fastest = speeds.into_iter().fold(0.0, f64::max);
        let scene = self.with_robot(|robot| {
            let joint = robot.joints.iter_mut().find(|joint| joint.name == name).expect("a joint of the robot");
            if let Some(limits) = &mut joint.limits {
                limits.velocity = Some(fastest / 1.01);
            }
        });
        self.push("follower one percent too fast", &[Kind::JointTooFast], |mutant, _| {
            mutant.scene = Some(scene);
            (fastest > 1e-3).then_some(())
        });
        self.add("coupling broken: a follower with values of its own", &[Kind::WrongScene], |plan, rng| {
            let leader = drive.terms[rng.below(drive.terms.len())].0;
            plan.robots[0].joint_names[leader] = name.clone();
            Some(())
        });
        self.add("coupling broken: a follower beside its leaders", &[Kind::WrongScene], |plan, _| {
            plan.robots[0].joint_names.push(name.clone());
            plan.promises.joint_velocities.push(1.0);
            plan.promises.joint_accelerations.push(1.0);
            for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
                waypoint.joints.push(drive.position(&waypoint.joints));
                waypoint.joint_velocities.push(0.0);
            }
            Some(())
        });
    }

    fn break_carried(&mut self) {
        let names: Vec<String> = self.scene.objects.iter().map(|object| object.name.clone()).collect();
        let world_from_objects = self.state.world_from_objects.clone();
        self.add("another object moved", &[Kind::WrongHolder], |plan, rng| {
            let others: Vec<usize> = (0..names.len()).filter(|&k| !plan.objects.contains(&names[k])).collect();
            let object = *others.get(rng.below(others.len().max(1)))?;
            plan.objects.push(names[object].clone());
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1e-6, 0.1);
            let n_waypoints = plan.waypoints().count() as f64;
            let holders = plan.segments[0].held_by.values().next().cloned().unwrap_or_default();
            let mut w = 0.0;
            for segment in &mut plan.segments {
                segment.held_by.insert(names[object].clone(), holders.clone());
                for waypoint in &mut segment.waypoints {
                    let mut pose = world_from_objects[object];
                    pose.translation.vector += shift * (w / n_waypoints);
                    waypoint.world_from_objects.push(PoseData::from(&pose));
                    w += 1.0;
                }
            }
            Some(())
        });
        self.add("object slips at one waypoint", &[Kind::GraspChanges], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let w = 1 + rng.below(plan.segments[s].waypoints.len() - 1);
            let pose = plan.segments[s].waypoints[w].world_from_objects.first_mut()?;
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1.1e-9, 1e-2);
            (0..3).for_each(|k| pose.position[k] += shift[k]);
            Some(())
        });
        self.add("object drifts in the hand", &[Kind::GraspChanges], |plan, rng| {
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1.1e-9, 1e-2);
            let n_waypoints = plan.waypoints().count() as f64 - 1.0;
            let waypoints = plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints);
            for (w, waypoint) in waypoints.enumerate() {
                let pose = waypoint.world_from_objects.first_mut()?;
                (0..3).for_each(|k| pose.position[k] += shift[k] * w as f64 / n_waypoints);
            }
            Some(())
        });
        self.add("object turns in the hand", &[Kind::GraspChanges], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let w = 1 + rng.below(plan.segments[s].waypoints.len() - 1);
            let pose = plan.segments[s].waypoints[w].world_from_objects.first_mut()?;
            let turn = Vector::from(rng.direction()) * log_uniform(rng, 2e-8, 1.0);
            let turned = Pose::from(&*pose);
            let rotation = turned.rotation * nalgebra::UnitQuaternion::from_scaled_axis(turn);
            *pose = PoseData::from(&Pose::from_parts(turned.translation, rotation));
            Some(())
        });
        self.add("object starts elsewhere", &[Kind::StartMismatch, Kind::GraspChanges], |plan, rng| {
            let shift = Vector::from(rng.direction()) * log_uniform(rng, 1.1e-6, 1e-2);
            let pose = plan.segments[0].waypoints[0].world_from_objects.first_mut()?;
            (0..3).for_each(|k| pose.position[k] += shift[k]);
            Some(())
        });
        self.add("object held by another hand", &[Kind::WrongHolder], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let holders = plan.segments[s].held_by.values_mut().next()?;
            holders[0] = if holders[0] == "left" { "right".into() } else { "left".into() };
            Some(())
        });
        self.add("object held by nobody", &[Kind::WrongHolder], |plan, rng| {
            let s = rng.below(plan.segments.len());
            let object = plan.objects.first()?.clone();
            plan.segments[s].held_by.insert(object, Vec::new());
            Some(())
        });
        self.add("carried object left out", &[Kind::WrongHolder], |plan, _| {
            plan.objects.first()?;
            plan.objects.clear();
            plan.hands.clear();
            for segment in &mut plan.segments {
                segment.held_by.clear();
                segment.waypoints.iter_mut().for_each(|waypoint| waypoint.world_from_objects.clear());
            }
            Some(())
        });
        let fingers: Vec<usize> = (self.question.carried.iter())
            .flat_map(|carried| {
                let hand = self.question.robot.hand_named(&carried.holder);
                hand.map_or(0..0, |hand| self.question.robot.layout.range(regrasp_robot::Part::Hand(hand)))
            })
            .collect();
        self.add("a finger moves while its hand holds", &[Kind::GraspChanges], |plan, rng| {
            let k = *fingers.get(rng.below(fingers.len().max(1)))?;
            let s = rng.below(plan.segments.len());
            let w = 1 + rng.below(plan.segments[s].waypoints.len() - 1);
            plan.segments[s].waypoints[w].joints[k] += sign(rng) * log_uniform(rng, 1.1e-9, 1e-2);
            Some(())
        });
    }

    /// Things in the way.
    fn break_room(&mut self) {
        let floors = Floors { apart: 0.0, held: -1e-3 };
        let Ok(items) = Items::new((self.scene, self.state), self.question, floors) else { return };
        let n_steps = self.steps().len();
        let (which, u) = (self.rng.below(n_steps), self.rng.uniform(0.3, 0.7));
        let (mut joints, mut frames, mut axes) = (Vec::new(), Vec::new(), Vec::new());
        self.steps()[which].joints_at(u, &mut joints);
        self.question.tree.frames(&joints, &mut frames, &mut axes);
        let place = |item: usize| frames[items.items[item].body].point(&items.items[item].center);
        let is_link = |item: &usize| matches!(items.items[*item].owner, Owner::Link(_)) && items.items[*item].body > 0;
        let links: Vec<usize> = (0..items.items.len()).filter(is_link).collect();
        let is_object = |item: &usize| matches!(items.items[*item].owner, Owner::Carried(_));
        let objects: Vec<usize> = (0..items.items.len()).filter(is_object).collect();
        let thing = |name: &str, at: Point, shape: Shape| Obstacle {
            name: name.into(),
            placed: PlacedShape { parent_from_shape: Pose::translation(at.x, at.y, at.z), shape },
            mesh_body: None,
        };
        let mut lit = self.scene.clone();
        let link = links[self.rng.below(links.len())];
        let lamp = Shape::Sphere { radius: log_uniform(self.rng, 1e-3, 0.02) };
        lit.obstacles.push(thing("lamp beside the elbow", place(link), lamp));
        self.push("link through a lamp between two waypoints", &[Kind::Collision], |mutant, _| {
            mutant.scene = Some(lit);
            Some(())
        });
        if let Some(&object) = objects.first() {
            let mut shelved = self.scene.clone();
            let shelf = Shape::Cuboid { half_extents: Vector::new(0.01, 0.01, log_uniform(self.rng, 2e-4, 0.01)) };
            shelved.obstacles.push(thing("shelf in the way", place(object), shelf));
            self.push("object in the hand through a shelf", &[Kind::Collision], |mutant, _| {
                mutant.scene = Some(shelved);
                Some(())
            });
        }
        let resting: Vec<usize> = (0..self.scene.objects.len())
            .filter(|index| self.question.carried.iter().all(|carried| carried.object != *index))
            .collect();
        if let Some(&index) = resting.first() {
            let mut state = self.state.clone();
            state.world_from_objects[index].translation = nalgebra::Translation3::from(place(link).coords);
            self.push("link through an object at rest", &[Kind::Collision], |mutant, _| {
                mutant.state = Some(state);
                Some(())
            });
        }
        // A link grows a knob where another one is at that moment.
        let own =
            items.pairs.iter().filter(|pair| is_link(&pair.a) && is_link(&pair.b) && pair.joints_a + pair.joints_b > 1);
        let own: Vec<_> = own.collect();
        if let Some(pair) = own.get(self.rng.below(own.len().max(1)))
            && let Owner::Link(grown) = items.items[pair.a].owner
        {
            let (body, body_from_link) = *self.question.tree.link(grown);
            let link_in_world = frames[body].then(&body_from_link).pose();
            let at = link_in_world.inverse_transform_point(&place(pair.b));
            let knob = PlacedShape {
                parent_from_shape: Pose::translation(at.x, at.y, at.z),
                shape: Shape::Sphere { radius: log_uniform(self.rng, 1e-3, 0.01) },
            };
            let scene = self.with_robot(|robot| robot.links[grown.0].collision.push(knob));
            self.push("two links of the robot meet", &[Kind::Collision], |mutant, _| {
                mutant.scene = Some(scene);
                Some(())
            });
        }
        self.add("clearance promised that is not kept", &[Kind::Collision], |plan, rng| {
            plan.promises.clearance = rng.uniform(0.3, 1.0);
            Some(())
        });
    }
}
