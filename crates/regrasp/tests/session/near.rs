//! Starts at which links are nearer to each other or to the object than plans keep them. Distances are those that the checker measures.

use crate::{loaded, observation, own_plan, turned};
use regrasp::InHandSettings;
use regrasp::base::Budget;
use regrasp::plan::check::CheckSettings;
use regrasp::plan::check::along::{Along, along};
use regrasp::plan::plan::{Plan, Waypoint};
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::starting::ProjectionLimits;
use regrasp::scene::LoadedScene;
use regrasp::session::Session;

/// Clearance asked for, in metres.
const ASKED: f64 = 0.0008;

fn careful(loaded: &LoadedScene, clearance: f64) -> Session<'_> {
    let mut settings = InHandSettings::default();
    settings.physics.clearance = clearance;
    Session::open(loaded, None, settings).unwrap()
}

fn measured(loaded: &LoadedScene, plan: &Plan) -> Along {
    along(&loaded.manipulation(), plan).unwrap()
}

/// Waypoints at which something is nearer than half of what is asked, one of each plan at most, with the distance and the pair.
fn near_ones(loaded: &LoadedScene) -> Vec<(Waypoint, f64, [String; 2])> {
    let nearest_of = |plan: &Plan| {
        let found = measured(loaded, plan);
        let waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints);
        let all_hold = |waypoint: &Waypoint| waypoint.contacts.iter().all(|contact| contact.point_in_object.is_some());
        let near = found.clearance.iter().zip(waypoints).filter_map(|(nearest, waypoint)| {
            let nearest = nearest.filter(|nearest| (1e-4..0.5 * ASKED).contains(&nearest.distance))?;
            all_hold(waypoint).then(|| (waypoint.clone(), nearest.distance, found.pairs[nearest.pair].clone()))
        });
        near.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    (0..30).filter_map(|seed| nearest_of(&own_plan(loaded, seed))).collect()
}

#[test]
fn what_is_near_at_the_start_may_stay_near_and_nothing_else() {
    let loaded = loaded("box_90x.toml");
    let (observing, session) = (crate::session(&loaded), careful(&loaded, ASKED));
    let (mut n_near, mut n_found) = (0, 0);
    for (k, (waypoint, distance, pair)) in near_ones(&loaded).into_iter().enumerate() {
        n_near += 1;
        let start = observing.project(&observation(&waypoint), &ProjectionLimits::default()).unwrap();
        let found = session.plan(&start, &turned(&start, 0.4), k as u64, &Budget::work(400_000), &|_| {});
        let Ok(plan) = found else { continue };
        n_found += 1;
        let report = session.check(&plan, &CheckSettings::default());
        assert_eq!(report.violations, [], "{k}");
        let judged = measured(&loaded, &plan);
        for nearest in judged.clearance.iter().flatten() {
            let names = &judged.pairs[nearest.pair];
            let is_it = *names == pair;
            let least = if is_it { 0.5 * distance } else { ASKED };
            assert!(nearest.distance >= least - 1e-6, "{k}: {names:?} {} of {pair:?} {distance}", nearest.distance);
        }
    }
    assert!(n_near >= 5 && n_found >= 3, "{n_near} {n_found}");
}

/// However much clearance is asked for, a start is refused only for what is nearer than the least distance, 0.02 mm.
#[test]
fn a_start_is_as_good_with_more_clearance() {
    let loaded = loaded("box_90x.toml");
    let observing = crate::session(&loaded);
    let mut n_near = 0;
    for (waypoint, distance, _) in near_ones(&loaded) {
        // Below the smallest share of the larger clearance.
        if distance > 0.0003 {
            continue;
        }
        n_near += 1;
        let start = observing.project(&observation(&waypoint), &ProjectionLimits::default()).unwrap();
        for clearance in [0.0004, 0.01] {
            let session = careful(&loaded, clearance);
            let found = session.plan(&start, &turned(&start, 0.02), 0, &Budget::work(300), &|_| {});
            let refused = found.err().filter(|failure| failure.kind == FailureKind::StartInvalid);
            assert!(refused.is_none(), "{clearance} {distance}: {}", refused.unwrap());
        }
    }
    assert!(n_near >= 3, "{n_near}");
}
