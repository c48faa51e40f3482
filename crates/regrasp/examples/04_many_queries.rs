//! Plans many queries at once: no plan depends on who else is planning.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::plan::check::{CheckSettings, check};
use regrasp::plan::format::to_json;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, Failure, InHandSettings, Plan, plan_in_hand};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    // A scene never changes: any number of threads may share it.
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let settings = InHandSettings::default();
    let solve = |seed: u64| -> Result<Plan, Failure> {
        let budget = Budget::work(5_000_000);
        plan_in_hand(&loaded.view(), loaded.task().query(seed).as_in_hand().unwrap(), &settings, seed, &budget, &|_| {})
    };

    let n_threads = std::thread::available_parallelism()?.get() as u64;
    let seeds: Vec<u64> = (0..24).collect();
    let mut results: Vec<(u64, Result<Plan, Failure>)> = std::thread::scope(|scope| {
        let shares = (0..n_threads).map(|share| {
            let own = seeds.iter().copied().filter(move |seed| seed % n_threads == share);
            let solve = &solve;
            scope.spawn(move || own.map(|seed| (seed, solve(seed))).collect::<Vec<_>>())
        });
        let workers: Vec<_> = shares.collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a search does not panic")).collect()
    });
    results.sort_by_key(|(seed, _)| *seed);

    let accepted = results.iter().filter(|(seed, result)| {
        result.as_ref().is_ok_and(|plan| {
            check((&loaded.scene, &loaded.state), Some(&loaded.task().query(*seed)), plan, &CheckSettings::default())
                .accepted()
        })
    });
    println!("{} of {} solved and accepted by the checker", accepted.count(), seeds.len());
    for (seed, result) in results.iter().take(4) {
        let alone = solve(*seed)?;
        assert_eq!(result.as_ref().map(to_json), Ok(to_json(&alone)), "the same bytes as alone");
    }
    Ok(())
}
