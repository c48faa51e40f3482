//! Objects that fold: surfaces that are rough, and shapes that are far from convex.

use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{ConvexHull, Point, Vector};
use regrasp_plan::check::CheckSettings;
use regrasp_planners::FailureKind;
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::fmt::Write;

/// The scene of a mesh in the wide hand.
fn scene(vertices: &[Point], triangles: &[[u32; 3]], object: &str, turn: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for p in vertices {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    std::fs::write(folder.path().join("thing.obj"), text).unwrap();
    let hand = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/hands/wide_four_finger/hand.toml");
    let scene = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"{hand}\"\n[object]\nname = \"thing\"\n\
         mesh = {{ file = \"thing.obj\", origin = \"center\" }}\nmass = 0.05\n{object}\n[start]\nposition = [0.0, 0.0, 0.078]\n\
         [goal]\nturn = {{ {turn} }}\n"
    );
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A ball of 32 mm whose vertices go in and out by 0.5 mm, so that most of its edges are creases.
fn rough_ball() -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut rng = Rng::keyed(3, "rough", 0);
    let points: Vec<Point> = (0..3000).map(|_| Point::from(Vector::from(rng.direction()) * 0.032)).collect();
    let hull = ConvexHull::new(&points).unwrap();
    let vertices = hull.vertices().iter().map(|v| v + v.coords.normalize() * rng.uniform(-5e-4, 5e-4)).collect();
    (vertices, hull.triangles().to_vec())
}

/// Three bars of 20 x 20 mm in the form of a U, 60 mm wide: it fills 0.6 of its hull.
fn horseshoe() -> (Vec<Point>, Vec<[u32; 3]>) {
    let outline = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]];
    let corner = |k: usize, z: f64| Point::new(f64::from(outline[k][0]) * 0.02, f64::from(outline[k][1]) * 0.02, z);
    let vertices = (0..8).map(|k| corner(k, -0.012)).chain((0..8).map(|k| corner(k, 0.012))).collect();
    // The bars, as two triangles each; upper side as it is, lower side turned.
    let flat = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]];
    let mut triangles: Vec<[u32; 3]> = flat.iter().flat_map(|&[a, b, c]| [[a + 8, b + 8, c + 8], [a, c, b]]).collect();
    for k in 0..8u32 {
        let next = (k + 1) % 8;
        triangles.extend([[k, next, next + 8], [k, next + 8, k + 8]]);
    }
    (vertices, triangles)
}

/// Plans some seeds; all plans are accepted. Returns how many there are.
fn n_accepted(loaded: &LoadedScene, seeds: u64, work: u64) -> usize {
    let mut n = 0;
    for seed in 0..seeds {
        let query = loaded.in_hand(seed);
        let budget = Budget::work(work);
        let Ok(plan) = plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), seed, &budget, &|_| {}) else {
            continue;
        };
        let report = loaded.judge(&query, &plan, &CheckSettings::default());
        assert!(report.accepted(), "seed {seed}: {:#?}", report.violations);
        n += 1;
    }
    n
}

#[test]
fn a_rough_ball_is_held_on_its_ridges_and_turned() {
    let (vertices, triangles) = rough_ball();
    let loaded = scene(&vertices, &triangles, "friction = 0.8", "axis = \"z\", angle_deg = 60");
    assert_eq!(loaded.scene.objects[0].edge_distance, 0.0);
    assert_eq!(n_accepted(&loaded, 3, 300_000), 3);
}

#[test]
fn a_horseshoe_is_turned() {
    let (vertices, triangles) = horseshoe();
    let loaded = scene(&vertices, &triangles, "friction = 1.0", "axis = \"z\", angle_deg = 45");
    assert_eq!(loaded.scene.objects[0].edge_distance, 0.004);
    assert!(n_accepted(&loaded, 3, 300_000) >= 2);
}

/// A horseshoe that is slippery cannot be turned, and the failure says how much friction would do; nothing of the kind is said of
/// an object that is too far away to be held.
#[test]
fn a_failure_says_that_friction_is_short() {
    let (vertices, triangles) = horseshoe();
    let fail = |object: &str, turn: &str| {
        let loaded = scene(&vertices, &triangles, object, turn);
        let query = loaded.in_hand(0);
        let budget = Budget::work(4_000);
        plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 0, &budget, &|_| {}).expect_err("it slips")
    };
    let failure = fail("friction = 0.15", "axis = \"x\", angle_deg = 90");
    assert_eq!(failure.kind, FailureKind::WorkSpent);
    assert!(
        failure.message.contains("friction is short") && failure.message.contains("with friction 0.100"),
        "{failure:?}"
    );
    assert!(failure.message.contains(" with 0.667 (1 over the margin)"), "{}", failure.message);
    assert!(failure.advice.starts_with("fingertips with more friction (friction = 1"), "{}", failure.advice);
    let failure = fail("friction = 1.5", "axis = \"x\", angle_deg = 175");
    assert!(!failure.message.contains("friction is short"), "{}", failure.message);
}
