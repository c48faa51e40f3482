//! Postures of free fingers: out of the way while the others move the object (independent fingers; Saut 2011, sec. 3.1).

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Way, clear_share};
use crate::in_hand::grasps::combine::most_free;
use crate::in_hand::moving::spin;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::relocation::hover;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Heights over its contact to which a finger may just lift off, in metres. By hand.
const HOVERS: [f64; 2] = [0.006, 0.02];

/// Postures drawn at random.
const DRAWN: usize = 3;

/// Fingers that may be left free in one extension: more make more combinations than are worth ranking.
const AT_ONCE: usize = 3;

/// Fingers that the next extension from `state` may leave free, as bits: some now and then where a pose was tried often, or
/// where a finger is free already; always those that hold and cannot follow the object.
pub fn draw_leavable(search: &mut Search, state: &GraspState, n_tries: u32) -> u32 {
    let stay_behind = search.model().closing_fingers() & state.holding;
    stay_behind | draw_others_leavable(search, state, n_tries)
}

fn draw_others_leavable(search: &mut Search, state: &GraspState, n_tries: u32) -> u32 {
    let model = search.model();
    // Every soft finger that is free leaves the object one direction more.
    let is_early = n_tries <= search.settings.search.free_after && !spin::is_restricted(model, state.holding);
    if most_free(model, &search.settings.search) == 0 || (state.is_held_by_all() && is_early) {
        return 0;
    }
    if !search.rng.chance(search.settings.search.free_share) {
        return 0;
    }
    let mut fingers: Vec<usize> = (0..model.n_fingers()).collect();
    search.rng.shuffle(&mut fingers);
    fingers.iter().take(AT_ONCE).fold(0, |bits, finger| bits | 1 << finger)
}

/// A free posture of `finger` in `state` that is out of the way for as much of `way` as can be; the first tried of several
/// that are equally good: just lifted off, at rest, drawn at random. None when none is clear of object, palm and obstacles.
pub fn free_posture(search: &mut Search, finger: usize, state: &GraspState, way: &Way) -> Option<Candidate> {
    let placement = Placement::from(&state.world_from_object);
    let mut postures: Vec<Coordinates> = Vec::with_capacity(HOVERS.len() + 1 + DRAWN);
    if let Some(contact) = state.contact(finger) {
        let model = search.model();
        let lifted = HOVERS
            .iter()
            .filter_map(|height| hover(model, &placement, finger, &contact, &state.joints[finger], *height));
        postures.extend(lifted);
    }
    best_of(search, finger, &state.world_from_object, way, postures)
}

/// As [`free_posture`], for a finger that is nowhere yet, with the object at `world_from_object`.
pub fn free_posture_at(search: &mut Search, finger: usize, world_from_object: &Pose, way: &Way) -> Option<Candidate> {
    best_of(search, finger, world_from_object, way, Vec::new())
}

fn best_of(
    search: &mut Search,
    finger: usize,
    world_from_object: &Pose,
    way: &Way,
    mut postures: Vec<Coordinates>,
) -> Option<Candidate> {
    let model = search.model();
    let chain = model.fingers[finger].ik.chain();
    postures.push(model.view.hand.fingers[finger].rest.iter().copied().collect());
    for _ in 0..DRAWN {
        let margin = model.fingers[finger].limit_margin;
        let limits = chain.lower.iter().zip(&chain.upper);
        let drawn: Coordinates =
            limits.map(|(l, u)| search.rng.uniform(l + margin, (u - margin).max(l + margin))).collect();
        if chain.within_linear_limits(&drawn, margin) {
            postures.push(drawn);
        }
    }
    let mut best: Option<Candidate> = None;
    for joints in postures {
        let Some(follow) = clear_share(&mut search.workspace, finger, &joints, world_from_object, way) else {
            continue;
        };
        if best.as_ref().is_none_or(|known| follow > known.follow) {
            best = Some(Candidate { contact: None, joints, follow });
            if follow == 1.0 {
                break;
            }
        }
    }
    search.workspace.place_object(world_from_object);
    best
}
