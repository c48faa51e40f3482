//! Failures and roadmaps as the plain data that pages and pictures are made of (`regrasp_viewer::story`).
//!
//! The viewer knows no planner: what only planners know is converted here.

use crate::robot_roadmap::RobotRoadmap;
use regrasp_geometry::frame::{parts_of, pose_distance, rotation_between};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::Plan;
use regrasp_planners::in_hand::roadmap::GraspRoadmap;
use regrasp_planners::robot_miss::{ExchangeOutcome, MetBody, MetKind, RobotMiss, WantedHand};
use regrasp_planners::{Failure, Outline, OutlineEdge, OutlineNode};
use regrasp_scene::{HandView, Query, Scene, State};
use regrasp_viewer::robots::{ExchangePlaces, Met, MissingHand, RobotFailure, WristGraph, corners};
use regrasp_viewer::story::{
    CauseStory, FailureStory, NearestMissStory, RoadmapEdge, RoadmapEdgeKind, RoadmapNode, RoadmapStory,
};

/// Most nodes and edges of a graph that a page is told: those made first.
const MOST_NODES: usize = 10_000;
const MOST_EDGES: usize = 20_000;
/// Poses that differ by less, in metres and radians, are one.
const SAME_POSE: f64 = 1e-9;

/// A robot's roadmap in the scene of `query`: where it brings the wrists, exchanges, and what rests. Joints that the roadmap does not
/// plan stand as at the query's start. None for a query of a single hand, and where the robot lacks a joint of the roadmap.
pub fn wrist_graph_of(roadmap: &RobotRoadmap, scene: &Scene, query: &Query) -> Option<WristGraph> {
    let (robot, start) = match query {
        Query::Motion(of) => (&scene.robots[of.robot], &of.start),
        Query::PickAndPlace(of) => (&scene.robots[of.robot], &of.start),
        Query::InHand(_) | Query::Tracking(_) => return None,
    };
    let (graph, exchanges) = match roadmap {
        RobotRoadmap::Motion(roads) => (Some(&roads.graph), Vec::new()),
        RobotRoadmap::Task(of) => (of.roads.as_ref().map(|roads| &roads.graph), of.exchange_states().collect()),
    };
    let mut poses = Vec::new();
    let mut wrists = |state: &[f64]| -> Vec<Point> {
        robot.link_poses(state, &mut poses);
        robot.arms.iter().map(|arm| poses[arm.mount.0].translation.vector.into()).collect()
    };
    let mut arms: Vec<(String, Vec<Point>)> = robot.arms.iter().map(|arm| (arm.name.clone(), Vec::new())).collect();
    let mut edges = Vec::new();
    if let Some(graph) = graph {
        let places: Vec<usize> = graph.joints.iter().map(|name| robot.layout.index_of(name)).collect::<Option<_>>()?;
        for node in &graph.graph.nodes {
            let mut state = start.clone();
            places.iter().zip(node).for_each(|(place, value)| state[*place] = *value);
            arms.iter_mut().zip(wrists(&state)).for_each(|((_, points), point)| points.push(point));
        }
        edges = graph.graph.edges.iter().map(|edge| edge.map(|node| node as usize)).collect();
    }
    let middle = |state: &[f64]| {
        let points = wrists(state);
        Point::from(points.iter().map(|point| point.coords).sum::<Vector>() / points.len().max(1) as f64)
    };
    // States of another robot are left out.
    let exchanges = exchanges.into_iter().filter(|state| state.len() == start.len()).map(middle).collect();
    let supports = scene.supports.iter().map(|support| &support.body);
    let still = scene
        .obstacles
        .iter()
        .chain(supports)
        .map(|body| corners(&body.placed.shape, &body.placed.parent_from_shape))
        .collect();
    Some(WristGraph { arms, edges, exchanges, still })
}

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

/// What failed of a task of a whole robot, in its scene: the nearest miss, or the start where there is none. `story` is that of the
/// failure. None for a query of a single hand.
pub fn robot_failure<'a>(
    (scene, state): (&'a Scene, &'a State),
    query: &'a Query,
    failure: &'a Failure,
    story: &'a FailureStory,
) -> Option<RobotFailure<'a>> {
    let (robot, start, object) = match query {
        Query::Motion(of) => (of.robot, &of.start, None),
        Query::PickAndPlace(of) => {
            (of.robot, &of.start, Some((of.object, [of.world_from_object_start, of.world_from_object_goal])))
        }
        Query::InHand(_) | Query::Tracking(_) => return None,
    };
    let miss = failure.robot_miss.as_deref();
    let here = miss.and_then(|miss| miss.world_from_object.as_ref()).map(Pose::from);
    let met = |body: &MetBody| match body.kind {
        MetKind::Link => Met::Link(body.name.clone()),
        MetKind::Carried => Met::Object(body.name.clone()),
        MetKind::Resting => Met::Resting(body.name.clone()),
    };
    let missing = |wanted: &WantedHand| {
        let hand = scene.hands[scene.hand_named(&wanted.hand)?].carrier?.hand;
        Some(MissingHand {
            hand,
            world_from_hand: Pose::from(&wanted.world_from_hand),
            wrist: wanted.wrist.map(Point::from),
        })
    };
    let wanted = miss.map_or(&[][..], |miss| &miss.wanted);
    Some(RobotFailure {
        scene,
        state,
        robot,
        joints: miss.map_or(start, |miss| &miss.joints),
        what: miss.map_or_else(String::new, in_words),
        object: object.map(|(index, [start, goal])| (index, [here.unwrap_or(start), start, goal])),
        meeting: miss.and_then(|miss| miss.meeting.as_ref()).map(|meeting| [0, 1].map(|k| met(&meeting.bodies[k]))),
        missing: wanted.iter().filter_map(missing).collect(),
        exchanges: miss.map_or_else(Vec::new, exchange_places),
        failure: story,
    })
}

