//! `regrasp grasps --import FILE HAND OBJECT`: grasps of another tool, judged.

use crate::args;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration};
use regrasp::base::{Diagnostic, Place, files};
use regrasp::grasp::GraspList;
use regrasp::grasp::list::isaac::from_isaac;
use regrasp::grasp::list::{ForeignGrasps, format};
use regrasp::grasp_lists::GraspSettings;
use regrasp::grasp_lists::import::import_grasps;
use regrasp::scene::GraspScene;
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Grasps that are not kept and are named one by one.
const SHOWN: usize = 12;

/// The grasps of the file `path` that hold.
///
/// Errors: files that cannot be read, a list of ours of another object (`G734`), grasps that do not fit the hand.
pub fn import(path: &Path, scene: &GraspScene, settings: &GraspSettings, talk: &Talk) -> Result<GraspList, Stop> {
    let started = Instant::now();
    let foreign = read(path, scene)?;
    let (hand, object) = (&scene.scene.hands[0].hand, &scene.scene.objects[0]);
    let imported = import_grasps(hand, object, &foreign, settings).map_err(|failure| {
        let problem = failure.message.clone();
        Stop::BadInput(Diagnostic::new("G735", Place::file(path), problem).fix(failure.advice.clone()).into())
    })?;
    let seconds = started.elapsed().as_secs_f64();
    let (n_read, n_kept) = (foreign.grasps.len(), imported.list.grasps.len());
    talk.say(format!("import {}, {n_kept} kept   {}", counted(n_read, "grasp"), duration(seconds)));
    for dropped in imported.dropped.iter().take(SHOWN) {
        talk.say(format!("  {}: {}", dropped.name, dropped.reason));
    }
    if imported.dropped.len() > SHOWN {
        talk.say(format!("  and {} more", imported.dropped.len() - SHOWN));
    }
    let dropped: Vec<_> =
        imported.dropped.iter().map(|one| json!({ "name": one.name, "reason": one.reason })).collect();
    talk.event("import", json!({ "seconds": seconds, "read": n_read, "kept": n_kept, "dropped": dropped }));
    if imported.list.grasps.is_empty() { Err(Stop::Rejected) } else { Ok(imported.list) }
}

/// A list of ours, or an Isaac grasp file.
fn read(path: &Path, scene: &GraspScene) -> Result<ForeignGrasps, Stop> {
    let bytes = files::read_at_most(path, format::MAX_BYTES)?;
    let is_pickle = path.extension().is_some_and(|extension| extension == "npy") || bytes.starts_with(b"\x93NUMPY");
    if is_pickle {
        let diagnostic = Diagnostic::new("G736", Place::file(path), "is a file of numpy, which may hold programs")
            .expected("an Isaac grasp file or a grasp list")
            .fix("convert it where you trust it: docs/how-to/grasps.md has the lines of Python");
        return Err(Stop::BadInput(diagnostic.into()));
    }
    if bytes.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
        return Ok(from_isaac(path, &bytes)?);
    }
    let list = format::from_json(path, &bytes)?;
    let of_object = |role: &str| role == "object" || role == "mesh";
    let known: Vec<&str> =
        scene.scene.inputs.iter().filter(|input| of_object(&input.role)).map(|input| input.sha256.as_str()).collect();
    let other = list.inputs.iter().find(|input| of_object(&input.role) && !known.contains(&input.sha256.as_str()));
    match other {
        Some(input) if !known.is_empty() => {
            let problem = format!("was made of another \"{}\": its SHA-256 is {}", input.name, input.sha256);
            let diagnostic = Diagnostic::new("G734", Place::file(path), problem).expected(known.join(", "));
            Err(Stop::BadInput(diagnostic.fix("name the object that the list was made of").into()))
        }
        _ => Ok(ForeignGrasps::from(&list)),
    }
}

/// Refuses flags of the search beside `--import` (`A511`).
pub fn refuse_flags(arguments: &args::Grasps) -> Result<(), Stop> {
    let flags = [("--frames", arguments.frames.is_some()), ("--grasps", arguments.grasps.is_some())];
    match flags.into_iter().find(|(_, is_set)| *is_set) {
        Some((flag, _)) => {
            let problem = "stands beside --import, which searches for nothing".to_owned();
            Err(Stop::argument("A511", flag, problem, "one of the two"))
        }
        None => Ok(()),
    }
}
