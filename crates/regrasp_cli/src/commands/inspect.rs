//! `regrasp inspect`: what a hand is like, and a hand file for it.

use super::inspect_robot;
use super::room::Room;
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::outputs::{refuse_input, refuse_unwritable};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, grouped, metres};
use regrasp::base::{Diagnostic, Place, Rng, files};
use regrasp::file_names::name_from;
use regrasp::robot::import::LoadOptions;
use regrasp::robot::inspect::whole::inspect_whole;
use regrasp::robot::inspect::{
    HandInspection, InspectSettings, Inspection, JointRow, PairTable, RobotInspection, hand_file_text, inspect,
};
use regrasp::robot::{Finger, Hand};
use serde_json::json;
use std::fmt::Write;

/// Pairs of links that are listed one by one.
const PAIRS_SHOWN: usize = 24;

/// Prints the report on stdout; writes the hand file when asked.
pub fn run(arguments: &args::Inspect, common: &Common, talk: &Talk) -> Result<(), Stop> {
    if let Some(path) = &arguments.output {
        refuse_unwritable(path)?;
    }
    let is_hand_file = arguments.urdf.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if arguments.base.is_some() && is_hand_file {
        return Err(Stop::argument("A505", "--base", "stands beside a hand file", "a URDF; hand files say base_link"));
    }
    if is_hand_file && (arguments.robot || arguments.srdf.is_some()) {
        let argument = if arguments.robot { "--robot" } else { "--srdf" };
        return Err(Stop::argument("A505", argument, "stands beside a hand file", "the URDF of a robot"));
    }
    interrupt::flag()?;
    let settings = InspectSettings { n_postures: arguments.samples as usize };
    let mut rng = Rng::keyed(arguments.seed, "inspect", 0);
    let options = LoadOptions { base: arguments.base.clone(), ..load::options(common) };
    let found = inspect(&arguments.urdf, &options, &settings, &mut rng)?;
    if let Some(path) = &arguments.output {
        refuse_input(path, found.inputs.iter().map(|input| input.path.as_path()))?;
    }
    for note in &found.notes {
        talk.note(note);
    }
    let may_be_robot = !is_hand_file && arguments.base.is_none();
    if may_be_robot && (found.hand.is_err() || arguments.robot || arguments.srdf.is_some()) {
        let files = (arguments.urdf.as_path(), arguments.srdf.as_deref());
        let whole = inspect_whole(found.tree.clone(), files, &options, &settings, &mut rng)?;
        match whole {
            Some(whole) => return inspect_robot::run(&found, &whole, arguments, common, talk),
            None if arguments.robot || arguments.srdf.is_some() => {
                let diagnostic = Diagnostic::new("U214", Place::file(&arguments.urdf), "has no arm")
                    .expected("six moving joints that follow each other without a branch");
                return Err(Stop::BadInput(diagnostic.into()));
            }
            None => {}
        }
    }
    let room = found.hand.as_ref().ok().map(|(hand, _)| Room::of(hand, arguments.seed));
    talk.event(
        "inspection",
        json!({
            "robot": found.robot,
            "hand": found.hand.as_ref().ok().map(|(_, table)| table),
            "room": room,
            "no_hand": found.hand.as_ref().err().map(|error| &error.diagnostics),
        }),
    );
    if !talk.is_json() {
        talk.data(&report(&found, room.as_ref()));
    }
    match (&found.hand, &arguments.output) {
        (Err(error), Some(_)) => Err(Stop::BadInput(error.clone())),
        (Ok((hand, table)), Some(path)) => {
            let read = found.inputs.iter().find(|input| input.role == "urdf");
            let urdf = read.map_or(arguments.urdf.as_path(), |input| &input.path);
            let urdf = name_from(path, urdf, &common.packages);
            let text = hand_file_text(hand, &urdf, &table.pairs.always_ids);
            files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
            talk.event("written", json!({ "path": path }));
            talk.say(format!("wrote  {}", path.display()));
            Ok(())
        }
        (_, None) => Ok(()),
    }
}

/// The whole report.
fn report(found: &Inspection, room: Option<&Room>) -> String {
    let mut out = String::new();
    robot_part(&found.robot, &mut out);
    match &found.hand {
        Ok((hand, table)) => {
            hand_part(hand, table, &mut out);
            room.into_iter().for_each(|room| room.write(&mut out));
            pairs_part(&table.pairs, "hand file", &mut out);
        }
        Err(error) => {
            let _ = writeln!(out, "\nnot a hand as it stands:\n{error}");
        }
    }
    regrasp::base::diagnostic::printable(&out)
}

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

fn hand_part(model: &Hand, hand: &HandInspection, out: &mut String) {
    let _ = writeln!(
        out,
        "\nhand on {}: {}, span {:.1} cm",
        hand.base,
        counted(hand.fingers.len(), "finger"),
        100.0 * hand.span
    );
    let at_rest = tips_at_rest(model);
    for (finger, tip_at_rest) in hand.fingers.iter().zip(&at_rest) {
        let tip = match finger.tip_shape {
            "sphere" => format!("ball of radius {:.1} mm", 1e3 * finger.tip_radius),
            shape => shape.to_owned(),
        };
        let tip = match finger.tip.error {
            Some(error) if finger.tip_shape == "mesh" => {
                format!("{tip}, {} within {:.2} mm of its hull", finger.tip.surface, 1e3 * error)
            }
            Some(error) => format!("{tip}, within {:.2} mm of the link", 1e3 * error),
            None => tip,
        };
        let _ = writeln!(
            out,
            "  {:<10}  tip {} ({tip}), at rest at {}  joints {}",
            finger.name,
            finger.tip_link,
            metres(tip_at_rest),
            finger.joints.join(", ")
        );
        for one in &finger.tip.stands_out {
            let _ = writeln!(
                out,
                "              collision element {} of {} stands out of the {} by {:.2} mm where it may touch: {}, most at {}",
                one.element,
                finger.tip_link,
                finger.tip.surface,
                1e3 * one.by,
                counted(one.n_faces, "face"),
                metres(&one.at)
            );
        }
    }
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

/// Centres of the fingertips in the rest posture, in the frame of the hand's base link.
fn tips_at_rest(hand: &Hand) -> Vec<[f64; 3]> {
    let centre = |finger: &Finger| finger.chain.tip(&finger.rest, &finger.tip.center_in_body).coords.into();
    hand.fingers.iter().map(centre).collect()
}
