//! Sessions: many queries of one scene that is open.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use crate::plan::Plan;
use crate::search::{failed, rejected};
use crate::verdict::{level_named, report};
use crate::watch::watched;
use pyo3::prelude::*;
use regrasp::Budget;
use regrasp::geometry::{Pose, Vector, pose_from};
use regrasp::plan::check::CheckSettings;
use regrasp::planners::in_hand::roadmap::GraspRoadmap;
use regrasp::planners::in_hand::starting::{self, Observation, ProjectionLimits};
use regrasp::scene::query::IN_HAND;
use regrasp::session::{ObservedVelocities, SessionRoadmap, Touching};
use regrasp::settings::{Overrides, SettingsError, settings_for};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A valid start, as `Session.project` found it.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Start {
    start: starting::Start,
}

#[pymethods]
impl Start {
    /// What it is, as JSON.
    fn describe(&self) -> String {
        let (position, quat_xyzw) = regrasp::geometry::frame::parts_of(&self.start.world_from_object);
        let moved = &self.start.moved;
        let word = |what: &Touching| match what {
            Touching::Holds => "holds",
            Touching::Slides => "slides",
            Touching::Free => "free",
        };
        json!({
            "world_from_object": { "position": position, "quat_xyzw": quat_xyzw },
            "joints": self.start.joints,
            "holds": self.start.holds,
            "touching": self.start.touching.iter().map(word).collect::<Vec<_>>(),
            "moved": {
                "object": moved.object,
                "object_turn": moved.object_turn,
                "tip": moved.tip,
                "joint": moved.joint,
            },
        })
        .to_string()
    }
}

/// A pose of the world: position, and quaternion x y z w.
type PoseParts = ([f64; 3], [f64; 4]);
/// Velocities of joints, and of the object, linear and angular.
type VelocityParts = (Vec<f64>, [f64; 3], [f64; 3]);

/// What `Session.project` is asked.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ProjectRequest {
    pose: PoseParts,
    joints: Vec<f64>,
    velocities: Option<VelocityParts>,
    presses: Option<Vec<bool>>,
    distance: f64,
    turn: f64,
    sliding: f64,
}

/// What `Session.plan` is asked beside start and goal.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PlanRequest {
    goal: PoseParts,
    seed: u64,
    max_work: u64,
    time_limit: Option<f64>,
    level: String,
    progress: Option<Py<PyAny>>,
}

/// The checker's settings for plans that are judged at the level called `level`.
fn judging(py: Python<'_>, level: &str) -> PyResult<CheckSettings> {
    let level = level_named(level).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
    Ok(CheckSettings { level, ..CheckSettings::default() })
}

/// A scene that is open.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Session {
    scene: Py<Scene>,
    task: Option<String>,
    settings: regrasp::InHandSettings,
    roadmap: Option<SessionRoadmap>,
}

impl Session {
    fn opened(&self) -> Result<regrasp::Session<'_>, regrasp::InputError> {
        let Scene { loaded, prepared, .. } = self.scene.get();
        let session = regrasp::Session::open(loaded, self.task.as_deref(), self.settings.clone())?.sharing(prepared);
        Ok(match &self.roadmap {
            Some(roadmap) => session.with_roadmap(roadmap),
            None => session,
        })
    }
}

#[pymethods]
impl Session {
    /// Opens `scene` for the hand and object of `task`; `settings` as JSON; `roadmap` is a file.
    #[staticmethod]
    fn open(
        py: Python<'_>,
        scene: Py<Scene>,
        task: Option<String>,
        settings: Option<&str>,
        threads: usize,
        roadmap: Option<PathBuf>,
    ) -> PyResult<Self> {
        guarded(py, || {
            let asked = Overrides { n_threads: threads, ..Overrides::default() };
            let settings = settings_for(IN_HAND, settings, &asked).map_err(|wrong| {
                let problem = match wrong {
                    SettingsError::Unreadable { problem, .. } | SettingsError::Invalid(problem) => problem,
                    SettingsError::OtherMethod { name, problem } => format!("\"{name}\": {problem}"),
                    SettingsError::NotForTracking { why, .. } => why.to_owned(),
                };
                error::argument(py, "Session", "settings", problem, "keys and values like \"settings\" in a plan file")
            })?;
            // A session is asked again and again: nobody waits for what would have helped.
            let settings = regrasp::InHandSettings { advise: false, ..settings.in_hand };
            let mut session = Session { scene, task, settings, roadmap: None };
            let agreed = py.detach(|| {
                let opened = session.opened()?;
                roadmap.map(|path| opened.agreed_roadmap(&path, GraspRoadmap::read(&path)?)).transpose()
            });
            session.roadmap = agreed.map_err(|error: regrasp::InputError| error::input(py, &error))?;
            Ok(session)
        })
    }

