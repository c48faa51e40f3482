//! The checker: a second way of knowing whether a plan may be carried out.
//!
//! It shares no decision with the planner: own forward kinematics from the robot's joints, own closed forms of
//! surfaces, force closure by exact cones with a certificate, distances by parry, and motion bounds between waypoints.

/// What a plan allows itself, against what scene and checker allow.
pub mod allowance;
/// Margin and clearance at every waypoint.
pub mod along;
/// Room for the weight in every direction.
mod any_gravity;
/// Which query a plan is judged against.
pub mod asked;
/// Where joints and object are between two waypoints.
pub mod between;
/// Everything that can collide, and which pairs must not.
pub mod bodies;
/// Hands that robots carry.
mod carried;
/// Force closure with margin, by exact second-order cones.
pub mod closure;
/// No collision at any moment.
pub mod collision;
/// Fingertips on their contacts, and contacts on the object.
pub mod contact;
/// What can be judged from the waypoints alone.
pub mod continuity;
/// Distance of contacts from sharp edges.
pub mod edges;
/// Obstacles that are too far away to matter in a step.
pub mod far;
/// `regrasp check`: everything is read afresh from files.
pub mod files;
/// The scene file of a plan, where nobody says which it is.
pub mod find_scene;
/// Contact forces and joint torques.
pub mod forces;
/// Grasps that the query gives.
pub mod given;
/// The judge of grasp lists.
pub mod grasps;
/// Who holds the object.
mod holders;
/// The checker's own forward kinematics and motion bounds.
pub mod kinematics;
/// How much a verdict covers.
pub mod level;
/// Lifting and landing of moving fingertips.
pub mod lift;
/// What is too large to be judged.
pub mod limits;
/// The scene as the checker sees it.
pub mod model;
/// One step between two waypoints, and certificates of separation.
pub mod motion;
/// A piece of the object's surface near a fingertip.
pub mod patch;
/// The triangles of a polyhedron in pieces, for questions about what is near.
mod pieces;
/// Convex polygons.
mod polygon;
/// How far apart poses are, and what lies between.
pub mod pose;
/// Shapes and fingertips prepared once for many plans.
pub mod prepared;
/// What the plan promises, and whether the promises may be made and are kept.
pub mod promises;
/// Plans of whole robots.
pub mod robots;
/// Which finger moves, and which are free.
pub mod roles;
/// Fingertips that roll.
pub mod rolling;
/// Closure and pads of rolling contacts between waypoints.
pub mod rolling_closure;
/// How far contacts slip from landing to lifting.
pub mod slip;
/// How far a contact slips in one step.
pub mod step_slip;
/// Distance from the object's surface and the normals there.
pub mod surface;
/// Plans of pick and place.
pub mod tasks;
/// When waypoints are passed, and how fast.
pub mod times;
/// Fingertips: where they touch.
pub mod tip;
/// How fast a fingertip moves at most, seen from the object.
pub mod tip_rates;
/// The surface of a fingertip.
pub mod tip_surface;
/// Fingertips that stay on the object in tracking, and how far they may go.
pub mod tracking;
/// What can be wrong with a plan.
pub mod violation;
/// Poses to be passed between start and goal.
pub mod way;

pub use along::{Along, along};
pub use asked::{OwnQuery, query_of};
pub use files::{CheckedFiles, check_files};
pub use find_scene::{find_scene, find_scene_among};
pub use grasps::{GraspReport, check_grasps};
pub use level::Level;
pub use robots::RobotAlong;
pub use robots::check_robot;
pub use slip::HoldSlip;
pub use tasks::check_pick_and_place;
pub use violation::{Moment, Violation, ViolationKind};

use crate::format::AnyPlan;
use crate::plan::Plan;
use crate::robot_plan::RobotPlan;
use model::CheckedHand;
use prepared::Prepared;
use regrasp_geometry::Pose;
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{Manipulation, Query, Scene, State};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

