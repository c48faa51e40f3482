//! Plans tasks of pick and place: `tasks [--package NAME=DIR] [--settings JSON] [--seeds N] [--roadmap] [--out FILE] SCENE...`. Times are
//! processor times of one thread. Scenes have to name their grasp lists.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use cpu_time::ThreadTime;
use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_grasp::list::format::from_json;
use regrasp_plan::check::{CheckSettings, check_any};
use regrasp_robot::LoadOptions;
use regrasp_scene::{Query, load_scene};
use regrasp_tasks::{RoadmapBuildSettings, TaskRoadmap, TaskSettings, build_roadmap, plan_with_roadmap};
use std::path::{Path, PathBuf};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (mut scenes, mut seeds, mut out) = (Vec::new(), 1, None);
    let (mut settings, mut prepares) = (TaskSettings::default(), false);
    let mut options = LoadOptions::default();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_default();
        match argument.as_str() {
            "--package" => {
                let value = value();
                let (name, folder) = value.split_once('=').expect("NAME=DIR");
                options.resolve.packages.push((name.to_owned(), PathBuf::from(folder)));
            }
            "--settings" => settings = serde_json::from_str(&value()).expect("settings"),
            "--roadmap" => prepares = true,
            "--seeds" => seeds = value().parse().expect("a number"),
            "--out" => out = Some(PathBuf::from(value())),
            scene => scenes.push(scene.to_owned()),
        }
    }
    for path in &scenes {
        let loaded = load_scene(Path::new(path), &options).unwrap_or_else(|error| panic!("{error}"));
        for (index, _) in loaded.tasks.iter().enumerate() {
            let (mut n_solved, mut n_accepted, mut times, mut durations) = (0, 0, Vec::new(), Vec::new());
            let mut roadmap: Option<TaskRoadmap> = None;
            for seed in 0..seeds {
                let Query::PickAndPlace(query) = loaded.tasks[index].query(seed) else { continue };
                let of_object = loaded.scene.grasp_files.iter().filter(|file| file.object == query.object);
                let lists: Vec<(usize, GraspList)> = of_object
                    .map(|file| {
                        let bytes = std::fs::read(&file.path).expect("a list");
                        (file.hand, from_json(&file.path, &bytes).unwrap_or_else(|error| panic!("{error}")))
                    })
                    .collect();
                let world = (&loaded.scene, &loaded.state);
                if prepares && roadmap.is_none() {
                    let before = ThreadTime::now();
                    let of_build = RoadmapBuildSettings::default();
                    let (settings, budget) = ((&settings, &of_build), Budget::unlimited());
                    let built = build_roadmap(world, &query, &lists, settings, (0, &budget));
                    let built = built.unwrap_or_else(|failure| panic!("{failure}"));
                    let text = built.to_json();
                    println!(
                        "  roadmap: {} nodes, {} double grasps, {} exchanges, {} kB, {:.2} s",
                        built.roads.as_ref().map_or(0, |roads| roads.graph.graph.nodes.len()),
                        built.double_grasps.iter().map(|of| of.pairs.len()).sum::<usize>(),
                        built.n_exchanges(),
                        text.len() / 1000,
                        before.elapsed().as_secs_f64()
                    );
                    roadmap = Some(TaskRoadmap::from_json(Path::new("roadmap"), &text).expect("a roadmap"));
                }
                let before = ThreadTime::now();
                let budget = Budget::work(100_000_000);
                let found = plan_with_roadmap(world, &query, &lists, &settings, (seed, &budget), roadmap.as_ref());
                let seconds = before.elapsed().as_secs_f64();
                times.push(seconds);
                match found {
                    Ok(answer) => {
                        let plan = answer.plan;
                        n_solved += 1;
                        durations.push(plan.duration());
                        let plan = regrasp_plan::AnyPlan::Robot(Box::new(plan));
                        let asked = loaded.tasks[index].query(seed);
                        let report = check_any(world, Some(&asked), &plan, &CheckSettings::default());
                        n_accepted += usize::from(report.accepted());
                        let mut shown = 0;
                        for violation in report.violations.iter().take(5) {
                            println!("  seed {seed}: {violation:?}");
                            shown += 1;
                        }
                        if report.violations.len() > shown {
                            println!("  and {} more", report.violations.len() - shown);
                        }
                        let regrasp_plan::AnyPlan::Robot(plan) = plan else { continue };
                        if seed == 0 {
                            for segment in &plan.segments {
                                let [first, last] = [0, segment.waypoints.len() - 1].map(|k| segment.waypoints[k].time);
                                let held: Vec<_> = segment.held_by.values().flatten().collect();
                                println!(
                                    "  {:?} {held:?} {} waypoints, {first:.2} to {last:.2} s",
                                    segment.kind,
                                    segment.waypoints.len()
                                );
                            }
                            println!("  {:?}", plan.statistics);
                            if let Some(out) = &out {
                                std::fs::write(out, regrasp_plan::AnyPlan::Robot(plan).to_json()).expect("written");
                            }
                        }
                    }
                    Err(failure) => println!("  seed {seed}: {failure}; {}", failure.advice),
                }
            }
            let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
            let most = times.iter().copied().fold(0.0, f64::max);
            println!(
                "{path} {}: {n_solved} of {seeds} solved, {n_accepted} accepted, {:.3} s mean, {most:.3} s longest, plans of {:.2} s",
                loaded.tasks[index].name,
                mean(&times),
                mean(&durations)
            );
        }
    }
}
