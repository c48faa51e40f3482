//! What pages are told of what only planners know: failures and roadmaps, as the plain data of `regrasp_viewer::story`.

use regrasp_planners::Failure;
use regrasp_planners::in_hand::roadmap::GraspRoadmap;
use regrasp_plan::Plan;
use regrasp_viewer::story::{CauseStory, FailureStory, NearestMissStory, RoadmapStory};

/// Why no plan was found.
pub fn failure_story(failure: &Failure) -> FailureStory {
    let cause = |cause: &regrasp_planners::Cause| CauseStory {
        reason: cause.reason.clone(),
        count: cause.count,
        share: cause.share,
    };
    FailureStory {
        kind: kind_of(failure),
        message: failure.message.clone(),
        advice: failure.advice.clone(),
        causes: failure.causes.iter().map(cause).collect(),
        nearest_miss: failure.nearest_miss.as_ref().map(|miss| NearestMissStory {
            world_from_object: miss.world_from_object,
            joints: miss.joints.clone(),
            angle_left: miss.angle_left,
            distance_left: miss.distance_left,
        }),
    }
}

/// Lines of facts about the search that failed.
pub fn failure_facts(failure: &Failure) -> Vec<(String, String)> {
    let mut facts = vec![("Result".to_owned(), format!("NO PLAN: {}", kind_of(failure).replace('_', " ")))];
    if let Some(leg) = failure.leg {
        facts.push(("Leg".into(), leg.to_string()));
    }
    if let Some(miss) = &failure.nearest_miss {
        let (angle, distance) = (miss.angle_left.to_degrees(), 1e3 * miss.distance_left);
        facts.push(("Nearest".into(), format!("{angle:.1}\u{b0} and {distance:.1} mm left")));
    }
    let statistics = &failure.statistics;
    if statistics.work > 0 {
        facts.push(("Searched".into(), format!("{} nodes, {} configurations", statistics.nodes, statistics.work)));
        facts.push(("Restarts".into(), statistics.restarts.to_string()));
    }
    facts
}

/// The kind as events and files spell it.
fn kind_of(failure: &Failure) -> String {
    let value = serde_json::to_value(failure.kind).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

/// The graph of a roadmap.
pub fn roadmap_story(_roadmap: &GraspRoadmap, _plan: &Plan) -> RoadmapStory {
    RoadmapStory::default()
}
