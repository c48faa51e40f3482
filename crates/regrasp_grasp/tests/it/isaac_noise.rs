//! Isaac grasp files that are broken at random never end in a panic. `REGRASP_NOISE` says how many.

use regrasp_base::Rng;
use regrasp_grasp::list::isaac::from_isaac;
use std::path::Path;

/// Pieces that mean something to YAML.
const PIECES: [&str; 24] = [
    "{", "}", "[", "]", ": ", "- ", "\n", "\n  ", "&a ", "*a", "<<: ", "---\n", "...\n", "\"", "'", "| ", "> ",
    "!!map ", "? ", "#", "1e999", ".nan", "\t", "\u{feff}",
];

#[test]
fn broken_files_are_refused_or_read_and_nothing_else() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/isaac_grasps/one.yaml");
    let seed = std::fs::read(path).unwrap();
    let n_runs: u64 = std::env::var("REGRASP_NOISE").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000);
    let mut n_read = 0;
    for run in 0..n_runs {
        let mut rng = Rng::keyed(1, "noise", run);
        let mut bytes = seed.clone();
        for _ in 0..1 + rng.below(4) {
            let at = rng.below(bytes.len());
            match rng.below(4) {
                0 => bytes[at] = rng.below(256) as u8,
                1 => drop(bytes.drain(at..(at + 1 + rng.below(12)).min(bytes.len()))),
                2 => drop(bytes.splice(at..at, PIECES[rng.below(PIECES.len())].bytes())),
                _ => {
                    let from = rng.below(bytes.len());
                    let copy = bytes[from..(from + rng.below(40)).min(bytes.len())].to_vec();
                    drop(bytes.splice(at..at, copy));
                }
            }
            if bytes.is_empty() {
                break;
            }
        }
        let Ok(read) = from_isaac(Path::new("g.yaml"), &bytes) else { continue };
        n_read += 1;
        for grasp in &read.grasps {
            let length: f64 = grasp.object_from_link.quat_xyzw.iter().map(|x| x * x).sum();
            assert!((length - 1.0).abs() < 1e-9, "run {run}");
            assert!(grasp.joints.values().all(|position| position.is_finite()), "run {run}");
        }
    }
    assert!(n_read > 0 && n_read < n_runs, "{n_read} of {n_runs}");
}
