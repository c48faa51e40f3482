//! One file per command.

mod bench;
mod campaign;
pub mod check;
mod demo;
mod export;
mod grasp_files;
mod grasp_import;
mod grasps;
mod growth;
mod inspect;
mod inspect_parts;
mod inspect_robot;
mod motion;
mod pair;
mod pictures;
mod place;
pub mod plan;
mod roadmap;
mod robot_roadmap;
mod room;
mod rows;
mod runs;
mod simulate;
mod suite;
mod task_bench;
mod task_grasps;
mod view;
mod written;

use crate::args::{Arguments, Command};
use crate::stop::Stop;
use crate::talk::Talk;

/// Runs the command asked for.
pub fn run(arguments: &Arguments, talk: &Talk) -> Result<(), Stop> {
    let common = &arguments.common;
    match &arguments.command {
        Command::Demo(demo) => demo::run(demo, common, talk),
        Command::Inspect(inspect) => inspect::run(inspect, common, talk),
        Command::Place(place) => place::run(place, common, talk),
        Command::Plan(plan) => plan::run(plan, common, talk),
        Command::Grasps(grasps) => grasps::run(grasps, common, talk),
        Command::Check(check) => check::run(check, common, talk),
        Command::View(view) => view::run(view, common, talk),
        Command::Export(export) => export::run(export, common, talk),
        Command::Simulate(simulate) => simulate::run(simulate),
        Command::Bench(bench) => bench::run(bench, common, talk),
        Command::Growth(growth) => growth::run(growth, talk),
        Command::Roadmap(roadmap) => roadmap::run(roadmap, common, talk),
        Command::Campaign(campaign) => campaign::run(campaign, common, talk),
    }
}
