//! Turns about contact normals, measured another way.

use super::*;
use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::Candidate;
use crate::in_hand::grasps::choose::choose_grasp;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::moving::transfer::transfer;
use crate::in_hand::roadmap_tests::with_settings;
use crate::settings::InHandSettings;
use regrasp_geometry::interpolate_pose;

/// Parts of a step in which turns are measured.
const PARTS: usize = 16;

/// The turn of `finger` about its normal from one moment to the next: rotations of the link seen from the object, projected on
/// the direction from the nearest point of the surface to the tip's centre, in many parts.
fn turn(model: &Model, finger: usize, from: &Moment, to: &Moment) -> f64 {
    let surface = &model.view.object.surface;
    let ik = model.fingers[finger].ik;
    let at = |t: f64| {
        let pose = interpolate_pose(&from.world_from_object, &to.world_from_object, t);
        let joints: Vec<f64> =
            from.joints[finger].iter().zip(&to.joints[finger]).map(|(a, b)| a + t * (b - a)).collect();
        let center = pose.inverse_transform_point(&ik.tip(&joints));
        let normal = (center - surface.project(&center).point_in_object).normalize();
        let link = Placement::from(&pose).rotation.tr_mul(&ik.chain().last_frame(&joints).rotation);
        (link, normal)
    };
    (0..PARTS)
        .map(|k| {
            let [a, b, c] = [2 * k, 2 * k + 1, 2 * k + 2].map(|half| at(half as f64 / (2 * PARTS) as f64));
            frame::turn_between(&a.0, &c.0).dot(&b.1)
        })
        .sum()
}

/// A closed grasp of both fingers at a pose near the way.
fn draw_state(search: &mut Search) -> Option<GraspState> {
    let (pose, goal, n) = (search.draw_pose(), search.goal, search.model().n_fingers());
    let mut pool = Pool::new(&pose, &goal, n);
    search.workspace.place_object(&pose);
    let options: Vec<Vec<Candidate>> = (0..n).map(|finger| pool.towards_aim(search, finger, 6)).collect();
    if options.iter().any(Vec::is_empty) {
        return None;
    }
    choose_grasp(search, &pose, &options, None)
}

fn elsewhere(search: &mut Search, pose: &Pose, distance: f64, angle: f64) -> Pose {
    let shift = Vector::from(search.rng.direction()) * distance;
    let turn = UnitQuaternion::from_scaled_axis(Vector::from(search.rng.direction()) * angle);
    Pose::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation)
}

fn assert_still(model: &Model, start: &GraspState, moments: &[Moment]) {
    let first = start.moment();
    for finger in 0..model.n_fingers() {
        let mut total = 0.0;
        for (from, to) in std::iter::once(&first).chain(moments).zip(moments) {
            let spin = turn(model, finger, from, to);
            assert!(spin.abs() < 1e-4, "finger {finger} turns by {spin} in a step");
            total += spin;
        }
        assert!(total.abs() < 1e-3, "finger {finger} turns by {total} about its normal");
    }
}

#[test]
fn conditions_are_the_turns_that_steps_make() {
    with_settings("soft_pair_roll.toml", &InHandSettings::default(), |search| {
        let mut n_compared = 0;
        for _ in 0..200 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 1e-4, 3e-3);
            let model = search.model();
            let here = state.moment();
            let conditions = Conditions::of(model, state.holding, &here).unwrap();
            let Ok((_, spins)) = step_joints(model, state.holding, &here, &goal) else { continue };
            let expected = conditions.turns(&twist_between(model, &state.world_from_object, &goal));
            for (spin, expected) in spins.iter().zip(&expected) {
                assert!((spin - expected).abs() < 5e-5 + 0.02 * expected.abs(), "{spin} {expected}");
                n_compared += 1;
            }
        }
        assert!(n_compared >= 20, "too little was compared: {n_compared}");
    });
}

#[test]
fn soft_fingertips_do_not_turn_about_their_normals() {
    with_settings("soft_pair_roll.toml", &InHandSettings::default(), |search| {
        let mut n_moments = 0;
        for _ in 0..300 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 0.004, 0.3);
            let mut moments = Vec::new();
            transfer(&mut search.workspace, &state, &goal, &mut moments);
            assert_still(search.model(), &state, &moments);
            n_moments += moments.len();
        }
        assert!(n_moments > 50, "too little was seen: {n_moments}");
    });
}

#[test]
fn two_grasps_meet_at_one_pose() {
    with_settings("soft_pair_roll.toml", &InHandSettings::default(), |search| {
        let mut n_met = 0;
        for _ in 0..300 {
            let (Some(a), Some(b)) = (draw_state(search), draw_state(search)) else { continue };
            let model = search.model();
            let Some(Meeting { moments }) = meet(model, [&a, &b], &mut 0) else { continue };
            let last = |k: usize| moments[k].last().unwrap().world_from_object;
            assert_eq!(last(0), last(1));
            assert_still(model, &a, &moments[0]);
            assert_still(model, &b, &moments[1]);
            n_met += 1;
        }
        assert!(n_met >= 3, "too few meetings: {n_met}");
    });
}

#[test]
fn loops_end_exactly_at_poses_that_no_straight_transfer_reaches() {
    with_settings("soft_pair_roll.toml", &InHandSettings::default(), |search| {
        let mut n_closed = 0;
        for _ in 0..60 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 5e-4, 0.01);
            let model = search.model();
            let mut straight = Vec::new();
            if pursue(model, &state, &goal, &mut straight, |_| true) == 1.0 {
                continue;
            }
            let Some(found) = arrive_by_loop(model, &state, &goal, &mut search.rng, &mut 0) else { continue };
            assert_eq!(found.start, state);
            assert_eq!(found.moments.last().unwrap().world_from_object, goal);
            assert_still(model, &state, &found.moments);
            n_closed += 1;
        }
        assert!(n_closed >= 3, "too few loops close: {n_closed}");
    });
}

#[test]
fn the_turn_that_stops_a_transfer_is_the_one_that_a_step_would_make() {
    with_settings("soft_pair_roll.toml", &InHandSettings::default(), |search| {
        let mut n_compared = 0;
        for _ in 0..200 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 1e-4, 3e-3);
            let model = search.model();
            let mut moments = Vec::new();
            if pursue(model, &state, &goal, &mut moments, |_| true) == 1.0 {
                continue;
            }
            let end = moments.last().map_or_else(|| state.clone(), |last| state.at(last));
            let Some(needed) = turn_needed(model, &end, &goal) else { continue };
            let Ok((_, spins)) = step_joints(model, end.holding, &end.moment(), &goal) else { continue };
            let made = spins.iter().fold(0.0, |most: f64, spin| most.max(spin.abs()));
            assert!((made - needed).abs() < 5e-5 + 0.05 * needed, "{made} {needed}");
            n_compared += 1;
        }
        assert!(n_compared >= 10, "too little was compared: {n_compared}");
    });
}
