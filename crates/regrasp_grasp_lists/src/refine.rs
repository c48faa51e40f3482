//! Refinement: contacts move along the surface and the hand follows, then wrist and contacts move at random, to raise the closure margin.
//! The weighted sum of the other terms of the score does not fall, and no contact moves farther than a tip radius.

use crate::driven;
use crate::found::{Found, WayIn};
use crate::motors::Motors;
use crate::prepared::Prepared;
use crate::search::worth::{self, holding};
use crate::{above, way};
use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::surface::SurfacePoint;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_grasp::list::score::inverse_curvature;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};
use regrasp_manipulation::rolling::follow::ik_settings;
use regrasp_manipulation::workspace::{TipMode, Workspace};

/// Farthest that the wrist moves in one trial: metres and radians. By hand.
const WRIST_STEP: (f64, f64) = (0.006, 0.12);
/// Shares of the trials that move the wrist while contacts stay, the wrist with its contacts, all contacts; the others move one contact.
/// By hand.
const SHARES: [f64; 3] = [0.15, 0.05, 0.25];
/// Contacts of sharp tips move by this much at most, in metres.
const SMALL_TIP: f64 = 0.003;
/// Terms of the score may fall by this much: rounding.
const ROUNDING: f64 = 1e-9;
/// A margin must grow by this share to count.
const LEAST_GAIN: f64 = 1.002;

/// One trial of contacts alone for so many trials of the whole grasp. By measurement on apple, mug, horse and cube: with 4 margins grow about as
/// much, and it takes longer.
const CONTACT_TRIALS: usize = 8;
/// How much of the way to the best contacts the hand is asked to follow, in this order.
const SHARES_OF_WAY: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
/// Steps uphill after which the way in is tested. By hand.
const CLIMBS_PER_WAY: usize = 4;

/// A grasp on its way uphill.
#[derive(Clone)]
struct Climb {
    state: GraspState,
    /// Inverse curvature at the contacts of the holding fingers.
    flatness: Vec<f64>,
    margin: f64,
    others: f64,
    way: WayIn,
}

/// `found` with its exact margin, refined where that helps and is not `cut` short, with the stable poses in which the hand stays above
/// the support.
pub fn finish(prepared: &Prepared, workspace: &mut Workspace, found: &Found, cut: bool) -> Found {
    let before = worth::margin(prepared, &found.state).max(found.margin);
    let mut best = Found { margin: before, ..found.clone() };
    if !cut && let Some(refined) = refined(prepared, workspace, found, before) {
        best = refined;
    }
    best.scores.closure = regrasp_grasp::list::score::closure_term(best.margin);
    best.score = best.scores.mean(&prepared.settings.weights);
    best.stable_poses = above::stays_above(prepared, &best.state, &best.way);
    best
}

/// A grasp with a larger margin than `before`, complete; none where none was found.
fn refined(prepared: &Prepared, workspace: &mut Workspace, found: &Found, before: f64) -> Option<Found> {
    let mut rng = Rng::keyed(prepared.seed, "refinement", found.frame);
    let flatness: Vec<f64> =
        holding(&found.state).map(|f| flatness_at(prepared, f, &found.state.contacts[f])).collect();
    let terms = |state: &GraspState, flatness: &[f64]| {
        worth::other_terms(prepared, state, flatness).mean(&prepared.settings.weights)
    };
    let mut climb = Climb {
        margin: before,
        others: terms(&found.state, &flatness),
        state: found.state.clone(),
        flatness,
        way: found.way.clone(),
    };
    let first = climb.others;
    // Mostly the way so far still leads there: it is tested now and then, and at the end.
    let (mut reached, mut n_untested) = (climb.clone(), 0);
    if let Some(led) = led_by_contacts(prepared, workspace, found, &climb, &mut rng) {
        (climb, n_untested) = (led, 1);
    }
    for trial in 0..prepared.settings.refinement_trials {
        // Large steps first.
        let size = 1.0 - 0.9 * trial as f64 / prepared.settings.refinement_trials as f64;
        let by = Move::draw(&climb.state, prepared.motors.is_some(), size, &mut rng);
        let Some((state, flatness, margin)) = trial_of(prepared, found, &climb, &by) else { continue };
        let others = terms(&state, &flatness);
        let is_better =
            margin > climb.margin * LEAST_GAIN || (margin >= climb.margin && others > climb.others + ROUNDING);
        if !is_better || others < first - ROUNDING {
            continue;
        }
        workspace.set_state(&state);
        if !workspace.is_clear(TipMode::AllHold) || !worth::is_balanced(prepared, &state) {
            continue;
        }
        climb = Climb { state, flatness, margin, others, way: climb.way };
        n_untested += 1;
        if n_untested == CLIMBS_PER_WAY {
            climb = with_way(prepared, workspace, climb).unwrap_or_else(|| reached.clone());
            (reached, n_untested) = (climb.clone(), 0);
        }
    }
    if n_untested > 0 {
        climb = with_way(prepared, workspace, climb).unwrap_or(reached);
    }
    if climb.margin <= before * LEAST_GAIN {
        return None;
    }
    let Climb { state, flatness, margin, way, .. } = climb;
    let forces = worth::forces(prepared, &state)?;
    let scores = worth::terms(prepared, &state, &flatness, margin);
    Some(Found { state, margin, margin_before: Some(before), scores, forces, way, ..found.clone() })
}

