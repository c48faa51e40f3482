//! The checker: a second way of knowing whether a plan may be carried out.
//!
//! It shares no decision with the planner: own forward kinematics from the robot's joints, own closed forms of
//! surfaces, force closure by exact cones with a certificate, distances by parry, and motion bounds between waypoints.

/// Margin and clearance at every waypoint.
pub mod along;
/// Room for the weight in every direction.
mod any_gravity;
/// Everything that can collide, and which pairs must not.
pub mod bodies;
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
/// The checker's own forward kinematics and motion bounds.
pub mod kinematics;
/// Lifting and landing of moving fingertips.
pub mod lift;
/// The scene as the checker sees it.
pub mod model;
/// One step between two waypoints, and certificates of separation.
pub mod motion;
/// Plans broken in one known way each.
pub mod mutation;
/// A piece of the object's surface near a fingertip.
pub mod patch;
/// What the plan promises, and whether the promises may be made and are kept.
pub mod promises;
/// Fingertips that roll.
pub mod rolling;
/// Distance from the object's surface and the normals there.
pub mod surface;
/// When waypoints are passed, and how fast.
pub mod times;
/// Fingertips: where they touch.
pub mod tip;
/// Fingertips that stay on the object in tracking, and how far they may go.
pub mod tracking;
/// What can be wrong with a plan.
pub mod violation;
/// Poses to be passed between start and goal.
pub mod way;

pub use along::{Along, along};
pub use files::{CheckedFiles, check_files};
pub use find_scene::find_scene;
pub use violation::{Moment, Violation, ViolationKind};

