//! Rolling fingertips against the velocity constraint, integrated another way.

use crate::in_hand::PhysicsSettings;
use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::sample::draw_state;
use crate::in_hand::regrasping::change::whole_transfer;
use crate::in_hand::roadmap_tests::with_settings;
use crate::settings::InHandSettings;
use nalgebra::Matrix3xX;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, Vector, interpolate_pose};
use regrasp_grasp::contact::rolling_ellipsoid;
use regrasp_grasp::contact::rolling_ellipsoid::Stance;
use regrasp_manipulation::grasp::sequence::Motion;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::settings::TransferMode;
use regrasp_robot::kinematics::finger_ik::Coordinates;

fn rolling() -> InHandSettings {
    InHandSettings {
        physics: PhysicsSettings { transfer: TransferMode::Rolling, ..PhysicsSettings::default() },
        ..InHandSettings::default()
    }
}

/// A pose a few steps away.
fn elsewhere(search: &mut Search, pose: &Pose, distance: f64, angle: f64) -> Pose {
    let shift = Vector::from(search.rng.direction()) * distance;
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector::from(search.rng.direction()) * angle);
    Pose::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation)
}

/// Joints after the object's motion from `from` to `to`: the velocities of the two material points that touch are equal,
/// `J(q) q' = v`, with a Jacobian and an object velocity by finite differences, by `n` steps of the classical Runge-Kutta
/// method. The contact is where the surface is nearest to the tip's centre, or to the ellipsoid.
fn integrate(model: &Model, finger: usize, joints: &Coordinates, from: &Pose, to: &Pose, n: usize) -> Coordinates {
    let (ik, radius) = (model.fingers[finger].ik, model.fingers[finger].tip_radius);
    let chain = ik.chain();
    let rate = |q: &[f64], t: f64| -> Vec<f64> {
        let pose = interpolate_pose(from, to, t);
        let center = ik.tip(q);
        let surface = &model.view.object.surface;
        let foot = surface.project(&pose.inverse_transform_point(&center));
        let point: Point = pose * foot.point_in_object;
        let mut normal = (center - point).normalize();
        // The material points at the contact, fixed in the link and in the object.
        let touching = match model.fingers[finger].curved {
            None => center - normal * radius,
            Some(ellipsoid) => {
                let placement = Placement::from(&pose);
                let stance = Stance {
                    center: pose.inverse_transform_point(&center),
                    object_from_link: placement.rotation.tr_mul(&chain.last_frame(q).rotation),
                    normal: placement.vector_to_child(&normal),
                };
                normal = rolling_ellipsoid::Touch::of(surface, ellipsoid, &stance).unwrap().stance.normal;
                normal = placement.vector(&normal);
                center + model.fingers[finger].arm_with(q, &normal)
            }
        };
        let in_link = chain.last_frame(q).point_to_child(&touching);
        let in_object = pose.inverse_transform_point(&touching);
        let h = 1e-6;
        let velocity =
            (interpolate_pose(from, to, t + h) * in_object - interpolate_pose(from, to, t - h) * in_object) / (2.0 * h);
        let mut jacobian = Matrix3xX::zeros(q.len());
        for k in 0..q.len() {
            let moved = |by: f64| {
                let mut other = q.to_vec();
                other[k] += by;
                chain.last_frame(&other).point(&in_link)
            };
            jacobian.set_column(k, &((moved(h) - moved(-h)) / (2.0 * h)));
        }
        jacobian.svd(true, true).solve(&velocity, 1e-9).unwrap().iter().copied().collect()
    };
    let mut q = joints.to_vec();
    let h = 1.0 / n as f64;
    let added =
        |q: &[f64], rate: &[f64], by: f64| -> Vec<f64> { q.iter().zip(rate).map(|(a, b)| a + by * b).collect() };
    for k in 0..n {
        let t = k as f64 * h;
        let a = rate(&q, t);
        let b = rate(&added(&q, &a, 0.5 * h), t + 0.5 * h);
        let c = rate(&added(&q, &b, 0.5 * h), t + 0.5 * h);
        let d = rate(&added(&q, &c, h), t + h);
        q = (0..q.len()).map(|i| q[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i])).collect();
    }
    q.into_iter().collect()
}

