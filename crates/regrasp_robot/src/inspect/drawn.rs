//! Fingertips that are drawn and have no collision geometry: what is drawn stands for it.

use super::guess::last_moving_joints;
use super::rigid::rigid_links;
use crate::import::assemble::some_of;
use crate::import::urdf::{DROPPED, load_robot_with};
use crate::import::{LoadOptions, LoadedRobot};
use crate::robot::{LinkId, Robot};
use regrasp_base::InputError;
use std::collections::BTreeSet;
use std::path::Path;

/// `loaded`, read again from the file `path` with the visuals of `links` as their collision geometry. Where they cannot be read, it stays as it
/// is; a remark says why.
///
/// Errors: out of time (`F004`).
pub(crate) fn read_again(
    mut loaded: LoadedRobot,
    links: &BTreeSet<String>,
    (path, options): (&Path, &LoadOptions),
) -> Result<LoadedRobot, InputError> {
    let named: Vec<String> = links.iter().map(|link| format!("\"{link}\"")).collect();
    let named = some_of(&named);
    let has_geometry = |robot: &Robot, name: &String| robot.link_named(name).is_some_and(|link| !is_bare(robot, link));
    let problem = match load_robot_with(path, options, links) {
        Ok(mut again) if links.iter().all(|link| has_geometry(&again.robot, link)) => {
            again.notes.push(format!(
                "links without collision geometry for which their visuals stand (`collision_from_visuals` in the hand file): {named}"
            ));
            return Ok(again);
        }
        // Where lenient, what cannot be read is left out; its remark says which.
        Ok(again) => again.notes.into_iter().find(|note| note.contains(DROPPED)).unwrap_or_default(),
        Err(error) => {
            options.check_time(path)?;
            error.diagnostics.into_iter().next().map_or_else(String::new, |first| first.problem)
        }
    };
    loaded.notes.push(format!(
        "links without collision geometry whose visuals could stand for it, but cannot be read ({problem}): {named}"
    ));
    Ok(loaded)
}

fn is_bare(robot: &Robot, link: LinkId) -> bool {
    robot.links[link.0].collision.is_empty()
}

/// Names of links that are drawn and have no collision geometry: those of fingertips of the hands on `bases` that have none at all, and where
/// no link of the robot has any, all that are drawn.
pub(crate) fn drawn_links(robot: &Robot, bases: &[LinkId]) -> BTreeSet<String> {
    let all: Vec<LinkId> = (0..robot.links.len()).map(LinkId).collect();
    let links: Vec<LinkId> = if all.iter().all(|&link| is_bare(robot, link)) {
        all
    } else {
        let above: Vec<_> = bases.iter().map(|&base| robot.joints_to(base)).collect();
        let ends = last_moving_joints(robot).into_iter().map(|joint| &robot.joints[joint.0]);
        let of_hands = ends.filter(|joint| above.iter().any(|path| robot.joints_to(joint.parent).starts_with(path)));
        let tips = of_hands.map(|joint| rigid_links(robot, joint.child).into_iter().map(|(link, _)| link).collect());
        tips.filter(|tip: &Vec<LinkId>| tip.iter().all(|&link| is_bare(robot, link))).flatten().collect()
    };
    let drawn = links.into_iter().filter(|link| !robot.links[link.0].visual.is_empty());
    drawn.map(|link| robot.links[link.0].name.clone()).collect()
}
