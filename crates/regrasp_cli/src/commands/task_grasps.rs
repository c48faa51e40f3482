//! Grasp lists of a task of pick and place: the scene names them, or an earlier run left them beside the scene, or they are made now and
//! saved there.

use crate::args::Common;
use crate::commands::written::{Limits, available_threads};
use crate::judge_grasps;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration};
use regrasp::base::files;
use regrasp::file_names::name_from;
use regrasp::grasp::list::format;
use regrasp::grasp::record::PlanInput;
use regrasp::plan::check::grasps::source_of;
use regrasp::planners::FailureKind;
use regrasp::scene::scene::InputFile;
use regrasp::scene::{LoadedScene, ObjectSource, PickAndPlaceQuery, load_grasp_scene};
use regrasp::task_grasps::{make_list, read_grasps, read_list, refuse_too_heavy, settings_of_made_lists};
use regrasp::{Budget, GraspList};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// The lists of all hands that the robot carries. Hands without a grasp of the object are left out, with a note, where another hand has
/// one.
///
/// Errors: a list of another hand or object (`G740`, `G741`), a list that cannot be read; no hand has a grasp.
pub fn lists(
    path: &Path,
    (loaded, query): (&LoadedScene, &PickAndPlaceQuery),
    seed: u64,
    limits: &Limits,
    common: &Common,
    talk: &Talk,
) -> Result<Vec<(usize, GraspList)>, Stop> {
    let mut grasps = read_grasps(&loaded.scene, query)?;
    if !grasps.missing.is_empty() {
        refuse_too_heavy(&loaded.scene, query).map_err(|failure| Stop::NoRobotPlan(Box::new(failure)))?;
    }
    let mut none = None;
    for hand in grasps.missing.clone() {
        let beside = beside(path, loaded, query, hand);
        if beside.is_file() {
            let list = read_list(&beside, &loaded.scene, query, hand)?;
            talk.say(format!("grasps {}   {}, made earlier", beside.display(), counted(list.grasps.len(), "grasp")));
            grasps.add(hand, list);
            continue;
        }
        match make(path, &beside, (loaded, query, hand), (seed, limits), common, talk) {
            Ok(list) => grasps.add(hand, list),
            Err(Stop::NoGrasp(failure)) => {
                talk.note(&failure.message);
                none = Some(Stop::NoGrasp(failure));
            }
            Err(stop) => return Err(stop),
        }
    }
    match none {
        Some(stop) if grasps.lists.is_empty() => Err(stop),
        _ => Ok(grasps.lists),
    }
}

/// `SCENE.HAND.OBJECT.grasps.json` in the folder of the scene.
fn beside(path: &Path, loaded: &LoadedScene, query: &PickAndPlaceQuery, hand: usize) -> PathBuf {
    let plain =
        |name: &str| name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect();
    let [scene, hand, object]: [String; 3] =
        [&loaded.scene.name, &loaded.scene.hands[hand].name, &loaded.scene.objects[query.object].name]
            .map(|n| plain(n));
    path.with_file_name(format!("{scene}.{hand}.{object}.grasps.json"))
}

/// Makes a list, judges it as `regrasp grasps` does, and saves it at `beside`.
fn make(
    path: &Path,
    beside: &Path,
    (loaded, query, hand): (&LoadedScene, &PickAndPlaceQuery, usize),
    (seed, limits): (u64, &Limits),
    common: &Common,
    talk: &Talk,
) -> Result<GraspList, Stop> {
    let started = Instant::now();
    let placed = &loaded.scene.hands[hand];
    let settings = settings_of_made_lists(&placed.hand, available_threads());
    talk.say(format!(
        "grasps the scene names no list of hand \"{}\" and object \"{}\": looking for {}",
        placed.name,
        loaded.scene.objects[query.object].name,
        counted(settings.grasps, "grasp")
    ));
    let budget = Budget {
        deadline: limits.time_limit.map(|limit| started + limit),
        cancelled: Arc::clone(&limits.cancelled),
        ..Budget::work(limits.max_work)
    };
    let list =
        make_list(&loaded.scene, query, hand, (&settings, seed), &budget).map_err(|failure| match failure.kind {
            FailureKind::Interrupted => Stop::Interrupted,
            _ => Stop::NoGrasp(Box::new(failure)),
        })?;
    talk.say(format!("grasps {} found   {}", list.grasps.len(), duration(started.elapsed().as_secs_f64())));
    let Some(file) = file_of(loaded, hand) else { return Ok(list) };
    let source = ObjectSource::Scene(path.to_owned());
    // The hand by itself from its file, as the checker sees it; the object is the one of the task.
    let mut afresh = load_grasp_scene(&file, &source, &load::options(common))?;
    let is_first = loaded.scene.objects[query.object].name == afresh.scene.objects[0].name;
    afresh.scene.objects = vec![loaded.scene.objects[query.object].clone()];
    let input = |input: &InputFile| PlanInput {
        role: input.role.clone(),
        name: input.name.clone(),
        sha256: input.sha256.clone(),
    };
    let list = GraspList {
        source: is_first.then(|| {
            let packages = load::options(common).resolve.packages;
            let [hand, scene] = [file.as_path(), path].map(|file| PathBuf::from(name_from(beside, file, &packages)));
            source_of(&hand, &ObjectSource::Scene(scene), None)
        }),
        inputs: afresh.scene.inputs.iter().map(input).collect(),
        ..list
    };
    let (list, _) = judge_grasps::accepted(list, &afresh, settings.n_threads, talk)?;
    let bytes = format::to_json(&list);
    match files::write_atomic(beside, bytes.as_bytes()) {
        Ok(()) => {
            let sha256 = files::sha256(bytes.as_bytes());
            talk.event("written", json!({ "format": "grasps", "path": beside, "sha256": sha256 }));
            talk.say(format!("wrote  {}   the next run takes it from there", beside.display()));
        }
        // The plan does not need the file.
        Err(error) => talk.note(&format!("{} cannot be written: {error}", beside.display())),
    }
    Ok(list)
}

/// The file of a hand that a robot carries.
fn file_of(loaded: &LoadedScene, hand: usize) -> Option<PathBuf> {
    let carrier = loaded.scene.hands[hand].carrier?;
    loaded.scene.robots[carrier.robot].hands[carrier.hand].file.clone()
}
