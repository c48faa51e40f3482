//! Suites: the tables and figures of a paper, measured again. `docs/reference/suite-format.md` says what a suite file may contain.
//!
//! Codes: B600 not TOML or not the shape of a suite, B601 another format or version, B602 a value that makes no sense, B603
//! settings of another kind of task than the scene's.

/// The results of a suite as Markdown.
pub mod results;
/// Rows of a suite as CSV; those of an earlier run are taken over.
pub mod rows;
/// What a paper found, and whether our rows confirm it.
pub mod verdicts;

use nalgebra::UnitQuaternion;
use regrasp_base::toml_table::too_deep;
use regrasp_base::{Diagnostic, InputError, Place, Rng};
use regrasp_geometry::Vector;
use regrasp_planners::in_hand::Alpha;
use regrasp_planners::{InHandSettings, TrackingSettings};
use regrasp_scene::query::{IN_HAND, TRACKING};
use regrasp_scene::{Query, Task};
use serde::Deserialize;
use serde::de::Error as _;
use std::path::{Path, PathBuf};
use verdicts::Verdict;

/// Value of `format` in a suite file.
pub const FORMAT: &str = "regrasp-suite";
/// Value of `format_version` that this version reads.
pub const FORMAT_VERSION: u32 = 1;

/// A suite file, read.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Always `regrasp-suite`.
    pub format: String,
    /// Version of the format.
    pub format_version: u32,
    /// Heading of the results.
    pub title: String,
    /// Said under the heading.
    #[serde(default)]
    pub note: String,
    /// Folder for the results, relative to the suite file.
    pub results: PathBuf,
    /// Work allowed per trial, in configurations looked at.
    #[serde(default = "default_max_work")]
    pub max_work: u64,
    /// Tables.
    #[serde(default)]
    pub tables: Vec<Table>,
    /// Figures.
    #[serde(default)]
    pub figures: Vec<Figure>,
}

fn default_max_work() -> u64 {
    20_000_000
}

/// A table of the paper.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Heading.
    pub title: String,
    /// Said under the heading.
    #[serde(default)]
    pub note: String,
    /// What the paper reports.
    #[serde(default)]
    pub published: Vec<Published>,
    /// What is measured.
    pub rows: Vec<Entry>,
    /// What the paper found.
    #[serde(default)]
    pub verdicts: Vec<Verdict>,
}

/// A row of the paper's own table: a mean, or smallest, mean and largest.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Name of the row.
    pub name: String,
    /// Seconds.
    pub time_s: Vec<f64>,
    /// Nodes of the graph.
    #[serde(default)]
    pub nodes: Vec<f64>,
    /// Nodes generated, where the paper tells them from those of the graph; of tracking, sub-goals tried.
    #[serde(default)]
    pub generated: Vec<f64>,
    /// Of tracking, sub-goals on the path.
    #[serde(default)]
    pub on_path: Vec<f64>,
}

/// A scene, planned with many seeds.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name of the row, unique in its table.
    pub name: String,
    /// Scene file, relative to the suite file.
    pub scene: PathBuf,
    /// Trials: seeds 0, 1, ...
    pub trials: u64,
    /// Wall-clock time allowed per trial, in seconds.
    #[serde(default)]
    pub time_limit_s: Option<f64>,
    /// Work allowed per trial, where it is not the suite's.
    #[serde(default)]
    pub max_work: Option<u64>,
    /// Largest mean processor time asked for, in seconds: the results say whether it was met.
    #[serde(default)]
    pub mean_at_most_s: Option<f64>,
    /// Smallest share of trials that is asked to be solved, of 1; where there is none, `mean_at_most_s` asks for all.
    #[serde(default)]
    pub solved_at_least: Option<f64>,
    /// The goal is the start, turned by so many degrees about an axis that the seed draws, in place of the scene's. Tracking only.
    #[serde(default)]
    pub turn_deg: Option<f64>,
    /// Settings of tracking, for scenes with a task of that kind; what is left out has its default.
    #[serde(default)]
    pub tracking: Option<TrackingSettings>,
    /// Settings of the planner that are not those of geometry alone, which the papers plan with.
    #[serde(default = "InHandSettings::plain", deserialize_with = "changed_from_plain")]
    pub settings: InHandSettings,
}

