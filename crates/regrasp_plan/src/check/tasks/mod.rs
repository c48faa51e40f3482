//! The judge of plans of pick and place: what such plans mean is said in `docs/reference/plan-format.md`, "Plans of pick and place".
//!
//! It shares the robot, the motions and the distances with the judge of motions (`check/robots`). Who holds the object is taken from
//! `held_by` and compared with geometry, segment by segment.
//!
//! Not judged: torques of the arms, and balance of the robot. [`Report::assumed`] says so.

/// Contacts of hands that hold.
pub mod contacts;
/// Start, end and promises.
pub mod ends;
/// Contact forces.
pub mod forces;
/// Who holds the object, by segment.
pub mod holders;
/// Motions in a hand.
pub mod in_hand;
/// How an object in a hand moves.
pub mod motion;
/// What may not move.
pub mod rest;
/// Every pair of bodies, and holders by geometry.
pub mod room;
/// Objects on supports.
pub mod standing;
/// What a plan is about.
pub mod task;

use crate::check::promises::check_input_files;
use crate::check::robots::{RobotAlong, rules, ties};
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Level, Log, Report, limits};
use crate::robot_plan::RobotPlan;
use regrasp_scene::{PickAndPlaceQuery, Scene, State};
use room::Room;
use task::Task;

/// Judges `plan` in `scene`; with a `query`, also whether it answers that query.
///
/// `scene` must be loaded afresh from the files: the hashes in `scene.inputs` are compared with those of the plan. All that the plan
/// does not move rests in `state`.
pub fn check_pick_and_place(
    (scene, state): (&Scene, &State),
    query: Option<&PickAndPlaceQuery>,
    plan: &RobotPlan,
    settings: &CheckSettings,
) -> Report {
    let work = limits::Work::of(settings);
    let mut log = Log { most_per_kind: settings.most_per_kind, work, ..Log::default() };
    let mut report = Report { duration: plan.duration(), n_waypoints: plan.waypoints().count(), ..Report::default() };
    report.assumed = vec![
        "torques of the arms: the drives carry arms, hands and object".into(),
        "balance of the robot: it stands firmly".into(),
    ];
    check_input_files(&plan.inputs, &scene.inputs, &mut log);
    match Task::new(scene, query, plan) {
        Err(violation) => log.push(violation),
        Ok(task) => {
            if rules::check_form(&task.question, plan, &mut log) {
                judge(&task, state, query, plan, settings, (&mut log, &mut report));
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
    task: &Task,
    state: &State,
    query: Option<&PickAndPlaceQuery>,
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let question = &task.question;
    if let Some(query) = query {
        ends::check_ends(task, query, plan, settings, log);
    }
    ends::check_promises(task, settings, log);
    rules::check_meeting(question, plan, settings, log);
    rules::check_joints(question, plan, settings, log);
    ties::check_ties(question, plan, log);
    rules::check_promises(question, task.scene, plan, log);
    let Some(phases) = holders::read_phases(task, plan, log) else { return };
    holders::check_order(task, &phases, log);
    if !contacts::check_entries(task, &phases, plan, log) {
        return;
    }
    let holds = rest::holds_of(task, &phases, plan);
    rest::check_rest(task, &phases, &holds, plan, settings, log);
    contacts::check_contacts(task, &holds, plan, settings, (log, report));
    if let Some(leap) = rules::leap(question, plan, settings) {
        log.push(Violation::new(Kind::JointJump, format!("a step is too long to be followed: {leap}")));
        report.left_out.push(format!("motion between waypoints: {leap}"));
        return;
    }
    in_hand::check_in_hand((task, state), &phases, plan, settings, (log, report));
    let room = Room::new(task, (&phases, &holds), plan, settings);
    room.check_standing(log);
    forces::check_forces((task, &room), (&phases, &holds), plan, settings, (log, report));
    room.check_room(state, (log, report));
}

/// Clearance at every waypoint of a plan of pick and place and at moments between, about `n_moments` in all.
///
/// Err with a message when the plan is not of this scene, or its form is broken.
pub fn task_along((scene, state): (&Scene, &State), plan: &RobotPlan, n_moments: usize) -> Result<RobotAlong, String> {
    let task = Task::new(scene, None, plan).map_err(|violation| violation.to_string())?;
    let mut log = Log { most_per_kind: 1, ..Log::default() };
    let phases = match rules::check_form(&task.question, plan, &mut log) {
        true => holders::read_phases(&task, plan, &mut log),
        false => None,
    };
    let Some(phases) = phases else {
        return Err(log.found.first().map_or_else(String::new, ToString::to_string));
    };
    let holds = rest::holds_of(&task, &phases, plan);
    Room::new(&task, (&phases, &holds), plan, &CheckSettings::default()).along(state, n_moments)
}
