//! A saved roadmap answers queries with plans that the checker accepts, comes back from its bytes as it was, and is refused
//! where it is broken or was built for something else.

use crate::in_hand_methods::scene;
use regrasp_base::Budget;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_planners::in_hand::InHandSettings;
use regrasp_planners::in_hand::roadmap::{
    BuildSettings, GraspRoadmap, QueryMemory, Region, RoadmapPlanner, build_roadmap, seal,
};
use regrasp_scene::LoadedScene;
use std::path::Path;

fn small_roadmap(loaded: &LoadedScene, n_threads: usize) -> GraspRoadmap {
    let query = loaded.task.query(0);
    let region = Region::around(&query.poses(), &loaded.scene.object.center_of_mass, 0.005, 1.0);
    let build = BuildSettings { places: 40, grasps: 60, neighbours: 12, ..BuildSettings::default() };
    let settings = InHandSettings { n_threads, ..InHandSettings::default() };
    build_roadmap(&loaded.scene, &region, &build, &settings, 3, &Budget::unlimited(), &|_| {})
        .unwrap_or_else(|failure| panic!("{failure}"))
}

#[test]
fn answers_are_accepted_and_the_graph_grows_by_them() {
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    let roadmap = small_roadmap(&loaded, 1);
    let planner = RoadmapPlanner::new(path, &roadmap, &loaded.scene).expect("built for this scene");
    let (mut n_answered, mut memory, mut last) = (0, QueryMemory::default(), None);
    for seed in 0..20 {
        let query = planner.random_query(seed);
        let Ok(answer) = planner.plan(&query, seed, &Budget::work(1_000_000), &mut memory) else { continue };
        n_answered += 1;
        let report = check(&loaded.scene, Some(&query), &answer.plan, &CheckSettings::default());
        assert!(report.accepted(), "seed {seed}: {report:#?}");
        let again =
            planner.plan(&query, seed, &Budget::work(1_000_000), &mut QueryMemory::default()).expect("answered");
        assert!(again.plan == answer.plan, "seed {seed}: memory changes the answer");
        last = Some(answer);
    }
    assert!(n_answered >= 15, "{n_answered} of 20 answered");
    let before = roadmap.census();
    let grown = roadmap.clone().grown_by(&last.expect("one answer"));
    assert!(grown.census().places > before.places && grown.census().nodes > before.nodes);
    let read = GraspRoadmap::from_bytes(path, &grown.to_bytes()).expect("grown graphs are whole");
    assert_eq!(read.census(), grown.census());
}

#[test]
fn bytes_come_back_and_do_not_depend_on_threads() {
    let loaded = scene("sphere_90x.toml");
    let bytes = small_roadmap(&loaded, 1).to_bytes();
    assert!(bytes == small_roadmap(&loaded, 3).to_bytes(), "threads change the graph");
    let read = GraspRoadmap::from_bytes(Path::new("a"), &bytes).expect("its own bytes");
    assert!(read.to_bytes() == bytes);
}

#[test]
fn other_scenes_and_broken_bytes_are_refused() {
    let loaded = scene("sphere_90x.toml");
    let roadmap = small_roadmap(&loaded, 1);
    let path = Path::new("sphere.roadmap");
    let refused =
        |other: &LoadedScene| roadmap.refuse_other_scene(path, &other.scene).expect_err("another").to_string();
    assert!(refused(&scene("box_90x.toml")).contains("R611"));
    assert!(refused(&scene("tight_sphere_180z.toml")).contains("R610"));
    let mut slippery = scene("sphere_90x.toml");
    slippery.scene.object.friction *= 0.5;
    assert!(refused(&slippery).contains("R612"));

    let bytes = roadmap.to_bytes();
    for cut in (0..bytes.len()).step_by(bytes.len() / 97) {
        assert!(GraspRoadmap::from_bytes(path, &bytes[..cut]).is_err(), "{cut} bytes");
    }
    for at in (0..bytes.len()).step_by(bytes.len() / 211) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0x41;
        assert!(GraspRoadmap::from_bytes(path, &flipped).is_err(), "byte {at}");
        // With the checksum made good again nothing may panic, whatever it says.
        seal(&mut flipped);
        let _ = GraspRoadmap::from_bytes(path, &flipped);
    }
}