/// How strict the checker is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CheckSettings {
    /// What the plan is judged for.
    pub level: Level,
    /// Whether a plan may bring the query that it answers.
    pub own_query: OwnQuery,
    /// Largest contact tolerance that a plan may promise, in metres. Issue 2: 0.5 mm.
    pub largest_contact_tolerance: f64,
    /// Largest slip of a rolling fingertip in a segment that a plan may promise, in metres. Issue 4: 0.1 mm.
    pub largest_slip_tolerance: f64,
    /// Largest slip of a contact from landing to lifting, in metres. In 105 default plans of the bundled scenes with hard
    /// fingertips it is 0.012 mm at most, 0.02 mm on meshes of 16,000 triangles: rolling is integrated in steps.
    pub largest_slip: f64,
    /// Largest slip of a contact from landing to lifting as a share of the way that it travels over the object. In the same
    /// plans it is 0.1 % at most where the contact travels 5 mm or more.
    pub slip_share: f64,
    /// What a contact may slip however little it travels, in metres: rolling is integrated in steps, and over the edges of
    /// meshes it leaves 0.02 mm.
    pub slip_floor: f64,
    /// Closure margin asked of every holding set even if the plan promises less; dimensionless.
    pub smallest_margin: f64,
    /// Start, way poses and goal may be missed by this much, in metres and radians.
    pub pose_tolerance: f64,
    /// What must be the same (end and begin of segments, a grasp, a resting object) may differ by this much, in metres
    /// and radians: rounding, not motion.
    pub meeting_tolerance: f64,
    /// Joints may be this far beyond their limits: rounding.
    pub limit_tolerance: f64,
    /// Largest turn of a joint or of the object in one step, in radians.
    pub largest_turn: f64,
    /// Largest slide of a joint or of the object in one step, in metres.
    pub largest_slide: f64,
    /// Where a joint turns farther than this in a step, or is farther beyond its limits, in radians, motion between waypoints is
    /// not judged: the plan is rejected anyway, and following such a motion has no end.
    pub followed_turn: f64,
    /// The same for sliding joints and the object, in metres.
    pub followed_slide: f64,
    /// Configurations, samples and distances that are looked at; what is left then is not judged, and the plan is rejected.
    /// Plans of the planner need less than a hundredth.
    pub most_work: u64,
    /// When judging ends: what is left then is not judged, and the plan is rejected. No part of files of settings.
    #[serde(skip)]
    pub deadline: Option<Instant>,
    /// Contacts may be this far off the object's surface, in metres.
    pub surface_tolerance: f64,
    /// Contact normals may be this far off the surface's, in radians.
    pub normal_tolerance: f64,
    /// Contact forces and the object's weight may fail to balance by this much, and any force may be this far beyond a
    /// limit, in newtons. Issue 4: 1e-6 N.
    pub force_tolerance: f64,
    /// Their moments about the centre of mass may fail to balance by this much, in newton metres. Issue 4: 1e-7 N m.
    pub moment_tolerance: f64,
    /// Joint torques may be off by this share of (force times largest lever arm), and those that the weight of some direction
    /// may need above their limit by this share of it.
    pub torque_tolerance: f64,
    /// Half-way between two waypoints, and where contacts travel far at more moments, the imbalance (torques over the
    /// torque scale) may be this share of the sum of all normal forces.
    pub half_way_imbalance: f64,
    /// Joint velocities that should be zero, or below another, may miss that by this much, in rad/s or m/s.
    pub velocity_tolerance: f64,
    /// Where forces change between two segments, at least this much time lies between, in seconds.
    pub shortest_pause: f64,
    /// Motion that is too small to be divided further when distances stay unresolved, in metres.
    pub resolution: f64,
    /// A lifted fingertip must get this far from the object before it may go anywhere, in metres.
    pub lift_clearance: f64,
    /// The tip of a finger that is free all through a segment keeps this far from the object, in metres.
    pub free_clearance: f64,
    /// The open hand of a listed grasp comes on a line of at least this length, in metres. A shorter one would say of every grasp that
    /// it can be reached.
    pub shortest_way_in: f64,
    /// Largest goal tolerance that a tracking plan may promise, in radians. Cherif 1999, table 2: a cell of 2.406 degrees.
    pub largest_goal_tolerance: f64,
    /// In tracking, a fingertip that does not turn, or not about the normal, or not across it, may do so by this much in a
    /// segment, in radians: what the largest slip tolerance is at 50 mm from the axis.
    pub turn_tolerance: f64,
    /// A fingertip that slides in tracking is faster than this in every step, in metres per second: sliding has a direction
    /// then.
    pub smallest_sliding_speed: f64,
    /// A fingertip that does not slide in tracking slips no faster than this on the mean of a segment, in metres per
    /// second: short segments would let it slide otherwise. A fiftieth of the velocity at which fingertips slide in
    /// Cherif 1999 (table 3).
    pub largest_slip_speed: f64,
    /// Relative velocities and turns of a tracking plan may be off by this share of their size: those at a moment differ
    /// from the means of a step, and nothing but the direction of friction counts on them.
    pub relative_velocity_share: f64,
    /// Directions of sliding may be off by this much, in radians.
    pub relative_velocity_angle: f64,
    /// Friction of a sliding fingertip may differ from the scene's coefficient times the normal force, along the sliding,
    /// by this share of it. Issue 6: 1e-9.
    pub sliding_force_tolerance: f64,
    /// Most violations of a kind that are reported one by one.
    pub most_per_kind: usize,
}