/// The grasp nearest to the contacts of largest margin that the hand can follow to; none where it follows to none.
fn led_by_contacts(
    prepared: &Prepared,
    workspace: &mut Workspace,
    found: &Found,
    climb: &Climb,
    rng: &mut Rng,
) -> Option<Climb> {
    if prepared.motors.is_some() {
        return None;
    }
    let goal = best_contacts(prepared, found, climb, rng)?;
    for share in SHARES_OF_WAY {
        for wrist_follows in [true, false] {
            let Some((state, flatness, margin)) = following(prepared, found, climb, &goal, (share, wrist_follows))
            else {
                continue;
            };
            let others = worth::other_terms(prepared, &state, &flatness).mean(&prepared.settings.weights);
            if margin <= climb.margin * LEAST_GAIN || others < climb.others - ROUNDING {
                continue;
            }
            workspace.set_state(&state);
            if workspace.is_clear(TipMode::AllHold) && worth::is_balanced(prepared, &state) {
                return Some(Climb { state, flatness, margin, others, way: climb.way.clone() });
            }
        }
    }
    None
}

/// Contacts of large margin near those of `climb`, wherever the hand can be; none where there are no better ones.
fn best_contacts(prepared: &Prepared, found: &Found, climb: &Climb, rng: &mut Rng) -> Option<GraspState> {
    let mut best = climb.state.clone();
    let mut margin = climb.margin;
    for trial in 0..prepared.settings.refinement_trials / CONTACT_TRIALS {
        let size = 1.0 - 0.9 * (trial * CONTACT_TRIALS) as f64 / prepared.settings.refinement_trials as f64;
        let by = Move::slide(&best, size, rng);
        let mut state = best.clone();
        let places: Option<()> = holding(&best).try_for_each(|f| {
            if let Some(target) = by.target(prepared, &state, f) {
                let at = contact_near(prepared, found, f, &target)?;
                state.contacts[f] =
                    Contact { point_in_object: at.point_in_object, normal_in_object: at.normal_in_object };
            }
            Some(())
        });
        if places.is_none() {
            continue;
        }
        let reached = worth::margin(prepared, &state);
        if reached > margin {
            (best, margin) = (state, reached);
        }
    }
    (margin > climb.margin * LEAST_GAIN).then_some(best)
}

/// `climb` with its contacts moved by a share of the way to those of `goal`, and the hand where it touches them.
fn following(
    prepared: &Prepared,
    found: &Found,
    climb: &Climb,
    goal: &GraspState,
    (share, wrist_follows): (f64, bool),
) -> Option<(GraspState, Vec<f64>, f64)> {
    let mut state = climb.state.clone();
    let mut flatness = climb.flatness.clone();
    let fingers: ArrayVec<usize, MAX_FINGERS> = holding(&state).collect();
    for (which, &f) in fingers.iter().enumerate() {
        let (from, to) = (climb.state.contacts[f].point_in_object, goal.contacts[f].point_in_object);
        let at = contact_near(prepared, found, f, &(from + share * (to - from)))?;
        state.contacts[f] = Contact { point_in_object: at.point_in_object, normal_in_object: at.normal_in_object };
        let curvature = prepared.model.view.object.surface.curvature(&at);
        flatness[which] = inverse_curvature(curvature, prepared.model.fingers[f].tip_radius);
    }
    let margin = worth::margin(prepared, &state);
    if margin <= climb.margin {
        return None;
    }
    if wrist_follows {
        let center = |state: &GraspState, f: usize| {
            let contact = &state.contacts[f];
            contact.point_in_object + prepared.model.fingers[f].settle_radius * contact.normal_in_object.into_inner()
        };
        let pairs: ArrayVec<(Point, Point), MAX_FINGERS> = fingers
            .iter()
            .map(|&f| (center(&state, f), climb.state.world_from_object * center(&climb.state, f)))
            .collect();
        state.world_from_object = aligned(&pairs)?;
    }
    for &f in &fingers {
        touch(prepared, &mut state, f)?;
    }
    Some((state, flatness, margin))
}

