//! The nearest valid start to a state that was observed: what cameras and encoders say is never exactly a grasp.
//!
//! Damped least squares move object and joints so that the fingers that hold touch. Small draws about that take links out of
//! collision, and where they do not, object and fingers go aside one coordinate at a time, as far as the limits let them. What comes out
//! is a start that planning does not refuse, or the reason why there is none nearby.

/// Where the fingers that hold touch.
mod fit;
/// Links pushed out of what they are in.
mod push;

use crate::ends::blocked::{refuse_buried_object, refuse_object_out_of_reach};
use crate::ends::end::End;
use crate::ends::given::{self, NoTouch};
use crate::failure::Failure;
use crate::forces::held::Held;
use crate::grasp::state::GraspState;
use crate::model::{Model, friction_in_words, releasable};
use crate::workspace::{TipMode, Workspace};
use fit::{Posture, fit, gap_of, relative_velocity};
use push::pushed;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector, frame};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// What was observed, in the hand's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Pose of the object.
    pub hand_from_object: Pose,
    /// Positions of all joints, in the order of `Hand::joint_names`.
    pub joints: Vec<f64>,
    /// Velocities, where they are known.
    pub velocities: Option<Velocities>,
    /// For every finger whether it presses on something, where that is felt.
    pub presses: Option<Vec<bool>>,
}

/// Velocities of hand and object, in the hand's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Velocities {
    /// Of all joints.
    pub joints: Vec<f64>,
    /// Of the origin of the object's frame.
    pub linear: Vector,
    /// Of the object.
    pub angular: Vector,
}

/// How far a start may be from what was observed, and what counts as what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectionLimits {
    /// Largest distance that the object's centre of mass and any fingertip moves, in metres.
    pub distance: f64,
    /// Largest turn of the object and of any joint, in radians (metres for joints that slide).
    pub turn: f64,
    /// Contacts whose surfaces slide faster over each other slide, in metres per second.
    pub sliding: f64,
}

impl Default for ProjectionLimits {
    /// By hand: twice the noise of good pose estimates.
    fn default() -> Self {
        ProjectionLimits { distance: 0.001, turn: 0.02, sliding: 0.002 }
    }
}

/// What a finger does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touching {
    /// It holds the object.
    Holds,
    /// It touches and slides; it holds in the start, as soon as it rests.
    Slides,
    /// It does not touch, or touches where no contact of a start may be (nearer to an edge than a quarter of the object's `edge_distance`):
    /// the start lifts it off.
    Free,
}

/// How far a start is from what was observed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moved {
    /// The object's centre of mass, in metres.
    pub object: f64,
    /// The object, in radians.
    pub object_turn: f64,
    /// The fingertip that moved farthest, in metres.
    pub tip: f64,
    /// The joint that moved farthest, in radians or metres.
    pub joint: f64,
}

/// A valid start.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// The start, in the hand's frame.
    pub state: GraspState,
    /// What each finger does.
    pub touching: Vec<Touching>,
    /// How far it is from what was observed.
    pub moved: Moved,
}

/// Draws about the fitted posture when links collide.
const DRAWS: u64 = 48;
/// The last draws stray by this share of the limits, as standard deviation.
const DRAWN_SHARE: f64 = 0.5;
/// A finger that is felt to press may be this many times the largest distance off: it bends.
const PRESSING_REACH: f64 = 2.0;

/// The nearest valid start to `observed`.
///
/// Errors: numbers that make no sense, or no start within `limits`, and why.
pub fn project(model: &Model, observed: &Observed, limits: &ProjectionLimits) -> Result<Projection, Failure> {
    let posture = posture_of(model, observed)?;
    refuse_beyond_limits(model, observed, &posture, limits)?;
    let object = Placement::from(&posture.object);
    let gaps: Vec<Option<f64>> =
        (0..model.n_fingers()).map(|f| gap_of(model, f, &posture.joints[f], &object)).collect();
    let felt = |finger: usize| observed.presses.as_ref().and_then(|presses| presses.get(finger)).copied();
    let touches = |finger: usize| {
        let reach = if felt(finger) == Some(true) { PRESSING_REACH } else { 1.0 } * limits.distance;
        gaps[finger].is_none_or(|gap| gap <= reach)
    };
    let mut holding = (0..model.n_fingers()).filter(|&f| touches(f)).fold(0_u32, |bits, f| bits | 1 << f);
    let (mut first, mut lifted): (Option<Failure>, Option<usize>) = (None, None);
    // A fingertip that may not touch where it does is lifted off. Then whoever touches least is taken to be free, one finger after the
    // other, as long as the others hold.
    while holding != 0 {
        match start_with(model, observed, &posture, holding, limits) {
            Ok(state) => return Ok(described(model, observed, &posture, state, limits)),
            Err(failure) => match (&mut first, lifted) {
                (None, _) => first = Some(failure),
                (Some(first), Some(finger)) => {
                    let name = &model.view.hand.fingers[finger].name;
                    first.message =
                        format!("{}; with finger \"{name}\" lifted off, {}", first.message, failure.message);
                }
                (Some(_), None) => {}
            },
        }
        lifted = on_an_edge(model, &posture, holding);
        if let Some(finger) = lifted {
            holding &= !(1 << finger);
            continue;
        }
        let loose = (0..model.n_fingers()).filter(|&f| holding & (1 << f) != 0 && felt(f) != Some(true));
        let farthest = loose.max_by(|&a, &b| gaps[a].unwrap_or(f64::MIN).total_cmp(&gaps[b].unwrap_or(f64::MIN)));
        match farthest.filter(|&f| gaps[f].is_some_and(|gap| gap > 0.0)) {
            Some(finger) => holding &= !(1 << finger),
            None => break,
        }
    }
    Err(first.unwrap_or_else(|| {
        let nearest = gaps.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        refusal(
            format!("no finger touches the object: the nearest is {:.1} mm away", 1e3 * nearest),
            "look where the object is, and grasp it anew",
        )
    }))
}

