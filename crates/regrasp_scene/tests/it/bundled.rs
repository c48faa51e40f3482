//! Every bundled scene loads, and its object starts where the notes say.

use crate::support::{repository, shared_models, with_models};
use regrasp_geometry::{Point, Pose};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{GraspRequest, LoadedScene, load_scene};
use std::path::{Path, PathBuf};

/// The `.toml` files of `scenes/folder`, sorted.
fn scenes_in(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(repository().join("scenes").join(folder)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    paths
}

fn load(path: &Path, options: &LoadOptions) -> LoadedScene {
    load_scene(path, options).unwrap_or_else(|error| panic!("{error}"))
}

fn center_in_world(loaded: &LoadedScene, world_from_object: &Pose) -> Point {
    world_from_object * loaded.scene.objects[0].center_of_mass
}

/// Scenes of the papers that are more than a turn in place, and those of tracking, which have a start grasp; and those of several hands.
const PAPER_SCENES: [&str; 17] = [
    "bulb",
    "cubic",
    "diamond",
    "diamond_any_start",
    "ellipsoid_free",
    "ellipsoid_obstacle",
    "five_fingertips",
    "football",
    "football_any_start",
    "football_pivot",
    "icosahedron",
    "pencil",
    "robot_two_arms",
    "three_fingertips",
    "tracking_sphere_six",
    "tracking_sphere_wide",
    "two_hands",
];

#[test]
fn scenes_of_the_bundled_hands_load_without_models() {
    let mut paths = scenes_in("");
    let is_of_paper =
        |path: &PathBuf| PAPER_SCENES.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name));
    assert_eq!(paths.iter().filter(|path| is_of_paper(path)).count(), PAPER_SCENES.len());
    paths.retain(|path| !is_of_paper(path));
    assert_eq!(paths.len(), 15);
    for path in paths {
        let loaded = load(&path, &LoadOptions::default());
        assert_eq!(loaded.notes, Vec::<String>::new(), "{}", path.display());
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let n_fingers = if name.starts_with("six_finger") {
            6
        } else if name.starts_with("soft_pair") {
            2
        } else {
            4
        };
        assert_eq!(loaded.scene.hands[0].hand.fingers.len(), n_fingers);
        let query = loaded.task().query(7);
        let start = center_in_world(&loaded, query.start());
        assert!((start - Point::new(0.0, 0.0, 0.078)).norm() < 1e-12);
        assert_eq!(*query.start_grasp(), GraspRequest::Automatic);
        let roles: Vec<&str> = loaded.scene.inputs.iter().map(|input| input.role.as_str()).collect();
        let n_meshes = usize::from(name.starts_with("egg_"));
        assert_eq!(roles, ["scene", "hand", "urdf", "mesh"][..3 + n_meshes]);
        for input in &loaded.scene.inputs {
            assert_eq!(input.sha256, regrasp_base::files::sha256(&std::fs::read(&input.path).unwrap()));
            assert!(!Path::new(&input.name).is_absolute(), "{}", input.name);
        }
    }
}

#[test]
fn the_bulb_is_what_its_generator_writes() {
    let written = std::fs::read_to_string(repository().join("assets/objects/bulb.obj")).unwrap();
    assert_eq!(
        written,
        crate::bulb_mesh::obj(),
        "cargo run -p regrasp_scene --example bulb_mesh > assets/objects/bulb.obj"
    );
}

#[test]
fn the_bulb_is_round_closed_and_as_large_as_its_scene_says() {
    let loaded = load(&repository().join("scenes/bulb.toml"), &LoadOptions::default());
    assert_eq!(loaded.notes, Vec::<String>::new(), "closed and wound outwards");
    let regrasp_geometry::Shape::Mesh(mesh) = &loaded.scene.objects[0].shape else { panic!("the bulb is a mesh") };
    let radius_at = |low: f64, high: f64| {
        let there = mesh.vertices().iter().filter(|v| v.z >= low && v.z <= high);
        there.map(|v| v.x.hypot(v.y)).fold(0.0, f64::max)
    };
    assert!((radius_at(-0.024, 0.024) - 0.024).abs() < 2e-4);
    assert!((radius_at(0.030, 0.050) - 0.009).abs() < 1e-6);
    let center = loaded.scene.objects[0].center_of_mass;
    assert!(center.x.hypot(center.y) < 1e-9 && center.z > 0.0 && center.z < 0.012, "{center}");
    // 2 mm of play: the socket's faces are 11 mm off the vertical axis.
    for obstacle in loaded.scene.obstacles.iter().filter(|obstacle| obstacle.name != "socket_roof") {
        let regrasp_geometry::Shape::Cuboid { half_extents } = &obstacle.placed.shape else { panic!("boxes") };
        let at = obstacle.placed.parent_from_shape.translation.vector;
        assert!((at.x.hypot(at.y) - half_extents.x - 0.011).abs() < 1e-6, "{}", obstacle.name);
    }
}

