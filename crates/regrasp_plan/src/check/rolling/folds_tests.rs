//! A smooth hull that moves over a sheet with folds, where it nearly touches in several places at once.

use super::smooth_reach::tests::{bar, folded};
use super::*;
use crate::check::kinematics::Path;
use crate::plan::{ContactState, PoseData};
use nalgebra::{Isometry3, Translation3};
use regrasp_base::Rng;
use regrasp_geometry::Shape;
use regrasp_robot::{ContactModel, LinkId};
use std::sync::Arc;

/// A finger without joints, whose last body stands at the world's origin.
fn finger() -> FingerModel {
    let tip = bar();
    FingerModel {
        name: "bar".into(),
        path: Path { joints: Vec::new(), last_from_link: Matrix4::identity() },
        center: Point::origin(),
        radius: 0.02,
        surface: TipSurface::Smooth(Arc::new(tip)),
        pad: None,
        contact: ContactModel::Point,
        tip_link: LinkId(0),
        tip_elements: Vec::new(),
        body_from_tip_link: Matrix4::identity(),
        center_at_rest: Point::origin(),
        coordinates: 0..0,
        moving_joints: Vec::new(),
    }
}

fn waypoint(time: f64, world_from_object: &Pose, normal: Option<Vector>) -> Waypoint {
    let contact = ContactState::at(ContactMode::Rolling, [0.0; 3], normal.unwrap_or_else(Vector::z).into());
    Waypoint {
        time,
        joints: Vec::new(),
        joint_velocities: Vec::new(),
        joint_torques: Vec::new(),
        world_from_object: PoseData::from(world_from_object),
        contacts: vec![contact],
    }
}

/// What a step slips, how far its contact travels and how the tip turns is the same whatever was asked before. The checker once
/// rejected a good plan of the LEAP hand, because it went on from the end of the look before and so began in the other place.
#[test]
fn what_is_measured_of_a_step_does_not_depend_on_what_was_asked_before() {
    let finger = finger();
    let TipSurface::Smooth(tip) = &finger.surface else { unreachable!() };
    let mut rng = Rng::keyed(3, "folds", 0);
    let mut n_moving = 0;
    for _ in 0..12 {
        let shape = SortedShape::of(&Shape::Mesh(Arc::new(folded(&mut rng, 0.1e-3))));
        // The object stands so that the bar faces it, with a random side, and then rocks a little.
        let turn = UnitQuaternion::from_scaled_axis(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
        let facing = turn * tip.point(&-(turn.inverse() * Vector::z()));
        let start = Pose::from_parts(Translation3::from(-facing), turn).inverse();
        let rocked = Isometry3::new(
            Vector::from(rng.direction()) * rng.uniform(0.0, 1e-4),
            Vector::from(rng.direction()) * rng.uniform(0.0, 0.02),
        );
        let ends = [start, rocked * start];
        let normals = {
            let [from, to] = [0, 1].map(|k| waypoint(k as f64, &ends[k], None));
            let roll = Roll::new((0, &finger), &from, &to, &shape, 5e-4);
            [0.0, 1.0].map(|t| roll.contact(t).map(|(_, normal)| normal))
        };
        let [from, to] = [0, 1].map(|k| waypoint(k as f64, &ends[k], normals[k]));
        let roll = || Roll::new((0, &finger), &from, &to, &shape, 5e-4);
        let measured = |roll: &Roll| (roll.slip(1e-7), roll.travel(), roll.turning());
        let fresh = measured(&roll());
        n_moving += usize::from(fresh.1 > 1e-4);
        for t in [1.0, 0.7, 0.4] {
            let asked = roll();
            asked.contact(t);
            assert_eq!(measured(&asked), fresh, "after {t}");
        }
        let asked = roll();
        asked.off_surface(5e-4);
        assert_eq!(measured(&asked), fresh);
    }
    assert!(n_moving > 4, "{n_moving}");
}
