//! A hand at an object that lies on a support: postures, the way in, and the way up.

pub use crate::clear::with_fingers;
use crate::clear::{is_hand_clear, links_of};
use crate::context::{Context, Grasp};
use crate::failing::{Stage, Tally, Try};
use crate::forces;
use crate::line::{LINE_STEPS, are_states_free, is_lift_free, is_motion_free, is_state_free, is_way_free, straight};
use crate::placements::{Place, stable_pose};
use crate::posture::least_first;
use crate::timing::Smooth;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose};
use regrasp_robot::kinematics::arm_ik::{ArmPosture, IkBudget, Unreachable};
use std::cell::OnceCell;

/// Postures of an arm that are looked at for one posture of the common joints: at first, and where nothing else is left.
const POSTURES: usize = 4;
const MORE_POSTURES: usize = 24;
/// So many times as many postures are compared for how natural they are.
const POOL: usize = 3;
/// So many times as many postures of the common joints are drawn where nothing else is left.
const MORE_DRAWS: usize = 8;
/// Reasons for which no posture is looked at.
const BELOW_SUPPORT: &str = "hands below the support";
/// The fingers do not hold the weight.
pub const TOO_HEAVY: &str = "grasps that do not hold the weight";
const OUT_OF_REACH: &str = "out of reach";
/// A reason that more postures do not change.
pub const HAND_COLLIDES: &str = "hands in collision";
/// Shares of the way in that are tried. A shorter one is planned before.
pub const WAY_SHARES: [f64; 2] = [1.0, 0.4];
/// Shares of the lift that are tried.
pub const LIFT_SHARES: [f64; 2] = [1.0, 1.0 / 3.0];
/// Steps in time of fingers that open or close.
pub const FINGER_STEPS: usize = 8;

/// How much is looked at for one grasp, or one pair of grasps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// What is likely alone: another grasp may be easier.
    Little,
    /// All the rest, after a look with little effort.
    Full,
}

/// A hand at the object. All states have the other arms where they are at the start.
#[derive(Debug, Clone)]
pub struct Station {
    /// The hand.
    pub hand: usize,
    /// Index among its grasps.
    pub grasp: usize,
    /// The open hand from the object to where its way in begins.
    pub way: Smooth,
    /// The hand with the object, straight off the support.
    pub lift: Smooth,
}

/// Tests that need neither kinematics nor collision. Err with a reason.
pub fn may_hold(context: &Context, place: &Place, hand: usize, grasp: &Grasp) -> Result<(), &'static str> {
    if stable_pose(context, hand, &place.world_from_object).is_some_and(|pose| !grasp.stable_poses.contains(&pose)) {
        return Err(BELOW_SUPPORT);
    }
    if !forces::holds(context, hand, grasp, &place.world_from_object) {
        return Err(TOO_HEAVY);
    }
    Ok(())
}

/// Postures of the common joints: that of `state`, then drawn ones that keep their limits.
pub fn common_postures(
    context: &Context,
    hands: &[usize],
    state: &[f64],
    n_draws: usize,
    rng: &mut Rng,
) -> Vec<Vec<f64>> {
    let mut common: Vec<usize> = hands.iter().flat_map(|&hand| context.common_above(hand)).collect();
    common.sort_unstable();
    common.dedup();
    let mut found = vec![state.to_vec()];
    if common.is_empty() {
        return found;
    }
    let coordinates = &context.robot.layout.coordinates;
    for _ in 0..n_draws {
        let mut drawn = state.to_vec();
        for &k in &common {
            drawn[k] = rng.uniform(coordinates[k].lower.max(-3.2), coordinates[k].upper.min(3.2));
        }
        if context.robot.layout.within_limits(&drawn, 0.0) {
            found.push(drawn);
        }
    }
    found
}