impl Default for CheckSettings {
    fn default() -> Self {
        CheckSettings {
            level: Level::Motion,
            own_query: OwnQuery::Refused,
            largest_slip: 0.1e-3,
            slip_share: 0.005,
            slip_floor: 0.05e-3,
            largest_contact_tolerance: 0.5e-3,
            largest_slip_tolerance: 0.1e-3,
            smallest_margin: 0.0,
            pose_tolerance: 1e-6,
            meeting_tolerance: 1e-9,
            limit_tolerance: 1e-9,
            largest_turn: 0.5,
            largest_slide: 0.05,
            followed_turn: 10.0,
            followed_slide: 1.0,
            most_work: 20_000_000,
            deadline: None,
            surface_tolerance: 1e-5,
            normal_tolerance: 1e-3,
            force_tolerance: 1e-6,
            moment_tolerance: 1e-7,
            torque_tolerance: 1e-6,
            half_way_imbalance: 0.05,
            velocity_tolerance: 1e-6,
            shortest_pause: 1e-3,
            resolution: 0.05e-3,
            lift_clearance: 0.1e-3,
            free_clearance: 0.05e-3,
            shortest_way_in: 0.02,
            largest_goal_tolerance: 0.042,
            turn_tolerance: 2e-3,
            smallest_sliding_speed: 1e-5,
            largest_slip_speed: 1e-4,
            relative_velocity_share: 0.05,
            relative_velocity_angle: 0.02,
            sliding_force_tolerance: 1e-9,
            most_per_kind: 20,
        }
    }
}

/// The smallest distance found at a waypoint between two things that must not touch.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Clearance {
    /// Distance, in metres.
    pub distance: f64,
    /// The pair.
    pub pair: [String; 2],
    /// When.
    pub at: Moment,
}

/// What the checker says.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Report {
    /// What the plan was judged for.
    pub level: Level,
    /// The highest level at which nothing is wrong; none where the plan is wrong at every level.
    pub reached: Option<Level>,
    /// Gravity that the plan was judged under, in the world, in metres per second squared; none for that of any direction.
    pub gravity_in_world: Option<[f64; 3]>,
    /// What is wrong, at most some of each kind; empty when the plan is accepted.
    pub violations: Vec<Violation>,
    /// What was not judged, and why; empty when everything was. Such a plan is never accepted.
    pub left_out: Vec<String>,
    /// What is taken for granted because plans of this kind say nothing of it, or because the hand has nothing to test it with; empty where
    /// nothing is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<String>,
    /// How many violations were found, those not listed included.
    pub n_violations: usize,
    /// Smallest closure margin of a holding set; none when none was judged.
    pub min_margin: Option<f64>,
    /// Smallest distance at a waypoint of a pair that must not touch; between waypoints it is certified to be positive.
    pub min_clearance: Option<Clearance>,
    /// Largest distance of a holding fingertip from its contact, in metres, certified between waypoints; for tips that roll
    /// the largest that was measured, while between waypoints it is certified to be within the tolerance.
    pub max_contact_error: f64,
    /// Largest slip in a segment of a finger that rolls, or that does not slide in tracking, in metres; none when there is
    /// none.
    pub max_slip: Option<f64>,
    /// The contact that slips most from landing to lifting, fixed ones of round fingertips included; none where nothing moves.
    pub max_hold_slip: Option<HoldSlip>,
    /// Largest imbalance of forces and weight at a waypoint, in newtons; none in plans without forces.
    pub max_force_residual: Option<f64>,
    /// Largest imbalance of moments at a waypoint, in newton metres; none in plans without forces.
    pub max_moment_residual: Option<f64>,
    /// Largest imbalance half-way between waypoints, and where contacts travel far at more moments, torques over the
    /// torque scale, as a share of the sum of all normal forces; none in plans without forces.
    pub max_half_way_imbalance: Option<f64>,
    /// Largest distance of the friction of a sliding fingertip from Coulomb's law, as a share of friction times normal
    /// force; none when no finger slides.
    pub max_sliding_force_error: Option<f64>,
    /// Time that the plan takes, in seconds.
    pub duration: f64,
    /// Waypoints judged.
    pub n_waypoints: usize,
    /// Distances measured.
    pub n_distances: u64,
}

