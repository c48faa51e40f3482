//! Contacts farther from edges than the object asks for, measured on the box itself.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::Pose;
use regrasp_plan::check::CheckSettings;
use regrasp_plan::plan::Waypoint;
use regrasp_plan::{ContactMode, Plan};
use regrasp_planners::in_hand::{InHandSettings, PhysicsSettings, plan_in_hand};
use regrasp_scene::{GraspRequest, InHandQuery, LoadedScene};

/// Half of the size of the box of `box_90x.toml`, in metres, and what contacts keep from its edges.
const HALF: [f64; 3] = [0.025, 0.025, 0.030];
const EDGE_DISTANCE: f64 = 0.004;

fn settings(edge_margin: f64) -> InHandSettings {
    InHandSettings {
        physics: PhysicsSettings { edge_margin, ..PhysicsSettings::default() },
        ..InHandSettings::default()
    }
}

fn plan(loaded: &LoadedScene, query: &InHandQuery, edge_margin: f64, seed: u64) -> Plan {
    let budget = Budget::work(3_000_000);
    let plan = plan_in_hand(&loaded.view(), query, &settings(edge_margin), seed, &budget, &|_| {});
    let plan = plan.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    let report = loaded.judge(query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "seed {seed}: {:#?}", report.violations);
    plan
}

/// For every finger that holds, how far its contact is from the nearest edge: the point lies on one pair of faces, and an edge is where
/// it would lie on a second one.
fn edge_distances(waypoint: &Waypoint) -> Vec<Option<f64>> {
    let of_point = |point: [f64; 3]| {
        let mut inside: Vec<f64> = point.iter().zip(HALF).map(|(x, half)| half - x.abs()).collect();
        inside.sort_by(f64::total_cmp);
        assert!(inside[0].abs() < 1e-6, "{point:?} is on a face");
        inside[1]
    };
    let contacts = waypoint.contacts.iter();
    contacts
        .map(|contact| contact.point_in_object.filter(|_| contact.mode != ContactMode::Free).map(of_point))
        .collect()
}

fn waypoints(plan: &Plan) -> impl Iterator<Item = &Waypoint> {
    plan.segments.iter().flat_map(|segment| &segment.waypoints)
}

fn nearest(plan: &Plan) -> f64 {
    waypoints(plan).flat_map(edge_distances).flatten().fold(f64::INFINITY, f64::min)
}

#[test]
fn contacts_keep_the_margin_where_the_planner_chooses_them() {
    let loaded = scene("box_90x.toml");
    let mut n_nearer = 0;
    for seed in 0..8 {
        let query = loaded.in_hand(seed);
        n_nearer += u32::from(nearest(&plan(&loaded, &query, 0.0, seed)) < EDGE_DISTANCE + 0.003);
        let kept = nearest(&plan(&loaded, &query, 0.003, seed));
        assert!(kept >= EDGE_DISTANCE + 0.003 - 1e-9, "seed {seed}: {kept}");
    }
    assert!(n_nearer >= 4, "only {n_nearer} of 8 plans without the margin come so near");
}

#[test]
fn contacts_of_a_given_start_may_only_go_away_from_an_edge() {
    let loaded = scene("box_90x.toml");
    let margin = 0.005;
    let mut n_near = 0;
    for seed in 0..20 {
        let query = loaded.in_hand(seed);
        let before = plan(&loaded, &query, 0.0, seed);
        let end = waypoints(&before).last().unwrap();
        if edge_distances(end).into_iter().flatten().all(|distance| distance >= EDGE_DISTANCE + margin) {
            continue;
        }
        let holds = end.contacts.iter().map(|contact| contact.mode != ContactMode::Free).collect();
        let back = InHandQuery {
            world_from_object_start: Pose::from(&end.world_from_object),
            world_from_object_goal: query.world_from_object_start,
            start_grasp: GraspRequest::Posture { joints: end.joints.clone(), holds },
            ..query
        };
        let after = plan(&loaded, &back, margin, seed);
        let all: Vec<Vec<Option<f64>>> = waypoints(&after).map(edge_distances).collect();
        for finger in 0..all[0].len() {
            // Since the start, or since it landed.
            let mut was: Option<f64> = None;
            let mut has_lifted = false;
            for now in all.iter().map(|fingers| fingers[finger]) {
                has_lifted |= now.is_none();
                if let Some(now) = now {
                    let enough = now >= EDGE_DISTANCE + margin - 1e-9;
                    assert!(enough || !has_lifted, "seed {seed}: finger {finger} landed {now} from an edge");
                    assert!(enough || was.is_none_or(|was| now >= was - 1e-9), "seed {seed}: finger {finger} at {now}");
                }
                was = now;
            }
        }
        n_near += 1;
    }
    assert!(n_near >= 5, "only {n_near} of 20 plans end near an edge");
}
