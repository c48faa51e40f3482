//! Scenes in which a robot moves, and plans of straight motions for them: for tests that need plans and no planner.

use regrasp_plan::plan::PoseData;
use regrasp_plan::robot_plan::{RobotPlan, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, MotionQuery, Scene, load_scene_text};
use std::path::Path;

/// The bundled robot with two arms. The right hand holds a ball; a lamp stands between the arms, a shelf in front of them.
pub const TWO_ARMS: &str = r#"format = "regrasp-scene"
format_version = 2

[robot]
file = "ROBOT"

[[objects]]
name = "ball"
sphere = { radius = 0.02 }
mass = 0.1
friction = 0.8
position = [0.7, 0.6, 0.331]

[[objects]]
name = "cup"
cylinder = { radius = 0.03, length = 0.08 }
mass = 0.1
friction = 0.8
position = [0.5, 0.5, 0.361]

[[supports]]
name = "table"
box = { size = [0.5, 1.6, 0.02] }
position = [0.6, 0.0, 0.3]

[[obstacles]]
name = "lamp"
cylinder = { radius = 0.02, length = 0.7 }
position = [0.45, 0.0, 0.66]

[[obstacles]]
name = "shelf"
box = { size = [0.3, 1.2, 0.02] }
position = [0.75, 0.0, 1.1]

[[tasks]]
name = "swing"
task = "motion"
goal = { joints = { right_shoulder = 0.1, right_elbow = -0.7, right_wrist_roll = 0.6, left_elbow = -0.2 } }

[[tasks]]
name = "carry"
task = "motion"
start = { joints = { torso_yaw = 0.0 } }
goal = { joints = { torso_yaw = -0.3, right_shoulder = 0.2, right_elbow = -0.4 } }
carried = [{ object = "ball", hand = "right", position = [0.639395640, -0.25, 0.640143615] }]
"#;

/// The scene of the bundled robot.
pub fn two_arms() -> String {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/robots/two_arms/robot.toml");
    TWO_ARMS.replace("ROBOT", robot)
}

