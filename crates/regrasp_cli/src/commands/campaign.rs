//! `regrasp campaign`: long tests of the tool itself.

use crate::args::{self, CampaignKind, Common, Search};
use crate::commands::task_grasps;
use crate::commands::written::Limits;
use crate::interrupt;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::scene::LoadedScene;
use regrasp::{AnyPlan, Budget, Failure, GraspList, PlannerSettings, Query, plan_any, plan_task};
use regrasp_bench::Problem;
use regrasp_bench::determinism::compare;
use regrasp_bench::mutations::Campaign;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Runs the campaign asked for; exit code 1 when it finds fault.
pub fn run(arguments: &args::Campaign, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let cancelled = interrupt::flag()?;
    match &arguments.kind {
        CampaignKind::Determinism { scenes, queries, threads, search } => {
            let loaded = load_all(scenes, common, talk)?;
            determinism(&loaded, *queries, threads, search, &cancelled, talk)
        }
        CampaignKind::Mutations { scenes, mutants, good, search } => {
            let files = load::scene_files(scenes)?;
            let read = |path: &PathBuf| Mutated::read(path, search, &cancelled, common, talk);
            let scenes = files.iter().map(read).collect::<Result<Vec<_>, Stop>>()?;
            mutations(&scenes, *mutants, *good, search, &cancelled, talk)
        }
    }
}

fn load_all(scenes: &[PathBuf], common: &Common, talk: &Talk) -> Result<Vec<LoadedScene>, Stop> {
    load::scene_files(scenes)?
        .iter()
        .map(|path| load::in_hand_scene(path, "campaigns make plans", common, talk))
        .collect()
}

/// Query `i` is seed `i / n` of scene `i % n`.
fn determinism(
    scenes: &[LoadedScene],
    queries: u64,
    threads: &[usize],
    search: &Search,
    cancelled: &Arc<AtomicBool>,
    talk: &Talk,
) -> Result<(), Stop> {
    let settings = load::settings(search, 1)?;
    let budget = Budget {
        max_work: search.max_work,
        deadline: None,
        improve_for: search.improve,
        cancelled: Arc::clone(cancelled),
    };
    let (mut n_same, mut n_solved) = (0, 0);
    for i in 0..queries {
        let loaded = &scenes[(i % scenes.len() as u64) as usize];
        let seed = i / scenes.len() as u64;
        let comparison = compare(
            Problem { task: loaded.manipulation(), query: &loaded.task().query(seed), seed },
            &settings,
            &budget,
            threads,
        );
        if cancelled.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        n_same += u64::from(comparison.is_same());
        n_solved += u64::from(comparison.status == "solved");
        talk.event(
            "comparison",
            json!({ "scene": comparison.scene, "seed": seed, "status": comparison.status, "digests": comparison.digests }),
        );
        if !comparison.is_same() {
            talk.say(format!("DIFFERENT   {} seed {seed}: {:?}", comparison.scene, comparison.digests));
        }
    }
    let counts: Vec<String> = threads.iter().map(usize::to_string).collect();
    let line = format!(
        "determinism: {n_same} of {queries} queries give the same bytes on {} threads ({n_solved} solved)\n",
        counts.join(", ")
    );
    if !talk.is_json() {
        talk.data(&line);
    }
    if n_same == queries && n_solved > 0 { Ok(()) } else { Err(Stop::Rejected) }
}

/// A scene of a campaign of mutations.
struct Mutated {
    loaded: LoadedScene,
    settings: PlannerSettings,
    /// Grasps of the hands, where the task is pick and place.
    lists: Vec<(usize, GraspList)>,
}

impl Mutated {
    fn read(
        path: &Path,
        search: &Search,
        cancelled: &Arc<AtomicBool>,
        common: &Common,
        talk: &Talk,
    ) -> Result<Self, Stop> {
        let loaded = load::scene_with_mutants(path, common, talk)?;
        let limits = Limits {
            max_work: search.max_work,
            time_limit: search.time_limit,
            improve_for: None,
            cancelled: Arc::clone(cancelled),
        };
        let (settings, lists) = match loaded.task().pick_and_place() {
            Some(query) => {
                let lists = task_grasps::lists(path, (&loaded, query), 0, &limits, common, talk)?;
                (load::for_task(loaded.task(), search, 1)?, lists)
            }
            None => {
                let in_hand = load::settings(search, 1)?;
                (PlannerSettings { in_hand, ..PlannerSettings::default() }, Vec::new())
            }
        };
        Ok(Mutated { loaded, settings, lists })
    }

    fn plan(&self, query: &Query, seed: u64, budget: &Budget) -> Result<AnyPlan, Failure> {
        let around = (&self.loaded.scene, &self.loaded.state);
        match query {
            Query::PickAndPlace(query) => plan_task(around, query, &self.lists, &self.settings, seed, budget)
                .map(|plan| AnyPlan::Robot(Box::new(plan))),
            _ => plan_any(around, query, &self.settings, seed, budget, &|_| {}),
        }
    }
}

/// Good plans (plan `i` is seed `i / n` of scene `i % n`) must be accepted, broken ones rejected.
fn mutations(
    scenes: &[Mutated],
    mutants: u64,
    good: u64,
    search: &Search,
    cancelled: &Arc<AtomicBool>,
    talk: &Talk,
) -> Result<(), Stop> {
    let mut campaign = Campaign::default();
    let mut unsolved = 0;
    for i in 0..good {
        let scene = &scenes[(i % scenes.len() as u64) as usize];
        let loaded = &scene.loaded;
        let seed = i / scenes.len() as u64;
        let query = loaded.task().query(seed);
        let deadline = search.time_limit.map(|limit| Instant::now() + limit);
        let budget = Budget {
            max_work: search.max_work,
            deadline,
            improve_for: search.improve,
            cancelled: Arc::clone(cancelled),
        };
        match scene.plan(&query, seed, &budget) {
            Ok(AnyPlan::Robot(plan)) => campaign.add_robot(loaded, &plan, seed, mutants),
            Ok(AnyPlan::InHand(plan)) => {
                campaign.add(Problem { task: loaded.manipulation(), query: &query, seed }, &plan, mutants);
            }
            Err(_) => unsolved += 1,
        }
        if cancelled.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        if (i + 1) % 50 == 0 {
            talk.say(format!("{} of {good} plans, {} mutants", i + 1, campaign.n_mutants()));
        }
    }
    talk.event("campaign", json!({ "campaign": campaign, "unsolved": unsolved }));
    if !talk.is_json() {
        talk.data(&campaign.table());
        talk.data(&format!("{unsolved} queries had no plan\n"));
    }
    if campaign.is_clean() { Ok(()) } else { Err(Stop::Rejected) }
}
