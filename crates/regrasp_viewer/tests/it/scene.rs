use crate::places::repository;
use crate::sample::{Sample, options_with_models, story_without_plan};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_robot::Hand;
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use regrasp_viewer::story::{Carrier, HandStory, LinkKind, Role, Story, pack};

fn story_of(loaded: &LoadedScene, options: &LoadOptions) -> Story {
    story_without_plan(loaded.manipulation(), options)
}

/// Compares the tree of the story with the chains of the hand at random joints; the largest difference.
fn assert_same_kinematics(hand: &Hand, story: &HandStory) {
    let mut rng = Rng::keyed(3, "story", 0);
    for _ in 0..50 {
        let within = |(lower, upper): (f64, f64), rng: &mut Rng| rng.uniform(lower.max(-3.0), upper.min(3.0));
        let limits = hand.fingers.iter().flat_map(|f| f.chain.lower.iter().copied().zip(f.chain.upper.iter().copied()));
        let joints: Vec<f64> = limits.map(|limits| within(limits, &mut rng)).collect();
        let poses = story.world_from_links(&joints);
        let mut first = 0;
        for (f, finger) in hand.fingers.iter().enumerate() {
            let n = finger.chain.n_coordinates();
            let mut bodies = Vec::new();
            finger.chain.forward(&joints[first..first + n], &mut bodies);
            first += n;
            // Fingertips, and every collision shape of the finger on its link.
            let told = &story.fingers[f];
            let exact = bodies.last().unwrap() * finger.tip.center_in_body;
            let found = poses[told.tip_link] * regrasp_geometry::Point::from(told.tip_center_in_link);
            assert!((exact - found).norm() < 1e-12, "{}: {exact} {found}", told.name);
            assert_eq!(told.tip_radius, finger.tip.radius());
            for shape in &finger.shapes {
                let name = &hand.robot.links[shape.link.0].name;
                let link = story.links.iter().position(|link| link.name == *name).unwrap();
                assert_eq!(story.links[link].finger, f as i32, "{name}");
                let body_from_link = hand.robot.fixed_pose_in_body(shape.link);
                let exact: Pose = bodies[shape.body] * body_from_link;
                let difference = exact.to_homogeneous() - poses[link].to_homogeneous();
                assert!(difference.amax() < 1e-12, "{name}: {difference}");
            }
        }
        for palm in &hand.palm {
            let name = &hand.robot.links[palm.link.0].name;
            assert_eq!(story.links.iter().find(|link| link.name == *name).unwrap().finger, -1);
        }
    }
}

#[test]
fn links_are_where_the_hand_has_them() {
    let mut scenes =
        vec![("scenes/sphere_90x.toml", LoadOptions::default()), ("scenes/bulb.toml", LoadOptions::default())];
    if let Some(options) = options_with_models() {
        // The Shadow hand has coupled joints, the wrist of which belongs to no finger.
        scenes.extend(
            ["scenes/allegro/cube57_z.toml", "scenes/shadow/cube57_x.toml", "scenes/trifinger/sphere32_z.toml"]
                .map(|scene| (scene, options.clone())),
        );
    }
    for (path, options) in scenes {
        let loaded = load_scene(&repository().join(path), &options).unwrap();
        let scene = &loaded.scene;
        let story = story_of(&loaded, &options);
        let hand = story.scene.hand();
        let names: Vec<&str> = hand.joints.iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names, scene.hands[0].hand.joint_names());
        for (place, link) in hand.links.iter().enumerate() {
            assert!(link.parent < place as i32 && (link.parent >= 0) == (place > 0), "{path}: {}", link.name);
            assert_eq!(link.joint >= 0, link.kind != LinkKind::Fixed);
        }
        assert_same_kinematics(&scene.hands[0].hand, hand);
        let has_mimic = hand.links.iter().any(|link| link.joint >= 0 && link.multiplier != 1.0 || link.offset != 0.0);
        let shares = |link: usize| hand.links.iter().filter(|l| l.joint == link as i32).count() > 1;
        let n_coupled = (0..hand.joints.len()).filter(|&k| shares(k)).count();
        assert_eq!(has_mimic || n_coupled > 0, path.contains("shadow"), "{path}");
    }
}

#[test]
fn every_shape_is_drawn_once_and_every_piece_has_its_mesh() {
    let options = LoadOptions::default();
    let loaded = load_scene(&repository().join("scenes/ellipsoid_obstacle.toml"), &options).unwrap();
    let scene = &loaded.scene;
    let story = story_of(&loaded, &options).scene;
    for (i, mesh) in story.meshes.iter().enumerate() {
        assert!(story.meshes[..i].iter().all(|other| other != mesh), "mesh {i} is there twice");
        assert!(story.pieces.iter().any(|piece| piece.mesh == i), "mesh {i} is of no use");
        assert!(pack::unpack(mesh).is_some());
    }
    assert!(story.pieces.iter().all(|piece| piece.mesh < story.meshes.len() && piece.role == Role::Collision));
    let n_link_shapes: usize = scene.hands[0].hand.robot.links.iter().map(|link| link.collision.len()).sum();
    let on_links = story.pieces.iter().filter(|piece| matches!(piece.on, Carrier::Hand(..)));
    assert!(on_links.clone().count() >= n_link_shapes);
    assert_eq!(
        on_links
            .filter(|piece| piece.is_tip)
            .map(|piece| story.name_of(piece.on))
            .collect::<std::collections::BTreeSet<_>>()
            .len(),
        4
    );
    assert_eq!(
        story.pieces.iter().filter(|piece| !matches!(piece.on, Carrier::Hand(..))).count(),
        1 + scene.obstacles.len()
    );
}

