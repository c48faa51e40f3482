//! Roadmaps that are made before queries.

use crate::{Case, accepted_by_checker, holders};
use regrasp_base::Budget;
use regrasp_tasks::{FailureKind, RoadmapBuildSettings, TaskRoadmap, TaskSettings, build_roadmap, plan_with_roadmap};
use std::path::Path;

fn small() -> RoadmapBuildSettings {
    RoadmapBuildSettings { nodes_per_arm: 8, exchanges: 40, tries: 160 }
}

fn built(case: &Case, settings: &TaskSettings) -> TaskRoadmap {
    let world = (&case.loaded.scene, &case.loaded.state);
    build_roadmap(world, &case.query, &case.lists, (settings, &small()), (1, &Budget::unlimited()))
        .unwrap_or_else(|failure| panic!("{failure}"))
}

#[test]
fn a_saved_roadmap_gives_the_plans_of_one_in_memory() {
    let case = Case::new("justin_horse.toml");
    let settings = TaskSettings::default();
    let roadmap = built(&case, &settings);
    assert!(roadmap.n_exchanges() > 10 && roadmap.roads.is_some(), "{} exchanges", roadmap.n_exchanges());
    let text = roadmap.to_json();
    let saved = TaskRoadmap::from_json(Path::new("roadmap"), &text).unwrap();
    assert_eq!(saved.to_json(), text);
    let world = (&case.loaded.scene, &case.loaded.state);
    let budget = Budget::work(20_000_000);
    for seed in 0..2 {
        let plan = |roadmap: &TaskRoadmap| {
            plan_with_roadmap(world, &case.query, &case.lists, &settings, (seed, &budget), Some(roadmap)).unwrap().plan
        };
        let (first, second) = (plan(&roadmap), plan(&saved));
        assert_eq!(first, second);
        accepted_by_checker(&case, &first, seed);
        assert_eq!(
            (holders(&first), first.method.as_str()),
            (vec!["right".to_owned(), "left".to_owned()], "super_graph")
        );
    }
}

#[test]
fn a_roadmap_grows_by_what_a_plan_has_and_it_has_not() {
    let case = Case::new("justin_horse.toml");
    let settings = TaskSettings::default();
    let world = (&case.loaded.scene, &case.loaded.state);
    let of_build = RoadmapBuildSettings { nodes_per_arm: 2, exchanges: 0, tries: 0 };
    let budget = Budget::work(50_000_000);
    let built =
        build_roadmap(world, &case.query, &case.lists, (&settings, &of_build), (1, &Budget::unlimited())).unwrap();
    assert_eq!(built.n_exchanges(), 0);
    let ask = |roadmap: &TaskRoadmap| {
        plan_with_roadmap(world, &case.query, &case.lists, &settings, (4, &budget), Some(roadmap)).unwrap()
    };
    let first = ask(&built);
    accepted_by_checker(&case, &first.plan, 4);
    let grown = built.grown_by(world, &case.query, &case.lists, &settings, &first).unwrap();
    assert_eq!((grown.n_exchanges(), &grown.origin), (1, &built.origin));
    let grown = TaskRoadmap::from_json(Path::new("roadmap"), &grown.to_json()).unwrap();
    assert_eq!(grown.differs_from(world, &case.query, &case.lists, &settings).unwrap(), None);
    // The exchange is taken from the roadmap now, and is not added again.
    let second = ask(&grown);
    accepted_by_checker(&case, &second.plan, 4);
    let again = grown.grown_by(world, &case.query, &case.lists, &settings, &second).unwrap();
    assert_eq!(again.n_exchanges(), 1);
}

#[test]
fn roadmaps_do_not_depend_on_threads_and_are_made_again_the_same() {
    let case = Case::new("justin_horse_near.toml");
    let settings = TaskSettings::default();
    let first = built(&case, &settings).to_json();
    let again = std::thread::scope(|scope| scope.spawn(|| built(&case, &settings).to_json()).join().unwrap());
    assert_eq!(first, again);
}

#[test]
fn a_roadmap_of_something_else_is_refused() {
    let settings = TaskSettings::default();
    let case = Case::new("justin_horse.toml");
    let roadmap = built(&case, &settings);
    let differs = |other: &Case, settings: &TaskSettings| {
        let world = (&other.loaded.scene, &other.loaded.state);
        roadmap.differs_from(world, &other.query, &other.lists, settings).unwrap()
    };
    assert_eq!(differs(&case, &settings), None);
    // The same robot, object and obstacles; the object stands elsewhere, or its goal is elsewhere.
    let mut elsewhere = Case::new("justin_horse.toml");
    elsewhere.query.world_from_object_goal.translation.vector.y -= 0.02;
    assert_eq!(differs(&elsewhere, &settings), None);
    let vases = Case::new("justin_horse_vases.toml");
    assert_eq!(differs(&vases, &settings), Some("what rests around the robot"));
    let mut short = Case::new("justin_horse.toml");
    short.lists[0].1.grasps.pop();
    assert_eq!(differs(&short, &settings), Some("the object or a list of its grasps"));
    let other = TaskSettings { line_step: 0.02, ..TaskSettings::default() };
    assert_eq!(differs(&case, &other), Some("a setting that exchanges depend on"));
    let world = (&vases.loaded.scene, &vases.loaded.state);
    let budget = Budget::work(1000);
    let failure =
        plan_with_roadmap(world, &vases.query, &vases.lists, &settings, (0, &budget), Some(&roadmap)).unwrap_err();
    assert_eq!(failure.kind, FailureKind::SettingsInvalid);
    assert!(failure.message.contains("what rests around the robot differs"), "{}", failure.message);
}

#[test]
fn broken_files_are_errors() {
    let case = Case::new("justin_horse_near.toml");
    let text = built(&case, &TaskSettings::default()).to_json();
    let code = |text: &str| TaskRoadmap::from_json(Path::new("roadmap"), text).unwrap_err().diagnostics[0].code;
    assert_eq!(code("{}"), "R601");
    assert_eq!(code(&text[..text.len() / 2]), "R601");
    assert_eq!(code(&text.replacen("\"format_version\":1", "\"format_version\":9", 1)), "R602");
    assert_eq!(code(&text.replacen("\"first\":", "\"first\":99", 1)), "R606");
}