/// Puts drawn postures of the common joints, all but the first, in the order of how natural they are with wrists at points.
pub fn natural_first(context: &Context, commons: &mut [Vec<f64>], wrists: &[Point]) {
    if let Some((_, drawn)) = commons.split_first_mut()
        && !context.natural.is_silent()
    {
        least_first(drawn, |state| context.natural.of_common(context.robot, state, wrists));
    }
}

/// Joints of the arm of `hand` that bring its base to a pose, the most natural first, of those nearest to the joints of `state`. Errors: how
/// far it is out of reach.
pub fn arm_postures(
    context: &Context,
    hand: usize,
    state: &[f64],
    world_from_hand: &Pose,
    n_postures: usize,
) -> Result<Vec<Vec<f64>>, (f64, String)> {
    let own = &context.hands[hand];
    let arm = &context.robot.arms[own.arm];
    let base = context.robot.world_from_root() * root_from(context, arm.base, state);
    let base_from_mount = base.inverse() * world_from_hand * own.hand_from_mount;
    // More come for nothing only where all are known in closed form.
    let weighs = n_postures > 1 && context.natural.weighs_arms();
    let n_found = if weighs && own.ik.has_closed_form() { n_postures * POOL } else { n_postures };
    let budget = IkBudget { postures: n_found, starts: 30, free_angles: 24, seed: context.seed };
    match own.ik.solve(&base_from_mount, &state[own.arm_joints.clone()], &budget) {
        Ok(mut postures) => {
            if weighs {
                let natural = &context.natural;
                least_first(&mut postures, |found| natural.of_arm(context.robot, own.arm, &base, &found.joints));
            }
            let state_of = |posture: ArmPosture| {
                let mut state = state.to_vec();
                state[own.arm_joints.clone()].copy_from_slice(&posture.joints);
                state
            };
            Ok(postures.into_iter().take(n_postures).map(state_of).collect())
        }
        Err(unreachable) => {
            let by = match &unreachable {
                Unreachable::TooFar { by } | Unreachable::TooNear { by } | Unreachable::Limits { by, .. } => *by,
                Unreachable::NotFound { distance, angle } => distance + angle,
            };
            Err((by, format!("arm \"{}\": {unreachable}", arm.name)))
        }
    }
}

fn root_from(context: &Context, link: regrasp_robot::LinkId, state: &[f64]) -> Pose {
    let mut poses = Vec::new();
    context.robot.link_poses(state, &mut poses);
    context.robot.world_from_root().inverse() * poses[link.0]
}