/// A finger of `holding` whose tip, where all of them touch, is nearer to an edge than a contact of a start may be.
fn on_an_edge(model: &Model, posture: &Posture, holding: u32) -> Option<usize> {
    let fitted = fit(model, posture, holding);
    let (object, body) = (Placement::from(&fitted.object), model.view.object);
    (0..model.n_fingers()).filter(|&f| holding & (1 << f) != 0).find(|&f| {
        let contact = model.fingers[f].contact_at(&body.surface, &fitted.joints[f], &object);
        contact.is_some_and(|(contact, _)| !body.may_start_at(&body.surface.project(&contact.point_in_object)))
    })
}

fn refusal(message: String, advice: &str) -> Failure {
    End::Start.failure(message, advice)
}

/// What was observed, within the limits of the joints.
fn posture_of(model: &Model, observed: &Observed) -> Result<Posture, Failure> {
    let n_joints: usize = model.fingers.iter().map(|finger| finger.ik.chain().n_coordinates()).sum();
    if observed.joints.len() != n_joints {
        let message = format!("the observed state has {} joints, the hand {n_joints}", observed.joints.len());
        return Err(refusal(message, "give a position for every joint of every finger"));
    }
    let pose = &observed.hand_from_object;
    let numbers = observed.joints.iter().chain(pose.translation.vector.iter()).chain(pose.rotation.coords.iter());
    if let Some(bad) = numbers.clone().find(|value| !value.is_finite()) {
        return Err(refusal(format!("the observed state has {bad} among its numbers"), "leave such a state out"));
    }
    let mut left = observed.joints.as_slice();
    let joints = model.fingers.iter().map(|finger| {
        let chain = finger.ik.chain();
        let (own, rest) = left.split_at(chain.n_coordinates());
        left = rest;
        let limits = chain.lower.iter().zip(&chain.upper);
        let near: Coordinates = own.iter().zip(limits).map(|(&q, (&low, &high))| q.clamp(low, high.max(low))).collect();
        match chain.bring_within_limits(&near) {
            Some(within) => within.into_iter().collect(),
            None => near,
        }
    });
    Ok(Posture { object: *pose, joints: joints.collect() })
}

/// Refuses joints that are farther beyond their limits than a start may move them: what the fingers would touch there is another question.
fn refuse_beyond_limits(
    model: &Model,
    observed: &Observed,
    posture: &Posture,
    limits: &ProjectionLimits,
) -> Result<(), Failure> {
    let within = posture.joints.iter().flatten();
    let mut seen = observed.joints.iter().zip(within).zip(model.view.hand.joint_names());
    let Some(((seen, within), name)) = seen.find(|((seen, within), _)| !((*seen - *within).abs() <= limits.turn))
    else {
        return Ok(());
    };
    let by = (seen - within).abs();
    let message = format!(
        "joint \"{name}\" is at {seen:.4}, {by:.4} beyond its limits; a start moves joints by {} at most",
        limits.turn
    );
    Err(refusal(message, "ease the finger off its stop, or correct the limits of the joint in the URDF"))
}

