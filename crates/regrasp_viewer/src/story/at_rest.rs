//! What rests in a scene: the object before it is moved, other objects, supports, obstacles, links of robots, other hands.

use super::links::{Looks, Tree, link_looks, link_pieces, world_from_links};
use super::shapes::Shapes;
use super::{Carrier, OtherCarrier, Part, PieceStory, PoseData, Role};
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::ResolveOptions;
use regrasp_scene::{Manipulation, is_of_hand};

/// The object that is moved, then obstacles, supports and the other objects where they rest.
pub(super) fn bodies(task: &Manipulation, shapes: &mut Shapes) -> Vec<PieceStory> {
    let scene = task.scene;
    let mut pieces = Vec::new();
    let mut add = |on, part, name: &str, from_mesh: &Pose, shape: &Shape| {
        let (on, mesh) = (Carrier::Other(on), shapes.index_of(shape));
        let (name, from_mesh) = (name.to_owned(), PoseData::from(from_mesh));
        pieces.push(PieceStory { on, part, name, role: Role::Collision, mesh, from_mesh, is_tip: false });
    };
    add(OtherCarrier::Object, Part::Object, &task.object().name, &Pose::identity(), &task.object().shape);
    let supports = scene.supports.iter().map(|support| (Part::Support, &support.body));
    for (part, body) in scene.obstacles.iter().map(|obstacle| (Part::Obstacle, obstacle)).chain(supports) {
        add(OtherCarrier::World, part, &body.name, &body.placed.parent_from_shape, &body.placed.shape);
    }
    for (index, object) in scene.objects.iter().enumerate().filter(|(index, _)| *index != task.object_index) {
        let at_rest = &task.state.world_from_objects[index];
        add(OtherCarrier::World, Part::Object, &object.name, at_rest, &object.shape);
    }
    for link in task.robot_bodies() {
        add(OtherCarrier::World, Part::Obstacle, &link.name, &link.placed.parent_from_shape, &link.placed.shape);
    }
    pieces
}

/// A hand that rests, by its index in the scene: what collides, and what it looks like.
pub(super) fn hand(
    task: &Manipulation,
    index: usize,
    packages: &ResolveOptions,
    shapes: &mut Shapes,
) -> (Vec<PieceStory>, Looks) {
    let placed = &task.scene.hands[index];
    let tree = Tree::new(&placed.hand);
    let root = tree.world_from_root(&placed.hand, &task.state.world_from_hand(task.scene, index));
    let poses = world_from_links(&tree.links, &root, &task.state.hand_joints[index]);
    let own = |link| is_of_hand(task.scene, index, link);
    let mut collision = link_pieces(&placed.hand, &tree, &own, shapes);
    let mut looks = link_looks(&placed.hand, &tree, &own, &collision, packages, shapes);
    for piece in collision.iter_mut().chain(&mut looks.pieces) {
        let Carrier::Link(link) = piece.on else { continue };
        piece.from_mesh = PoseData::from(&(poses[link] * Pose::from(&piece.from_mesh)));
        piece.on = Carrier::Other(OtherCarrier::World);
        piece.name = format!("{}/{}", placed.name, piece.name);
    }
    for (about, _) in &mut looks.notes {
        about.push_str(&format!(" of {}", placed.name));
    }
    (collision, looks)
}