/// A figure of the paper: mean time against a constant alpha, a panel per curve.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Name of its SVG file, without extension.
    pub name: String,
    /// Heading.
    pub title: String,
    /// Said under the heading.
    #[serde(default)]
    pub note: String,
    /// Values of alpha, within `[0, 1]`.
    pub alpha: Vec<f64>,
    /// Curves; `settings.alpha` is replaced by the value of each point.
    pub curves: Vec<Entry>,
    /// What the paper found.
    #[serde(default)]
    pub verdicts: Vec<Verdict>,
}

/// A row of a table or a point of a figure, to be measured.
#[derive(Debug, Clone)]
pub struct Job {
    /// Where it stands, such as `Table 1/gait, 90 x` or `figure_10/sphere/0.3`; unique in the suite.
    pub name: String,
    /// Scene file.
    pub scene: PathBuf,
    /// Trials.
    pub trials: u64,
    /// Wall-clock limit per trial, in seconds.
    pub time_limit_s: Option<f64>,
    /// Work limit per trial.
    pub max_work: u64,
    /// Settings of the planner.
    pub settings: InHandSettings,
    /// Settings of tracking, where the row has some.
    pub tracking: Option<TrackingSettings>,
    /// Degrees by which the object is turned about an axis that the seed draws, where the goal is not the scene's.
    pub turn_deg: Option<f64>,
}

impl Job {
    /// What `task` asks for with `seed`, to the goal of this job.
    pub fn query(&self, task: &Task, seed: u64) -> Query {
        let query = task.query(seed);
        match (self.turn_deg, query) {
            (Some(degrees), Query::Tracking(mut query)) => {
                let axis = Vector::from(Rng::keyed(seed, "suite_goal_axis", 0).direction());
                let turn = UnitQuaternion::from_scaled_axis(axis * degrees.to_radians());
                query.world_from_object_goal.rotation = turn * query.world_from_object_start.rotation;
                Query::Tracking(query)
            }
            (_, query) => query,
        }
    }

    /// Errors (`B603`, with the place of the suite at `suite_path`): settings that mean nothing for the task of the scene.
    pub fn refuse_other_task(&self, task: &Task, suite_path: &Path) -> Result<(), InputError> {
        if task.of_robot.is_some() {
            let problem =
                format!("\"{}\" names {}, which asks for a motion of a robot", self.name, self.scene.display());
            let diagnostic = Diagnostic::new("B603", Place::file(suite_path), problem);
            return Err(diagnostic
                .expected("a scene in which a hand moves an object")
                .fix("name another scene")
                .into());
        }
        let (key, other) = match task.kind_name() {
            IN_HAND if self.tracking.is_some() => ("tracking", "settings"),
            IN_HAND if self.turn_deg.is_some() => ("turn_deg", "a [goal]"),
            TRACKING if self.settings != InHandSettings::plain() => ("settings", "tracking"),
            _ => return Ok(()),
        };
        let problem = format!("\"{}\" has `{key}`, which its scene's task has no use for", self.name);
        Err(Diagnostic::new("B603", Place::file(suite_path), problem)
            .expected(format!("`{other}` for {}", self.scene.display()))
            .fix("leave the key out, or name another scene")
            .into())
    }
}

/// The settings of geometry alone, but for those that are given.
fn changed_from_plain<'de, D: serde::Deserializer<'de>>(given: D) -> Result<InHandSettings, D::Error> {
    let given = serde_json::Map::deserialize(given)?;
    let mut all = serde_json::to_value(InHandSettings::plain()).map_err(D::Error::custom)?;
    if let Some(all) = all.as_object_mut() {
        all.extend(given);
    }
    serde_json::from_value(all).map_err(D::Error::custom)
}

