//! What rests in a scene: the object before it is moved, other objects, supports, obstacles, other hands.

use super::links::{Looks, Tree, link_looks, link_pieces, world_from_links};
use super::shapes::Shapes;
use super::{Carrier, OtherCarrier, Part, PieceStory, PoseData, Role};
use regrasp_geometry::{Pose, Shape};
use regrasp_plan::check::kinematics::world_from_root;
use regrasp_robot::ResolveOptions;
use regrasp_scene::{Manipulation, SceneHand};

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
    pieces
}

/// A hand that rests at `joints`: what collides, and what it looks like.
///
/// Err with a message when couplings of the robot lead nowhere.
pub(super) fn hand(
    placed: &SceneHand,
    joints: &[f64],
    packages: &ResolveOptions,
    shapes: &mut Shapes,
) -> Result<(Vec<PieceStory>, Looks), String> {
    let tree = Tree::new(&placed.hand);
    let root = world_from_root(&placed.hand, &placed.world_from_hand)?;
    let poses = world_from_links(&tree.links, &root, joints);
    let mut collision = link_pieces(&placed.hand, &tree, shapes);
    let mut looks = link_looks(&placed.hand, &tree, &collision, packages, shapes);
    for piece in collision.iter_mut().chain(&mut looks.pieces) {
        let Carrier::Link(link) = piece.on else { continue };
        piece.from_mesh = PoseData::from(&(poses[link] * Pose::from(&piece.from_mesh)));
        piece.on = Carrier::Other(OtherCarrier::World);
        piece.name = format!("{}/{}", placed.name, piece.name);
    }
    for (about, _) in &mut looks.notes {
        about.push_str(&format!(" of {}", placed.name));
    }
    Ok((collision, looks))
}
