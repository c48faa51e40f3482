//! Tasks that have no plan: each failure names its stage.

use crate::Case;
use regrasp_geometry::Pose;
use regrasp_tasks::{Failure, FailureKind, TaskSettings};

fn failure(case: &Case, settings: &TaskSettings) -> Failure {
    case.plan(settings, 0).expect_err("no plan")
}

#[test]
fn what_is_hopeless_is_refused_before_any_search() {
    let mut case = Case::new("justin_horse_near.toml");
    let start = case.query.world_from_object_start;
    case.query.world_from_object_start = Pose::translation(0.0, 0.0, 0.05) * start;
    let found = failure(&case, &TaskSettings::default());
    assert_eq!(found.kind, FailureKind::StartInvalid);
    assert!(found.message.starts_with("start: \"horse\" touches no support"), "{found}");
    case.query.world_from_object_start = start;

    case.loaded.scene.objects[0].mass = 20.0;
    let found = failure(&case, &TaskSettings::default());
    assert!(found.message.starts_with("start: \"horse\" weighs 20 kg"), "{found}");

    let found = failure(&Case::new("impossible_reach.toml"), &TaskSettings::default());
    assert_eq!(found.kind, FailureKind::GoalInvalid);
    assert!(found.message.contains("out of reach of every arm"), "{found}");
}

#[test]
fn a_search_that_fails_names_its_stage_and_counts() {
    let case = Case::new("justin_horse.toml");
    let settings = TaskSettings { hand_over: false, put_down: false, ..TaskSettings::default() };
    let found = failure(&case, &settings);
    assert!(found.message.starts_with("grasp: ") || found.message.starts_with("place: "), "{found}");
    assert!(!found.causes.is_empty() && found.statistics.work > 0);
    let few = TaskSettings { exchange_places: 0, put_down: false, ..TaskSettings::default() };
    let found = failure(&case, &few);
    assert!(found.message.starts_with("exchange: "), "{found}");
}