impl Suite {
    /// Everything that is to be measured, in order. Scenes are found from the folder of `suite_path`.
    pub fn jobs(&self, suite_path: &Path) -> Vec<Job> {
        let folder = suite_path.parent().unwrap_or(Path::new(""));
        let job = |name: String, entry: &Entry, settings: InHandSettings| Job {
            name,
            scene: folder.join(&entry.scene),
            trials: entry.trials,
            time_limit_s: entry.time_limit_s,
            max_work: entry.max_work.unwrap_or(self.max_work),
            settings,
            tracking: entry.tracking.clone(),
            turn_deg: entry.turn_deg,
        };
        let mut jobs = Vec::new();
        for table in &self.tables {
            jobs.extend(table.rows.iter().map(|row| job(table.job_name(row), row, row.settings.clone())));
        }
        for figure in &self.figures {
            for curve in &figure.curves {
                for &value in &figure.alpha {
                    let mut settings = curve.settings.clone();
                    settings.baselines.alpha = Alpha::Constant { value };
                    jobs.push(job(figure.job_name(curve, value), curve, settings));
                }
            }
        }
        jobs
    }

    /// Folder for the results.
    pub fn results_folder(&self, suite_path: &Path) -> PathBuf {
        suite_path.parent().unwrap_or(Path::new("")).join(&self.results)
    }

    /// What makes no sense, one sentence each.
    fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let entries = self.tables.iter().flat_map(|table| &table.rows);
        for entry in entries.chain(self.figures.iter().flat_map(|figure| &figure.curves)) {
            if let Err(problem) = entry.settings.validate() {
                faults.push(format!("row \"{}\": settings: {problem}", entry.name));
            }
            if let Some(Err(problem)) = entry.tracking.as_ref().map(TrackingSettings::validate) {
                faults.push(format!("row \"{}\": tracking: {problem}", entry.name));
            }
            if entry.solved_at_least.is_some_and(|share| !(share > 0.0 && share <= 1.0)) {
                faults.push(format!("row \"{}\": solved_at_least must be above 0 and at most 1", entry.name));
            }
            if entry.turn_deg.is_some_and(|turn| !(turn > 0.0 && turn <= 180.0)) {
                faults.push(format!("row \"{}\": turn_deg must be above 0 and at most 180", entry.name));
            }
            if entry.trials == 0 || entry.max_work == Some(0) {
                faults.push(format!("row \"{}\": trials and max_work must be at least 1", entry.name));
            }
            if [entry.time_limit_s, entry.mean_at_most_s].iter().flatten().any(|s| !(*s > 0.0 && *s <= 1e7)) {
                faults.push(format!("row \"{}\": times must be above 0 and at most 1e7 s", entry.name));
            }
        }
        for figure in &self.figures {
            if figure.alpha.is_empty() || !figure.alpha.iter().all(|value| (0.0..=1.0).contains(value)) {
                faults.push(format!("figure \"{}\": alpha must be a list of values between 0 and 1", figure.name));
            }
            if figure.name.is_empty() || !figure.name.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-".contains(&b)) {
                faults.push(format!("figure \"{}\": a name is made of letters, digits, _ and -", figure.name));
            }
        }
        for table in &self.tables {
            faults.extend(table.verdicts.iter().flat_map(|verdict| verdict.faults_in_table(table)));
        }
        for figure in &self.figures {
            faults.extend(figure.verdicts.iter().flat_map(|verdict| verdict.faults_in_figure(figure)));
        }
        for published in self.tables.iter().flat_map(|table| &table.published) {
            let lists = [&published.time_s, &published.nodes, &published.generated, &published.on_path];
            if lists.iter().any(|list| !matches!(list.len(), 0 | 1 | 3)) {
                faults.push(format!("published \"{}\": give a mean, or smallest, mean and largest", published.name));
            }
        }
        let mut names: Vec<String> = self.jobs(Path::new("")).into_iter().map(|job| job.name).collect();
        names.sort();
        faults.extend(names.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| format!("\"{}\" twice", pair[0])));
        faults
    }
}

impl Table {
    /// True for a table of finger tracking, which counts sub-goals.
    pub fn is_tracking(&self) -> bool {
        self.rows.iter().any(|row| row.tracking.is_some()) || self.published.iter().any(|row| !row.on_path.is_empty())
    }

    /// Name of the job of `row`.
    pub fn job_name(&self, row: &Entry) -> String {
        format!("{}/{}", self.title, row.name)
    }
}

