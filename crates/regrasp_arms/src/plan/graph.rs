//! Graphs of a query's robot among what rests around it.

use super::problem::{KnownRoads, Problem};
use crate::model::ArmModel;
use crate::roadmap::{BuildSettings, Roads, SuperGraph, build, fingerprint_of_robot, fingerprint_of_world};
use crate::world::World;
use regrasp_robot::LinkId;
use regrasp_robot::manipulator::layout::Part;
use regrasp_scene::{MotionQuery, Scene, State};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The robot of graphs: arms and torso move, fingers are as the robot file has them at rest.
fn model(problem: &Problem) -> ArmModel {
    let coordinates = &problem.robot.layout.coordinates;
    let free: Vec<usize> = (0..coordinates.len()).filter(|&k| !matches!(coordinates[k].part, Part::Hand(_))).collect();
    problem.bare_model(&problem.robot.layout.rest(), &free)
}

/// The super graph of a query's robot. None of robots that do not have one arm or two.
pub fn build_graph(
    around: (&Scene, &State),
    query: &MotionQuery,
    settings: &BuildSettings,
    seed: u64,
) -> Option<SuperGraph> {
    let problem = Problem::new(around, query);
    build(&model(&problem), &problem.world, settings, seed)
}

/// What differs from what a graph was made for, in words. None where nothing does.
pub fn graph_differs(around: (&Scene, &State), query: &MotionQuery, graph: &SuperGraph) -> Option<&'static str> {
    let problem = Problem::new(around, query);
    if graph.robot != fingerprint_of_robot(&model(&problem)) {
        return Some("the robot");
    }
    (graph.world != fingerprint_of_world(&problem.world)).then_some("what rests around the robot")
}

/// The graph with ways that queries found, and the number of nodes that they added. `ways` has states of the robot; motions between
/// them are straight. The query says for which robot, among what, the graph was made.
pub fn grow_graph(
    around: (&Scene, &State),
    query: &MotionQuery,
    roads: &Roads,
    ways: &[Vec<Vec<f64>>],
) -> (Roads, usize) {
    let problem = Problem::new(around, query);
    roads.grown_by(ways, &model(&problem), &problem.world)
}

impl<'a> Problem<'a> {
    /// Lets searches use a graph of the robot; `unknown` has what rests and the graph does not know.
    pub fn use_graph(&mut self, roads: &'a Roads, unknown: World) {
        let robot = self.robot;
        let (rest, now) = (robot.layout.rest(), &self.query.start);
        let mut changed = BTreeSet::new();
        for hand in 0..robot.hands.len() {
            let fingers = robot.layout.range(Part::Hand(hand));
            if now[fingers.clone()] != rest[fingers] {
                let links = (0..robot.robot.links.len()).map(LinkId);
                changed.extend(links.filter(|link| robot.part_of(*link) == Part::Hand(hand)));
            }
        }
        self.roads = Some(KnownRoads { roads, unknown: Arc::new(unknown), changed });
    }
}
