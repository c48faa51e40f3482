//! The LEAP hand, whose fingertips are meshes: the hand file that `inspect` writes is planned with, and its plans are accepted.

use crate::places::shared_models;
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_mutations::mutants;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand};
use regrasp_robot::inspect::{InspectSettings, hand_file_text, inspect};
use regrasp_robot::tip::{HullSurface, LARGEST_MISFIT, TipShape};
use regrasp_robot::{Hand, LoadOptions};
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;

/// A sphere in the hand, of which `inspect` writes the file; the y axis of the left hand is that of the right one mirrored.
fn scene(models: &Path, side: &str, folder: &Path) -> LoadedScene {
    let urdf = models.join(format!("hands/leap/leap_{side}.urdf"));
    let settings = InspectSettings { n_postures: 200 };
    let found = inspect(&urdf, &LoadOptions::default(), &settings, &mut Rng::keyed(0, "inspect", 0)).unwrap();
    let (hand, table) = found.hand.unwrap();
    std::fs::write(folder.join("hand.toml"), hand_file_text(&hand, &urdf.to_string_lossy(), &table.pairs.always_ids))
        .unwrap();
    let y = if side == "left" { -0.02 } else { 0.02 };
    let scene = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"hand.toml\"\n[object]\nname = \
         \"ball\"\nsphere = {{ radius = 0.032 }}\nmass = 0.1\nfriction = 0.8\n[start]\nposition = [0.095, {y}, 0.085]\n[goal]\nturn \
         = {{ axis = \"z\", angle_deg = 60 }}\n"
    );
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{side}: {error}"))
}

fn tips_are_smooth_meshes(hand: &Hand) {
    assert_eq!(hand.fingers.len(), 4);
    for finger in &hand.fingers {
        let TipShape::Hull { surface: HullSurface::Smooth(surface), misfit, elements, hull } = &finger.tip.shape else {
            panic!("{:?}", finger.tip.shape)
        };
        assert_eq!(elements, &[3], "{}", finger.name);
        assert!(*misfit < LARGEST_MISFIT && surface.points().len() <= 512 && hull.vertices().len() > 1000);
    }
}

#[test]
fn the_leap_hand_turns_a_sphere_with_the_file_that_inspect_writes() {
    let Some(models) = shared_models() else { return };
    for side in ["right", "left"] {
        let folder = tempfile::tempdir().unwrap();
        let loaded = scene(&models, side, folder.path());
        tips_are_smooth_meshes(&loaded.scene.hands[0].hand);
        let plan_of = |seed: u64| {
            let (view, query) = (loaded.view(), loaded.in_hand(seed));
            plan_in_hand(&view, &query, &InHandSettings::default(), seed, &Budget::work(400_000), &|_| {})
        };
        let plan = plan_of(1).unwrap_or_else(|failure| panic!("{side}: {failure}"));
        let query = loaded.task().query(1);
        let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
        assert!(report.accepted(), "{side}: {report:#?}");
        assert!(report.max_slip.is_some_and(|slip| slip < 1e-4), "{side}: {:?}", report.max_slip);
        if side == "left" {
            continue;
        }
        for mutant in mutants(&plan, loaded.manipulation(), &mut Rng::keyed(1, "leap", 0)) {
            let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
            let report = check((scene, &loaded.state), Some(&query), &mutant.plan, &CheckSettings::default());
            let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            assert!(fits, "{}: {report:#?}", mutant.name);
        }
    }
}
