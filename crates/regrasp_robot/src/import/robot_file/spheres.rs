//! Sphere models: balls of a second URDF that stand for the collision geometry of links.

use super::super::hand_file::locate_and_load;
use super::super::options::{LoadOptions, LoadedInput};
use crate::robot::Robot;
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::toml_table::{Entry, Found};
use regrasp_geometry::Shape;
use std::collections::BTreeSet;
use std::path::Path;

/// Replaces the collision geometry of links by the balls that the URDF of `entry` has for them. Links that it has no balls for keep their
/// own.
///
/// Errors: links that the robot lacks (`U205`, a note where lenient), shapes that are no balls (`U213`), no ball at all (`U213`).
pub(super) fn replace(
    entry: &Entry,
    robot: &mut Robot,
    path: &Path,
    options: &LoadOptions,
    found: &mut Found,
) -> Option<LoadedInput> {
    let (model, mut inputs) = locate_and_load(entry, path, options, &BTreeSet::new(), found)?;
    let mut n_balls = 0;
    for link in model.links.iter().filter(|link| !link.collision.is_empty()) {
        let Some(own) = robot.link_named(&link.name) else {
            if options.lenient {
                found.note(
                    &entry.span,
                    format!("balls of link \"{}\" are left out: the robot has no such link", link.name),
                );
                continue;
            }
            let meant = did_you_mean(&link.name, robot.links.iter().map(|link| link.name.as_str()));
            let problem = format!("has balls for link \"{}\", which the robot does not have", link.name);
            let diagnostic = entry.error("U205", found, problem).expected("a sphere model of the same robot");
            let fix = meant.map_or("--lenient to skip it".to_owned(), |meant| format!("did you mean \"{meant}\"?"));
            found.diagnostics.push(diagnostic.fix(fix));
            continue;
        };
        if let Some(other) = link.collision.iter().find(|placed| !matches!(placed.shape, Shape::Sphere { .. })) {
            let kind = match other.shape {
                Shape::Mesh(_) | Shape::Convex(_) => "a mesh",
                Shape::Cuboid { .. } => "a box",
                _ => "a cylinder or capsule",
            };
            let problem = format!("has {kind} on link \"{}\"", link.name);
            let diagnostic = entry.error("U213", found, problem);
            found.diagnostics.push(diagnostic.expected("<sphere> as the only collision geometry"));
            continue;
        }
        n_balls += link.collision.len();
        robot.links[own.0].collision.clone_from(&link.collision);
    }
    if n_balls == 0 && found.diagnostics.is_empty() {
        let diagnostic = entry.error("U213", found, "has no ball for any link of the robot");
        found.diagnostics.push(diagnostic.expected("a URDF whose links have <sphere> as collision geometry"));
    }
    let mut input = inputs.drain(..1).next()?;
    input.role = "spheres".into();
    Some(input)
}
