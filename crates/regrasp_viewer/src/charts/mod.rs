//! Charts of a plan, as SVG: the same plan gives the same bytes.
//!
//! All charts with a time axis have it at the same place, so that they can be laid one under the other.

/// Why no plan was found.
mod causes;
/// Distance of what must not touch.
mod clearance;
/// Normal forces.
mod forces;
/// Which finger holds when.
mod gait;
/// Joint angles within their limits.
mod joints;
/// Closure margin.
mod margin;
/// The way of the object's orientation.
mod orientation;
/// The way of the object's rotation vectors in space.
mod orientation_path;
/// SVG text: elements, escaping, numbers, axes.
pub mod svg;
/// The time axis, and a panel over it.
pub(crate) mod time_axis;
/// Where fingers touched the object.
mod traces;

pub use causes::causes;
pub use clearance::clearance;
pub use forces::forces;
pub use gait::gait;
pub use joints::joints;
pub use margin::margin;
pub use orientation::orientation;
pub use orientation_path::orientation_path;
pub use traces::traces;

use crate::story::Story;

/// A chart, and the name of its file without extension.
pub type Chart = (&'static str, String);

/// Names of all charts that there are.
pub const NAMES: [&str; 9] =
    ["gait", "margin", "clearance", "joints", "forces", "orientation", "orientation_path", "traces", "causes"];

/// Every chart that the story has data for.
pub fn all(story: &Story) -> Vec<Chart> {
    let mut charts = Vec::new();
    let mut add = |name: &'static str, chart: Option<String>| {
        debug_assert!(NAMES.contains(&name), "{name} is not in the list of names");
        charts.extend(chart.map(|chart| (name, chart)));
    };
    if let Some(plan) = &story.plan {
        add("gait", Some(gait(plan)));
        if let Some(judged) = &story.judged {
            add("margin", margin(plan, judged));
            add("clearance", clearance(plan, judged));
        }
        add("joints", joints(plan, &story.scene));
        add("forces", forces(plan));
        add("orientation", orientation(plan, story.roadmap.as_ref()));
        if plan.promises.tracking.is_some() {
            add("orientation_path", orientation_path(plan));
            add("traces", traces(plan, &story.scene));
        }
    }
    if let Some(failure) = &story.failure {
        add("causes", causes(failure));
    }
    charts
}

/// What the chart is of, in a few words.
fn title(plan: &regrasp_plan::Plan) -> String {
    use regrasp_geometry::Pose;
    let [start, goal] = [&plan.start, &plan.goal].map(|pose| Pose::from(pose).rotation);
    let angle = start.angle_to(&goal).to_degrees();
    if plan.promises.tracking.is_some() {
        return format!("{angle:.0}\u{b0} over {} sub-goals", plan.statistics.transfers);
    }
    let counted = |n: u64, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    format!(
        "{angle:.0}\u{b0} in {} and {}",
        counted(plan.statistics.transfers, "transfer"),
        counted(plan.n_relocations(), "relocation")
    )
}