#[test]
fn the_cube_turns_all_the_way_in_three_legs() {
    let loaded = load(&repository().join("scenes/cubic.toml"), &LoadOptions::default());
    let poses = loaded.task().query(3).as_in_hand().unwrap().poses();
    assert_eq!(poses.len(), 4);
    let step = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), 120f64.to_radians());
    for pair in poses.windows(2) {
        assert!(
            (pair[1].rotation * pair[0].rotation.inverse()).angle_to(&step) < 1e-9,
            "all legs go the same way round"
        );
        assert_eq!(pair[0].translation, pair[1].translation);
    }
}

#[test]
fn allegro_scenes_start_at_home_and_turn_by_what_their_name_says() {
    let Some(models) = shared_models() else { return };
    let options = with_models(&models);
    let mut paths = scenes_in("allegro");
    // Those of tracking begin with a grasp, at one place.
    paths.retain(|path| !path.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("tracking_")));
    assert_eq!(paths.len(), 19);
    let home = Point::new(0.082, 0.003, 0.005);
    for path in paths {
        let loaded = load(&path, &options);
        assert_eq!(loaded.scene.hands[0].hand.fingers.len(), 4);
        assert_eq!(loaded.scene.hands[0].hand.n_joints(), 16);
        let name = path.file_stem().unwrap().to_str().unwrap();
        let wanted_angle = if name.contains("_180") { 180f64 } else { 90.0 };
        let wanted_axis = match name.chars().last() {
            Some('x') => nalgebra::Vector3::x(),
            Some('y') => nalgebra::Vector3::y(),
            _ => nalgebra::Vector3::z(),
        };
        let mut starts = Vec::new();
        for seed in 0..20 {
            let query = loaded.task().query(seed);
            let start = center_in_world(&loaded, query.start());
            assert!((start - home).norm() <= 0.005 + 1e-6, "{name} {start}");
            let goal = center_in_world(&loaded, query.goal());
            assert!((start - goal).norm() < 1e-6, "{name} turns in place");
            let turn = query.goal().rotation * query.start().rotation.inverse();
            let expected = nalgebra::UnitQuaternion::from_scaled_axis(wanted_axis * wanted_angle.to_radians());
            assert!(turn.angle_to(&expected) < 1e-9, "{name}");
            starts.push(start);
        }
        assert!(starts.windows(2).all(|pair| (pair[0] - pair[1]).norm() > 1e-6), "{name} varies with the seed");
    }
}

#[test]
fn scanned_objects_have_their_sizes_and_lie_aligned() {
    let Some(models) = shared_models() else { return };
    // Extents along the world axes at the start, as trimesh and a minimum-area rectangle give them.
    let expected =
        [("rubiks_x", [0.0581, 0.0590, 0.0579]), ("apple_z", [0.0754, 0.0749, 0.0719]), ("can_y", [0.05, 0.05, 0.08])];
    for (name, extents) in expected {
        let loaded = load(&repository().join(format!("scenes/allegro/{name}.toml")), &with_models(&models));
        let rotation = loaded.task().query(0).start().rotation;
        let (mut low, mut high) = (Point::from([f64::INFINITY; 3]), Point::from([f64::NEG_INFINITY; 3]));
        let vertices = match &loaded.scene.objects[0].shape {
            regrasp_geometry::Shape::Mesh(mesh) => mesh.vertices(),
            regrasp_geometry::Shape::Convex(hull) => hull.vertices(),
            other => panic!("{name} is a {}", other.kind()),
        };
        for vertex in vertices {
            low = low.inf(&(rotation * vertex));
            high = high.sup(&(rotation * vertex));
        }
        for k in 0..3 {
            assert!((high[k] - low[k] - extents[k]).abs() < 5e-4, "{name} {:?}", high - low);
        }
    }
}

#[test]
fn three_fingered_hands_load() {
    let Some(models) = shared_models() else { return };
    for folder in ["dclaw", "trifinger"] {
        let loaded = load(&repository().join(format!("scenes/{folder}/sphere32_z.toml")), &with_models(&models));
        assert_eq!(loaded.scene.hands[0].hand.fingers.len(), 3);
        assert_eq!(loaded.scene.hands[0].hand.n_joints(), 9);
    }
}

