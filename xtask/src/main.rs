//! `cargo xtask TASK`: experiments that take minutes to hours, and the pages of the book that are generated from code. Run it in the
//! repository's folder.

mod bench;
mod campaign;
mod grasp_growth;
mod grasp_replay;
mod grasps;
mod matrix;
mod reference;
mod replay;
mod run;
mod scans;
mod tasks;

use run::Outcome;
use std::process::ExitCode;

/// A task: its name, what it does, and the function that does it.
type Task = (&'static str, &'static str, fn(&[String]) -> Outcome);

/// All tasks, in the order in which `cargo xtask` lists them.
const TASKS: [Task; 19] = [
    (
        "reference",
        "write the generated pages of docs/reference (--check: fail if they are out of date)",
        reference::task,
    ),
    ("bench", "measure everything in docs/benchmarks.md; hours", bench::all),
    (
        "bench-suite",
        "measure the suites named, or all, and write the page: saut2011 cherif1999 sahbani2007",
        bench::suites,
    ),
    (
        "bench-roadmap",
        "measure queries on roadmaps of sphere and box, and on one of a million motions",
        bench::roadmaps,
    ),
    ("bench-grasps", "lists of grasps of real hands and objects, as out/grasps/grasps.md", grasps::bench),
    (
        "grasp-growth",
        "how lists of grasps grow with frames, triangles, fingers and threads: out/grasps/growth.md",
        grasp_growth::growth,
    ),
    (
        "replay-grasps",
        "shake and lift grasps of six hands in MuJoCo, as out/grasps/replay.md; hours",
        grasp_replay::replay,
    ),
    ("bench-arms", "motions of whole robots: problems of MotionBenchMaker, super graphs; needs PyYAML", bench::arms),
    ("bench-tasks", "tasks of pick and place beside the table of Saut 2010, as out/tasks/tasks.md", tasks::bench),
    ("growth", "measure how loading and planning grow with fingers, triangles, obstacles and threads", bench::growth),
    (
        "bench-matrix",
        "every object in three hands, placed by the tool (HAND...; CELLS=N, AT_ONCE=N, SEEDS=N; page)",
        matrix::task,
    ),
    ("bench-scans", "turn scanned objects that are not convex in the Allegro hand", scans::task),
    (
        "benchmark-page",
        "write docs/benchmarks.md from what was measured (--check: fail if it, or a suite's results, are older)",
        bench::page,
    ),
    ("replay", "replay plans in MuJoCo: six scenes, negative controls, and all in-hand scenes", replay::in_hand),
    ("replay-tracking", "replay tracking plans in MuJoCo", replay::tracking),
    (
        "replay-roadmap",
        "replay answers of roadmaps in MuJoCo, beside plans for the same queries without a graph",
        replay::roadmaps,
    ),
    ("campaign", "same bytes on any number of threads; the checker against broken and good plans", campaign::checker),
    ("fuzz", "fuzz every reader; needs cargo-fuzz", campaign::fuzz),
    (
        "fuzz-program",
        "broken files of every kind against the whole program (RUNS, default 20000)",
        campaign::fuzz_program,
    ),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((name, rest)) = arguments.split_first() else { return usage() };
    let Some((_, _, task)) = TASKS.iter().find(|(known, ..)| known == name) else {
        eprintln!("error: there is no task {name:?}");
        return usage();
    };
    match task(rest) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("Usage: cargo xtask TASK [ARGUMENTS]\n");
    for (name, what, _) in TASKS {
        eprintln!("  {name:<16} {what}");
    }
    eprintln!(
        "\nModels of real hands: REGRASP_MODELS, else ../shared/models. Without them the tasks leave these hands out."
    );
    eprintln!("SEEDS=N, SCENE_SEEDS=N, ... set numbers of trials; OUT=DIR is where scratch files go (default: out).");
    ExitCode::FAILURE
}