    /// The nearest valid start: `(start, None)`, or `(None, failure)` as JSON.
    fn project(&self, py: Python<'_>, request: ProjectRequest) -> PyResult<(Option<Start>, Option<String>)> {
        guarded(py, || {
            let ProjectRequest { pose, joints, velocities, presses, distance, turn, sliding } = request;
            let found = py.detach(|| {
                let observed = Observation {
                    world_from_object: pose_from(pose.0, pose.1),
                    joints,
                    velocities: velocities.map(|(joints, linear, angular)| ObservedVelocities {
                        joints,
                        linear: Vector::from(linear),
                        angular: Vector::from(angular),
                    }),
                    presses,
                };
                let limits = ProjectionLimits { distance, turn, sliding };
                Ok(self.opened()?.project(&observed, &limits))
            });
            let found = found.map_err(|error: regrasp::InputError| error::input(py, &error))?;
            Ok(match found {
                Ok(start) => (Some(Start { start }), None),
                Err(failure) => (None, Some(failed(&failure))),
            })
        })
    }

    /// Plans from `start` and judges the plan: `(plan, report, seconds)` where the checker accepts it, else `(None, failure,
    /// seconds)`, both as JSON. The seconds are those of search, check and everything.
    fn plan(&self, py: Python<'_>, start: &Start, request: PlanRequest) -> PyResult<(Option<Plan>, String, [f64; 3])> {
        guarded(py, || {
            let started = Instant::now();
            let check_settings = judging(py, &request.level)?;
            let session = self.opened().map_err(|error| error::input(py, &error))?;
            let goal: Pose = pose_from(request.goal.0, request.goal.1);
            let deadline = request.time_limit.map(|limit| started + Duration::from_secs_f64(limit));
            let mut left = request.max_work;
            let (mut search, mut check) = (0.0, 0.0);
            let timed = |sum: &mut f64, since: Instant| *sum += since.elapsed().as_secs_f64();
            let budget = |max_work, cancelled| Budget { max_work, deadline, improve_for: None, cancelled };
            // A plan of the roadmap counts where the checker accepts it as the caller wants it.
            let asked = Instant::now();
            let mapped = match self.roadmap {
                None => None,
                Some(_) => watched(py, request.progress.as_ref(), |cancelled, _| {
                    session.ask_roadmap(&start.start, &goal, request.seed, &budget(left, cancelled))
                })?,
            };
            timed(&mut search, asked);
            let judge = |plan: &regrasp::Plan| session.check_asked(plan, &start.start, &goal, &check_settings);
            let mut found = None;
            match mapped {
                Some(Ok(plan)) => {
                    let judged = Instant::now();
                    let verdict = py.detach(|| judge(&plan));
                    timed(&mut check, judged);
                    left = left.saturating_sub(plan.statistics.work);
                    found = verdict.accepted().then_some((plan, verdict));
                }
                Some(Err(failure)) => left = left.saturating_sub(failure.statistics.work),
                None => {}
            }
            let (plan, verdict) = match found {
                Some(found) => found,
                None => {
                    let searched = Instant::now();
                    let answer = watched(py, request.progress.as_ref(), |cancelled, progress| {
                        session.search(&start.start, &goal, request.seed, &budget(left, cancelled), progress)
                    })?;
                    timed(&mut search, searched);
                    let plan = match answer {
                        Ok(plan) => plan,
                        Err(failure) => {
                            return Ok((None, failed(&failure), [search, check, started.elapsed().as_secs_f64()]));
                        }
                    };
                    let judged = Instant::now();
                    let verdict = py.detach(|| judge(&plan));
                    timed(&mut check, judged);
                    (plan, verdict)
                }
            };
            let said = if verdict.accepted() { report(&verdict) } else { rejected(&plan, &verdict) };
            let plan = verdict.accepted().then_some(Plan { plan });
            Ok((plan, said, [search, check, started.elapsed().as_secs_f64()]))
        })
    }

    /// Judges a plan against the query that it brings, else that of the session's task; the report as JSON.
    fn check(&self, py: Python<'_>, plan: &Plan, level: &str) -> PyResult<String> {
        guarded(py, || {
            let settings = judging(py, level)?;
            let session = self.opened().map_err(|error| error::input(py, &error))?;
            Ok(report(&py.detach(|| session.check(&plan.plan, &settings))))
        })
    }
}