fn in_words(miss: &RobotMiss) -> String {
    match &miss.meeting {
        Some(meeting) => format!("{}: {}", miss.reason, meeting.in_words()),
        None => miss.reason.clone(),
    }
}

/// Places of exchanges by their outcome.
fn exchange_places(miss: &RobotMiss) -> Vec<ExchangePlaces> {
    let outcomes = [
        (ExchangeOutcome::HandsTouch, "hands touch, wherever the object is"),
        (ExchangeOutcome::OutOfReach, "out of reach"),
        (ExchangeOutcome::InCollision, "in collision"),
        (ExchangeOutcome::NoWay, "without a way of a hand or finger"),
    ];
    let of = |(outcome, words): (ExchangeOutcome, &str)| ExchangePlaces {
        outcome: words.into(),
        places: miss.exchanges.iter().filter(|at| at.outcome == outcome).map(|at| at.position.into()).collect(),
    };
    outcomes.into_iter().map(of).collect()
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
    if let Some(reached) = &failure.reached {
        facts
            .push(("Graph".into(), format!("{} grasps in {} components", reached.nodes.len(), reached.n_components())));
    }
    if let Some(miss) = &failure.robot_miss {
        facts.push(("Nearest".into(), in_words(miss)));
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

/// The graph of a roadmap opened for `view`, with the way of `plan` through it where the plan was made on it.
pub fn roadmap_story(roadmap: &GraspRoadmap, view: &HandView, plan: &Plan) -> RoadmapStory {
    let outline = roadmap.outline_in_world(view);
    let mut story = outline_story(&outline, &Pose::from(&plan.goal));
    story.solution = way_through(&outline, plan);
    story
}

/// The graph of a saved roadmap, with angles to the pose of its first node, without a solution.
pub fn roadmap_from_first(roadmap: &GraspRoadmap) -> RoadmapStory {
    let outline = roadmap.outline();
    let first = outline.nodes.first().map_or_else(Pose::identity, |node| node.world_from_object);
    outline_story(&outline, &first)
}

/// What a search had reached when it failed; none where the planner keeps no graph. `goal` is the pose asked for.
/// Component 0 is the start's.
pub fn reached_story(failure: &Failure, goal: &Pose) -> Option<RoadmapStory> {
    let mut story = outline_story(failure.reached.as_ref()?, goal);
    // The nodes of the start come first, if there are any.
    let of_start = story.nodes.first().filter(|_| failure.nearest_miss.is_some()).map_or(0, |node| node.component);
    for node in &mut story.nodes {
        node.component = match node.component {
            component if component == of_start => 0,
            0 => of_start,
            other => other,
        };
    }
    Some(story)
}

fn outline_story(outline: &Outline, goal: &Pose) -> RoadmapStory {
    let n_shown = outline.nodes.len().min(MOST_NODES);
    let node = |(grown, node): (usize, &OutlineNode)| RoadmapNode {
        quat_xyzw: parts_of(&node.world_from_object).1,
        component: node.component,
        grown,
        angle_to_goal: rotation_between(&node.world_from_object, goal).norm(),
    };
    let edge = |edge: &OutlineEdge| RoadmapEdge {
        nodes: edge.nodes,
        kind: match edge.changes_grasp {
            true => RoadmapEdgeKind::TransferRegrasp,
            false => RoadmapEdgeKind::Transfer,
        },
    };
    let shown = outline.edges.iter().filter(|edge| edge.nodes.iter().all(|&node| node < n_shown));
    RoadmapStory {
        nodes: outline.nodes[..n_shown].iter().enumerate().map(node).collect(),
        edges: shown.take(MOST_EDGES).map(edge).collect(),
        solution: Vec::new(),
    }
}

/// The nodes at which segments of `plan` end, one after the other; empty when a plan made elsewhere meets fewer than two.
fn way_through(outline: &Outline, plan: &Plan) -> Vec<usize> {
    let mut way: Vec<usize> = Vec::new();
    for waypoint in
        plan.segments.iter().flat_map(|segment| segment.waypoints.first().into_iter().chain(segment.waypoints.last()))
    {
        let pose = Pose::from(&waypoint.world_from_object);
        let is_there = |node: &OutlineNode| pose_distance(&pose, &node.world_from_object, 1.0) < SAME_POSE;
        let found = outline.nodes[..outline.nodes.len().min(MOST_NODES)].iter().position(is_there);
        if let Some(node) = found.filter(|node| way.last() != Some(node)) {
            way.push(node);
        }
    }
    if way.len() < 2 { Vec::new() } else { way }
}
