//! Tasks of pick and place: one seed of one scene planned, judged, measured; rows as CSV, and a table of them.

use crate::Spread;
use crate::row::{Judge, status_of};
use cpu_time::ProcessTime;
use regrasp_plan::check::{CheckSettings, check_any};
use regrasp_plan::{AnyPlan, RobotPlan, format};
use regrasp_planners::Failure;
use regrasp_scene::{LoadedScene, Query};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// What came of one seed of one task. Times in seconds.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TaskRow {
    /// Scene, with the name of the task where the scene has several.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// `solved`, or the kind of failure.
    pub status: String,
    /// The stage at which planning failed.
    pub stage: String,
    /// The checker's verdict.
    pub accepted: Option<bool>,
    /// Wall-clock time of the planner, without the lists of grasps.
    pub plan_s: f64,
    /// Processor time of the same.
    pub plan_cpu_s: f64,
    /// Wall-clock time of the checker.
    pub check_s: Option<f64>,
    /// How long the plan takes.
    pub motion_s: Option<f64>,
    /// Segments of the plan.
    pub segments: usize,
    /// The hands that hold the object, in the order in which they take it, with `>` between.
    pub hands: String,
    /// Processor time of the roadmap that was built before, once for all seeds.
    pub offline_cpu_s: Option<f64>,
    /// Configurations looked at.
    pub work: u64,
    /// Why there is no plan, or the first violation of one that was rejected.
    pub cause: String,
}

const COLUMNS: [&str; 14] = [
    "scene",
    "seed",
    "status",
    "stage",
    "accepted",
    "plan_s",
    "plan_cpu_s",
    "check_s",
    "motion_s",
    "segments",
    "hands",
    "offline_cpu_s",
    "work",
    "cause",
];

/// What came of something, and the processor time that it took, in seconds.
pub fn with_cpu_seconds<T>(make: impl FnOnce() -> T) -> (T, f64) {
    let started = ProcessTime::now();
    let made = make();
    (made, started.elapsed().as_secs_f64())
}

/// Plans the first task of `loaded` by `plan` and judges what comes of it, as it reads from the file that `regrasp plan` would write.
pub fn run(
    loaded: &LoadedScene,
    seed: u64,
    judge: Judge,
    plan: &dyn Fn(&Query) -> Result<RobotPlan, Failure>,
) -> TaskRow {
    let task = loaded.task();
    let query = task.query(seed);
    let scene = match query.name() {
        "" => loaded.scene.name.clone(),
        name => format!("{}:{name}", loaded.scene.name),
    };
    let mut row = TaskRow { scene, seed, ..TaskRow::default() };
    let started = (Instant::now(), ProcessTime::now());
    let found = plan(&query);
    row.plan_s = started.0.elapsed().as_secs_f64();
    row.plan_cpu_s = started.1.elapsed().as_secs_f64();
    match found {
        Ok(plan) => {
            row.status = "solved".into();
            (row.motion_s, row.segments) = (Some(plan.duration()), plan.segments.len());
            (row.hands, row.work) = (hands_of(&plan).join(">"), plan.statistics.work);
            if let Judge::Checker(level) = judge {
                judged(loaded, &query, &plan, CheckSettings { level, ..CheckSettings::default() }, &mut row);
            }
        }
        Err(failure) => {
            row.status = status_of(&failure);
            row.stage = stage_of(&failure).to_owned();
            row.work = failure.statistics.work;
            row.cause = failure.message;
        }
    }
    row
}

fn judged(loaded: &LoadedScene, query: &Query, plan: &RobotPlan, settings: CheckSettings, row: &mut TaskRow) {
    let plan = match format::robot_from_json(Path::new("plan.json"), format::robot_to_json(plan).as_bytes()) {
        Ok(plan) => AnyPlan::Robot(Box::new(plan)),
        Err(error) => {
            row.accepted = Some(false);
            row.cause = error.diagnostics.first().map_or_else(String::new, ToString::to_string);
            return;
        }
    };
    let started = Instant::now();
    let report = check_any((&loaded.scene, &loaded.state), Some(query), &plan, &settings);
    row.check_s = Some(started.elapsed().as_secs_f64());
    row.accepted = Some(report.accepted());
    if let Some(violation) = report.violations.first() {
        row.cause = violation.to_string();
    } else if let Some(left_out) = report.left_out.first() {
        row.cause = format!("not judged: {left_out}");
    }
}

/// The stage that a failure names: what stands before the first colon of its message.
fn stage_of(failure: &Failure) -> &str {
    match failure.message.split_once(':') {
        Some((stage, _)) if stage.len() <= 30 => stage,
        _ => "",
    }
}

/// The hands that hold the object, in the order in which they take it.
fn hands_of(plan: &RobotPlan) -> Vec<&str> {
    let mut taken: Vec<&str> = Vec::new();
    let mut before: Vec<&str> = Vec::new();
    for segment in &plan.segments {
        let is_hand = |name: &&str| plan.hands.iter().any(|hand| hand.name == **name);
        let now: Vec<&str> = segment.held_by.values().flatten().map(String::as_str).filter(is_hand).collect();
        taken.extend(now.iter().filter(|name| !before.contains(name)));
        before = now;
    }
    taken
}

