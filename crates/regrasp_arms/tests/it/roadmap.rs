//! Roadmaps of robots with two arms.

use crate::places::repository;
use regrasp_arms::model::cover::covers;
use regrasp_arms::motion::{ColliderSettings, Track};
use regrasp_arms::roadmap::{BuildSettings, Changes, QuerySettings, Roads, SuperGraph, build, query};
use regrasp_arms::world::{Obstacle, World};
use regrasp_arms::{ArmModel, Collider};
use regrasp_base::Budget;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_robot::manipulator::layout::Part;
use regrasp_robot::{LoadOptions, load_manipulator};
use std::path::Path;

fn model() -> ArmModel {
    let path = repository().join("assets/robots/upper_body/robot.toml");
    let robot = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    let coordinates = &robot.layout.coordinates;
    let free: Vec<usize> = (0..coordinates.len()).filter(|&k| !matches!(coordinates[k].part, Part::Hand(_))).collect();
    ArmModel::new(&robot, &covers(&robot.robot), &[], &robot.layout.rest(), &free)
}

fn obstacle(name: &str, size: [f64; 3], position: [f64; 3]) -> Obstacle {
    let shape = Shape::Cuboid { half_extents: Vector::from(size) * 0.5 };
    let parent_from_shape = Pose::translation(position[0], position[1], position[2]);
    Obstacle { name: name.into(), placed: PlacedShape { parent_from_shape, shape } }
}

fn table() -> Vec<Obstacle> {
    vec![obstacle("table", [0.7, 1.6, 0.04], [0.85, 0.0, 0.4]), obstacle("vase", [0.1, 0.1, 0.3], [0.7, 0.35, 0.57])]
}

fn small() -> BuildSettings {
    BuildSettings { nodes_per_arm: 8, ..BuildSettings::default() }
}

#[test]
fn nodes_and_edges_of_a_super_graph_are_free_where_everything_is_tested() {
    let (model, world) = (model(), World::new(table()));
    let parts = model.parts();
    assert_eq!((parts.common.len(), parts.arms.len()), (3, 2), "{parts:?}");
    let graph = build(&model, &world, &small(), 1).unwrap();
    assert!(graph.graph.nodes.len() > 20 && graph.graph.edges.len() > 20, "{}", graph.graph.nodes.len());
    let settings = ColliderSettings { clearance: graph.clearance, ..ColliderSettings::default() };
    let mut all = Collider::new(&model, &world, settings);
    for node in &graph.graph.nodes {
        assert!(all.contact(node).is_none() && model.is_within_limits(node, 0.0));
    }
    for &[a, b] in &graph.graph.edges {
        let track = Track::straight(&graph.graph.nodes[a as usize], &graph.graph.nodes[b as usize]);
        // What is not decided may differ by the intervals that are looked at: shapes decide then.
        let is_free =
            all.is_certified_free(&track) || (0..=50).all(|i| all.contact(&track.at(f64::from(i) / 50.0)).is_none());
        assert!(is_free, "{a} {b}");
    }
    assert_eq!(build(&model, &world, &small(), 1).unwrap(), graph);
    let again = SuperGraph::from_json(Path::new("graph"), &graph.to_json()).unwrap();
    assert_eq!(again, graph);
}

#[test]
fn queries_go_around_what_the_graph_does_not_know_and_enrich_it() {
    let (model, known) = (model(), World::new(table()));
    let graph = build(&model, &known, &small(), 2).unwrap();
    let ends = [graph.graph.nodes[0].clone(), graph.graph.nodes[graph.graph.nodes.len() / 2].clone()];
    let settings = ColliderSettings { clearance: graph.clearance, ..ColliderSettings::default() };
    let free_of = |obstacle: &Obstacle| {
        let world = World::new(vec![obstacle.clone()]);
        let mut collider = Collider::new(&model, &world, settings);
        ends.iter().all(|end| collider.contact(end).is_none())
    };
    let candidates = [[0.5, 0.0, 1.0], [0.6, -0.3, 0.9], [0.5, 0.3, 1.2], [0.9, 0.0, 0.8]];
    let new = candidates.into_iter().map(|at| obstacle("lamp", [0.08, 0.08, 0.5], at)).find(free_of).unwrap();
    let whole = World::new(table().into_iter().chain([new.clone()]).collect());
    let unknown = World::new(vec![new]);
    let n_before = graph.graph.nodes.len();
    let mut graph = Roads::new(graph);
    let changes = Changes { whole: &whole, unknown: &unknown, is_changed: &|_| false };
    let ask = |graph: &mut Roads| {
        let ends = [ends[0].as_slice(), ends[1].as_slice()];
        query(graph, &model, &changes, ends, &QuerySettings::default(), (3, &Budget::work(100_000)))
    };
    let first = ask(&mut graph);
    let path = first.path.clone().expect("a path");
    let mut all = Collider::new(&model, &whole, settings);
    for pair in path.windows(2) {
        let track = Track::straight(&pair[0], &pair[1]);
        assert!((0..=40).all(|i| all.contact(&track.at(f64::from(i) / 40.0)).is_none()));
    }
    assert_eq!(graph.graph.graph.nodes.len() as u64, n_before as u64 + first.n_added);
}

