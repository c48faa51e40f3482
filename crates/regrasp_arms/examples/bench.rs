//! Times of motions of whole robots: `arms [--package NAME=DIR] [--settings FILE] [--seeds N] [--csv FILE] SCENE...`; `arms --roadmap ROBOT` builds super graphs.
//!
//! `cargo xtask bench-arms` runs it. Processor time of one thread.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use cpu_time::ThreadTime;
use regrasp_arms::model::cover::covers;
use regrasp_arms::motion::Track;
use regrasp_arms::motion::{Collider, ColliderSettings};
use regrasp_arms::roadmap::{BuildSettings, Changes, QuerySettings, Roads, build, query};
use regrasp_arms::search::{Region, RrtSettings, rrt_connect};
use regrasp_arms::world::{Obstacle, World};
use regrasp_arms::{ArmModel, Stage, plan_in_stages};
use regrasp_base::{Budget, Rng};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_plan::check::{CheckSettings, check_robot};
use regrasp_robot::manipulator::layout::Part;
use regrasp_robot::{LoadOptions, load_manipulator};
use regrasp_scene::load_scene;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest search, in seconds.
const LIMIT: Duration = Duration::from_secs(10);

#[derive(Default)]
struct Row {
    /// Seconds of: preparation, search, simplification, certification, times.
    stages: [f64; 5],
    /// Seconds of the checker.
    check: f64,
    is_solved: bool,
    is_accepted: bool,
    length: f64,
    duration: f64,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut scenes = Vec::new();
    let (mut settings, mut seeds, mut csv) = (String::from("{}"), 1, None);
    // SRDFs of benchmarks name links that their URDFs lack.
    let mut options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().expect("a value").clone();
        match argument.as_str() {
            "--settings" => settings = std::fs::read_to_string(value()).expect("settings"),
            "--seeds" => seeds = value().parse().expect("a number"),
            "--csv" => csv = Some(value()),
            "--package" => {
                let value = value();
                let (name, folder) = value.split_once('=').expect("NAME=DIR");
                options.resolve.packages.push((name.to_owned(), PathBuf::from(folder)));
            }
            "--roadmap" => return roadmaps(Path::new(&value())),
            scene => scenes.push(PathBuf::from(scene)),
        }
    }
    let settings = serde_json::from_str(&settings).expect("settings of motions");
    let mut rows = Vec::new();
    let mut table = String::from(
        "scene,seed,solved,accepted,prepare_s,search_s,simplify_s,certify_s,times_s,check_s,length,duration\n",
    );
    for path in &scenes {
        let loaded = load_scene(path, &options).unwrap_or_else(|error| panic!("{error}"));
        for seed in 0..seeds {
            let asked = loaded.task().query(seed);
            let query = asked.as_motion().expect("a task of kind motion");
            let mut row = Row::default();
            let mut before = ThreadTime::now();
            let mut watch = |stage: Stage| {
                let now = ThreadTime::now();
                row.stages[stage as usize] += now.duration_since(before).as_secs_f64();
                before = now;
            };
            let budget = Budget::unlimited().with_deadline(Instant::now() + LIMIT);
            let world = (&loaded.scene, &loaded.state);
            match plan_in_stages(world, query, &settings, seed, &budget, &mut watch) {
                Ok(plan) => {
                    row.is_solved = true;
                    let before = ThreadTime::now();
                    let report = check_robot(world, Some(query), &plan, &CheckSettings::default());
                    row.check = before.elapsed().as_secs_f64();
                    row.is_accepted = report.accepted();
                    if let Some(violation) = report.violations.first() {
                        println!("{} seed {seed}: {violation:?}", path.display());
                    }
                    row.duration = plan.duration();
                    let joints: Vec<&Vec<f64>> = plan.waypoints().map(|waypoint| &waypoint.joints).collect();
                    row.length = joints.windows(2).map(|pair| regrasp_arms::search::distance(pair[0], pair[1])).sum();
                }
                Err(failure) => println!("{} seed {seed}: {failure}", path.display()),
            }
            let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            let times = row.stages.map(|seconds| format!("{seconds:.9}")).join(",");
            table += &format!(
                "{name},{seed},{},{},{times},{:.9},{:.6},{:.6}\n",
                row.is_solved, row.is_accepted, row.check, row.length, row.duration
            );
            rows.push(row);
        }
    }
    if let Some(csv) = csv {
        std::fs::write(csv, table).expect("the table is written");
    }
    let solved: Vec<&Row> = rows.iter().filter(|row| row.is_solved).collect();
    let n_accepted = solved.iter().filter(|row| row.is_accepted).count();
    println!("solved {} of {}, {n_accepted} accepted by the checker", solved.len(), rows.len());
    let line = |name: &str, scale: f64, value: &dyn Fn(&Row) -> f64| {
        let mut values: Vec<f64> = solved.iter().map(|row| scale * value(row)).collect();
        values.sort_by(f64::total_cmp);
        if let (Some(last), n) = (values.last(), values.len()) {
            let mean = values.iter().sum::<f64>() / n as f64;
            println!(
                "| {name} | {:.1} | {:.1} | {:.1} | {last:.1} | {mean:.1} |",
                values[n / 2],
                values[n * 3 / 4],
                values[n * 95 / 100]
            );
        }
    };
    println!("| what | median | 75 % | 95 % | largest | mean |\n|---|---|---|---|---|---|");
    for (index, name) in ["prepare", "search", "simplify", "certify", "times"].into_iter().enumerate() {
        line(&format!("{name} us"), 1e6, &|row| row.stages[index]);
    }
    line("search to times us", 1e6, &|row| row.stages[1..].iter().sum());
    line("check us", 1e6, &|row| row.check);
    line("length rad", 1.0, &|row| row.length);
    line("duration s", 1.0, &|row| row.duration);
}