/// The start in which the fingers of `holding` hold, if there is one near `posture`.
fn start_with(
    model: &Model,
    observed: &Observed,
    posture: &Posture,
    holding: u32,
    limits: &ProjectionLimits,
) -> Result<GraspState, Failure> {
    refuse_open(model, posture, holding)?;
    let fitted = fit(model, posture, holding);
    let mut workspace = Workspace::new(model);
    let (mut first, mut in_the_way) = (None, None);
    let mut rng = Rng::keyed(0, "projection", 0);
    for draw in 0..=DRAWS {
        let share = DRAWN_SHARE * draw as f64 / DRAWS as f64;
        let near = if draw == 0 { fitted.clone() } else { drawn(model, &fitted, limits, share, &mut rng) };
        match valid(model, &mut workspace, observed, &near, holding, limits) {
            Ok(state) => return Ok(state),
            Err(failure) => first.get_or_insert(failure),
        };
        if draw == 0 {
            in_the_way = workspace.blocking_pair.take();
        }
    }
    if let Some(pair) = in_the_way {
        let mut aside = pushed(model, &fitted, pair, holding, limits);
        if let Some(state) = aside.find_map(|near| valid(model, &mut workspace, observed, &near, holding, limits).ok())
        {
            return Ok(state);
        }
    }
    Err(first.expect("there is at least one draw"))
}

/// `posture`, with object and joints displaced at random by a share of the limits.
fn drawn(model: &Model, posture: &Posture, limits: &ProjectionLimits, share: f64, rng: &mut Rng) -> Posture {
    let mut vector = |size: f64| Vector::from_fn(|_, _| size * rng.normal());
    let (shift, turn) = (vector(share * limits.distance), vector(0.5 * share * limits.turn));
    let mut joints = posture.joints.clone();
    for (finger, own) in model.fingers.iter().zip(&mut joints) {
        let chain = finger.ik.chain();
        for (k, value) in own.iter_mut().enumerate() {
            let size = fit::deviation(chain, k) / fit::TURN_DEVIATION * 0.4 * share * limits.turn;
            *value = (*value + size * rng.normal()).clamp(chain.lower[k], chain.upper[k].max(chain.lower[k]));
        }
    }
    Posture { object: fit::displaced(&posture.object, &shift, &turn), joints }
}

/// The start that is nearest to `near`, if it is valid.
fn valid(
    model: &Model,
    workspace: &mut Workspace,
    observed: &Observed,
    near: &Posture,
    holding: u32,
    limits: &ProjectionLimits,
) -> Result<GraspState, Failure> {
    let object = Placement::from(&near.object);
    let names = &model.view.hand.fingers;
    let mut fingers: Vec<(Option<Contact>, Coordinates)> = Vec::with_capacity(model.n_fingers());
    for (f, finger) in model.fingers.iter().enumerate() {
        let own = near.joints[f].clone();
        if holding & (1 << f) == 0 {
            fingers.push((None, own));
            continue;
        }
        let name = &names[f].name;
        let (contact, own) =
            given::touching(finger, &model.view.object.surface, &own, &object).map_err(|no_touch| {
                let how = match no_touch {
                    NoTouch::Inside => "is deep in the object".to_owned(),
                    NoTouch::Off(gap) => format!("is {:.1} mm off the surface", 1e3 * gap),
                    NoTouch::Stuck(_) => "cannot be brought onto the surface within its joint limits".to_owned(),
                };
                refusal(format!("the tip of finger \"{name}\" {how}"), "observe again, or grasp anew")
            })?;
        if !finger.pad_faces(&own, &object.vector(&contact.normal_in_object)) {
            let message = format!("finger \"{name}\" touches outside its pad");
            return Err(refusal(message, "grasp anew, or declare a larger pad"));
        }
        let foot = model.view.object.surface.project(&contact.point_in_object);
        let body = model.view.object;
        if !body.may_start_at(&foot) {
            let least = body.least_observed_edge_distance();
            let message = format!("finger \"{name}\" touches nearer to an edge than {least} m");
            return Err(refusal(message, "grasp anew, or allow a smaller edge_distance"));
        }
        fingers.push((Some(contact), own));
    }
    let state = GraspState::of(near.object, fingers.into_iter());
    refuse_far(&moved(model, observed, &state), limits)?;
    workspace.set_state(&state);
    if !workspace.is_clear(TipMode::AllHold) {
        let name = |body: usize| model.bodies[body].name.as_str();
        let (a, b) = workspace.blocking_pair.map_or(("?", "?"), |pair| (name(pair.a), name(pair.b)));
        let message = format!("\"{a}\" and \"{b}\" are nearer than {} m", model.settings.clearance);
        return Err(refusal(
            message,
            "move them apart: they are farther in each other than can be an error of the estimate",
        ));
    }
    refuse_buried_object(model, End::Start, &state.world_from_object)?;
    refuse_object_out_of_reach(model, End::Start, &state.world_from_object)?;
    refuse_unbalanced(model, &state)?;
    Ok(state)
}