#[test]
fn looks_come_from_the_robot_file_and_do_not_matter_to_planning() {
    let Some(options) = options_with_models() else { return };
    let loaded = load_scene(&repository().join("scenes/allegro/cube57_z.toml"), &options).unwrap();
    let scene = &loaded.scene;
    let story = story_of(&loaded, &options);
    let of_role = |story: &Story, role: Role| story.scene.pieces.iter().filter(|piece| piece.role == role).count();
    assert!(of_role(&story, Role::Visual) > 20);
    assert!(!story.facts.iter().any(|(label, _)| label.starts_with("Looks of")));
    // No visual mesh is among what the scene was read from.
    assert!(scene.inputs.iter().all(|input| !input.name.contains("visual")));
}

#[test]
fn what_cannot_be_read_looks_as_it_collides_and_the_facts_name_it() {
    let folder = tempfile::tempdir().unwrap();
    let hand = repository().join("assets/hands/wide_four_finger");
    std::fs::copy(hand.join("hand.toml"), folder.path().join("hand.toml")).unwrap();
    let urdf = std::fs::read_to_string(hand.join("hand.urdf")).unwrap();
    let with = |geometry: &str| format!("<visual><geometry>{geometry}</geometry></visual>");
    let in_link = |urdf: &str, name: &str, visual: &str| {
        let open = format!("<link name=\"{name}\">");
        assert!(urdf.contains(&open), "{name}");
        urdf.replace(&open, &format!("{open}{visual}"))
    };
    let urdf = in_link(&urdf, "palm", &with("<mesh filename=\"palm.dae\"/>"));
    let urdf = in_link(&urdf, "east_proximal", &with("<box size=\"0.01 0.02 nonsense\"/>"));
    let urdf = in_link(&urdf, "north_proximal", &with("<box size=\"0.01 0.02 0.03\"/>"));
    std::fs::write(folder.path().join("hand.urdf"), urdf).unwrap();
    let scene = std::fs::read_to_string(repository().join("scenes/sphere_90x.toml")).unwrap();
    let scene = scene.replace("../assets/hands/wide_four_finger/hand.toml", "hand.toml");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();

    let options = LoadOptions::default();
    let loaded = load_scene(&path, &options).unwrap();
    let story = story_of(&loaded, &options);
    let looks_of = |name: &str| story.facts.iter().find(|(label, _)| *label == format!("Looks of {name}"));
    assert!(looks_of("palm").unwrap().1.contains("palm.dae"), "{:?}", looks_of("palm"));
    assert!(looks_of("east_proximal").is_some() && looks_of("north_proximal").is_none());
    let meshes = |name: &str, role: Role| -> Vec<usize> {
        story
            .scene
            .pieces
            .iter()
            .filter(|p| story.scene.name_of(p.on).as_deref() == Some(name) && p.role == role)
            .map(|p| p.mesh)
            .collect()
    };
    for name in ["palm", "east_proximal", "west_proximal"] {
        assert_eq!(meshes(name, Role::Visual), meshes(name, Role::Collision), "{name}");
    }
    assert_ne!(meshes("north_proximal", Role::Visual), meshes("north_proximal", Role::Collision));
    assert_eq!(meshes("sphere", Role::Visual), meshes("sphere", Role::Collision));
}

#[test]
fn a_story_is_the_same_after_json_and_every_time() {
    let sample = Sample::sphere();
    let story = sample.story();
    let json = story.to_json();
    assert_eq!(serde_json::from_str::<Story>(&json).unwrap(), story);
    assert_eq!(sample.story().to_json(), json);
    assert_eq!(story.asked.len(), 2);
}

#[test]
fn fingertips_are_drawn_as_they_touch_whatever_else_their_link_is() {
    let path = repository().join("scenes/oval_sphere_90x.toml");
    let loaded = load_scene(&path, &LoadOptions::default()).unwrap();
    let story = story_of(&loaded, &LoadOptions::default());
    for finger in &story.scene.hand().fingers {
        let on_tip = |carrier: &Carrier| *carrier == Carrier::Hand(0, finger.tip_link);
        let tips = story.scene.pieces.iter().filter(|piece| on_tip(&piece.on) && piece.is_tip);
        let is_ellipsoid = |mesh: usize| {
            let (mesh, sizes) = (&story.scene.meshes[mesh], [0.011, 0.012, 0.015]);
            (0..3).all(|k| (mesh.upper[k] - mesh.lower[k] - sizes[k]).abs() < 2e-4)
        };
        assert_eq!(tips.filter(|piece| is_ellipsoid(piece.mesh)).count(), 1, "{}", finger.name);
    }
}