#[test]
fn a_graph_grows_by_ways_and_leaves_out_what_is_not_free() {
    let (model, world) = (model(), World::new(table()));
    let graph = build(&model, &world, &small(), 2).unwrap();
    let roads = Roads::new(graph.clone());
    let settings = ColliderSettings { clearance: graph.clearance, ..ColliderSettings::default() };
    let mut all = Collider::new(&model, &world, settings);
    // New configurations near nodes, and one in which the right hand is in the table.
    let near = |node: usize, by: f64| -> Vec<f64> {
        let drawn = graph.graph.nodes[node].iter().zip(&model.coordinates);
        drawn.map(|(q, c)| (q + by).clamp(c.lower, c.upper)).collect()
    };
    let mut is_free = |p: &[f64], q: &[f64]| all.is_certified_free(&Track::straight(p, q));
    let mut free = Vec::new();
    for node in 0..graph.graph.nodes.len() {
        let way = vec![near(node, 0.01), near(node, 0.02), near(node, 0.03)];
        if way.windows(2).all(|pair| is_free(&pair[0], &pair[1])) {
            free.push(way);
        }
    }
    let [first, last] = [&free[0], &free[free.len() - 1]];
    let mut blocked = None;
    let mut rng = regrasp_base::Rng::keyed(5, "blocked", 0);
    while blocked.is_none() {
        let drawn: Vec<f64> = model.coordinates.iter().map(|c| rng.uniform(c.lower, c.upper)).collect();
        blocked = (!is_free(&drawn, &drawn)).then_some(drawn);
    }
    let way: Vec<Vec<f64>> = first.iter().cloned().chain(blocked).chain(last.iter().cloned()).collect();
    let states = |way: &[Vec<f64>]| -> Vec<Vec<f64>> { way.iter().map(|at| model.state_at(at)).collect() };
    let (grown, n_added) = roads.grown_by(&[states(&way)], &model, &world);
    let n_before = graph.graph.nodes.len();
    assert_eq!(n_added, 6);
    assert_eq!(grown.graph.graph.nodes[n_before..n_before + 3], way[..3]);
    assert_eq!(grown.graph.graph.nodes[n_before + 3..], way[4..]);
    assert_eq!(grown.graph.graph.nodes[..n_before], graph.graph.nodes[..]);
    let new: Vec<[u32; 2]> =
        grown.graph.graph.edges.iter().copied().filter(|edge| edge[1] as usize >= n_before).collect();
    assert_eq!(grown.graph.graph.edges.len(), graph.graph.edges.len() + new.len());
    // Each piece between the ends, and its links: each new configuration is a short way from a node of the graph.
    assert!(new.len() >= 4 + 2, "{new:?}");
    let of = |node: u32| &grown.graph.graph.nodes[node as usize];
    for &[a, b] in &new {
        let track = Track::straight(of(a), of(b));
        assert!((0..=200).all(|i| all.contact(&track.at(f64::from(i) / 200.0)).is_none()), "{a} {b}");
    }
    // Saved and read, it is the same; nothing is grown by nothing.
    assert_eq!(SuperGraph::from_json(Path::new("graph"), &grown.graph.to_json()).unwrap(), grown.graph);
    assert_eq!(roads.grown_by(&[], &model, &world), (roads.clone(), 0));
    assert_eq!(roads.grown_by(&[states(&way[..1])], &model, &world), (roads, 0));
}
