use crate::sample::{Sample, options_with_models};
use regrasp_plan::check::{CheckSettings, along, check};
use regrasp_plan::{ContactMode, Plan};

fn samples() -> Vec<Sample> {
    let mut samples = vec![Sample::sphere()];
    samples.extend(options_with_models().map(|options| Sample::new("scenes/allegro/cube57_z.toml", options)));
    samples
}

fn has_rolling(plan: &Plan) -> bool {
    let contacts = plan.segments.iter().flat_map(|s| &s.waypoints).flat_map(|w| &w.contacts);
    contacts.into_iter().any(|contact| contact.mode == ContactMode::Rolling)
}

#[test]
fn the_series_has_the_smallest_values_of_the_report() {
    for sample in samples() {
        let found = along(&sample.loaded.manipulation(), &sample.plan).unwrap();
        let n_waypoints: usize = sample.plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
        assert_eq!((found.margin.len(), found.clearance.len()), (n_waypoints, n_waypoints));
        let least = found.margin.iter().copied().fold(f64::INFINITY, f64::min);
        let reported = sample.report.min_margin.unwrap();
        assert!(has_rolling(&sample.plan));
        // The report looks between waypoints too.
        assert!(reported <= least + 1e-9 && reported > 0.5 * least, "{least} {reported}");
        // The report looks at the waypoints that steps begin with.
        let reported = sample.report.min_clearance.as_ref().unwrap();
        let mut begin =
            sample.plan.segments.iter().flat_map(|s| (1..=s.waypoints.len()).map(|k| k < s.waypoints.len()));
        let at_begin = found.clearance.iter().filter(|_| begin.next().unwrap());
        let least = at_begin.flatten().min_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap();
        assert!((least.distance - reported.distance).abs() < 1e-12, "{least:?} {reported:?}");
        assert_eq!(found.pairs[least.pair], reported.pair);
    }
}

#[test]
fn a_plan_of_another_scene_has_no_series_but_a_page() {
    let sample = Sample::sphere();
    let mut other = sample.plan.clone();
    other.joint_names.pop();
    assert!(along(&sample.loaded.manipulation(), &other).is_err());
    let report =
        check((&sample.loaded.scene, &sample.loaded.state), Some(&sample.query), &other, &CheckSettings::default());
    assert!(!report.accepted());
    let judged = sample.story_of(&other, &report).judged.unwrap();
    assert!(!judged.accepted && !judged.violations.is_empty());
    assert!(judged.margin.iter().all(Option::is_none) && judged.clearance.iter().all(Option::is_none));
}

#[test]
fn a_rejected_plan_says_so() {
    let sample = Sample::sphere();
    let mut broken = sample.plan.clone();
    for segment in &mut broken.segments {
        for waypoint in &mut segment.waypoints {
            waypoint.joints[1] += 0.2;
        }
    }
    let report =
        check((&sample.loaded.scene, &sample.loaded.state), Some(&sample.query), &broken, &CheckSettings::default());
    let story = sample.story_of(&broken, &report);
    assert!(story.facts.iter().any(|(label, value)| label == "Checker" && value.starts_with("REJECTED")));
    assert!(!story.judged.unwrap().violations.is_empty());
}