/// The scene that `text` says.
pub fn load(text: &str) -> LoadedScene {
    let path = Path::new("scene.toml");
    load_scene_text(path, text.as_bytes().to_vec(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The motion query called `name`.
pub fn motion(loaded: &LoadedScene, name: &str) -> MotionQuery {
    let task = loaded.task_named(name).unwrap_or_else(|| panic!("no task \"{name}\""));
    task.query(0).as_motion().expect("a task of kind motion").clone()
}

/// A plan that goes straight from one of `corners` to the next, resting at each, in `pieces` steps per leg, as fast as `share` of
/// the limits. It is one segment.
pub fn straight(scene: &Scene, query: &MotionQuery, corners: &[Vec<f64>], pieces: usize, share: f64) -> RobotPlan {
    let mut plan = RobotPlan::answering(scene, query);
    plan.method = "straight".into();
    let robot = &scene.robots[query.robot];
    let holds: Vec<_> = (query.carried.iter())
        .map(|carried| {
            let link = carried.holder.link(scene, query.robot).expect("the robot carries the hand");
            let mut poses = Vec::new();
            robot.link_poses(&query.start, &mut poses);
            (link, poses[link.0].inverse() * carried.world_from_object)
        })
        .collect();
    let mut waypoints: Vec<RobotWaypoint> = Vec::new();
    let mut now = 0.0;
    let mut add = |time: f64, joints: Vec<f64>, joint_velocities: Vec<f64>| {
        let mut poses = Vec::new();
        robot.link_poses(&joints, &mut poses);
        let world_from_objects = holds.iter().map(|(link, held)| PoseData::from(&(poses[link.0] * held))).collect();
        waypoints.push(RobotWaypoint { time, joints, joint_velocities, world_from_objects, contacts: Vec::new() });
    };
    add(0.0, corners[0].clone(), vec![0.0; corners[0].len()]);
    for pair in corners.windows(2) {
        let way: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| b - a).collect();
        // From rest to rest by one cubic: the largest speed is 1.5 times the mean, the largest acceleration 6 over the time squared.
        let time_of = |(k, way): (usize, &f64)| {
            let of_speed = 1.5 * way.abs() / (share * plan.promises.joint_velocities[k]);
            of_speed.max((6.0 * way.abs() / (share * plan.promises.joint_accelerations[k])).sqrt())
        };
        let span = way.iter().enumerate().map(time_of).fold(1e-3, f64::max);
        for piece in 1..=pieces {
            let u = piece as f64 / pieces as f64;
            let (at, slope) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / span);
            let joints = match piece == pieces {
                true => pair[1].clone(),
                false => pair[0].iter().zip(&way).map(|(from, way)| from + at * way).collect(),
            };
            let velocities = way.iter().map(|way| if piece == pieces { 0.0 } else { slope * way }).collect();
            add(now + u * span, joints, velocities);
        }
        now += span;
    }
    let kind = if query.carried.is_empty() { RobotSegmentKind::Transit } else { RobotSegmentKind::Carry };
    plan.segments = vec![RobotSegment { kind, held_by: RobotPlan::held_by(scene, query), in_hand: None, waypoints }];
    plan
}

/// A robot whose chest stays upright: torso_3 follows two joints. Its head stands still, nodding.
pub fn upright() -> (tempfile::TempDir, LoadedScene) {
    let folder = tempfile::tempdir().unwrap();
    let joint = |name: &str, parent: &str, child: &str, z: f64| {
        format!(
            "<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/>\
             <origin xyz='0 0 {z}'/><axis xyz='0 1 0'/><limit lower='-2' upper='2' velocity='2' effort='9'/></joint>"
        )
    };
    let link = |name: &str| {
        format!(
            "<link name='{name}'><collision><origin xyz='0 0 0.1'/><geometry><sphere radius='0.04'/></geometry>\
             </collision></link>"
        )
    };
    let urdf = format!(
        "<robot name='upright'>{}{}{}{}{}{}{}{}{}</robot>",
        link("base"),
        link("lower"),
        link("upper"),
        link("chest"),
        link("head"),
        joint("torso_1", "base", "lower", 0.1),
        joint("torso_2", "lower", "upper", 0.3),
        joint("torso_3", "upper", "chest", 0.3),
        joint("neck", "chest", "head", 0.3)
    );
    std::fs::write(folder.path().join("body.urdf"), urdf).unwrap();
    let robot = "format = \"regrasp-robot\"\nformat_version = 1\n[[models]]\nurdf = \"body.urdf\"\n[held]\nneck = 0.3\n[[couplings]]\njoint = \"torso_3\"\n\
                 terms = [{ leader = \"torso_1\", multiplier = -1.0 }, { leader = \"torso_2\", multiplier = -1.0 }]\n";
    std::fs::write(folder.path().join("robot.toml"), robot).unwrap();
    let scene = "format = \"regrasp-scene\"\nformat_version = 2\n[robot]\nfile = \"robot.toml\"\n[[tasks]]\ntask = \"motion\"\n\
                 goal = { joints = { torso_1 = 0.9, torso_2 = 0.9 } }\n";
    let path = folder.path().join("scene.toml");
    let loaded =
        load_scene_text(&path, scene.into(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    (folder, loaded)
}

/// A plan of pick and place that was made by hand, with its scene: `tests/support/pick_and_place/make.py` wrote both.
pub fn pick_and_place() -> (LoadedScene, RobotPlan) {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/support/pick_and_place"));
    let [scene, plan] = ["scene.toml", "plan.json"].map(|name| folder.join(name));
    let text = std::fs::read(&scene).unwrap();
    let loaded = load_scene_text(&scene, text, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let bytes = std::fs::read(&plan).unwrap();
    let plan = regrasp_plan::format::robot_from_json(&plan, &bytes).unwrap_or_else(|error| panic!("{error}"));
    (loaded, plan)
}
