//! Soft fingertips, of which two hold, and fingers with coupled joints, on real hands: plans against the checker, and
//! the checker against the same plans in hands without torsion or with other couplings.

use crate::places::shared_models;
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_mutations::mutants;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand, validate_once};
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_scene::{LoadedScene, Scene, load_scene};
use std::collections::BTreeSet;
use std::path::Path;

pub fn scene(name: &str, models: &Path) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let resolve = ResolveOptions { packages: vec![("models".into(), models.to_owned())], search_paths: vec![] };
    load_scene(&path, &LoadOptions { resolve, ..LoadOptions::default() }).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Plans `name` with some seeds; every plan is accepted and every mutant of it rejected for a reason that fits. Returns
/// the names of the mutants.
fn mutants_of_accepted_plans(name: &str, models: &Path, seeds: std::ops::Range<u64>) -> BTreeSet<&'static str> {
    let loaded = scene(name, models);
    let settings = InHandSettings::default();
    let mut names = BTreeSet::new();
    for seed in seeds {
        let query = loaded.in_hand(seed);
        let plan = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(20_000_000), &|_| {})
            .unwrap_or_else(|failure| panic!("{name}, seed {seed}: {failure}"));
        assert_eq!(validate_once(&loaded.view(), &plan, &settings), Ok(()), "{name}, seed {seed}");
        let asked = query.clone().into();
        let judge =
            |scene: &Scene, plan: &Plan| check((scene, &loaded.state), Some(&asked), plan, &CheckSettings::default());
        let report = judge(&loaded.scene, &plan);
        assert!(report.accepted(), "{name}, seed {seed}: {report:#?}");
        for mutant in mutants(&plan, loaded.manipulation(), &mut Rng::keyed(seed, "soft and coupled", 0)) {
            let report = judge(mutant.scene.as_ref().unwrap_or(&loaded.scene), &mutant.plan);
            let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            assert!(fits, "{name}, seed {seed}, {}: {report:#?}", mutant.name);
            names.insert(mutant.name);
        }
    }
    names
}

#[test]
fn three_soft_fingers_hold_by_two_while_the_third_moves() {
    let Some(models) = shared_models() else { return };
    let mut names = mutants_of_accepted_plans("dclaw/soft_sphere32_x.toml", &models, 0..3);
    names.extend(mutants_of_accepted_plans("trifinger/soft_sphere32_z.toml", &models, 0..1));
    for wanted in [
        "torsion that two fingers hold by is absent",
        "torsion that two fingers hold by is a thousandth",
        "fingertips without friction",
    ] {
        assert!(names.contains(wanted), "{wanted} is not among {names:?}");
    }
}

#[test]
fn five_fingers_with_coupled_joints_turn_a_sphere() {
    let Some(models) = shared_models() else { return };
    let names = mutants_of_accepted_plans("shadow/sphere32_z.toml", &models, 0..2);
    for wanted in [
        "coupling broken by three degrees",
        "coupling left out",
        "coupled joint beyond its limit",
        "coupled joint named as if it were free",
    ] {
        assert!(names.contains(wanted), "{wanted} is not among {names:?}");
    }
}