/// The pose that brings the first point of every pair nearest to the second (Kabsch 1976).
fn aligned(pairs: &[(Point, Point)]) -> Option<Pose> {
    let mean = |of: &dyn Fn(&(Point, Point)) -> Vector| -> Vector {
        pairs.iter().map(of).sum::<Vector>() / pairs.len().max(1) as f64
    };
    let (from, to) = (mean(&|pair| pair.0.coords), mean(&|pair| pair.1.coords));
    let covariance: Matrix3<f64> = pairs.iter().map(|(a, b)| (b.coords - to) * (a.coords - from).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = UnitQuaternion::from_matrix(&(u * signs * v_t));
    Some(Pose::from_parts(Translation3::from(to - rotation * from), rotation))
}

/// `climb` with a way that leads there; none where there is none.
fn with_way(prepared: &Prepared, workspace: &mut Workspace, climb: Climb) -> Option<Climb> {
    if way::is_free(prepared, workspace, &climb.state, &climb.way) {
        return Some(climb);
    }
    let way = way::way_in(prepared, workspace, &climb.state, None).ok()?;
    Some(Climb { way, ..climb })
}

/// How a trial differs from the grasp so far.
#[derive(Debug, Clone)]
struct Move {
    /// Shift and turn of the object in the hand; zero where the wrist stays.
    wrist: [Vector; 2],
    /// True if contacts go with the wrist.
    carries: bool,
    /// By finger: the angle about the normal at which the contact moves, and how far, in tip radii.
    slides: ArrayVec<Option<[f64; 2]>, MAX_FINGERS>,
}

impl Move {
    fn draw(state: &GraspState, has_motors: bool, size: f64, rng: &mut Rng) -> Self {
        let slides: ArrayVec<Option<[f64; 2]>, MAX_FINGERS> = (0..state.contacts.len()).map(|_| None).collect();
        let kind = rng.unit();
        let [stay, carry, all] = SHARES;
        if has_motors || kind < stay + carry {
            let shift = Vector::from(rng.direction()) * (WRIST_STEP.0 * size * rng.unit());
            let turn = Vector::from(rng.direction()) * (WRIST_STEP.1 * size * rng.unit());
            return Move { wrist: [shift, turn], carries: kind >= stay, slides };
        }
        Move::of_contacts(state, size, kind < stay + carry + all, rng)
    }

    /// Contacts move, one or all, as often as in [`Move::draw`].
    fn slide(state: &GraspState, size: f64, rng: &mut Rng) -> Self {
        let [stay, carry, all] = SHARES;
        let is_all = rng.unit() * (1.0 - stay - carry) < all;
        Move::of_contacts(state, size, is_all, rng)
    }

    fn of_contacts(state: &GraspState, size: f64, is_all: bool, rng: &mut Rng) -> Self {
        let mut slides: ArrayVec<Option<[f64; 2]>, MAX_FINGERS> = (0..state.contacts.len()).map(|_| None).collect();
        let fingers: ArrayVec<usize, MAX_FINGERS> = holding(state).collect();
        let one = fingers[rng.below(fingers.len())];
        for f in fingers {
            if is_all || f == one {
                slides[f] = Some([rng.uniform(0.0, std::f64::consts::TAU), size * rng.unit()]);
            }
        }
        Move { wrist: [Vector::zeros(); 2], carries: false, slides }
    }

    /// Where the contact of a finger slides to, in the object's frame and beside its surface.
    fn target(&self, prepared: &Prepared, state: &GraspState, finger: usize) -> Option<Point> {
        let [angle, share] = self.slides[finger]?;
        let contact = &state.contacts[finger];
        let (x, y) = regrasp_geometry::frame::tangents(&contact.normal_in_object);
        let aside = x.into_inner() * angle.cos() + y.into_inner() * angle.sin();
        Some(contact.point_in_object + aside * (share * farthest(prepared, finger)))
    }
}

/// A grasp near `climb`, moved, with its inverse curvatures and its margin; none where that is smaller.
fn trial_of(prepared: &Prepared, found: &Found, climb: &Climb, by: &Move) -> Option<(GraspState, Vec<f64>, f64)> {
    let mut state = climb.state.clone();
    let mut flatness = climb.flatness.clone();
    let moves_wrist = by.wrist[0] != Vector::zeros();
    if moves_wrist {
        state.world_from_object = moved(prepared, &state.world_from_object, by.wrist[0], by.wrist[1]);
        if let Some(motors) = &prepared.motors {
            let (again, flatness) = closed_again(prepared, motors, found, &state)?;
            let margin = worth::margin(prepared, &again);
            return Some((again, flatness, margin));
        }
    }
    let fingers: ArrayVec<usize, MAX_FINGERS> = holding(&state).collect();
    for (which, &f) in fingers.iter().enumerate() {
        let contact = state.contacts[f];
        let target = match by.target(prepared, &state, f) {
            Some(target) => Some(target),
            None if by.carries => {
                let in_hand = climb.state.world_from_object * contact.point_in_object;
                Some(state.world_from_object.inverse_transform_point(&in_hand))
            }
            None => None,
        };
        if let Some(target) = target {
            let at = contact_near(prepared, found, f, &target)?;
            state.contacts[f] = Contact { point_in_object: at.point_in_object, normal_in_object: at.normal_in_object };
            let curvature = prepared.model.view.object.surface.curvature(&at);
            flatness[which] = inverse_curvature(curvature, prepared.model.fingers[f].tip_radius);
        }
    }
    // Joints come last: contacts that are no better need none.
    let moves_contacts = by.carries || by.slides.iter().any(Option::is_some);
    let margin = if moves_contacts { worth::margin(prepared, &state) } else { climb.margin };
    if margin < climb.margin {
        return None;
    }
    for f in fingers {
        if moves_wrist || by.slides[f].is_some() {
            touch(prepared, &mut state, f)?;
        }
    }
    Some((state, flatness, margin))
}

/// How far the contact of a finger may move, in metres: a tip radius.
fn farthest(prepared: &Prepared, finger: usize) -> f64 {
    prepared.model.fingers[finger].settle_radius.max(SMALL_TIP)
}

/// Where the tip of `finger` touches near `target`, if that is near enough to where it touched before refinement.
fn contact_near(prepared: &Prepared, found: &Found, finger: usize, target: &Point) -> Option<SurfacePoint> {
    let object = prepared.model.view.object;
    let near = object.surface.project(target);
    let at = object.surface.settle(&near, prepared.model.fingers[finger].settle_radius)?;
    let moved_by = (at.point_in_object - found.state.contacts[finger].point_in_object).norm();
    let is_near = moved_by <= farthest(prepared, finger);
    (is_near && object.surface.crease_distance(&at) >= object.edge_distance).then_some(at)
}

/// The hand closed anew where `state` has the object, if no contact moves farther than contacts may.
fn closed_again(
    prepared: &Prepared,
    motors: &Motors,
    found: &Found,
    state: &GraspState,
) -> Option<(GraspState, Vec<f64>)> {
    let again = driven::close_again(prepared, motors, state, &state.world_from_object)?;
    let is_near = |f: usize| {
        let moved_by = (again.contacts[f].point_in_object - found.state.contacts[f].point_in_object).norm();
        moved_by <= farthest(prepared, f)
    };
    if !holding(&again).all(is_near) {
        return None;
    }
    let flatness = driven::flatness(prepared, &again);
    Some((again, flatness))
}

/// The object in the hand frame, turned about the place where the fingers meet and shifted.
fn moved(prepared: &Prepared, hand_from_object: &Pose, shift: Vector, turn: Vector) -> Pose {
    let meeting = prepared.hand_from_grasp.translation;
    let motion = Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
    meeting * motion * meeting.inverse() * hand_from_object
}

/// Joints of `finger` that touch its contact, near those that it has.
fn touch(prepared: &Prepared, state: &mut GraspState, finger: usize) -> Option<()> {
    let placement = Placement::from(&state.world_from_object);
    let contact = state.contacts[finger];
    let normal = UnitVector::new_unchecked(placement.vector(&contact.normal_in_object));
    let settings = ik_settings(prepared.model, finger, normal);
    let joints = prepared.model.fingers[finger].touch_near(&placement, &contact, &state.joints[finger], &settings)?;
    state.joints[finger] = joints;
    Some(())
}

fn flatness_at(prepared: &Prepared, finger: usize, contact: &Contact) -> f64 {
    let surface = &prepared.model.view.object.surface;
    let at = surface.project(&contact.point_in_object);
    inverse_curvature(surface.curvature(&at), prepared.model.fingers[finger].tip_radius)
}
