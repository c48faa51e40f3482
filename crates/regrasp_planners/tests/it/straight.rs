//! Fingers that relocate go straight in their joints where that is clear: the same plan in less time.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_plan::check::CheckSettings;
use regrasp_plan::plan::Segment;
use regrasp_plan::{Plan, SegmentKind};
use regrasp_planners::in_hand::{ImprovementSettings, InHandSettings, plan_in_hand, validate_once};
use regrasp_scene::LoadedScene;

/// Plans without any improvement but that, and has the plan judged.
fn plan(loaded: &LoadedScene, straighten: bool, seed: u64) -> Plan {
    let improvement = ImprovementSettings { straighten, ..ImprovementSettings::none() };
    let settings = InHandSettings { improvement, ..InHandSettings::default() };
    let query = loaded.in_hand(seed);
    let plan = plan_in_hand(&loaded.view(), &query, &settings, seed, &Budget::work(20_000_000), &|_| {}).unwrap();
    let report = loaded.judge(&query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "{} seed {seed}: {:#?}", loaded.scene.name, report.violations);
    assert_eq!(validate_once(&loaded.view(), &plan, &settings), Ok(()));
    plan
}

fn seconds(segment: &Segment) -> f64 {
    let ends = segment.waypoints.first().zip(segment.waypoints.last());
    ends.map_or(0.0, |(first, last)| last.time - first.time)
}

/// How far the joints go in all.
fn joint_path(segment: &Segment) -> f64 {
    let steps = segment.waypoints.windows(2);
    let changes = steps.flat_map(|pair| pair[0].joints.iter().zip(&pair[1].joints).map(|(a, b)| (b - a).abs()));
    changes.sum()
}

#[test]
fn relocations_take_less_time_and_nothing_else_changes() {
    let (mut before, mut after) = (0.0, 0.0);
    for name in ["sphere_90x.toml", "box_90x.toml", "box_180z.toml", "six_finger_sphere_90x.toml"] {
        let loaded = scene(name);
        for seed in 0..3 {
            let [crooked, straight] = [false, true].map(|straighten| plan(&loaded, straighten, seed));
            assert_eq!(crooked.segments.len(), straight.segments.len());
            for (old, new) in crooked.segments.iter().zip(&straight.segments) {
                assert_eq!((old.kind, &old.moving_finger, &old.held_by), (new.kind, &new.moving_finger, &new.held_by));
                let ends = |segment: &Segment| {
                    let of =
                        |waypoint: &regrasp_plan::plan::Waypoint| (waypoint.joints.clone(), waypoint.contacts.clone());
                    segment.waypoints.first().map(of).zip(segment.waypoints.last().map(of))
                };
                assert!(ends(old) == ends(new), "{name} seed {seed}");
                if old.kind != SegmentKind::Regrasp {
                    assert_eq!(old.waypoints.len(), new.waypoints.len());
                    continue;
                }
                assert!(joint_path(new) <= joint_path(old) + 1e-9, "{name} seed {seed}");
                before += seconds(old);
                after += seconds(new);
            }
        }
    }
    // Three joints a finger, as many as its tip needs: those with more gain a third.
    assert!(after < 0.95 * before, "relocations take {after:.1} s, and {before:.1} s before");
}
