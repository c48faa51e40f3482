//! Advice of failures: what it names was tried, and leads to a plan when it is followed.

use crate::places::repository;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_plan::check::CheckSettings;
use regrasp_planners::{Failure, FailureKind, InHandSettings, plan_in_hand};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::load_scene_text;

/// Objects with their masses, in kilograms.
const BALL: (&str, f64) = ("sphere = { radius = 0.03 }", 0.1);
const BOX: (&str, f64) = ("box = { size = [0.05, 0.05, 0.06] }", 0.1);

/// Plans a turn of an object in the wide hand by 90 degrees about z; a plan is judged.
fn turn((object, mass): (&str, f64), position: &str, friction: f64, work: u64) -> Result<Plan, Failure> {
    let text = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\n\
         file = \"assets/hands/wide_four_finger/hand.toml\"\n[object]\n{object}\nmass = {mass}\n\
         friction = {friction}\n[start]\nposition = [{position}]\n[goal]\nturn = {{ axis = \"z\", angle_deg = 90 }}\n"
    );
    let path = repository().join("advice.toml");
    let loaded = load_scene_text(&path, text.into_bytes(), &LoadOptions::default()).unwrap();
    let query = loaded.in_hand(0);
    let found = plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 0, &Budget::work(work), &|_| {});
    if let Ok(plan) = &found {
        let report = loaded.judge(&query, plan, &CheckSettings::default());
        assert!(report.accepted(), "{:?}", report.violations);
    }
    found
}

const HOME: &str = "0.0, 0.0, 0.078";

#[test]
fn friction_that_helps_is_named_and_helps() {
    let failure = turn(BOX, HOME, 0.1, 20_000).expect_err("it slips");
    assert_eq!(failure.kind, FailureKind::WorkSpent);
    let named = failure.advice.strip_prefix("friction = ").and_then(|text| text.split(' ').next());
    let named: f64 = named.and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{}", failure.advice));
    assert!(turn(BOX, HOME, named, 400_000).is_ok(), "{}", failure.advice);
}

/// The ball is lifted until it can no longer be turned: the advice there names a pose nearby, and the ball is turned from that.
#[test]
fn a_start_nearer_to_the_palm_is_named_and_helps() {
    let lifted = (0..30).map(|k| format!("0.0, 0.0, {:.3}", 0.08 + 0.005 * f64::from(k)));
    let failed = lifted.map(|position| turn(BALL, &position, 0.8, 12_000)).find_map(Result::err);
    let failure = failed.expect("somewhere it is out of reach");
    assert_eq!(failure.kind, FailureKind::WorkSpent);
    let named = failure.advice.split(['[', ']']).nth(1).unwrap_or_else(|| panic!("{}", failure.advice));
    assert!(turn(BALL, named, 0.8, 100_000).is_ok(), "{named}: {}", failure.advice);
}

/// Rubber fingertips, so that more friction is not tried.
#[test]
fn a_mass_that_helps_is_named_and_helps() {
    let with_mass = |mass: f64, work: u64| turn((BALL.0, mass), HOME, 1.5, work);
    let failure = with_mass(8.0, 20_000).expect_err("it is too heavy");
    let named = failure.advice.strip_prefix("mass = ").and_then(|text| text.split(' ').next());
    let named: f64 = named.and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{}", failure.advice));
    assert!(with_mass(named, 100_000).is_ok(), "{}", failure.advice);
}
