//! The checker accepts a plan that is good by construction.

use crate::sample;
use regrasp_plan::check::{CheckSettings, check};

#[test]
fn a_good_plan_is_accepted() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    let report = check(&scene, Some(&sample::query(&plan)), &plan, &CheckSettings::default());
    assert!(report.accepted(), "{report:#?}");
    assert!(report.min_margin.unwrap() > 0.005);
    assert!(report.max_contact_error < 0.1e-3);
}
