//! What `regrasp inspect` says of every robot: its joints and meshes, and the links that touch.

use crate::words::{counted, grouped};
use regrasp::robot::inspect::{JointRow, PairTable, RobotInspection};
use std::fmt::Write;

/// Pairs of links that are listed one by one.
const PAIRS_SHOWN: usize = 24;

pub(super) fn robot_part(robot: &RobotInspection, out: &mut String) {
    let n_mimic = robot.joints.iter().filter(|joint| joint.follows.is_some()).count();
    let n_fixed = robot.joints.iter().filter(|joint| joint.kind == "fixed").count();
    let _ = writeln!(
        out,
        "robot {}: {}, {} ({} independent, {n_mimic} mimic, {n_fixed} fixed), root link {}\n",
        robot.name,
        counted(robot.n_links, "link"),
        counted(robot.joints.len(), "joint"),
        robot.joints.len() - n_mimic - n_fixed,
        robot.root
    );
    let width = robot.joints.iter().map(|joint| joint.name.chars().count()).max().unwrap_or(0).clamp(5, 40);
    let _ = writeln!(
        out,
        "{:<width$}  {:<10}  {:>9} {:>9}  {:>8} {:>8}  parent -> child",
        "joint", "type", "lower", "upper", "speed", "effort"
    );
    for joint in robot.joints.iter().filter(|joint| joint.kind != "fixed") {
        joint_line(joint, width, out);
    }
    if !robot.meshes.is_empty() {
        let _ = writeln!(out, "\nmeshes (size in cm)");
    }
    for mesh in &robot.meshes {
        let [x, y, z] = mesh.size.map(|length| 100.0 * length);
        let _ = writeln!(
            out,
            "  {:>7} triangles  {:<14}  {x:.1} x {y:.1} x {z:.1}  {}",
            grouped(mesh.n_triangles as u64),
            if mesh.watertight { "watertight" } else { "not watertight" },
            mesh.links.join(", ")
        );
    }
    for suspicion in &robot.suspicions {
        let _ = writeln!(out, "\nsuspicious: {suspicion}");
    }
}

fn joint_line(joint: &JointRow, width: usize, out: &mut String) {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |x| format!("{x:.4}"));
    let _ = write!(
        out,
        "{:<width$}  {:<10}  {:>9} {:>9}  {:>8} {:>8}  {} -> {}",
        joint.name,
        joint.kind,
        number(joint.lower),
        number(joint.upper),
        number(joint.velocity),
        number(joint.effort),
        joint.parent,
        joint.child
    );
    if let Some(follows) = &joint.follows {
        let _ = write!(out, "  = {} * {}", follows.multiplier, follows.joint);
        for leader in &follows.others {
            let _ = write!(out, " + {} * {}", leader.multiplier, leader.joint);
        }
        let _ = write!(out, " + {}", follows.offset);
    }
    out.push('\n');
}

pub(super) fn pairs_part(pairs: &PairTable, file: &str, out: &mut String) {
    let _ = writeln!(
        out,
        "\nlinks over {} random postures: {} always touch, {} sometimes, {} never",
        grouped(pairs.n_postures as u64),
        counted(pairs.always.len(), "pair"),
        pairs.sometimes.len(),
        pairs.never.len()
    );
    for [a, b] in pairs.always.iter().take(PAIRS_SHOWN) {
        let _ = writeln!(out, "  always     {a} and {b}: excused in the {file}");
    }
    for pair in pairs.sometimes.iter().take(PAIRS_SHOWN) {
        let _ = writeln!(out, "  {:>7.2} %  {} and {}", 100.0 * pair.share, pair.links[0], pair.links[1]);
    }
    if pairs.sometimes.len() > PAIRS_SHOWN {
        let _ = writeln!(
            out,
            "  and {} more that touch sometimes; all of them with --json",
            pairs.sometimes.len() - PAIRS_SHOWN
        );
    }
    for [a, b] in &pairs.at_rest {
        let _ = writeln!(out, "  at rest    {a} and {b} touch in the rest posture");
    }
}
