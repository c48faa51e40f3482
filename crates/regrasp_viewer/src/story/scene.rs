//! The hand and the object of a plan, and everything around them.

use super::links::{Tree, as_look, link_looks, link_pieces, world_from_links};
use super::shapes::Shapes;
use super::{FingerStory, JointStory, Part, PoseData, SceneStory, at_rest};
use regrasp_geometry::Pose;
use regrasp_robot::{Hand, ResolveOptions};
use regrasp_scene::{Manipulation, is_of_hand};

/// The scene, with remarks on what could not be shown as it is. Visual meshes are looked for in `packages`.
pub(super) fn scene_story(task: &Manipulation, packages: &ResolveOptions) -> (SceneStory, Vec<(String, String)>) {
    let hand = task.hand();
    let tree = Tree::new(hand);
    let root = tree.world_from_root(hand, &task.world_from_hand());
    let mut shapes = Shapes::default();
    let own = |link| is_of_hand(task.scene, task.hand_index, link);
    let mut pieces = link_pieces(hand, &tree, &own, &mut shapes);
    let mut around = at_rest::bodies(task, &mut shapes);
    let mut looks = link_looks(hand, &tree, &own, &pieces, packages, &mut shapes);
    for index in (0..task.scene.hands.len()).filter(|index| *index != task.hand_index) {
        let (collision, own) = at_rest::hand(task, index, packages, &mut shapes);
        around.extend(collision);
        looks.join(own);
    }
    if looks.are_known {
        looks.pieces.extend(around.iter().filter(|piece| piece.part != Part::Hand).map(as_look));
    } else {
        looks.pieces.clear();
    }
    pieces.extend(around);
    pieces.extend(looks.pieces);
    let mut notes = looks.notes;
    let names = hand.joint_names();
    let effort_of = |name: &str| hand.robot.joint_named(name).and_then(|id| hand.robot.joints[id.0].limits?.effort);
    let chains = hand.fingers.iter().map(|finger| &finger.chain);
    let limits = chains.flat_map(|chain| chain.lower.iter().copied().zip(chain.upper.iter().copied()));
    let finite = |value: f64| value.is_finite().then_some(value);
    let joint = |(name, (lower, upper)): (&String, (f64, f64))| JointStory {
        name: name.clone(),
        lower: finite(lower),
        upper: finite(upper),
        effort: effort_of(name),
    };
    let joints = names.iter().zip(limits).map(joint).collect();
    let meshes = shapes.packed(&mut notes);
    let story = SceneStory {
        links: tree.links.clone(),
        hands: task.scene.hands.iter().map(|hand| hand.name.clone()).collect(),
        moving_hand: task.hand_index,
        objects: task.scene.objects.iter().map(|object| object.name.clone()).collect(),
        moved_object: task.object_index,
        world_from_root: PoseData::from(&root),
        joints,
        fingers: fingers(hand, &tree),
        friction: task.object().friction,
        gravity_in_world: task.scene.gravity().in_world().map(Into::into),
        meshes,
        pieces,
    };
    (story, notes)
}

fn fingers(hand: &Hand, tree: &Tree) -> Vec<FingerStory> {
    let story = |finger: &regrasp_robot::Finger| {
        let link = finger.tip.link;
        let center = hand.robot.fixed_pose_in_body(link).inverse() * finger.tip.center_in_body;
        FingerStory {
            name: finger.name.clone(),
            tip_link: tree.place_of[link.0],
            tip_center_in_link: center.coords.into(),
            tip_radius: finger.tip.radius(),
        }
    };
    hand.fingers.iter().map(story).collect()
}

impl SceneStory {
    /// Poses of all links in the world at `joints`, one value per entry of [`SceneStory::joints`].
    pub fn world_from_links(&self, joints: &[f64]) -> Vec<Pose> {
        world_from_links(&self.links, &Pose::from(&self.world_from_root), joints)
    }
}
