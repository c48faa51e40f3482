//! Hands and objects of the tests.

use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_grasp::record::PlanInput;
use regrasp_grasp_lists::{Failure, GraspSettings, list_grasps};
use regrasp_plan::check::{CheckSettings, GraspReport, check_grasps};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A bundled hand with the object of a bundled scene.
pub fn bundled(hand: &str, scene: &str) -> GraspScene {
    let hand = root().join("assets/hands").join(hand).join("hand.toml");
    let object = ObjectSource::Scene(root().join("scenes").join(scene));
    load_grasp_scene(&hand, &object, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The wide hand with a lamp on its palm, which a joint of no finger turns, and the object of a bundled scene.
pub fn with_lamp(scene: &str, lamp: f64) -> GraspScene {
    let hand = root().join("assets/hands/wide_four_finger");
    let own = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("lamp_{lamp}"));
    std::fs::create_dir_all(&own).unwrap();
    let joint = r#"<joint name="lamp" type="revolute"><parent link="palm"/><child link="shade"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint><link name="shade"/></robot>"#;
    let urdf = std::fs::read_to_string(hand.join("hand.urdf")).unwrap();
    std::fs::write(own.join("hand.urdf"), urdf.replace("</robot>", joint)).unwrap();
    let file = std::fs::read_to_string(hand.join("hand.toml")).unwrap();
    let held = format!("base_link = \"palm\"\n\n[held]\nlamp = {lamp}\n");
    std::fs::write(own.join("hand.toml"), file.replace("base_link = \"palm\"\n", &held)).unwrap();
    let object = ObjectSource::Scene(root().join("scenes").join(scene));
    load_grasp_scene(&own.join("hand.toml"), &object, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A bundled hand with the bundled horse, which folds.
pub fn with_horse(hand: &str) -> GraspScene {
    let hand = root().join("assets/hands").join(hand).join("hand.toml");
    let object = ObjectSource::Mesh(MeshObject {
        path: root().join("assets/objects/horse.obj"),
        scale: 1.0,
        mass: 0.1,
        friction: 0.8,
        edge_distance: Some(0.002),
        crease_angle_deg: Some(80.0),
    });
    load_grasp_scene(&hand, &object, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Settings for a list of so many grasps.
pub fn settings(grasps: usize) -> GraspSettings {
    GraspSettings { grasps, n_threads: 2, ..GraspSettings::default() }
}

/// The list of a scene, with its files.
pub fn list(scene: &GraspScene, settings: &GraspSettings, seed: u64) -> Result<GraspList, Failure> {
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let mut list = list_grasps(hand, object, settings, seed, &Budget::unlimited())?;
    let input = |input: &regrasp_scene::scene::InputFile| PlanInput {
        role: input.role.clone(),
        name: input.name.clone(),
        sha256: input.sha256.clone(),
    };
    list.inputs = scene.scene.inputs.iter().map(input).collect();
    Ok(list)
}

/// What the checker says.
pub fn check(scene: &GraspScene, list: &GraspList) -> GraspReport {
    check_grasps(scene, list, &CheckSettings::default(), 2)
}