impl Figure {
    /// Name of the job of a point of `curve`.
    pub fn job_name(&self, curve: &Entry, alpha: f64) -> String {
        format!("{}/{}/{alpha}", self.name, curve.name)
    }
}

/// True when the file at `path` says that it is a suite.
pub fn is_suite(path: &Path) -> bool {
    let says_so = |text: String| match too_deep(&text) {
        Some(_) => None,
        None => text.parse::<toml::Table>().ok()?.get("format").map(|format| format.as_str() == Some(FORMAT)),
    };
    path.extension().is_some_and(|extension| extension == "toml")
        && regrasp_base::files::read_text(path).ok().and_then(says_so) == Some(true)
}

/// Reads the suite file at `path`.
///
/// Errors: not TOML, an unknown or missing key or a wrong type (`B600`); another format or version (`B601`); values that
/// make no sense (`B602`), all of them.
pub fn read(path: &Path) -> Result<Suite, InputError> {
    let text = regrasp_base::files::read_text(path)?;
    if let Some(at) = too_deep(&text) {
        let problem = "opens more brackets than any suite does";
        return Err(Diagnostic::new("B600", Place::at_offset(path, &text, at), problem)
            .fix("close every [ and { where its list or table ends")
            .into());
    }
    let suite: Suite = toml::from_str(&text).map_err(|error| {
        let place = Place::at_offset(path, &text, error.span().map_or(0, |span| span.start));
        Diagnostic::new("B600", place, error.message().trim().replace('\n', "; "))
            .expected("a suite file as in docs/reference/suite-format.md")
    })?;
    if suite.format != FORMAT || suite.format_version != FORMAT_VERSION {
        let seen = format!("is \"{}\" version {}", suite.format, suite.format_version);
        return Err(Diagnostic::new("B601", Place::line(path, 1), seen)
            .expected(format!("\"{FORMAT}\" version {FORMAT_VERSION}"))
            .into());
    }
    let mut found = regrasp_base::diagnostic::Diagnostics::default();
    for fault in suite.faults() {
        found.push(Diagnostic::new("B602", Place::file(path), fault));
    }
    found.into_result(suite)
}