/// Super graphs of a robot before a table with clutter.
fn roadmaps(robot: &Path) {
    let robot = load_manipulator(robot, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).manipulator;
    let coordinates = &robot.layout.coordinates;
    let free: Vec<usize> = (0..coordinates.len()).filter(|&k| !matches!(coordinates[k].part, Part::Hand(_))).collect();
    let covers = covers(&robot.robot);
    let model = ArmModel::new(&robot, &covers, &[], &robot.layout.rest(), &free);
    let cuboid = |name: &str, size: [f64; 3], at: [f64; 3]| Obstacle {
        name: name.into(),
        placed: PlacedShape {
            parent_from_shape: Pose::translation(at[0], at[1], at[2]),
            shape: Shape::Cuboid { half_extents: Vector::from(size) * 0.5 },
        },
    };
    let world = World::new(vec![
        cuboid("table", [0.7, 1.6, 0.04], [0.85, 0.0, 0.4]),
        cuboid("vase", [0.1, 0.1, 0.3], [0.7, 0.35, 0.57]),
        cuboid("lamp", [0.06, 0.06, 0.5], [0.8, -0.2, 0.67]),
        cuboid("box", [0.2, 0.15, 0.12], [0.75, -0.5, 0.48]),
    ]);
    println!("{} bodies, {} balls, {} pairs", model.bodies.len(), model.balls.len(), model.pairs.len());
    for nodes_per_arm in [10, 20, 30, 40, 50] {
        for seed in 0..3 {
            let before = ThreadTime::now();
            let settings = BuildSettings { nodes_per_arm, ..BuildSettings::default() };
            let Some(built) = build(&model, &world, &settings, seed) else { return };
            let seconds = before.elapsed().as_secs_f64();
            let (nodes, edges) = (built.graph.nodes.len(), built.graph.edges.len());
            println!("nodes per arm {nodes_per_arm}, seed {seed}: {nodes} nodes, {edges} edges, {seconds:.2} s");
        }
    }
    for (n_moved, n_nodes) in [(1, 30), (1, 50), (10, 50), (30, 50)] {
        queries(&model, &world, n_moved, n_nodes);
    }
}

