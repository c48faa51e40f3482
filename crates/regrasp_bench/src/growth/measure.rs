//! Loading and batches, measured.

use crate::at_once::in_order;
use crate::row::{Problem, Row, RunSettings, measured, plan_only};
use cpu_time::ProcessTime;
use regrasp_base::InputError;
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;
use std::time::Instant;

/// Times that a scene is loaded; the least counts.
const N_LOADS: usize = 3;

/// Time of something, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Wall-clock time.
    pub wall_s: f64,
    /// Processor time of all threads of the process.
    pub cpu_s: f64,
}

/// Loads a scene that needs no packages a few times; each cost is the least of these.
///
/// Errors: as [`load_scene`].
pub fn timed_load(path: &Path) -> Result<(LoadedScene, Cost), InputError> {
    let mut least = Cost { wall_s: f64::INFINITY, cpu_s: f64::INFINITY };
    let mut last = None;
    for _ in 0..N_LOADS {
        drop(last.take());
        let started = (Instant::now(), ProcessTime::now());
        last = Some(load_scene(path, &Default::default())?);
        least.wall_s = least.wall_s.min(started.0.elapsed().as_secs_f64());
        least.cpu_s = least.cpu_s.min(started.1.elapsed().as_secs_f64());
    }
    Ok((last.expect("loaded at least once"), least))
}

/// Plans the queries of seeds 0 to `n` - 1, `n_at_once` at a time; then measures and judges every plan. The time is the
/// wall-clock time from the first query to the last plan.
pub fn batch(loaded: &LoadedScene, n: usize, n_at_once: usize, settings: &RunSettings) -> (Vec<Row>, f64) {
    let queries: Vec<_> = (0..n as u64).map(|seed| loaded.task().query(seed)).collect();
    let problem = |index: usize| Problem { task: loaded.manipulation(), query: &queries[index], seed: index as u64 };
    let mut planned = Vec::with_capacity(n);
    let started = Instant::now();
    let plan = |index: usize| plan_only(problem(index), settings);
    let told = in_order(n, n_at_once, plan, |_, result| {
        planned.push(result);
        Ok::<(), ()>(())
    });
    let wall_s = started.elapsed().as_secs_f64();
    debug_assert!(told.is_ok(), "telling does not fail");
    let rows = planned
        .into_iter()
        .enumerate()
        .map(|(index, planned)| measured(problem(index), planned, &settings.planner, settings.judge));
    (rows.collect(), wall_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::{Curve, Point, write_scene};
    use crate::row::Judge;
    use regrasp_plan::check::Level;
    use regrasp_planners::InHandSettings;

    #[test]
    fn a_batch_is_judged_and_does_not_depend_on_the_threads() {
        let folder = std::env::temp_dir().join(format!("regrasp_growth_batch_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = write_scene(&Point { curve: Curve::Threads, object: "box", size: 1 }, &folder).unwrap();
        let (loaded, load) = timed_load(&path).unwrap();
        assert!(load.wall_s > 0.0 && load.wall_s.is_finite() && load.cpu_s.is_finite());
        let settings = RunSettings {
            planner: InHandSettings { n_threads: 1, ..InHandSettings::plain() },
            tracking: Default::default(),
            max_work: 1_000_000,
            time_limit: None,
            judge: Judge::Checker(Level::Geometry),
            improve_for: None,
            cancelled: Default::default(),
        };
        let told = [1, 3].map(|n_at_once| {
            let (rows, wall_s) = batch(&loaded, 6, n_at_once, &settings);
            assert!(wall_s > 0.0);
            rows.into_iter()
                .map(|row| {
                    assert_eq!((row.status.as_str(), row.accepted), ("solved", Some(true)), "{}", row.cause);
                    (row.seed, row.work, row.nodes, row.relocations)
                })
                .collect::<Vec<_>>()
        });
        assert_eq!(told[0], told[1]);
        let works: std::collections::BTreeSet<u64> = told[0].iter().map(|row| row.1).collect();
        assert!(works.len() > 1, "the queries of a batch differ");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