impl Report {
    /// True when nothing is wrong, and everything was judged.
    pub fn accepted(&self) -> bool {
        self.n_violations == 0 && self.left_out.is_empty()
    }
}

/// Gathers violations, some of each kind.
#[derive(Debug, Default)]
pub struct Log {
    found: Vec<Violation>,
    /// By the level from which they count.
    counts: [usize; Level::ALL.len()],
    most_per_kind: usize,
    /// Work done, and how much may be.
    pub work: limits::Work,
}

impl Log {
    /// Adds one, if fewer than the most of its kind are listed; counts it anyway.
    pub fn push(&mut self, violation: Violation) {
        self.counts[violation.level as usize] += 1;
        let is_like = |other: &&Violation| (other.kind, other.level) == (violation.kind, violation.level);
        if self.found.iter().filter(is_like).count() < self.most_per_kind {
            self.found.push(violation);
        }
    }

    /// Violations that count at a level, those not listed included.
    fn count_at(&self, level: Level) -> usize {
        self.counts[..=level as usize].iter().sum()
    }
}

/// Judges `plan` in `scene`; with a `query`, also whether it answers that query.
///
/// `scene` must be loaded afresh from the files: the hashes in `scene.inputs` are compared with those of the plan.
/// All that the plan does not move rests in `state`.
pub fn check(around: (&Scene, &State), query: Option<&Query>, plan: &Plan, settings: &CheckSettings) -> Report {
    check_prepared(&Arc::default(), around, query, plan, settings)
}

/// The same, for many plans: shapes and fingertips that `prepared` has are not prepared again.
pub fn check_prepared(
    prepared: &Arc<Prepared>,
    (scene, state): (&Scene, &State),
    query: Option<&Query>,
    plan: &Plan,
    settings: &CheckSettings,
) -> Report {
    let work = limits::Work::of(settings);
    let mut log = Log { most_per_kind: settings.most_per_kind, work, ..Log::default() };
    let mut report = Report::default();
    asked::check_own_query(plan, settings, &mut log);
    promises::check_input_files(&plan.inputs, &scene.inputs, &mut log);
    // Where the scene leaves the start pose open any is an answer, and the other poses follow from it. That the object may be there
    // is judged as at every other moment.
    let started = query.filter(|query| query.has_open_start()).map(|query| query.started_at(&Pose::from(&plan.start)));
    let query = started.as_ref().or(query);
    let wrong_scene = |message| Violation::new(ViolationKind::WrongScene, message);
    let found = holders::manipulation(scene, state, query, plan)
        .and_then(|task| Ok((task, CheckedHand::with(&task, prepared).map_err(wrong_scene)?)));
    match found {
        Err(violation) => log.push(violation),
        Ok((task, model)) => {
            if let Some(tie) = task.hand().ties.first() {
                let robot = &task.hand().robot;
                let [follower, leader] =
                    [tie.follower, tie.coupling.terms[0].0].map(|joint| robot.joints[joint.0].name.as_str());
                let message = format!(
                    "joint \"{follower}\" follows joint \"{leader}\" of another finger: plans in such a hand are not judged"
                );
                log.push(wrong_scene(message).subjects([follower]));
            } else if form_is_sound(&model, plan, &mut log) {
                judge((&task, prepared), query, plan, settings, &model, &mut log, &mut report);
            }
        }
    }
    limits::report_cut(&mut log, &mut report.left_out);
    report.level = settings.level;
    report.gravity_in_world = scene.gravity().in_world().map(Into::into);
    report.reached = Level::ALL.into_iter().rev().find(|level| log.count_at(*level) == 0);
    report.n_violations = log.count_at(settings.level);
    report.violations = log.found;
    report.violations.retain(|violation| violation.level <= settings.level);
    report
}

/// Judges a plan of any kind: [`check`], [`check_robot`] or [`check_pick_and_place`].
pub fn check_any(
    (scene, state): (&Scene, &State),
    query: Option<&Query>,
    plan: &AnyPlan,
    settings: &CheckSettings,
) -> Report {
    let plan = match plan {
        AnyPlan::InHand(plan) => return check((scene, state), query, plan, settings),
        AnyPlan::Robot(plan) => plan,
    };
    let is_of_task = query.is_none_or(|query| query.task() == plan.task);
    let mut report = match plan.task == PICK_AND_PLACE {
        true => check_pick_and_place((scene, state), query.and_then(Query::as_pick_and_place), plan, settings),
        false => check_robot((scene, state), query.and_then(Query::as_motion), plan, settings),
    };
    if let Some(other) = query.filter(|_| !is_of_task) {
        let message = format!("the plan's task is \"{}\", the scene's \"{}\"", plan.task, other.task());
        report.violations.insert(0, Violation::new(ViolationKind::WrongScene, message));
        report.n_violations += 1;
        report.reached = None;
    }
    report
}

