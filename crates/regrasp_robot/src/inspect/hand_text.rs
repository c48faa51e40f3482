//! A hand as the text of a `hand.toml`.

use super::tip_report::tip_report;
use crate::contact_model::ContactModel;
use crate::hand::{Finger, Hand};
use crate::import::hand_file::{FORMAT, VERSION};
use crate::robot::{JointId, LinkId};
use crate::tip::TipShape;
use regrasp_geometry::Point;
use std::collections::BTreeSet;
use std::fmt::Write;

/// True when at most one joint moves one of two links against the other: such pairs are excused without being named.
fn are_neighbours(hand: &Hand, &(a, b): &(LinkId, LinkId)) -> bool {
    let moving = |link: LinkId| -> Vec<JointId> {
        let path = hand.robot.joints_to(link).into_iter();
        path.filter(|joint| hand.robot.joints[joint.0].moves()).collect()
    };
    let (to_a, to_b) = (moving(a), moving(b));
    let n_shared = to_a.iter().zip(&to_b).take_while(|(x, y)| x == y).count();
    to_a.len() + to_b.len() - 2 * n_shared <= 1
}

/// The text of a hand file that gives `hand` when it is loaded.
///
/// `urdf` is how the file names the URDF: a path relative to the hand file. `allow` are pairs of links to be excused
/// beyond the adjacent ones and those that the hand excuses already, such as those of [`super::PairTable::always`].
pub fn hand_file_text(hand: &Hand, urdf: &str, allow: &BTreeSet<(LinkId, LinkId)>) -> String {
    let robot = &hand.robot;
    let name = |link: LinkId| quoted(&robot.links[link.0].name);
    let excused = hand.allowed_pairs.iter().filter(|pair| !are_neighbours(hand, pair));
    let allow: BTreeSet<(LinkId, LinkId)> = excused.chain(allow).copied().collect();
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "# Hand \"{}\": written by `regrasp inspect`; edit freely. Metres and radians.",
        comment(&robot.name)
    );
    let _ = writeln!(text, "format = {}\nformat_version = {VERSION}\nurdf = {}", quoted(FORMAT), quoted(urdf));
    let _ = writeln!(text, "base_link = {}", name(hand.base));
    if !allow.is_empty() {
        let _ = writeln!(
            text,
            "\n# Pairs of links that are never tested against each other, beside adjacent ones.\nallow = ["
        );
        for &(a, b) in &allow {
            let _ = writeln!(text, "    [{}, {}],", name(a), name(b));
        }
        let _ = writeln!(text, "]");
    }
    if !hand.without_geometry.is_empty() {
        let links: Vec<String> = hand.without_geometry.iter().map(|&link| name(link)).collect();
        let _ = writeln!(
            text,
            "\n# Links whose collision geometry is left out.\nwithout_geometry = [{}]",
            links.join(", ")
        );
    }
    let path = |link: LinkId| robot.joints_to(link);
    let is_of_hand =
        |link: LinkId| path(link).starts_with(&path(hand.base)) || path(hand.base).starts_with(&path(link));
    let drawn = (0..robot.links.len()).map(LinkId).filter(|id| robot.links[id.0].collision_from_visuals);
    let drawn: Vec<String> = drawn.filter(|&id| is_of_hand(id)).map(name).collect();
    if !drawn.is_empty() {
        let _ = writeln!(
            text,
            "\n# Links without collision geometry; their visuals stand for it.\ncollision_from_visuals = [{}]",
            drawn.join(", ")
        );
    }
    if !hand.held.is_empty() {
        let _ = writeln!(text, "\n# Joints that belong to no finger, and where they are held.\n[held]");
        for &(joint, position) in &hand.held {
            let _ = writeln!(text, "{} = {}", quoted(&robot.joints[joint.0].name), number(position));
        }
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let tied = hand.ties.iter().find(|tie| tie.follower == JointId(index)).map(|tie| &tie.coupling);
        let Some(coupling) = tied.or(joint.coupling.as_ref()) else { continue };
        let coupling = &coupling.through(|leader| {
            hand.ties.iter().find(|tie| tie.follower == leader && leader != JointId(index)).map(|tie| &tie.coupling)
        });
        let _ = writeln!(text, "\n[[couplings]]\njoint = {}", quoted(&joint.name));
        let leader = |id: JointId| quoted(&robot.joints[id.0].name);
        match coupling.single() {
            Some((id, multiplier)) => {
                let _ = writeln!(text, "leader = {}\nmultiplier = {}", leader(id), number(multiplier));
            }
            None => {
                let _ = writeln!(text, "terms = [");
                for &(id, multiplier) in &coupling.terms {
                    let _ = writeln!(text, "    {{ leader = {}, multiplier = {} }},", leader(id), number(multiplier));
                }
                let _ = writeln!(text, "]");
            }
        }
        // Held joints have their zero where they are held.
        let held = hand.held.iter().map(|&(joint, position)| coupling.multiplier(joint) * position).sum::<f64>();
        let offset = ((coupling.offset - held) * 1e12).round() / 1e12 + 0.0;
        let _ = writeln!(text, "offset = {}", number(offset));
    }
    for finger in &hand.fingers {
        let _ = writeln!(text, "\n[[fingers]]\nname = {}\ntip_link = {}", quoted(&finger.name), name(finger.tip.link));
        if let Some(first) = first_joint_if_needed(hand, finger) {
            let _ = writeln!(text, "first_joint = {}", quoted(&first));
        }
        let _ = writeln!(
            text,
            "# In the frame of the tip link.{}\ntip = {}",
            error_text(hand, finger),
            tip_text(hand, finger)
        );
        if finger.tip.contact != ContactModel::default() {
            let _ = writeln!(text, "contact = {}", quoted(finger.tip.contact.name()));
        }
        if let Some(pad) = finger.tip.pad {
            let axis = hand.robot.fixed_pose_in_body(finger.tip.link).rotation.inverse() * pad.axis_in_body;
            let [x, y, z] = [axis.x, axis.y, axis.z].map(|x| number(x + 0.0));
            let _ = writeln!(
                text,
                "pad = {{ axis = [{x}, {y}, {z}], angle_deg = {} }}",
                number(pad.cosine.acos().to_degrees())
            );
        }
        if let ContactModel::SoftFinger { torsion_radius } = finger.tip.contact {
            let _ = writeln!(text, "torsion_radius = {}", number(torsion_radius));
        }
        let rest: Vec<String> = (0..finger.rest.len())
            .map(|k| {
                let rounded = (finger.rest[k] * 1e4).round() / 1e4 + 0.0;
                let inside = rounded >= finger.chain.lower[k] && rounded <= finger.chain.upper[k];
                let value = if inside { rounded } else { finger.rest[k] };
                format!("{} = {}", quoted(&finger.chain.names[k]), number(value))
            })
            .collect();
        let _ = writeln!(text, "rest = {{ {} }}", rest.join(", "));
    }
    text
}

