//! Is friction what is missing? Grasps are drawn as the search draws them, and judged with more friction than it plans with.

use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip, closure};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::{Model, friction_in_words};
use regrasp_manipulation::workspace::Workspace;

/// Share of the failures that have to be for want of closure before grasps are drawn. By hand.
const CLOSURE_SHARE: f64 = 0.15;
/// Contacts drawn for each finger at each end of the query.
const CONTACTS: usize = 12;
/// Grasps that these contacts are combined to, at each end.
const GRASPS: usize = 250;
/// Share of the grasps in which every finger must be able to lift before friction counts as enough. By hand: scenes that are solved
/// at once have more.
const ENOUGH: f64 = 0.02;
/// Coefficients of a scene that are tried, over its margin, besides the scene's own without it: rubber on most things, soft rubber.
const MORE: [f64; 2] = [1.0, 1.5];

/// In how many of the grasps drawn each finger may lift, with one friction coefficient.
struct Lifts {
    /// What contacts have, with the margin taken off.
    friction: f64,
    /// What a scene would have to have for it; none for the scene's own without the margin.
    of_scene: Option<f64>,
    of_finger: [usize; MAX_FINGERS],
}

/// Says in `failure` that more friction would let fingers lift, where the search failed for want of closure and that is so.
pub fn advise(model: &Model, ends: [&Pose; 2], seed: u64, failure: &mut Failure) {
    let counts = &failure.statistics.failures;
    let of = |key: &str| counts.get(key).copied().unwrap_or(0) as f64;
    let total: f64 = counts.values().map(|&count| count as f64).sum();
    let is_open = matches!(failure.kind, FailureKind::WorkSpent | FailureKind::TimeLimit);
    if !is_open
        || !model.may_release
        || of("not_closed") + of("not_released") + of("no_order") < CLOSURE_SHARE * total.max(1.0)
    {
        return;
    }
    let Some((n_grasps, lifts)) = lifts(model, ends, seed) else { return };
    let n_fingers = model.n_fingers();
    let least = |lifts: &Lifts| (0..n_fingers).map(|f| (lifts.of_finger[f], f)).min().unwrap_or((0, 0));
    let share = |count: usize| count as f64 / n_grasps as f64;
    let (n_now, finger) = least(&lifts[0]);
    if share(n_now) >= ENOUGH {
        return;
    }
    let better: Vec<&Lifts> = lifts[1..].iter().filter(|other| least(other).0 > 2 * n_now.max(2)).collect();
    let Some(enough) = better.iter().find(|other| share(least(other).0) >= ENOUGH).or(better.last()) else { return };
    let name = &model.view.hand.fingers[finger].name;
    let others: Vec<String> = better
        .iter()
        .map(|other| format!("in {:.1} % with {}", 100.0 * share(other.of_finger[finger]), in_words(other)))
        .collect();
    failure.message += &format!(
        "; friction is short: of {n_grasps} grasps drawn at start and goal, the other fingers hold without \"{name}\" in {:.1} % with \
         friction {:.3} ({}), {}",
        100.0 * share(n_now),
        lifts[0].friction,
        friction_in_words(model),
        others.join(", ")
    );
    let are_soft = model.fingers.iter().all(|finger| matches!(finger.contact, ContactModel::SoftFinger { .. }));
    failure.advice = format!("{}; {}", what_helps(enough.of_scene, are_soft), failure.advice);
}

fn in_words(lifts: &Lifts) -> String {
    match lifts.of_scene {
        Some(of_scene) => format!("{:.3} ({of_scene} over the margin)", lifts.friction),
        None => format!("{} (no margin)", lifts.friction),
    }
}

/// What to change where the friction `of_scene` would do, or the scene's own without its margin.
fn what_helps(of_scene: Option<f64>, are_soft: bool) -> String {
    let friction = match of_scene {
        Some(enough) => format!("fingertips with more friction (friction = {enough})"),
        None => "a smaller `friction_margin` in the settings, where the scene's friction is sure".to_owned(),
    };
    let soft = if are_soft { "" } else { ", or soft fingertips (contact = \"soft_finger\")" };
    friction + soft
}

/// Number of grasps drawn, and in how many of them each finger may lift: with the friction that is planned with, then with more
/// and more. None where some finger has no contact at either end.
fn lifts(model: &Model, ends: [&Pose; 2], seed: u64) -> Option<(usize, Vec<Lifts>)> {
    let planned = model.frame.friction;
    let of_scene = model.view.object.friction;
    let margin = of_scene / planned;
    let more = MORE.into_iter().map(|value| (value / margin, Some(value)));
    let mut levels: Vec<(f64, Option<f64>)> = std::iter::once((of_scene, None)).chain(more).collect();
    levels.retain(|(friction, _)| *friction > 1.05 * planned);
    levels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lifts: Vec<Lifts> = std::iter::once((planned, Some(of_scene)))
        .chain(levels)
        .map(|(friction, of_scene)| Lifts { friction, of_scene, of_finger: [0; MAX_FINGERS] })
        .collect();
    let mut workspace = Workspace::new(model);
    let mut n_grasps = 0;
    for (end, pose) in ends.into_iter().enumerate() {
        let mut rng = Rng::keyed(seed, "friction", end as u64);
        let Some(contacts) = contacts_at(&mut workspace, pose, &mut rng) else { continue };
        for _ in 0..GRASPS {
            let grips: ArrayVec<Grip, MAX_FINGERS> =
                contacts.iter().enumerate().map(|(f, found)| model.grip(f, &found[rng.below(found.len())])).collect();
            n_grasps += 1;
            for lifts in &mut lifts {
                let frame = GraspFrame { friction: lifts.friction, ..model.frame };
                for finger in 0..grips.len() {
                    let mut others = grips.clone();
                    others.remove(finger);
                    let enough = model.settings.closure_margin;
                    lifts.of_finger[finger] += usize::from(closure::closure_margin(&others, &frame, enough) >= enough);
                }
            }
        }
    }
    (n_grasps > 0).then_some((n_grasps, lifts))
}

/// Contacts that each finger reaches with the object at `pose`. None where one of them finds none.
fn contacts_at(workspace: &mut Workspace, pose: &Pose, rng: &mut Rng) -> Option<Vec<Vec<Contact>>> {
    workspace.place_object(pose);
    let placement = Placement::from(pose);
    let n_fingers = workspace.model.n_fingers();
    let of_finger = |finger: usize| {
        let mut found = Vec::with_capacity(CONTACTS);
        draw_footholds(workspace, finger, &placement, CONTACTS, rng, |contact, _| found.push(contact));
        (!found.is_empty()).then_some(found)
    };
    (0..n_fingers).map(of_finger).collect()
}

#[cfg(test)]
mod tests {
    use super::what_helps;

    #[test]
    fn nothing_is_advised_that_the_scene_has() {
        assert_eq!(
            what_helps(Some(1.0), false),
            "fingertips with more friction (friction = 1), or soft fingertips (contact = \"soft_finger\")"
        );
        assert_eq!(what_helps(Some(1.5), true), "fingertips with more friction (friction = 1.5)");
        let margin = what_helps(None, true);
        assert!(margin.contains("friction_margin") && !margin.contains("0.8") && !margin.contains("soft"), "{margin}");
    }
}
