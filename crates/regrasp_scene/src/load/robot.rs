//! A robot of a scene file: arms that carry hands.

use super::files::Files;
use super::hand::refuse_rough_tips;
use super::pose;
use crate::manipulation::is_rigid_with_hand;
use crate::scene::{HandCarrier, InputFile, SceneHand};
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::Pose;
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::hand::PalmShape;
use regrasp_robot::{Hand, Manipulator, load_manipulator};

/// Reads the robot file that `entry` names, and `world_from_robot` of `table`; with the robot its hands.
pub(super) fn robot(
    entry: &Entry,
    table: &mut Table,
    files: &mut Files,
    found: &mut Found,
) -> Option<(Manipulator, Vec<SceneHand>)> {
    let world_from_robot = match table.optional("world_from_robot") {
        Some(entry) => entry.table(found).and_then(|mut inside| {
            let pose = pose::pose(&mut inside, found);
            inside.finish(found);
            pose
        }),
        None => Some(Pose::identity()),
    };
    let path = files.locate(entry, found)?;
    let loaded = match files.stock.robot(&path, || load_manipulator(&path, files.options)) {
        Ok(loaded) => loaded,
        Err(error) => {
            found.diagnostics.extend(error);
            return None;
        }
    };
    found.notes.extend(loaded.notes);
    let name_in_scene = entry.text(found)?.to_owned();
    for input in loaded.inputs {
        let name = if input.path == path { name_in_scene.clone() } else { input.name };
        files.inputs.push(InputFile { role: input.role, name, path: input.path, sha256: input.sha256 });
    }
    let robot = loaded.manipulator.placed_at(world_from_robot?);
    let at_rest = robot.layout.rest();
    let hand = |index: usize| SceneHand {
        name: robot.hands[index].name.clone(),
        hand: with_mount(&robot, index),
        world_from_hand: robot.world_from_hand(index, &at_rest),
        carrier: Some(HandCarrier { robot: 0, hand: index }),
        reach: None,
    };
    let hands: Vec<SceneHand> = (0..robot.hands.len()).map(hand).collect();
    hands.iter().for_each(|placed| refuse_rough_tips(&placed.hand, entry, found));
    Some((robot, hands))
}

/// The hand with the links of the arm that move as its base does: fingers keep away from them as from the palm.
fn with_mount(robot: &Manipulator, index: usize) -> Hand {
    let mut hand = robot.hands[index].hand.clone();
    let mut world_from_link = Vec::new();
    robot.link_poses(&robot.layout.rest(), &mut world_from_link);
    let base_from_world = world_from_link[hand.base.0].inverse();
    let arms = robot.arms.iter().flat_map(|arm| &arm.shapes);
    for shape in robot.common.shapes.iter().chain(arms) {
        if is_rigid_with_hand(robot, index, shape.link) {
            let parent_from_shape = base_from_world * world_from_link[shape.link.0] * shape.placed.parent_from_shape;
            let placed = PlacedShape { parent_from_shape, shape: shape.placed.shape.clone() };
            hand.palm.push(PalmShape { link: shape.link, placed });
        }
    }
    hand.allowed_pairs.extend(&robot.allowed_pairs);
    hand
}
