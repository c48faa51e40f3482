//! Fingertips that are no balls, and pads: ellipsoids and meshes roll and hold, and touch where they may.

use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_mutations::mutants;
use regrasp_plan::check::{CheckSettings, Level, Report, check};
use regrasp_plan::plan::ContactMode;
use regrasp_plan::{Plan, check::ViolationKind};
use regrasp_planners::Failure;
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand, validate_once};
use regrasp_robot::LoadOptions;
use regrasp_robot::tip::{Pad, TipShape};
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;

fn load(name: &str) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn plan(loaded: &LoadedScene, settings: &InHandSettings, seed: u64) -> Result<Plan, Failure> {
    plan_in_hand(&loaded.view(), &loaded.in_hand(seed), settings, seed, &Budget::work(2_000_000), &|_| {})
}

fn judge(loaded: &LoadedScene, plan: &Plan) -> Report {
    loaded.judge(&loaded.in_hand(plan.seed), plan, &CheckSettings::default())
}

/// Outward normals of the tips where they hold, in the frame of their last link, with the finger.
fn facing(loaded: &LoadedScene, plan: &Plan) -> Vec<(usize, Vector)> {
    let mut found = Vec::new();
    for waypoint in plan.segments.iter().flat_map(|segment| &segment.waypoints) {
        let pose = Pose::from(&waypoint.world_from_object);
        let mut joints = waypoint.joints.as_slice();
        for (f, (finger, contact)) in loaded.scene.hands[0].hand.fingers.iter().zip(&waypoint.contacts).enumerate() {
            let (own, others) = joints.split_at(finger.chain.n_coordinates());
            joints = others;
            if let Some(normal) = contact.normal_in_object.filter(|_| contact.holds()) {
                let normal = pose * Vector::from(normal);
                found.push((f, -finger.chain.last_frame(own).vector_to_child(&normal)));
            }
        }
    }
    found
}

#[test]
fn ellipsoids_and_meshes_roll_without_slipping_and_hold() {
    for name in ["oval_sphere_90x.toml", "oval_box_90x.toml", "egg_sphere_180z.toml"] {
        let loaded = load(name);
        let settings = InHandSettings::default();
        let mut travelled: f64 = 0.0;
        for seed in 0..6 {
            let plan =
                plan(&loaded, &settings, seed).unwrap_or_else(|failure| panic!("{name}, seed {seed}: {failure}"));
            assert_eq!(validate_once(&loaded.view(), &plan, &settings), Ok(()), "{name}, seed {seed}");
            let report = judge(&loaded, &plan);
            assert!(report.accepted(), "{name}, seed {seed}: {report:#?}");
            assert!(report.max_slip.is_some_and(|slip| slip < 1e-4), "{name}, seed {seed}: {:?}", report.max_slip);
            assert!(report.max_force_residual.is_some_and(|residual| residual < 1e-6));
            for segment in &plan.segments {
                for (from, to) in segment.waypoints[0].contacts.iter().zip(&segment.waypoints.last().unwrap().contacts)
                {
                    if let (ContactMode::Rolling, Some(a), Some(b)) =
                        (from.mode, from.point_in_object, to.point_in_object)
                    {
                        travelled = travelled.max((Vector::from(b) - Vector::from(a)).norm());
                    }
                }
            }
        }
        assert!(travelled > 3e-3, "{name}: contacts travel by {travelled}");
    }
}

#[test]
fn contacts_may_also_stay_on_the_object_while_such_a_tip_turns_over_them() {
    for name in ["oval_box_90x.toml", "egg_sphere_180z.toml"] {
        let loaded = load(name);
        for seed in 0..4 {
            let plan =
                plan(&loaded, &InHandSettings::plain(), seed).unwrap_or_else(|failure| panic!("{name}: {failure}"));
            let report = judge(&loaded, &plan);
            // No forces, and the tips pivot.
            assert_eq!(report.reached, Some(Level::Geometry), "{name}, seed {seed}: {report:#?}");
            assert!(report.max_slip.is_none());
        }
    }
}

#[test]
fn every_mutant_of_such_a_plan_is_rejected_for_a_fitting_reason() {
    for name in ["oval_box_90x.toml", "egg_sphere_180z.toml"] {
        let loaded = load(name);
        let good = plan(&loaded, &InHandSettings::default(), 1).unwrap();
        let query = loaded.task().query(1);
        let found = mutants(&good, loaded.manipulation(), &mut Rng::keyed(1, "tips", 0));
        assert!(found.iter().any(|mutant| mutant.name == "pad that ends beside the contact"));
        for mutant in found {
            let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
            let report = check((scene, &loaded.state), Some(&query), &mutant.plan, &CheckSettings::default());
            let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            assert!(fits, "{name}, {}: {report:#?}", mutant.name);
        }
    }
}

#[test]
fn a_hull_that_stands_off_its_ellipsoid_is_seen() {
    let mut loaded = load("egg_sphere_180z.toml");
    let good = plan(&loaded, &InHandSettings::default(), 1).unwrap();
    let TipShape::Hull { hull, .. } = &mut loaded.scene.hands[0].hand.fingers[2].tip.shape else { panic!("a hull") };
    let larger: Vec<_> = hull.vertices().iter().map(|p| p * 1.15).collect();
    *hull = std::sync::Arc::new(regrasp_geometry::ConvexHull::new(&larger).unwrap());
    let report = judge(&loaded, &good);
    assert!(report.violations.iter().any(|violation| violation.kind == ViolationKind::ContactOffTip), "{report:#?}");
}

#[test]
fn fingers_touch_with_their_pads_only() {
    let mut loaded = load("oval_sphere_90x.toml");
    let settings = InHandSettings::default();
    let axis = UnitVector::new_normalize(Vector::new(0.6, 0.0, 0.8));
    let pad = Pad { axis_in_body: axis, cosine: 65f64.to_radians().cos() };
    // Without pads some tip touches farther from the axis.
    let anywhere = (0..6).map(|seed| plan(&loaded, &settings, seed).unwrap());
    let farthest = anywhere
        .flat_map(|plan| facing(&loaded, &plan))
        .map(|(_, outward)| outward.dot(&axis))
        .fold(f64::INFINITY, f64::min);
    assert!(farthest < pad.cosine - 0.1, "{farthest}");
    loaded.scene.hands[0].hand.fingers.iter_mut().for_each(|finger| finger.tip.pad = Some(pad));
    for seed in 0..6 {
        let plan = plan(&loaded, &settings, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        let report = judge(&loaded, &plan);
        assert!(report.accepted(), "seed {seed}: {report:#?}");
        for (_, outward) in facing(&loaded, &plan) {
            assert!(pad.holds(&outward), "{outward}");
        }
    }
}

#[test]
fn a_finger_whose_pad_faces_the_palm_stays_away_and_the_others_hold() {
    let mut loaded = load("oval_sphere_90x.toml");
    let away = UnitVector::new_normalize(Vector::new(-1.0, 0.0, -1.0));
    loaded.scene.hands[0].hand.fingers[1].tip.pad = Some(Pad { axis_in_body: away, cosine: 0.995 });
    let plan = plan(&loaded, &InHandSettings::default(), 0).unwrap();
    assert!(judge(&loaded, &plan).accepted());
    assert!(facing(&loaded, &plan).iter().all(|&(f, _)| f != 1));
}
