//! Campaigns against the checker and the readers.

use crate::run::{Outcome, models, number, out, package, regrasp, regrasp_with, run, words};
use std::fs;
use std::path::Path;

/// Scenes of the wide hand.
pub const WIDE: &str = "scenes/sphere_90x.toml scenes/sphere_180z.toml scenes/sphere_180x.toml scenes/box_90x.toml \
     scenes/box_180z.toml scenes/box_180x.toml";
/// Way poses, soft fingertips, and fingers that are free while the object moves.
const MORE: &str = "scenes/cubic.toml scenes/soft_pair_roll.toml scenes/six_finger_box_90x.toml";
const SOFT_AND_COUPLED: &str =
    "scenes/dclaw/soft_sphere32_x.toml scenes/trifinger/soft_cylinder20_z.toml scenes/shadow/sphere32_z.toml";

/// Same bytes on 1, 2 and 8 threads, 100 queries; and the checker against broken and good plans.
pub fn checker(_: &[String]) -> Outcome {
    let program = regrasp()?;
    let run = |line: &str| regrasp_with(&program, line);
    run(&format!("campaign determinism {WIDE} {MORE} --queries 100 --threads 1,2,8"))?;
    run(&format!("campaign mutations {WIDE} {MORE} --mutants 100 --good 1000"))?;
    run("campaign mutations scenes/six_finger_box_90x.toml scenes/box_180x.toml \
         --settings docs/benchmarks/free_fingers.json --mutants 100 --good 200")?;
    // Torsion and couplings are broken in plans for real hands.
    match models() {
        Some(models) => {
            run(&format!("campaign mutations {SOFT_AND_COUPLED} {} --mutants 100 --good 300", package(&models)))
        }
        None => Ok(()),
    }
}

/// Every fuzz target, `FUZZ_RUNS` runs each. Inputs go through files: in memory where the system has such a folder.
pub fn fuzz(targets: &[String]) -> Outcome {
    let all = words(
        "urdf srdf hand_toml robot_toml scene_toml stl obj ply dae glb plan_json roadmap robot_roadmap grasps_json isaac_grasps run_json",
    );
    let runs = number("FUZZ_RUNS", 1_000_000)?;
    for target in if targets.is_empty() { &all } else { targets } {
        let (seeds, corpus) = (format!("fuzz/seeds/{target}"), format!("fuzz/corpus/{target}"));
        let failed = |error: std::io::Error| format!("{corpus}: {error}");
        fs::create_dir_all(&corpus).map_err(failed)?;
        for seed in crate::run::files(&seeds, "")? {
            let copy = Path::new(&corpus).join(seed.file_name().unwrap_or_default());
            if !copy.exists() {
                fs::copy(&seed, &copy).map_err(failed)?;
            }
        }
        let scratch = if Path::new("/dev/shm").is_dir() { "/dev/shm" } else { "/tmp" };
        let line = format!(
            "TMPDIR={scratch} cargo fuzz run --sanitizer none {target} -- -runs={runs} -max_len=4096 -timeout=30 \
             -rss_limit_mb=1024"
        );
        run("env", &words(&line))?;
    }
    Ok(())
}

/// Broken files of every kind against the whole program, 10 s and 1 GB each. `out/mutants` keeps what went wrong.
pub fn fuzz_program(arguments: &[String]) -> Outcome {
    regrasp()?;
    let runs = arguments.first().cloned().unwrap_or_else(|| "20000".to_owned());
    let seed = number("FUZZ_PROGRAM_SEED", 0)?;
    let folder = out("mutants")?;
    run("python3", &words(&format!("tests/campaigns/mutants.py --runs {runs} --seed {seed} -o {}", folder.display())))
}