/// Refuses fingers that cannot hold, before anything else is looked at.
fn refuse_open(model: &Model, posture: &Posture, holding: u32) -> Result<(), Failure> {
    let object = Placement::from(&posture.object);
    let mut contacts = Vec::with_capacity(model.n_fingers());
    for (f, finger) in model.fingers.iter().enumerate() {
        let contact = finger.contact_at(&model.view.object.surface, &posture.joints[f], &object);
        if contact.is_none() && holding & (1 << f) != 0 {
            let name = &model.view.hand.fingers[f].name;
            return Err(refusal(format!("the tip of finger \"{name}\" is deep in the object"), "observe again"));
        }
        contacts.push(contact.map_or_else(crate::grasp::state::no_contact, |(contact, _)| contact));
    }
    let margin = model.closure_margin(&contacts, holding);
    // The fit moves contacts a little: what is clearly open is refused, the rest is judged where it ends.
    if margin > 0.0 {
        return Ok(());
    }
    Err(not_closed(model, holding, margin))
}

fn not_closed(model: &Model, holding: u32, margin: f64) -> Failure {
    let names = |holds: bool| {
        let chosen = (0..model.n_fingers()).filter(|f| (holding & (1 << f) != 0) == holds);
        chosen.map(|f| format!("\"{}\"", model.view.hand.fingers[f].name)).collect::<Vec<_>>().join(", ")
    };
    let without = if holding == model.all_fingers() { String::new() } else { format!(" without {}", names(false)) };
    let message = format!(
        "the grasp of {} is not force closed{without}: margin {margin:.4} of {}, at friction {}",
        names(true),
        model.settings.closure_margin,
        friction_in_words(model)
    );
    refusal(message, "hold, bring the missing finger back, or grasp anew")
}

/// Refuses a start that planning would refuse: not closed, without forces, with no finger that may lift.
fn refuse_unbalanced(model: &Model, state: &GraspState) -> Result<(), Failure> {
    let margin = model.closure_margin(&state.contacts, state.holding);
    if margin < model.settings.closure_margin {
        return Err(not_closed(model, state.holding, margin));
    }
    if state.is_held_by_all() && model.may_release && releasable(model, &state.contacts, state.holding) == 0 {
        let message = "no finger can lift: no set of n-1 fingers has force closure".to_owned();
        return Err(refusal(message, "grasp anew"));
    }
    if let Some(forces) = &model.forces {
        let object = Placement::from(&state.world_from_object);
        let held = Held::new(model, forces, &object, &state.contacts, state.holding, |finger| &state.joints[finger]);
        held.forces(model, forces, None).map_err(|cause| refusal(cause.in_words(model), "grasp anew"))?;
    }
    Ok(())
}

fn refuse_far(moved: &Moved, limits: &ProjectionLimits) -> Result<(), Failure> {
    let measures = [
        ("the object", 1e3 * moved.object, 1e3 * limits.distance, "mm"),
        ("a fingertip", 1e3 * moved.tip, 1e3 * limits.distance, "mm"),
        ("the object", moved.object_turn, limits.turn, "rad"),
        ("a joint", moved.joint, limits.turn, "rad"),
    ];
    match measures.into_iter().find(|(_, by, most, _)| !(by <= most)) {
        None => Ok(()),
        Some((what, by, most, unit)) => {
            let message =
                format!("the nearest grasp moves {what} by {by:.3} {unit}; at most {most} {unit} are allowed");
            Err(refusal(message, "observe again, or allow more"))
        }
    }
}

/// How far `state` is from what was observed.
fn moved(model: &Model, observed: &Observed, state: &GraspState) -> Moved {
    let center = model.view.object.center_of_mass;
    let mut moved = Moved {
        object: (state.world_from_object * center - observed.hand_from_object * center).norm(),
        object_turn: frame::rotation_between(&state.world_from_object, &observed.hand_from_object).norm(),
        ..Moved::default()
    };
    let mut left = observed.joints.as_slice();
    for (finger, own) in model.fingers.iter().zip(&state.joints) {
        let (seen, rest) = left.split_at(own.len());
        left = rest;
        moved.tip = moved.tip.max((finger.ik.tip(seen) - finger.ik.tip(own)).norm());
        moved.joint = seen.iter().zip(own).map(|(a, b)| (a - b).abs()).fold(moved.joint, f64::max);
    }
    moved
}

/// The start with what every finger does.
fn described(
    model: &Model,
    observed: &Observed,
    posture: &Posture,
    state: GraspState,
    limits: &ProjectionLimits,
) -> Projection {
    let touching = (0..model.n_fingers()).map(|f| match &observed.velocities {
        _ if !state.holds(f) => Touching::Free,
        Some(velocities) if relative_velocity(model, posture, f, velocities) > limits.sliding => Touching::Slides,
        _ => Touching::Holds,
    });
    Projection { touching: touching.collect(), moved: moved(model, observed, &state), state }
}
