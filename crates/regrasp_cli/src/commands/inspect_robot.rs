//! `regrasp inspect` of a robot with arms: its parts, links that touch, and a robot file with hand files beside it.

use super::inspect_parts::{pairs_part, robot_part};
use crate::args::{self, Common};
use crate::outputs::{refuse_input, refuse_unwritable};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::counted;
use regrasp::base::files;
use regrasp::file_names::name_from;
use regrasp::robot::inspect::whole::{FileNames, FoundHand, WholeRobot, robot_file_text};
use regrasp::robot::inspect::{Inspection, hand_file_text};
use regrasp::robot::{JointId, LinkId};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Prints the report; writes the robot file and the hand files when asked.
pub fn run(
    found: &Inspection,
    whole: &WholeRobot,
    arguments: &args::Inspect,
    common: &Common,
    talk: &Talk,
) -> Result<(), Stop> {
    if let Some(srdf) = &whole.srdf {
        srdf.notes.iter().for_each(|note| talk.note(note));
        if common.lenient && !srdf.notes.is_empty() {
            talk.note("the SRDF is not all of this robot: commands that read the robot file need --lenient too");
        }
    }
    talk.event("inspection", json!({ "robot": found.robot, "whole": table(whole) }));
    if !talk.is_json() {
        let mut out = String::new();
        robot_part(&found.robot, &mut out);
        parts_part(whole, &mut out);
        pairs_part(&whole.pairs, "robot file", &mut out);
        talk.data(&regrasp::base::diagnostic::printable(&out));
    }
    match &arguments.output {
        Some(path) => write_files(path, found, whole, common, talk),
        None => Ok(()),
    }
}

fn write_files(path: &Path, found: &Inspection, whole: &WholeRobot, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let srdf = whole.srdf.as_ref().map(|loaded| loaded.input.path.as_path());
    let read = || found.inputs.iter().map(|input| input.path.as_path()).chain(srdf);
    let urdf = found.inputs.iter().find(|input| input.role == "urdf").map_or(Path::new(""), |input| &input.path);
    let hand_files: Vec<Option<PathBuf>> =
        whole.hands.iter().map(|hand| hand.hand.is_ok().then(|| beside(path, &hand.guess.name))).collect();
    for path in hand_files.iter().flatten() {
        refuse_unwritable(path)?;
    }
    for path in hand_files.iter().flatten().map(PathBuf::as_path).chain([path]) {
        refuse_input(path, read())?;
    }
    let write = |path: &Path, text: &str| {
        files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
        talk.event("written", json!({ "path": path }));
        talk.say(format!("wrote  {}", path.display()));
        Ok(())
    };
    for (hand, file) in whole.hands.iter().zip(&hand_files) {
        if let (FoundHand { hand: Ok(hand), .. }, Some(file)) = (hand, file) {
            write(file, &hand_file_text(hand, &name_from(file, urdf, &common.packages), &BTreeSet::new()))?;
        }
    }
    let names = FileNames {
        urdf: name_from(path, urdf, &common.packages),
        srdf: srdf.map(|srdf| name_from(path, srdf, &common.packages)),
        hands: hand_files.iter().map(|file| file.as_ref().map(|file| name_from(path, file, &[]))).collect(),
    };
    write(path, &robot_file_text(&whole.robot, whole, &names))
}

/// `robot.toml` and `right` make `robot_right.toml`.
fn beside(path: &Path, hand: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let plain: String = hand.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    path.with_file_name(format!("{stem}_{plain}.toml"))
}

fn table(whole: &WholeRobot) -> Value {
    let link = |link: LinkId| &whole.robot.links[link.0].name;
    let joints = |ids: &[JointId]| -> Vec<&String> { ids.iter().map(|id| &whole.robot.joints[id.0].name).collect() };
    let arms = whole.guess.arms.iter().map(|arm| {
        json!({ "name": arm.name, "base_link": link(arm.base), "mount_link": link(arm.mount), "joints": joints(&arm.joints) })
    });
    let hands = whole.hands.iter().map(|hand| {
        json!({
            "name": hand.guess.name,
            "arm": whole.guess.arms[hand.guess.arm].name,
            "base_link": link(hand.guess.base),
            "fingers": hand.hand.as_ref().ok().map(|hand| hand.fingers.len()),
            "no_hand": hand.hand.as_ref().err().map(|error| &error.diagnostics),
        })
    });
    json!({
        "arms": arms.collect::<Vec<_>>(),
        "hands": hands.collect::<Vec<_>>(),
        "common": joints(&whole.guess.common),
        "held": joints(&whole.guess.others),
        "pairs": whole.pairs,
    })
}

fn parts_part(whole: &WholeRobot, out: &mut String) {
    let link = |link: LinkId| whole.robot.links[link.0].name.as_str();
    let names = |ids: &[JointId]| -> String {
        ids.iter().map(|id| whole.robot.joints[id.0].name.as_str()).collect::<Vec<_>>().join(", ")
    };
    out.push('\n');
    for arm in &whole.guess.arms {
        let joints = counted(arm.joints.len(), "joint");
        let _ = writeln!(out, "arm {}: {joints} from {} to {}", arm.name, link(arm.base), link(arm.mount));
    }
    for hand in &whole.hands {
        let on = &whole.guess.arms[hand.guess.arm].name;
        let base = link(hand.guess.base);
        match &hand.hand {
            Ok(made) => {
                let fingers = counted(made.fingers.len(), "finger");
                let _ = writeln!(out, "hand {} on arm {on}: {fingers} on {base}", hand.guess.name);
            }
            Err(error) => {
                let _ = writeln!(out, "no hand on arm {on}, at {base}; its joints stay joints of the arm:\n{error}");
            }
        }
    }
    if !whole.guess.common.is_empty() {
        let _ = writeln!(out, "common joints: {}", names(&whole.guess.common));
    }
    if !whole.guess.others.is_empty() {
        let _ = writeln!(out, "held joints, which carry no arm: {}", names(&whole.guess.others));
    }
}