/// Queries among the same obstacles and some that the graph does not know: by the graph, and without it. All paths are certified.
fn queries(model: &ArmModel, known: &World, n_moved: usize, n_nodes: usize) {
    const QUERIES: u64 = 100;
    let settings = BuildSettings { nodes_per_arm: n_nodes, ..BuildSettings::default() };
    let Some(built) = build(model, known, &settings, 0) else { return };
    let clearance = built.clearance;
    let roads = Roads::new(built);
    let mut rng = Rng::keyed(0, "queries", 0);
    let region = Region::of(model, &[&model.configuration_of(&model.state)]);
    let of_collider = |clearance: f64| ColliderSettings { clearance, ..ColliderSettings::default() };
    let (mut lazy, mut single, mut solved) = (Vec::new(), Vec::new(), [0; 2]);
    let (mut tested, mut added) = (0, 0);
    for index in 0..QUERIES {
        let mut moved = Vec::new();
        for _ in 0..n_moved {
            let [x, y, z] = [rng.uniform(0.45, 0.9), rng.uniform(-0.6, 0.6), rng.uniform(0.55, 1.3)];
            let shape = Shape::Cylinder { half_length: 0.15, radius: 0.05 };
            let placed = PlacedShape { parent_from_shape: Pose::translation(x, y, z), shape };
            moved.push(Obstacle { name: "moved".into(), placed });
        }
        let whole = World::new(known.obstacles.iter().chain(&moved).cloned().collect());
        let unknown = World::new(moved);
        let mut collider = Collider::new(model, &whole, of_collider(clearance + 2e-3));
        let mut draw = || {
            let mut drawn = Vec::new();
            loop {
                region.draw(&mut rng, &mut drawn);
                if collider.contact(&drawn).is_none() && collider.is_sampled_free(&drawn, &drawn) {
                    return drawn.clone();
                }
            }
        };
        let ends = [draw(), draw()];
        // The graph as it was saved, for each of them.
        let mut graph = roads.clone();
        let budget = Budget::unlimited().with_deadline(Instant::now() + LIMIT);
        let before = ThreadTime::now();
        let slices = [ends[0].as_slice(), ends[1].as_slice()];
        let changes = Changes { whole: &whole, unknown: &unknown, is_changed: &|_| false };
        let found = query(&mut graph, model, &changes, slices, &QuerySettings::default(), (index, &budget));
        lazy.push(before.elapsed().as_secs_f64());
        solved[0] += usize::from(found.path.is_some());
        tested += found.n_tested;
        added += u64::from(found.n_added > 0);
        // Samples with the same margin, then the path is certified.
        let before = ThreadTime::now();
        let mut sampled = Collider::new(model, &whole, of_collider(clearance + 2e-3));
        let mut exact = Collider::new(model, &whole, of_collider(clearance));
        let rrt = RrtSettings::for_dimension(model.dimension());
        let budget = Budget::unlimited().with_deadline(Instant::now() + LIMIT);
        let mut rng = Rng::keyed(index, "single_query", 0);
        let found =
            rrt_connect(&ends[0], &ends[1..], &region, &rrt, &mut rng, &budget, |a, b| sampled.is_sampled_free(a, b));
        let proved = |path: &Vec<Vec<f64>>| {
            path.windows(2).all(|pair| exact.is_certified_free(&Track::straight(&pair[0], &pair[1])))
        };
        let is_proved = found.path.as_ref().is_some_and(proved);
        single.push(before.elapsed().as_secs_f64());
        solved[1] += usize::from(is_proved);
    }
    let line = |name: &str, values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n as f64;
        let ms = [values[n / 2], values[n * 3 / 4], values[n * 95 / 100], values[n - 1], mean].map(|s| 1e3 * s);
        println!("| {name} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |", ms[0], ms[1], ms[2], ms[3], ms[4]);
    };
    println!(
        "{QUERIES} queries with {n_moved} moved obstacles, {} nodes; solved and certified by the graph {}, without {}",
        roads.graph.graph.nodes.len(),
        solved[0],
        solved[1]
    );
    println!("motions tested {tested}, queries that the graph alone did not answer {added}");
    println!("| ms | median | 75 % | 95 % | largest | mean |\n|---|---|---|---|---|---|");
    line("by the graph", &mut lazy);
    line("single query", &mut single);
}