/// A station of a grasp at a place. Err with a reason.
pub fn station(
    context: &Context,
    place: &Place,
    [hand, grasp]: [usize; 2],
    (stage, effort): (Stage, Effort),
    tally: &mut Tally,
) -> Result<Station, &'static str> {
    let own = &context.hands[hand].grasps[grasp];
    let park = &context.query.start;
    let failed = |tally: &mut Tally, reason: &str, state: Option<&Vec<f64>>| {
        tally.keep(stage, rank(reason), || failed_try(place, [hand, grasp], reason, state));
    };
    let world_from_hand = place.world_from_object * own.object_from_hand;
    let hand_from_object = own.object_from_hand.inverse();
    let closed = with_fingers(context, park, hand, &own.closed);
    let open = with_fingers(context, park, hand, &own.open);
    let free = &context.arms_and_torso;
    let hands = [&own.closed, &own.open].map(|fingers| links_of(context, hand, fingers));
    if !hands.iter().all(|links| is_hand_clear(context, links, &world_from_hand)) {
        failed(tally, HAND_COLLIDES, None);
        return Err(HAND_COLLIDES);
    }
    let (n_postures, n_draws) = match effort {
        Effort::Little => (POSTURES, context.settings.common_draws),
        Effort::Full => (MORE_POSTURES, context.settings.common_draws * MORE_DRAWS),
    };
    let (models, mut reason) = ([const { OnceCell::new() }; 3], OUT_OF_REACH);
    let states = [(&closed, None), (&open, None), (&closed, Some((hand, &hand_from_object)))];
    // Made when they are needed.
    let model = |k: usize| models[k].get_or_init(|| context.model(states[k].0, free, states[k].1));
    let mut rng = Rng::keyed(context.seed, "common", 0);
    let mut commons = common_postures(context, &[hand], &closed, n_draws, &mut rng);
    let wrist = (world_from_hand * context.hands[hand].hand_from_mount).translation.vector;
    natural_first(context, &mut commons, &[wrist.into()]);
    for common in &commons {
        tally.work(1);
        let postures = match arm_postures(context, hand, common, &world_from_hand, n_postures) {
            Ok(postures) => postures,
            Err((by, words)) => {
                tally.miss(stage, by, || words);
                failed(tally, OUT_OF_REACH, None);
                continue;
            }
        };
        reason = worse(reason, "in collision");
        let free = are_states_free(context, model(0), &context.fixed, &postures, tally);
        for (at, is_free) in postures.into_iter().zip(free) {
            if !is_free {
                failed(tally, "in collision", Some(&at));
                continue;
            }
            reason = worse(reason, "without a way in");
            let direction = place.world_from_object.rotation * own.direction;
            let opened = with_fingers(context, &at, hand, &own.open);
            let way = WAY_SHARES.iter().find_map(|share| {
                let way = straight(context, hand, &opened, &(-direction * own.distance * *share))?;
                let timed = way.timed(&context.limits, 1.0, LINE_STEPS);
                is_way_free(context, (model(1), hand), &place.world_from_object, &timed, tally).then_some(way)
            });
            let Some(way) = way else {
                failed(tally, "without a way in", Some(&at));
                continue;
            };
            reason = worse(reason, "with fingers that cannot close");
            if !can_close(context, hand, [&opened, &at], tally) {
                failed(tally, "with fingers that cannot close", Some(&at));
                continue;
            }
            reason = worse(reason, "without a way up");
            let lift = LIFT_SHARES.iter().find_map(|share| {
                let lift = straight(context, hand, &at, &(context.up() * context.settings.lift * *share))?;
                let timed = lift.timed(&context.limits, 1.0, LINE_STEPS);
                let worlds = [&*context.fixed, &**place.without_supports(context)];
                let is_free = is_lift_free(context, model(2), worlds, &timed, tally)
                    && is_state_free(context, model(2), &context.fixed, lift.ends()[1], tally);
                is_free.then_some(lift)
            });
            if let Some(lift) = lift {
                return Ok(Station { hand, grasp, way, lift });
            }
            failed(tally, "without a way up", Some(&at));
        }
    }
    Err(reason)
}

/// The reason that is nearer to success.
fn worse(old: &'static str, new: &'static str) -> &'static str {
    if rank(new) > rank(old) { new } else { old }
}

/// How near to success a reason is.
fn rank(reason: &str) -> usize {
    const ORDER: [&str; 8] = [
        BELOW_SUPPORT,
        TOO_HEAVY,
        OUT_OF_REACH,
        HAND_COLLIDES,
        "in collision",
        "without a way in",
        "with fingers that cannot close",
        "without a way up",
    ];
    ORDER.iter().position(|other| *other == reason).unwrap_or(0)
}

/// A grasp at a place that failed.
pub fn failed_try(place: &Place, own: [usize; 2], reason: &str, state: Option<&Vec<f64>>) -> Try {
    Try {
        reason: reason.to_owned(),
        world_from_object: Some(place.world_from_object),
        grasps: vec![own],
        state: state.cloned(),
    }
}

/// True where the fingers get from the first state to the second one.
pub fn can_close(context: &Context, hand: usize, [from, to]: [&[f64]; 2], tally: &mut Tally) -> bool {
    let fingers: Vec<usize> = context.hands[hand].fingers.clone().collect();
    let model = context.model(from, &fingers, None);
    let timed = Smooth::Line([from.to_vec(), to.to_vec()]).timed(&context.limits, 1.0, FINGER_STEPS);
    is_motion_free(context, &model, &context.fixed, &timed, tally)
}
