//! `regrasp inspect`: what a hand is like, and a hand file for it.

use super::inspect_parts::{pairs_part, robot_part};
use super::inspect_robot;
use super::room::Room;
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::outputs::{refuse_input, refuse_unwritable};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, metres};
use regrasp::base::{Diagnostic, Place, Rng, files};
use regrasp::file_names::name_from;
use regrasp::robot::import::LoadOptions;
use regrasp::robot::inspect::whole::inspect_whole;
use regrasp::robot::inspect::{HandInspection, InspectSettings, Inspection, hand_file_text, inspect};
use regrasp::robot::{Finger, Hand};
use serde_json::json;
use std::fmt::Write;

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
    // One finger alone makes no hand: what was taken for it is an arm.
    let is_no_hand = found.hand.as_ref().map_or(true, |(hand, _)| hand.fingers.len() == 1);
    if may_be_robot && (is_no_hand || arguments.robot || arguments.srdf.is_some()) {
        let files = (arguments.urdf.as_path(), arguments.srdf.as_deref());
        let whole = inspect_whole(found.tree.clone(), files, &options, &settings, &mut rng)?;
        match whole {
            Some(whole) => {
                whole.notes.iter().for_each(|note| talk.note(note));
                return inspect_robot::run(&found, &whole, arguments, common, talk);
            }
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
            if common.lenient {
                talk.note("the URDF was read with --lenient; commands that read the hand file need --lenient too");
            }
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

/// Centres of the fingertips in the rest posture, in the frame of the hand's base link.
fn tips_at_rest(hand: &Hand) -> Vec<[f64; 3]> {
    let centre = |finger: &Finger| finger.chain.tip(&finger.rest, &finger.tip.center_in_body).coords.into();
    hand.fingers.iter().map(centre).collect()
}
