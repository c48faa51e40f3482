//! `regrasp plan`: plan a scene, check the plan, then write it.

use crate::args::{self, Common, Judging};
use crate::commands::motion;
use crate::commands::pictures;
use crate::commands::written::{Limits, available_threads, of_plan, rejected, write};
use crate::interrupt;
use crate::judge;
use crate::load;
use crate::outputs::{Output, Outputs, refuse_no_folder};
use crate::pages::Page;
use crate::progress::ProgressLines;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::geometry::Pose;
use regrasp::plan::format;
use regrasp::plan::plan::Statistics;
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::moved_fingers;
use regrasp::{Budget, HandView, Manipulation, Plan, PlannerSettings, Query};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Plans, checks, writes.
pub fn run(arguments: &args::Plan, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let written = outputs(arguments)?;
    let cancelled = interrupt::flag()?;
    // Reading counts too: a mesh of a million triangles takes seconds.
    let time_limit = arguments.search.time_limit.or_else(|| default_time_limit(&arguments.search));
    let deadline = time_limit.and_then(|limit| Instant::now().checked_add(limit));
    let loaded = arguments.judging.scene(load::scene_by(&arguments.scene, common, deadline, talk)?);
    let read = loaded.scene.inputs.iter().map(|input| input.path.as_path());
    let named = [&arguments.search.settings, &arguments.roadmap].into_iter().flatten().map(PathBuf::as_path);
    written.refuse_inputs(read.clone().chain(named))?;
    let grown = arguments.roadmap.iter().filter(|_| arguments.grow).map(|path| Output::new("--grow", path));
    Outputs::new(grown)?.refuse_inputs(read.chain(arguments.search.settings.as_deref()))?;
    if let Some(query) = &loaded.task().of_robot {
        let time_limit = deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
        let (max_work, improve_for) = (arguments.search.max_work, arguments.search.improve);
        let limits = Limits { max_work, time_limit, improve_for, cancelled };
        return motion::plan(arguments, common, &loaded, query, &limits, talk);
    }
    let given = [("--roadmap", arguments.roadmap.is_some()), ("--grow", arguments.grow)];
    if let Some((flag, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
        let problem = "is for robots that move; a hand's roadmap answers `regrasp roadmap query`";
        return Err(Stop::argument("A507", flag, problem, "a task of a whole robot"));
    }
    let query = arguments.judging.query(loaded.task().query(arguments.seed))?;
    let n_threads = arguments.threads.unwrap_or_else(available_threads);
    let settings = load::for_task(loaded.task(), &arguments.search, n_threads)?;
    say_query(&query, arguments.seed, n_threads, talk);

    let limits = Limits {
        max_work: arguments.search.max_work,
        time_limit: deadline.map(|deadline| deadline.saturating_duration_since(Instant::now())),
        improve_for: arguments.search.improve,
        cancelled,
    };
    let packages = load::options(common).resolve;
    let page_of =
        |query| arguments.report.as_deref().map(|path| Page::new(path, loaded.manipulation(), query, &packages));
    let plan = match search(&loaded.manipulation(), &query, &settings, arguments.seed, &limits, talk) {
        Err(Stop::NoPlan(mut failure)) => {
            if failure.kind == FailureKind::TimeLimit && arguments.search.time_limit.is_none() {
                let seconds = DEFAULT_TIME_LIMIT.as_secs();
                failure.message += &format!("; {seconds} s is the default time limit, --time-limit 300 allows more");
            }
            if let Some(page) = page_of(&query) {
                page.write_failure(&failure, talk)?;
            }
            if let Some(folder) = &arguments.failure {
                pictures::write_failure(folder, &failure, &query, talk)?;
            }
            return Err(Stop::NoPlan(failure));
        }
        found => found?,
    };
    let query = query.started_at(&Pose::from(&plan.start));
    let page = page_of(&query);
    let output = arguments.output.as_deref();
    let judging = arguments.judging.after_search(time_limit);
    judge_and_write(&plan, output, &arguments.scene, page.as_ref(), common, &judging, talk)
}

/// Time limit where no limit is given, for reading and planning.
const DEFAULT_TIME_LIMIT: Duration = Duration::from_secs(60);

/// The time limit of a search for which the caller gives no limit of any kind; time for improvement comes on top.
fn default_time_limit(search: &args::Search) -> Option<Duration> {
    let is_limited = search.max_work != args::DEFAULT_MAX_WORK || search.improve_work.is_some();
    (!is_limited).then(|| DEFAULT_TIME_LIMIT.saturating_add(search.improve.unwrap_or_default()))
}

/// The files that the arguments name, those of a failure too.
fn outputs(arguments: &args::Plan) -> Result<Outputs, Stop> {
    let plan = arguments.output.iter().flat_map(|path| of_plan(path));
    let page = arguments.report.iter().map(|path| Output::new("--report", path));
    let in_folder = |folder: &PathBuf| pictures::OF_FAILURE.map(|name| Output::beside("--failure", folder.join(name)));
    let pictures = arguments.failure.iter().flat_map(in_folder);
    let outputs = Outputs::new(plan.chain(page).chain(pictures))?;
    arguments.failure.as_deref().map_or(Ok(()), refuse_no_folder)?;
    Ok(outputs)
}

/// Judges a plan; writes it to `output`, or to stdout, if it is accepted. A page is written of every plan.
pub fn judge_and_write(
    plan: &Plan,
    output: Option<&Path>,
    scene: &Path,
    page: Option<&Page>,
    common: &Common,
    judging: &Judging,
    talk: &Talk,
) -> Result<(), Stop> {
    let bytes = format::to_json(plan);
    // Judged is what will be written, in a scene read afresh: the checker starts from files.
    let plan_path = output.unwrap_or(Path::new("plan.json"));
    let report = judge::judge_bytes(plan_path, bytes.as_bytes(), scene, common, judging, talk)?;
    if let Some(page) = page {
        page.write_plan(plan, &report, talk)?;
    }
    if !report.accepted() {
        return Err(rejected(output, &bytes, talk));
    }
    write(output, &bytes, talk)
}

/// Says what is asked.
pub fn say_query(query: &Query, seed: u64, n_threads: usize, talk: &Talk) {
    if query.as_in_hand().is_some_and(|query| query.stays()) {
        talk.say(format!("query  can it be held? seed {seed}, {}", counted(n_threads, "thread")));
        talk.event("query", json!({ "hold": true, "seed": seed, "threads": n_threads }));
        return;
    }
    let (start, goal) = (query.start(), query.goal());
    let angle = start.rotation.angle_to(&goal.rotation);
    let distance = (goal.translation.vector - start.translation.vector).norm();
    let n_way = query.way().len();
    let way = if n_way == 0 { String::new() } else { format!(", {}", counted(n_way, "way pose")) };
    if query.as_tracking().is_some() {
        // The goal says no position, and one thread searches.
        talk.say(format!("query  rotation {:.0} deg, by tracking, seed {seed}", angle.to_degrees()));
        talk.event("query", json!({ "angle": angle, "way_poses": n_way, "seed": seed, "threads": 1 }));
        return;
    }
    talk.say(format!(
        "query  rotation {:.0} deg, translation {:.1} mm{way}, seed {seed}, {}",
        angle.to_degrees(),
        1e3 * distance,
        counted(n_threads, "thread")
    ));
    talk.event(
        "query",
        json!({ "angle": angle, "distance": distance, "way_poses": n_way, "seed": seed, "threads": n_threads }),
    );
}

/// Searches, with progress, and says what was found.
pub fn search(
    task: &Manipulation,
    query: &Query,
    settings: &PlannerSettings,
    seed: u64,
    limits: &Limits,
    talk: &Talk,
) -> Result<Plan, Stop> {
    let lines = ProgressLines::new(talk);
    let started = Instant::now();
    let budget = Budget {
        max_work: limits.max_work,
        deadline: limits.time_limit.map(|limit| started + limit),
        improve_for: limits.improve_for,
        cancelled: Arc::clone(&limits.cancelled),
    };
    let report = |progress| lines.report(progress);
    let plan = match regrasp::planners::plan((task.scene, task.state), query, settings, seed, &budget, &report) {
        Ok(plan) => plan,
        Err(failure) if failure.kind == FailureKind::Interrupted => return Err(Stop::Interrupted),
        Err(failure) => return Err(Stop::NoPlan(Box::new(failure))),
    };
    say_plan(&plan, started.elapsed().as_secs_f64(), talk);
    if query.has_open_start() {
        let [x, y, z] = plan.start.position;
        let turn = Pose::from(&plan.start).rotation.angle().to_degrees();
        talk.say(format!("place  the object starts at [{x:.4}, {y:.4}, {z:.4}] m, turned by {turn:.1} degrees"));
        talk.event("place", json!({ "start": plan.start }));
    }
    say_moved(task, &query.started_at(&Pose::from(&plan.start)), &plan, talk);
    Ok(plan)
}

/// Says which fingers the plan has elsewhere than the query, because they did not touch there.
fn say_moved(task: &Manipulation, query: &Query, plan: &Plan, talk: &Talk) {
    for moved in moved_fingers(&HandView::of(task), query, plan) {
        let micrometres = 1e6 * moved.distance;
        talk.say(format!(
            "note   at the {} finger \"{}\" did not touch as given: it was moved by {micrometres:.0} micrometres",
            moved.end, moved.finger
        ));
        let event = json!({ "end": moved.end, "finger": moved.finger, "distance": moved.distance });
        talk.event("moved", event);
    }
}

/// Says what was found, in how many seconds.
pub fn say_plan(plan: &Plan, seconds: f64, talk: &Talk) {
    let waypoints: usize = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    if let Some(held) = held_in_words(plan) {
        talk.say(format!("hold   {held}   {}", duration(seconds)));
        let statistics = &plan.statistics;
        talk.event(
            "plan",
            json!({ "seconds": seconds, "statistics": statistics, "kept_margin": plan.promises.kept_margin, "hold": true }),
        );
        return;
    }
    if plan.promises.tracking.is_some() {
        let Statistics { nodes, samples, transfers, .. } = plan.statistics;
        talk.say(format!(
            "plan   {}, {} sub-goals on the path of {} tried in {} cells seen, {} waypoints   {}",
            counted(plan.segments.len(), "segment"),
            grouped(transfers),
            grouped(samples),
            grouped(nodes),
            grouped(waypoints as u64),
            duration(seconds),
        ));
        talk.event("plan", json!({ "seconds": seconds, "statistics": plan.statistics }));
        return;
    }
    talk.say(format!(
        "plan   {}, {}, {} waypoints, closure margin at least {:.4} (planned){}   {}",
        counted(plan.statistics.transfers as usize, "transfer"),
        counted(plan.n_relocations() as usize, "relocation"),
        grouped(waypoints as u64),
        plan.promises.kept_margin,
        if plan.statistics.cut_by_time { ", cut by the time limit" } else { "" },
        duration(seconds),
    ));
    if let Some(improvement) = &plan.statistics.improvement {
        let (first, improved) = (&improvement.first, &improvement.improved);
        talk.say(format!(
            "better {} instead of {}, object path {:.0} mm instead of {:.0}, joint path {:.1} rad instead of {:.1}, cost \
             {:.2} instead of {:.2} in {}",
            counted(improved.relocations as usize, "relocation"),
            first.relocations,
            1e3 * improved.object_path,
            1e3 * first.object_path,
            improved.joint_path,
            first.joint_path,
            improved.cost,
            first.cost,
            counted(improvement.rounds as usize, "round"),
        ));
    }
    talk.event(
        "plan",
        json!({ "seconds": seconds, "statistics": plan.statistics, "kept_margin": plan.promises.kept_margin }),
    );
}

/// Who holds the object and how hard, of a plan in which nothing moves.
fn held_in_words(plan: &Plan) -> Option<String> {
    let is_still = plan.statistics.transfers == 0 && plan.n_relocations() == 0 && plan.promises.tracking.is_none();
    let [segment] = plan.segments.as_slice() else { return None };
    let contacts = &segment.waypoints.first().filter(|_| is_still)?.contacts;
    let holding = || plan.fingers.iter().zip(contacts).filter(|(_, contact)| contact.holds());
    let names: Vec<&str> = holding().map(|(name, _)| name.as_str()).collect();
    let pressed = holding().filter_map(|(_, contact)| {
        let (force, normal) = (contact.force_in_object?, contact.normal_in_object?);
        Some(-(0..3).map(|axis| force[axis] * normal[axis]).sum::<f64>())
    });
    let pressed: Vec<f64> = pressed.collect();
    let least = pressed.iter().copied().fold(f64::INFINITY, f64::min);
    let most = pressed.iter().copied().fold(0.0, f64::max);
    let forces = if pressed.is_empty() { String::new() } else { format!(", normal forces {least:.2} to {most:.2} N") };
    Some(format!("by {}: closure margin at least {:.4} (planned){forces}", names.join(", "), plan.promises.kept_margin))
}