#[test]
fn a_transfer_ends_where_the_velocity_constraint_leads() {
    for scene in ["sphere_90x.toml", "box_90x.toml", "cubic.toml", "oval_sphere_90x.toml", "oval_box_90x.toml"] {
        with_settings(scene, &rolling(), |search| {
            let mut n_compared = 0;
            let mut longest: f64 = 0.0;
            for _ in 0..200 {
                let Some(state) = draw_state(search) else { continue };
                let goal = elsewhere(search, &state.world_from_object, 0.004, 0.2);
                let Some(way) = whole_transfer(search, &state, &goal) else { continue };
                let model = search.model();
                for finger in 0..model.n_fingers() {
                    let start = &state.joints[finger];
                    let expected = integrate(model, finger, start, &state.world_from_object, &goal, 24);
                    let end = &way.end().joints[finger];
                    let off = (model.fingers[finger].ik.tip(end) - model.fingers[finger].ik.tip(&expected)).norm();
                    assert!(off < 5e-6, "{scene}: the tip ends {off:e} m beside");
                    let travelled = way.end().contacts[finger].point_in_object - state.contacts[finger].point_in_object;
                    longest = longest.max(travelled.norm());
                    n_compared += 1;
                }
            }
            assert!(n_compared >= 20, "{scene}: too little was compared: {n_compared}");
            assert!(longest > 0.5e-3, "{scene}: no contact travelled: {longest}");
        });
    }
}

#[test]
fn tips_stay_one_radius_from_the_surface_and_contacts_under_them() {
    with_settings("box_90x.toml", &rolling(), |search| {
        let mut n_moments = 0;
        for _ in 0..200 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 0.003, 0.25);
            let Some(way) = whole_transfer(search, &state, &goal) else { continue };
            let model = search.model();
            let Motion::Transfer(moments) = way.steps()[0].motion() else { panic!("a transfer") };
            for moment in moments {
                n_moments += 1;
                for (finger, contact) in moment.contacts.iter().enumerate() {
                    let FingerParts { center, radius } = parts(model, finger, &moment.joints[finger]);
                    let center = moment.world_from_object.inverse_transform_point(&center);
                    let at = contact.point_in_object + contact.normal_in_object.into_inner() * radius;
                    assert!((center - at).norm() < 2e-9);
                    let distance = model.view.object.surface.signed_distance(&center);
                    assert!((distance - radius).abs() < 2e-9);
                }
            }
        }
        assert!(n_moments > 50, "too little was seen: {n_moments}");
    });
}

struct FingerParts {
    center: Point,
    radius: f64,
}

fn parts(model: &Model, finger: usize, joints: &Coordinates) -> FingerParts {
    FingerParts { center: model.fingers[finger].ik.tip(joints), radius: model.fingers[finger].tip_radius }
}

#[test]
fn what_rolled_there_rolls_back() {
    with_settings("sphere_90x.toml", &rolling(), |search| {
        let mut n_back = 0;
        for _ in 0..60 {
            let Some(state) = draw_state(search) else { continue };
            let goal = elsewhere(search, &state.world_from_object, 0.004, 0.2);
            let Some(way) = whole_transfer(search, &state, &goal) else { continue };
            let Some(back) = whole_transfer(search, way.end(), &state.world_from_object) else { continue };
            for (a, b) in back.end().joints.iter().flatten().zip(state.joints.iter().flatten()) {
                assert!((a - b).abs() < 1e-5, "{a} {b}");
            }
            n_back += 1;
        }
        assert!(n_back >= 10, "too little was tried: {n_back}");
    });
}
