//! Goals one after the other, each planned from where the last plan ends: as a robot would from where the object really is.

#![allow(clippy::print_stdout, reason = "examples talk")]

use regrasp::geometry::Pose;
use regrasp::plan::check::CheckSettings;
use regrasp::planners::in_hand::starting::{Observation, ProjectionLimits};
use regrasp::robot::import::LoadOptions;
use regrasp::scene::load_scene;
use regrasp::{Budget, InHandSettings, Session, plan_in_hand};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let settings = InHandSettings::default();
    let session = Session::open(&loaded, None, settings.clone())?;
    let budget = Budget::work(1_000_000);
    let query = loaded.task().query(0);
    let mut plan = plan_in_hand(session.view(), query.as_in_hand().unwrap(), &settings, 0, &budget, &|_| {})?;
    for (number, goal) in [query.start(), query.goal(), query.start()].into_iter().enumerate() {
        let last = plan.segments.last().unwrap().waypoints.last().unwrap();
        // A camera and encoders would say this.
        let seen = Observation {
            world_from_object: Pose::from(&last.world_from_object),
            joints: last.joints.clone(),
            velocities: None,
            presses: None,
        };
        let start = session.project(&seen, &ProjectionLimits::default())?;
        plan = session.plan(&start, goal, number as u64, &budget, &|_| {})?;
        let report = session.check(&plan, &CheckSettings::default());
        println!(
            "goal {}: {} relocations, {}",
            number + 1,
            plan.statistics.relocations,
            if report.accepted() { "accepted" } else { "rejected" }
        );
    }
    Ok(())
}
