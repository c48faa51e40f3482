//! The pairs of a scene against a count by hand.

use crate::support::{Folder, GOOD};
use regrasp_scene::collision_pairs;

const OBSTACLE: &str = "\n[[obstacles]]\nname = \"wall\"\nbox = { size = [0.01, 0.2, 0.2] }\nposition = [0.2, 0, 0]\n";

#[test]
fn every_pair_is_there_or_has_a_reason_not_to_be() {
    let mut loaded = Folder::new().load(&format!("{GOOD}{OBSTACLE}")).unwrap();
    let pairs = collision_pairs(&loaded.scene);
    let hand = &loaded.scene.hand;
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
    let link = |id: regrasp_scene::FingerShapeId| hand.fingers[id.finger.0].shapes[id.shape].link;
    let (a, b) = (link(a), link(b));
    loaded.scene.hand.allowed_pairs.insert((a.min(b), a.max(b)));
    let fewer = collision_pairs(&loaded.scene);
    assert!(fewer.finger_finger.len() < pairs.finger_finger.len());
    assert_eq!(fewer.within_finger.len(), pairs.within_finger.len());
}