/// Home is out in front of the palm and below the fingertips: all tips are balls of 12 mm, and at the grasp of the notes
/// (by measurement on a prototype) they touch a sphere of 32 mm at (82, 1, 1) mm.
#[test]
fn the_allegro_grasp_of_the_notes_touches_the_sphere() {
    let Some(models) = shared_models() else { return };
    let loaded = load(&repository().join("scenes/allegro/sphere32_x.toml"), &with_models(&models));
    let degrees =
        [[-10.0, 31.0, 98.0, 51.0], [7.0, 10.0, 95.0, 43.0], [1.0, 51.0, 91.0, 19.0], [76.0, 58.0, 32.0, 96.0f64]];
    let center = Point::new(0.082, 0.001, 0.001);
    for (finger, degrees) in loaded.scene.hands[0].hand.fingers.iter().zip(degrees) {
        let tip = finger.chain.tip(&degrees.map(f64::to_radians), &finger.tip.center_in_body);
        // The notes give whole degrees: half a degree over 150 mm is 1.3 mm.
        assert!(((tip - center).norm() - 0.044).abs() < 0.003, "{} {}", finger.name, (tip - center).norm());
    }
}

fn check_start_touches(loaded: &LoadedScene) {
    let query = loaded.task().query(0);
    assert_eq!(query.task(), regrasp_scene::query::TRACKING);
    let GraspRequest::Contacts(contacts) = query.start_grasp() else { panic!("contacts are given") };
    assert_eq!(contacts.len(), loaded.scene.hands[0].hand.fingers.len());
    let regrasp_geometry::Shape::Sphere { radius } = loaded.scene.objects[0].shape else { panic!("a sphere") };
    for contact in contacts {
        assert!((contact.coords.norm() - radius).abs() < 1e-8);
    }
    let turn = query.goal().rotation * query.start().rotation.inverse();
    let expected = nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::z() * 90f64.to_radians());
    assert!(turn.angle_to(&expected) < 1e-9);
}

#[test]
fn spheres_of_tracking_by_real_fingers_begin_with_contacts_on_them() {
    check_start_touches(&load(&repository().join("scenes/tracking_sphere_wide.toml"), &LoadOptions::default()));
    let Some(models) = shared_models() else { return };
    let path = repository().join("scenes/allegro/tracking_sphere32_z.toml");
    check_start_touches(&load(&path, &with_models(&models)));
}

/// Cherif 1999, sec. 7: masses, friction, orientations, radii and reach.
#[test]
fn scenes_of_finger_tracking_are_those_of_the_paper() {
    let football = ([0.5, 0.7, 0.4], [-0.6, -0.5, 0.8]);
    let ends = [
        ("diamond", [0.5, 0.4, 0.4], [-0.5, -0.5, 0.7]),
        ("football", football.0, football.1),
        ("football_pivot", football.0, football.1),
    ];
    for (name, start, goal) in ends {
        let loaded = load(&repository().join("scenes").join(format!("{name}.toml")), &LoadOptions::default());
        let (scene, query) = (&loaded.scene, loaded.task().query(3));
        assert_eq!((query.task(), scene.hands[0].reach), (regrasp_scene::query::TRACKING, Some(0.1)));
        assert_eq!((scene.objects[0].mass, scene.objects[0].friction), (1.0, 0.7));
        for (pose, vector) in [(query.start(), start), (query.goal(), goal)] {
            assert!((pose.rotation.scaled_axis() - regrasp_geometry::Vector::from(vector)).norm() < 1e-12);
            assert_eq!(pose.translation.vector, regrasp_geometry::Vector::zeros());
        }
        for finger in &scene.hands[0].hand.fingers {
            assert!((0.02..=0.04).contains(&finger.tip.radius()));
            assert_eq!(finger.tip.pad.is_some(), name.starts_with("football"));
        }
        let regrasp_scene::GraspRequest::Contacts(contacts) = query.start_grasp() else { panic!("contacts are given") };
        for (finger, contact) in scene.hands[0].hand.fingers.iter().zip(contacts) {
            let foot = scene.objects[0].surface.project(contact);
            assert!((foot.point_in_object - contact).norm() < 1e-8);
            let center =
                query.start() * (foot.point_in_object + foot.normal_in_object.into_inner() * finger.tip.radius());
            let away = (finger.ik.tip(&finger.rest) - center).norm();
            // Those of the diamond rest where half of the turn is done.
            assert!(if name == "diamond" { away < 0.1 } else { away < 2e-6 }, "{name}: {away}");
        }
    }
}