#[cfg(test)]
mod tests {
    use super::rows::SuiteRow;
    use super::*;
    use crate::row::Row;
    use regrasp_planners::tracking::RollingFinger;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn repository() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    fn read_text(text: &str) -> Result<Suite, String> {
        // Tests run side by side: each text has a file of its own.
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("regrasp_suite_{}_{number}.toml", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let suite = read(&path).map_err(|error| error.to_string());
        std::fs::remove_file(&path).unwrap();
        suite
    }

    const GOOD: &str = r#"format = "regrasp-suite"
format_version = 1
title = "A | suite"
results = "out"
[[tables]]
title = "T"
[[tables.published]]
name = "published"
time_s = [1, 5, 9]
nodes = [7]
[[tables.rows]]
name = "fast"
scene = "s.toml"
trials = 2
mean_at_most_s = 0.002
[[figures]]
name = "f"
title = "F"
alpha = [0.25, 0.5]
[[figures.curves]]
name = "c"
scene = "s.toml"
trials = 1
time_limit_s = 3
settings = { method = "visibility", guided_share = 0.0 }
"#;

    #[test]
    fn the_suites_of_the_repository_name_scenes_that_are_there() {
        for name in ["saut2011", "cherif1999", "sahbani2007"] {
            let path = repository().join("suites").join(name).with_extension("toml");
            assert!(is_suite(&path));
            let suite = read(&path).unwrap_or_else(|error| panic!("{error}"));
            for job in suite.jobs(&path) {
                assert!(job.scene.is_file() && !is_suite(&job.scene), "{}", job.scene.display());
                let loaded = regrasp_scene::load_scene(&job.scene, &Default::default()).unwrap();
                assert!(job.refuse_other_task(loaded.task(), &path).is_ok(), "{}", job.name);
            }
        }
    }

    #[test]
    fn jobs_are_rows_and_points() {
        let suite = read_text(GOOD).unwrap();
        let jobs = suite.jobs(Path::new("suites/a.toml"));
        let names: Vec<&str> = jobs.iter().map(|job| job.name.as_str()).collect();
        assert_eq!(names, ["T/fast", "f/c/0.25", "f/c/0.5"]);
        assert_eq!(jobs[0].scene, Path::new("suites/s.toml"));
        assert_eq!((jobs[0].settings.n_threads, jobs[0].max_work), (1, 20_000_000));
        assert_eq!(jobs[1].settings.baselines.alpha, Alpha::Constant { value: 0.25 });
        assert_eq!((jobs[1].settings.baselines.guided_share, jobs[1].time_limit_s), (0.0, Some(3.0)));
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_its_reason() {
        for (from, to, reason) in [
            ("title = \"T\"", "titel = \"T\"", "B600"),
            ("regrasp-suite", "regrasp-scene", "B601"),
            ("format_version = 1", "format_version = 2", "B601"),
            ("trials = 2", "trials = 0", "trials and max_work must be at least 1"),
            ("[0.25, 0.5]", "[0.25, 1.5]", "alpha must be"),
            ("[0.25, 0.5]", "[0.5, 0.5]", "\"f/c/0.5\" twice"),
            ("time_limit_s = 3", "time_limit_s = -3", "times must be"),
            ("guided_share = 0.0", "guided_share = 2.0", "guided_share is 2"),
            ("guided_share = 0.0", "gided_share = 2.0", "B600"),
            ("name = \"f\"", "name = \"../f\"", "letters, digits"),
            ("[1, 5, 9]", "[1, 5]", "smallest, mean and largest"),
            ("mean_at_most_s = 0.002", "solved_at_least = 99", "solved_at_least must be above 0"),
            ("mean_at_most_s = 0.002", "turn_deg = 181", "turn_deg must be above 0"),
            ("mean_at_most_s = 0.002", "tracking = { cell = -1 }", "tracking: cell is -1"),
            ("mean_at_most_s = 0.002", "tracking = { rolling_finger = \"twice\" }", "B600"),
        ] {
            assert!(GOOD.contains(from), "{from}");
            let error = read_text(&GOOD.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(reason), "{to}: {error}");
        }
    }

    #[test]
    fn results_hold_published_and_measured_numbers_and_say_what_was_met() {
        let suite = read_text(GOOD).unwrap();
        let row = |job: &str, seed, seconds: f64| SuiteRow {
            job: job.into(),
            inputs: String::new(),
            row: Row {
                status: "solved".into(),
                seed,
                plan_cpu_s: seconds,
                accepted: Some(true),
                nodes: 4 + 2 * seed,
                relocations: 1 + seed,
                ..Row::default()
            },
        };
        let mut rows = vec![row("T/fast", 0, 0.001), row("T/fast", 1, 0.003), row("f/c/0.5", 0, 2.5)];
        let page = results::markdown(&suite, &rows, "there/");
        assert!(page.contains("## A \\| suite"), "{page}");
        assert!(page.contains("| *published* | - | - | 1.00 s | 5.00 s | 9.00 s | - | 7 | - | - |"), "{page}");
        assert!(
            page.contains("| fast | 2/2 | 2/2 | 1.00 ms | 2.00 ms | 3.00 ms | 4 | 5 | 6 | 0 | 1.0 | 1.5 | - |"),
            "{page}"
        );
        assert!(page.contains("mean at most 2.00 ms: met"), "{page}");
        assert!(page.contains("![F](there/f.svg)") && page.contains("| 0.5 | 1/1 | 2.50 s | 2.50 s |"), "{page}");
        assert!(page.contains("| 0.25 | 0/0 | - | - |"), "not measured yet: {page}");
        let pictures = results::pictures(&suite, &rows);
        assert_eq!(pictures.len(), 1);
        assert!(pictures[0].0 == "f.svg" && pictures[0].1.matches("<circle").count() == 1);
        rows[1].row.status = "time_limit".into();
        assert!(results::markdown(&suite, &rows, "").contains("MISSED"), "a miss is no mean");
    }

    const TRACKING: &str = r#"format = "regrasp-suite"
format_version = 1
title = "A suite"
results = "out"
[[tables]]
title = "T"
[[tables.published]]
name = "F-1"
time_s = [43]
nodes = [247]
generated = [44]
on_path = [44]
[[tables.rows]]
name = "free"
scene = "s.toml"
trials = 4
solved_at_least = 0.75
mean_at_most_s = 0.05
[[tables.rows]]
name = "once"
scene = "s.toml"
trials = 4
solved_at_least = 0.75
tracking = { rolling_finger = "once", face_changes = false }
"#;

    #[test]
    fn a_table_of_tracking_counts_sub_goals_and_says_which_share_was_solved() {
        let suite = read_text(TRACKING).unwrap();
        let jobs = suite.jobs(Path::new("suites/a.toml"));
        assert_eq!(jobs[0].tracking, None);
        let once = jobs[1].tracking.as_ref().unwrap();
        assert!(once.rolling_finger == RollingFinger::Once && !once.face_changes);
        assert_eq!(
            TrackingSettings { rolling_finger: RollingFinger::Any, face_changes: true, ..once.clone() },
            Default::default()
        );
        // Of one kind of task only.
        let at = Path::new("suites/a.toml");
        let loaded = |name: &str| {
            let path = repository().join("scenes").join(name);
            regrasp_scene::load_scene(&path, &Default::default()).unwrap_or_else(|error| panic!("{error}"))
        };
        let (turn, track) = (loaded("sphere_90x.toml"), loaded("football.toml"));
        assert!(jobs[1].refuse_other_task(track.task(), at).is_ok());
        let error = jobs[1].refuse_other_task(turn.task(), at).unwrap_err().to_string();
        assert!(error.contains("B603") && error.contains("T/once") && error.contains("tracking"), "{error}");
        let in_hand = Job { settings: InHandSettings::default(), ..jobs[0].clone() };
        assert!(in_hand.refuse_other_task(track.task(), at).is_err());
        // Goals that the seed draws: as far from the start as asked, and the same every time.
        let turned = Job { turn_deg: Some(60.0), ..jobs[0].clone() };
        assert!(
            turned.refuse_other_task(turn.task(), at).is_err() && turned.refuse_other_task(track.task(), at).is_ok()
        );
        let goal = |job: &Job, seed| {
            let query = job.query(track.task(), seed).as_tracking().cloned().unwrap();
            (query.world_from_object_start.rotation, query.world_from_object_goal.rotation)
        };
        let (from, to) = goal(&turned, 3);
        assert!((from.angle_to(&to).to_degrees() - 60.0).abs() < 1e-9 && goal(&turned, 3) == (from, to));
        assert!(goal(&turned, 4).1.angle_to(&to) > 1e-3 && goal(&jobs[0], 3).1 == goal(&jobs[0], 4).1);
        let row = |job: &str, seed, status: &str| SuiteRow {
            job: job.into(),
            inputs: String::new(),
            row: Row {
                method: "tracking".into(),
                status: status.into(),
                seed,
                plan_cpu_s: 0.04,
                accepted: (status == "solved").then_some(true),
                nodes: 1000,
                samples: 41 + seed,
                transfers: 40,
                cause: if status == "solved" { String::new() } else { "6: weight not balanced".into() },
                ..Row::default()
            },
        };
        let mut rows: Vec<SuiteRow> = (0..4).map(|seed| row("T/free", seed, "solved")).collect();
        rows.extend((0..4).map(|seed| row("T/once", seed, if seed == 0 { "solved" } else { "work_spent" })));
        let page = results::markdown(&suite, &rows, "");
        assert!(page.contains("| *F-1* | - | - | - | 43.0 s | - | 247 | 44 | 44 | - | - |"), "{page}");
        let free = "| free | 4/4 (100 %) | 4/4 | 40.0 ms | 40.0 ms | 40.0 ms | 1000 | 42.5 | 40.0 | 0.0 | \
                    solved at least 75 %: met; mean at most 50.0 ms: met |";
        assert!(page.contains(free), "{page}");
        assert!(
            page.contains("| once | 1/4 (25 %) | 1/1 |") && page.contains("solved at least 75 %: MISSED"),
            "{page}"
        );
        assert!(page.contains("once, not solved: 3 work_spent, mostly 6: weight not balanced"), "{page}");
        assert!(!page.contains("relocations"), "{page}");
    }
}