use crate::plan::Plan;
use model::Model;
use regrasp_scene::{InHandQuery, Scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How strict the checker is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CheckSettings {
    /// Largest contact tolerance that a plan may promise, in metres. Issue 2: 0.5 mm.
    pub largest_contact_tolerance: f64,
    /// Largest slip of a rolling fingertip in a segment that a plan may promise, in metres. Issue 4: 0.1 mm.
    pub largest_slip_tolerance: f64,
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
    /// Half-way between two waypoints the imbalance (torques over the torque scale) may be this share of the sum of all
    /// normal forces.
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
    /// Largest goal tolerance that a tracking plan may promise, in radians. Paper 003, table 2: a cell of 2.406 degrees.
    pub largest_goal_tolerance: f64,
    /// In tracking, a fingertip that does not turn, or not about the normal, or not across it, may do so by this much in a
    /// segment, in radians: what the largest slip tolerance is at 50 mm from the axis.
    pub turn_tolerance: f64,
    /// A fingertip that slides in tracking is faster than this in every step, in metres per second: sliding has a direction
    /// then.
    pub smallest_sliding_speed: f64,
    /// A fingertip that does not slide in tracking slips no faster than this on the mean of a segment, in metres per
    /// second: short segments would let it slide otherwise. A fiftieth of the velocity at which fingertips slide in paper
    /// 003 (table 3).
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
            largest_contact_tolerance: 0.5e-3,
            largest_slip_tolerance: 0.1e-3,
            smallest_margin: 0.0,
            pose_tolerance: 1e-6,
            meeting_tolerance: 1e-9,
            limit_tolerance: 1e-9,
            largest_turn: 0.5,
            largest_slide: 0.05,
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
    /// What is wrong, at most some of each kind; empty when the plan is accepted.
    pub violations: Vec<Violation>,
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
    /// Largest imbalance of forces and weight at a waypoint, in newtons; none in plans without forces.
    pub max_force_residual: Option<f64>,
    /// Largest imbalance of moments at a waypoint, in newton metres; none in plans without forces.
    pub max_moment_residual: Option<f64>,
    /// Largest imbalance half-way between waypoints, torques over the torque scale, as a share of the sum of all normal
    /// forces; none in plans without forces.
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
    /// True when nothing is wrong.
    pub fn accepted(&self) -> bool {
        self.n_violations == 0
    }
}

/// Gathers violations, some of each kind.
#[derive(Debug, Default)]
pub struct Log {
    found: Vec<Violation>,
    count: usize,
    most_per_kind: usize,
}

impl Log {
    /// Adds one, if fewer than the most of its kind are listed; counts it anyway.
    pub fn push(&mut self, violation: Violation) {
        self.count += 1;
        if self.found.iter().filter(|other| other.kind == violation.kind).count() < self.most_per_kind {
            self.found.push(violation);
        }
    }
}

/// Judges `plan` in `scene`; with a `query`, also whether it answers that query.
///
/// `scene` must be loaded afresh from the files: the hashes in `scene.inputs` are compared with those of the plan.
pub fn check(scene: &Scene, query: Option<&InHandQuery>, plan: &Plan, settings: &CheckSettings) -> Report {
    let mut log = Log { most_per_kind: settings.most_per_kind, ..Log::default() };
    let mut report = Report::default();
    promises::check_inputs(plan, &scene.inputs, &mut log);
    match Model::new(scene) {
        Err(message) => log.push(Violation::new(ViolationKind::WrongScene, message)),
        Ok(model) => {
            if form_is_sound(&model, plan, &mut log) {
                judge(scene, query, plan, settings, &model, &mut log, &mut report);
            }
        }
    }
    report.n_violations = log.count;
    report.violations = log.found;
    report
}

/// Whether joints, fingers and waypoints of `plan` are those of the scene: everything else indexes by them.
fn form_is_sound(model: &Model, plan: &Plan, log: &mut Log) -> bool {
    continuity::check_form(model, plan, log);
    !log.found.iter().any(|violation| {
        use ViolationKind::{EmptySegment, NotANumber, WrongScene};
        matches!(violation.kind, EmptySegment | NotANumber | WrongScene)
    })
}

fn judge(
    scene: &Scene,
    query: Option<&InHandQuery>,
    plan: &Plan,
    settings: &CheckSettings,
    model: &Model,
    log: &mut Log,
    report: &mut Report,
) {
    report.n_waypoints = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    continuity::check_ends(query, plan, settings, log);
    given::check_given(&scene.object.shape, query, model, plan, settings, log);
    way::check_way(query, plan, settings, log);
    continuity::check_meeting(plan, settings, log);
    continuity::check_joints(model, plan, settings, log);
    continuity::check_roles(model, plan, settings, log);
    let rolled = rolling::check_rolling(&scene.object.shape, model, plan, settings, log);
    let tracked = tracking::check_tracking(&scene.object.shape, model, plan, settings, log);
    let held = contact::check_tips(model, plan, log);
    report.max_contact_error = held.max(rolled.max_contact_error).max(tracked.max_contact_error);
    report.max_slip = [rolled.max_slip, tracked.max_slip].into_iter().flatten().reduce(f64::max);
    if let Some(reach) = scene.reach {
        tracking::check_reach(reach, model, plan, settings, log);
    }
    contact::check_pads(model, plan, log);
    contact::check_contacts(&scene.object, model, plan, settings, log);
    report.min_margin = promises::check_closure(&scene.object, model, plan, settings, log);
    promises::check_promises(&scene.object, plan, settings, report.min_margin, log);
    times::check_times(&scene.object, model, plan, settings, log);
    report.duration = times::duration(plan);
    if let Some(balance) = forces::check_forces(scene, model, plan, settings, log) {
        report.max_force_residual = Some(balance.force);
        report.max_moment_residual = Some(balance.moment);
        report.max_half_way_imbalance = Some(balance.half_way);
        report.max_sliding_force_error = balance.sliding;
    }
    match bodies::Bodies::new(scene, model) {
        Err(message) => log.push(Violation::new(ViolationKind::WrongScene, message)),
        Ok(bodies) => {
            (report.min_clearance, report.n_distances) =
                collision::check_collision(&bodies, model, plan, settings, log);
        }
    }
}
