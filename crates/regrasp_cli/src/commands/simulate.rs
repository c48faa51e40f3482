//! `regrasp simulate`: how to replay a plan. The Python package does it; this program starts no other.

use crate::args;
use crate::stop::Stop;
use regrasp::base::files;
use regrasp::base::{Diagnostic, Place};
use regrasp::plan::format;

/// Says how. Always bad input (`A506`): nothing was simulated, and no script should believe that it was.
pub fn run(arguments: &args::Simulate) -> Result<(), Stop> {
    let plan = &arguments.plan;
    format::from_json(plan, &files::read(plan)?)?;
    let problem = "MuJoCo replays come with the Python package, which this program does not start";
    let fix = format!("pip install \"regrasp[sim]\", then python -m regrasp.simulate {}", plan.display());
    Err(Stop::BadInput(Diagnostic::new("A506", Place::file("command line"), problem).fix(fix).into()))
}
