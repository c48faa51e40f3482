//! The pairs of a scene against a count by hand.

use crate::support::{Folder, GOOD, repository, shared_models, with_models};
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Pose, Vector};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{FingerShapeId, LoadedScene, collision_pairs, load_scene};

const OBSTACLE: &str = "\n[[obstacles]]\nname = \"wall\"\nbox = { size = [0.01, 0.2, 0.2] }\nposition = [0.2, 0, 0]\n";

#[test]
fn every_pair_is_there_or_has_a_reason_not_to_be() {
    let mut loaded = Folder::new().load(&format!("{GOOD}{OBSTACLE}")).unwrap();
    let pairs = collision_pairs(&loaded.view());
    let hand = &loaded.scene.hands[0].hand;
    let n_shapes: usize = hand.fingers.iter().map(|finger| finger.shapes.len()).sum();
    assert_eq!(pairs.tip_object.len() + pairs.link_object.len(), n_shapes);
    assert_eq!(pairs.finger_obstacle.len(), n_shapes);
    assert_eq!(pairs.object_obstacle, [0]);
    assert_eq!(pairs.palm_object.len(), hand.palm.len());
    // Brute force over all ordered pairs of shapes.
    let (mut n_between, mut n_within) = (0, 0);
    for (i, a) in hand.fingers.iter().enumerate() {
        for (j, b) in hand.fingers.iter().enumerate() {
            for shape_a in &a.shapes {
                for shape_b in &b.shapes {
                    let allowed = hand.may_touch(shape_a.link, shape_b.link);
                    n_between += usize::from(i < j && !allowed);
                    n_within += usize::from(i == j && shape_a.body + 1 < shape_b.body && !allowed);
                }
            }
        }
    }
    assert_eq!(pairs.finger_finger.len(), n_between);
    assert_eq!(pairs.within_finger.len(), n_within);
    assert!(pairs.finger_palm.iter().all(|(id, _)| hand.fingers[id.finger.0].shapes[id.shape].body > 0));

    let (a, b) = pairs.finger_finger[0];
    let link = |id: FingerShapeId| hand.fingers[id.finger.0].shapes[id.shape].link;
    let (a, b) = (link(a), link(b));
    loaded.scene.hands[0].hand.allowed_pairs.insert((a.min(b), a.max(b)));
    let fewer = collision_pairs(&loaded.view());
    assert!(fewer.finger_finger.len() < pairs.finger_finger.len());
    assert_eq!(fewer.within_finger.len(), pairs.within_finger.len());
}

/// Names of the links of pairs that are less than `required` apart, with all fingers at rest and the object at its start.
fn near_at_rest(loaded: &LoadedScene, required: f64) -> Vec<String> {
    let scene = &loaded.scene;
    let hand = &scene.hands[0].hand;
    let pairs = collision_pairs(&loaded.view());
    let world_from_object = Placement::from(loaded.task().query(0).start());
    let bodies: Vec<Vec<Pose>> = hand
        .fingers
        .iter()
        .map(|finger| {
            let mut poses = Vec::new();
            finger.chain.forward(&finger.rest, &mut poses);
            poses
        })
        .collect();
    let finger_shape = |id: FingerShapeId| {
        let shape = &hand.fingers[id.finger.0].shapes[id.shape];
        let pose = bodies[id.finger.0][shape.body] * shape.placed.parent_from_shape;
        (&shape.placed.shape, Placement::from(&pose), hand.robot.links[shape.link.0].name.clone())
    };
    let palm_shape = |index: usize| {
        let palm = &hand.palm[index];
        let name = hand.robot.links[palm.link.0].name.clone();
        (&palm.placed.shape, Placement::from(&palm.placed.parent_from_shape), name)
    };
    let object = || (&scene.objects[0].shape, world_from_object, "object".to_owned());
    let mut tests = Vec::new();
    tests.extend(
        pairs.finger_finger.iter().chain(&pairs.within_finger).map(|&(a, b)| (finger_shape(a), finger_shape(b))),
    );
    tests.extend(pairs.finger_palm.iter().map(|&(a, palm)| (finger_shape(a), palm_shape(palm))));
    tests.extend(pairs.tip_object.iter().chain(&pairs.link_object).map(|&a| (finger_shape(a), object())));
    tests.extend(pairs.palm_object.iter().map(|&palm| (palm_shape(palm), object())));
    let mut near = Vec::new();
    for ((a, a_placed, a_name), (b, b_placed, b_name)) in tests {
        let mut direction = Vector::zeros();
        let answer = separation(
            Placed { shape: a, at: &a_placed },
            Placed { shape: b, at: &b_placed },
            required,
            required,
            &mut direction,
            &mut [0, 0],
        );
        if !matches!(answer, Separation::SeparatedBy(distance) if distance >= required) {
            near.push(format!("{a_name} and {b_name}"));
        }
    }
    near
}

#[test]
fn nothing_touches_at_rest() {
    let root = repository().join("scenes");
    let none = LoadOptions::default();
    for name in ["sphere_90x", "box_90x", "tight_sphere_180z", "tight_box_90x"] {
        let loaded = load_scene(&root.join(format!("{name}.toml")), &none).unwrap();
        assert_eq!(near_at_rest(&loaded, 1e-3), Vec::<String>::new(), "{name}");
    }
    let Some(models) = shared_models() else { return };
    for name in
        ["allegro/sphere32_x", "allegro/box_x", "allegro/cylinder20_x", "dclaw/sphere32_z", "trifinger/sphere32_z"]
    {
        let loaded = load_scene(&root.join(format!("{name}.toml")), &with_models(&models)).unwrap();
        assert_eq!(near_at_rest(&loaded, 1e-3), Vec::<String>::new(), "{name}");
    }
}
