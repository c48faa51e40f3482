//! The judge of plans in which a whole robot moves. It has kinematics, motions and distances of its own.
//!
//! Not judged, because such a plan says nothing of it: whether a hand can hold what it carries (contacts, forces), torques of the arms,
//! and balance of the robot. [`Report::assumed`] says so where something is carried.

/// Clearance over time.
pub mod along;
/// No two bodies meet at any moment.
pub mod apart;
/// Groups of what stands still.
mod crowd;
/// Everything that can collide, and which pairs must not.
pub mod items;
/// Where joints are between two waypoints.
pub mod motion;
/// What a plan is about.
pub mod question;
/// What can be judged without distances.
pub mod rules;
/// Joints on the motor of another finger's joint.
pub mod ties;
/// The robot as the checker sees it.
pub mod tree;

pub use along::{RobotAlong, motion_along};

use crate::check::promises::check_input_files;
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Level, Log, Report, limits};
use crate::robot_plan::RobotPlan;
use items::{Floors, Items};
use question::Question;
use regrasp_geometry::Pose;
use regrasp_scene::{MotionQuery, Scene, State};

/// Judges `plan` in `scene`; with a `query`, also whether it answers that query.
///
/// `scene` must be loaded afresh from the files: the hashes in `scene.inputs` are compared with those of the plan. All that the plan
/// does not move rests in `state`.
pub fn check_robot(
    (scene, state): (&Scene, &State),
    query: Option<&MotionQuery>,
    plan: &RobotPlan,
    settings: &CheckSettings,
) -> Report {
    let work = limits::Work::of(settings);
    let mut log = Log { most_per_kind: settings.most_per_kind, work, ..Log::default() };
    let mut report = Report { duration: plan.duration(), n_waypoints: plan.waypoints().count(), ..Report::default() };
    check_input_files(&plan.inputs, &scene.inputs, &mut log);
    match Question::new(scene, query, plan) {
        Err(violation) => log.push(violation),
        Ok(mut question) => {
            if rules::check_form(&question, plan, &mut log) {
                judge((scene, state), query, &mut question, plan, settings, (&mut log, &mut report));
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

fn judge(
    (scene, state): (&Scene, &State),
    query: Option<&MotionQuery>,
    question: &mut Question,
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let Some(first) = plan.waypoints().next() else { return };
    let at_start: Vec<Pose> = first.world_from_objects.iter().map(Pose::from).collect();
    question.take_hold(&first.joints, &at_start);
    let question = &*question;
    let assumed = question.carried.iter().map(|carried| {
        format!(
            "\"{}\" holds \"{}\": contacts and forces are not judged",
            carried.holder, plan.objects[carried.in_plan]
        )
    });
    report.assumed = assumed.collect();
    rules::check_holders(question, plan, scene, log);
    if let Some(query) = query {
        rules::check_ends(question, query, plan, settings, log);
    }
    rules::check_meeting(question, plan, settings, log);
    rules::check_joints(question, plan, settings, log);
    ties::check_ties(question, plan, log);
    rules::check_promises(question, scene, plan, log);
    rules::check_carried(question, plan, settings, log);
    if let Some(leap) = rules::leap(question, plan, settings) {
        log.push(Violation::new(Kind::JointJump, format!("a step is too long to be followed: {leap}")));
        report.left_out.push(format!("motion between waypoints: {leap}"));
        return;
    }
    match Items::new((scene, state), question, floors(plan, settings)) {
        Err(message) => log.push(Violation::new(Kind::WrongScene, message)),
        Ok(items) => {
            (report.min_clearance, report.n_distances) = apart::check_apart(question, &items, plan, settings, log);
        }
    }
}

/// What pairs have to keep. Two ways of measuring differ by less than the resolution, which is what a promised clearance may be missed
/// by; bodies never touch.
fn floors(plan: &RobotPlan, settings: &CheckSettings) -> Floors {
    Floors {
        apart: (plan.promises.clearance - settings.resolution).max(0.0),
        held: -settings.largest_contact_tolerance,
    }
}