/// The header line of CSV files.
pub fn header() -> String {
    COLUMNS.join(",") + "\n"
}

/// One line.
pub fn line(row: &TaskRow) -> String {
    let optional = |value: Option<f64>| value.map(|x| x.to_string()).unwrap_or_default();
    let fields: [String; COLUMNS.len()] = [
        row.scene.clone(),
        row.seed.to_string(),
        row.status.clone(),
        row.stage.clone(),
        row.accepted.map(|value| value.to_string()).unwrap_or_default(),
        row.plan_s.to_string(),
        row.plan_cpu_s.to_string(),
        optional(row.check_s),
        optional(row.motion_s),
        row.segments.to_string(),
        row.hands.clone(),
        optional(row.offline_cpu_s),
        row.work.to_string(),
        row.cause.clone(),
    ];
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let written = writer.write_record(&fields).and_then(|()| Ok(writer.flush()?));
    written.expect("memory takes every record");
    let bytes = writer.into_inner().expect("memory takes every record");
    String::from_utf8(bytes).expect("all fields are text")
}

/// A Markdown table of the rows by scene: solved, accepted, processor time, duration, how often the object changes hands, and the stages
/// at which the rest failed.
pub fn table(rows: &[TaskRow]) -> String {
    let mut scenes: Vec<&str> = Vec::new();
    for row in rows {
        if !scenes.contains(&row.scene.as_str()) {
            scenes.push(&row.scene);
        }
    }
    let mut text = String::from(
        "| scene | solved | accepted | offline CPU, s | CPU median, s | mean, s | max, s | plan takes, s | hands that hold | stages of failures |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for scene in scenes {
        let of_scene = || rows.iter().filter(|row| row.scene == scene);
        let solved = || of_scene().filter(|row| row.status == "solved");
        let number = |value: Option<f64>| value.map_or("-".into(), |x| format!("{x:.2}"));
        let cpu = Spread::of(solved().map(|row| row.plan_cpu_s));
        let motion = Spread::of(solved().filter_map(|row| row.motion_s));
        let _ = writeln!(
            text,
            "| {scene} | {} of {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            solved().count(),
            of_scene().count(),
            solved().filter(|row| row.accepted == Some(true)).count(),
            number(of_scene().find_map(|row| row.offline_cpu_s)),
            number(cpu.as_ref().map(|cpu| cpu.median)),
            number(cpu.as_ref().map(|cpu| cpu.mean)),
            number(cpu.as_ref().map(|cpu| cpu.max)),
            number(motion.as_ref().map(|motion| motion.mean)),
            counted(solved().map(|row| row.hands.as_str())),
            counted(of_scene().filter(|row| row.status != "solved").map(|row| match row.stage.as_str() {
                "" => row.status.as_str(),
                stage => stage,
            })),
        );
    }
    text
}

/// Words with how often each comes, the commonest first.
fn counted<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for word in words {
        match counts.iter_mut().find(|(known, _)| *known == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    match counts.is_empty() {
        true => "-".into(),
        false => counts.iter().map(|(word, count)| format!("{word} ({count})")).collect::<Vec<_>>().join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scene: &str, seed: u64, status: &str, stage: &str, hands: &str) -> TaskRow {
        let (scene, status, stage, hands) = (scene.into(), status.into(), stage.into(), hands.into());
        TaskRow {
            scene,
            seed,
            status,
            stage,
            hands,
            plan_cpu_s: 1.0 + seed as f64,
            accepted: Some(true),
            ..TaskRow::default()
        }
    }

    #[test]
    fn the_table_counts_what_was_solved_and_the_stages_of_the_rest() {
        let rows = [
            row("horse", 0, "solved", "", "right>left"),
            row("horse", 1, "solved", "", "right>left"),
            row("horse", 2, "work_spent", "exchange", ""),
            row("post", 0, "start_invalid", "", ""),
        ];
        let text = table(&rows);
        assert!(
            text.contains("| horse | 2 of 3 | 2 | - | 1.50 | 1.50 | 2.00 | - | right>left (2) | exchange (1) |"),
            "{text}"
        );
        assert!(text.contains("| post | 0 of 1 | 0 | - | - | - | - | - | - | start_invalid (1) |"), "{text}");
        let lines = line(&rows[0]);
        assert_eq!(lines.matches(',').count() + 1, COLUMNS.len());
        assert_eq!(header().matches(',').count() + 1, COLUMNS.len());
    }

    #[test]
    fn the_stage_is_what_stands_before_the_colon() {
        let failure = |message: &str| Failure::bare(regrasp_planners::FailureKind::Impossible, message.into(), "");
        assert_eq!(stage_of(&failure("exchange: 28 tried")), "exchange");
        assert_eq!(stage_of(&failure("the start is in collision")), "");
    }
}