/// How far the tip is off the link's collision geometry, as the rest of a comment.
fn error_text(hand: &Hand, finger: &Finger) -> String {
    let report = tip_report(hand, finger);
    match report.error {
        Some(error) => format!(" The {} is within {:.2} mm of the collision geometry.", report.surface, 1e3 * error),
        None => String::new(),
    }
}

fn tip_text(hand: &Hand, finger: &Finger) -> String {
    let body_from_link = hand.robot.fixed_pose_in_body(finger.tip.link);
    let [x, y, z] = (body_from_link.inverse() * finger.tip.center_in_body).coords.into();
    // A micrometre: finer than any hand is made.
    let point = Point::new(x, y, z).map(|c| (c * 1e6).round() / 1e6 + 0.0);
    let point = format!("[{}, {}, {}]", number(point.x), number(point.y), number(point.z));
    match &finger.tip.shape {
        TipShape::Sphere { radius } => {
            format!("{{ shape = \"sphere\", radius = {}, center = {point} }}", number(*radius))
        }
        TipShape::Point => format!("{{ shape = \"point\", position = {point} }}"),
        TipShape::Ellipsoid(ellipsoid) => {
            let turn = body_from_link.rotation.inverse() * ellipsoid.body_from_ellipsoid;
            let list = |values: &[f64]| values.iter().map(|&value| number(value)).collect::<Vec<_>>().join(", ");
            let (radii, turn) = (list(ellipsoid.radii.as_slice()), list(turn.coords.as_slice()));
            format!("{{ shape = \"ellipsoid\", radii = [{radii}], center = {point}, quat_xyzw = [{turn}] }}")
        }
        TipShape::Hull { elements, .. } if elements.is_empty() => format!("{{ shape = \"mesh\", center = {point} }}"),
        TipShape::Hull { elements, .. } => {
            format!("{{ shape = \"mesh\", center = {point}, collision = {elements:?} }}")
        }
    }
}

/// The first joint of the chain, where moving joints between it and the base belong to no finger.
fn first_joint_if_needed(hand: &Hand, finger: &Finger) -> Option<String> {
    let robot = &hand.robot;
    let above = robot.joints_to(hand.base).len();
    let moving: Vec<_> = robot
        .joints_to(finger.tip.link)
        .into_iter()
        .skip(above)
        .filter(|joint| robot.joints[joint.0].kind != crate::robot::JointKind::Fixed)
        .collect();
    let held = moving.len().checked_sub(finger.chain.joints.len())?;
    (held > 0).then(|| moving.get(held).map(|joint| robot.joints[joint.0].name.clone())).flatten()
}

/// A number that TOML reads as a float.
pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A TOML string.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// `text` on one line.
pub(super) fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