/// Clearance at every waypoint of a plan of whole robots and at moments between, about `n_moments` in all.
///
/// Err with a message when the plan is not of this scene, or its form is broken.
pub fn robot_along(around: (&Scene, &State), plan: &RobotPlan, n_moments: usize) -> Result<RobotAlong, String> {
    match plan.task == PICK_AND_PLACE {
        true => tasks::task_along(around, plan, n_moments),
        false => robots::motion_along(around, plan, n_moments),
    }
}

/// Whether joints, fingers and waypoints of `plan` are those of the scene: everything else indexes by them.
fn form_is_sound(model: &CheckedHand, plan: &Plan, log: &mut Log) -> bool {
    continuity::check_form(model, plan, log);
    !log.found.iter().any(|violation| {
        use ViolationKind::{EmptySegment, NotANumber, WrongScene};
        matches!(violation.kind, EmptySegment | NotANumber | WrongScene)
    })
}

fn judge(
    (task, prepared): (&Manipulation, &Arc<Prepared>),
    query: Option<&Query>,
    plan: &Plan,
    settings: &CheckSettings,
    model: &CheckedHand,
    log: &mut Log,
    report: &mut Report,
) {
    report.n_waypoints = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    continuity::check_ends(query, plan, settings, log);
    given::check_given(&model.shape, query, model, plan, settings, log);
    way::check_way(query, plan, settings, log);
    continuity::check_meeting(plan, settings, log);
    continuity::check_joints(model, plan, settings, log);
    continuity::check_roles(model, plan, settings, log);
    holders::check_holders(plan, log);
    let leap = limits::leap(model, plan, settings);
    if leap.is_none() {
        judge_tips(task, plan, settings, model, log, report);
    }
    contact::check_pads(model, plan, log);
    contact::check_contacts(task.object(), query, model, plan, settings, log);
    let at_waypoints = promises::check_closure(task.object(), model, plan, settings, log);
    let between = match leap {
        None => rolling_closure::check_rolling_closure(task.object(), model, plan, settings, log),
        Some(_) => None,
    };
    report.min_margin = at_waypoints.into_iter().chain(between).reduce(f64::min);
    promises::check_promises(task.object(), plan, settings, at_waypoints, log);
    allowance::check_allowance(task, model, plan, log);
    times::check_times(task.object(), model, plan, settings, log);
    report.duration = times::duration(plan);
    if let Some(balance) = forces::check_forces(task, model, plan, settings, log) {
        report.max_force_residual = Some(balance.force);
        report.max_moment_residual = Some(balance.moment);
        report.max_half_way_imbalance = Some(balance.half_way);
        report.max_sliding_force_error = balance.sliding;
    }
    match bodies::Bodies::with(task, model, prepared) {
        Err(message) => log.push(Violation::new(ViolationKind::WrongScene, message)),
        _ if leap.is_some() => {
            report.left_out.extend(leap.map(|leap| format!("motion between waypoints: {leap}")));
        }
        Ok(bodies) => {
            report.assumed.extend(bodies.without_geometry(model));
            (report.min_clearance, report.n_distances) =
                collision::check_collision(&bodies, model, plan, settings, log);
        }
    }
}

/// Fingertips on the object, at and between waypoints.
fn judge_tips(
    task: &Manipulation,
    plan: &Plan,
    settings: &CheckSettings,
    model: &CheckedHand,
    log: &mut Log,
    report: &mut Report,
) {
    let rolled = rolling::check_rolling(&model.shape, model, plan, settings, log);
    let tracked = tracking::check_tracking(&model.shape, model, plan, settings, log);
    let known = rolled.steps.into_iter().chain(tracked.steps).collect();
    report.max_hold_slip = slip::check_slip(&model.shape, model, plan, &known, settings, log);
    let held = contact::check_tips(model, plan, log);
    report.max_contact_error = held.max(rolled.max_contact_error).max(tracked.max_contact_error);
    report.max_slip = [rolled.max_slip, tracked.max_slip].into_iter().flatten().reduce(f64::max);
    if let Some(reach) = task.scene.hands[task.hand_index].reach {
        tracking::check_reach(reach, model, plan, settings, log);
    }
}
