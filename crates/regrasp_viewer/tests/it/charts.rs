//! Charts read back: values stand where the data are, names stay names.

use crate::sample::Sample;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_plan::plan::{ContactMode, Plan};
use regrasp_robot::LoadOptions;
use regrasp_viewer::charts::svg::Scale;
use regrasp_viewer::roadmap_picture::roadmap_picture;
use regrasp_viewer::story::{CauseStory, FailureStory, RoadmapEdge, RoadmapEdgeKind, RoadmapNode, RoadmapStory, Story};
use regrasp_viewer::{charts, palette, timeline};
use roxmltree::{Document, Node};

fn box_story() -> Story {
    Sample::new("scenes/box_90x.toml", LoadOptions::default()).story()
}

pub fn parsed(svg: &str) -> Document<'_> {
    Document::parse(svg).unwrap_or_else(|error| panic!("{error}: {svg}"))
}

pub fn number(node: &Node, name: &str) -> f64 {
    node.attribute(name).and_then(|value| value.parse().ok()).unwrap_or_else(|| panic!("no {name}"))
}

/// The points of the runs of a path.
pub fn runs(path: &Node) -> Vec<Vec<[f64; 2]>> {
    let data = path.attribute("d").expect("a path has data");
    let point = |text: &str| {
        let (x, y) = text.split_once(' ').expect("two coordinates");
        [x, y].map(|c| c.parse::<f64>().expect("a number"))
    };
    data.split('M').skip(1).map(|run| run.split('L').map(point).collect()).collect()
}

fn path_of_class<'a>(document: &'a Document, class: &str) -> Node<'a, 'a> {
    let found = document.descendants().find(|node| node.attribute("class") == Some(class));
    found.unwrap_or_else(|| panic!("no {class}"))
}

/// The scale of an axis, read from the first and last number written beside it.
fn scale_of(
    document: &Document,
    along: &str,
    is_on_axis: &dyn Fn(&Node) -> bool,
    shift: f64,
) -> impl Fn(f64) -> f64 + use<> {
    let ticks: Vec<(f64, f64)> = document
        .descendants()
        .filter(|node| node.has_tag_name("text") && is_on_axis(node))
        .filter_map(|node| Some((number(&node, along) - shift, node.text()?.parse().ok()?)))
        .collect();
    let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
    assert!(ticks.len() >= 3 && first.1 != last.1, "{ticks:?}");
    move |place| first.1 + (place - first.0) / (last.0 - first.0) * (last.1 - first.1)
}

fn values_of(document: &Document) -> impl Fn(f64) -> f64 + use<> {
    scale_of(document, "y", &|node| node.attribute("text-anchor") == Some("end") && number(node, "x") < 110.0, 4.0)
}

fn times_of(document: &Document) -> impl Fn(f64) -> f64 + use<> {
    let lowest = document
        .descendants()
        .filter(|node| node.has_tag_name("text") && node.text() == Some("time [s]"))
        .map(|node| number(&node, "y"))
        .next()
        .expect("a time axis");
    scale_of(document, "x", &move |node| (number(node, "y") - (lowest - 15.0)).abs() < 0.5, 0.0)
}

#[test]
fn margin_and_clearance_stand_where_the_checker_measured_them() {
    let story = box_story();
    let (plan, judged) = (story.plan.as_ref().expect("a plan"), story.judged.as_ref().expect("judged"));
    let times: Vec<f64> = timeline::steps(plan).iter().map(|step| step.waypoint.time).collect();
    let margin = charts::margin(plan, judged).expect("a chart");
    let clearance = charts::clearance(plan, judged).expect("a chart");
    for (svg, class, series, unit) in
        [(&margin, "margin", &judged.margin, 1.0), (&clearance, "clearance", &judged.clearance, 1e3)]
    {
        let document = parsed(svg);
        let (time, value) = (times_of(&document), values_of(&document));
        let points: Vec<[f64; 2]> = runs(&path_of_class(&document, class)).concat();
        let expected: Vec<(f64, f64)> =
            times.iter().zip(series).filter_map(|(time, value)| Some((*time, unit * (*value)?))).collect();
        assert_eq!(points.len(), expected.len());
        let largest = expected.iter().map(|e| e.1).fold(0.0, f64::max);
        for ([x, y], (at, measured)) in points.iter().zip(&expected) {
            assert!((time(*x) - at).abs() < 2e-3 * times[times.len() - 1], "{class}: {} at {at}", time(*x));
            assert!((value(*y) - measured).abs() < 5e-3 * largest, "{class}: {} for {measured}", value(*y));
        }
        let worst = expected.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
        let dot = document.descendants().find(|node| node.has_tag_name("circle")).expect("the worst moment");
        assert!((value(number(&dot, "cy")) - worst).abs() < 5e-3 * largest);
    }
}

/// How long a finger holds, counted waypoint by waypoint.
fn time_held(plan: &Plan, finger: usize) -> f64 {
    let steps = timeline::steps(plan);
    let holds = |k: usize| steps[k].waypoint.contacts[finger].mode != ContactMode::Free;
    let spans = 1..steps.len();
    spans.filter(|&k| holds(k - 1) && holds(k)).map(|k| steps[k].waypoint.time - steps[k - 1].waypoint.time).sum()
}

#[test]
fn bars_of_the_gait_are_as_long_as_fingers_hold() {
    let story = box_story();
    let plan = story.plan.as_ref().expect("a plan");
    let svg = charts::gait(plan);
    let document = parsed(&svg);
    let time = times_of(&document);
    for finger in 0..plan.fingers.len() {
        let fills = [palette::color(finger).to_owned(), format!("url(#roll{finger})")];
        let bars = document.descendants().filter(|node| {
            let own = node.attribute("fill").is_some_and(|fill| fills.iter().any(|known| known == fill));
            own && node.has_tag_name("rect") && node.attribute("x").is_some()
        });
        let drawn: f64 =
            bars.map(|bar| time(number(&bar, "x") + number(&bar, "width")) - time(number(&bar, "x"))).sum();
        let held = time_held(plan, finger);
        assert!((drawn - held).abs() < 0.01 * held, "{}: {drawn} {held}", plan.fingers[finger]);
        let marks = timeline::marks(plan, finger);
        let stretches = timeline::stretches(plan, finger);
        assert!(stretches.windows(2).all(|pair| pair[0].until == pair[1].from), "stretches leave no gap");
        assert!(marks.lifts.len().abs_diff(marks.lands.len()) <= 1);
    }
}

#[test]
fn the_orientation_ends_at_the_goal_and_jumps_to_the_antipode() {
    let mut story = box_story();
    let plan = story.plan.as_mut().expect("a plan");
    // All waypoints turned about z by 0 to 270 degrees.
    let n = timeline::steps(plan).len();
    let waypoints = plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints);
    for (k, waypoint) in waypoints.enumerate() {
        let angle = 1.5 * std::f64::consts::PI * k as f64 / (n - 1) as f64;
        let pose = Pose::rotation(nalgebra::Vector3::z() * angle);
        waypoint.world_from_object = (&pose).into();
    }
    let svg = charts::orientation(plan, None).expect("a chart");
    let document = parsed(&svg);
    let runs = runs(&path_of_class(&document, "orientation"));
    // Seen along y: z upward. From the middle to the upper rim, then from the lower rim half-way back.
    assert_eq!(runs.len(), 2, "{runs:?}");
    let ball = document.descendants().find(|node| node.has_tag_name("circle")).expect("the ball");
    let [x, y, radius] = ["cx", "cy", "r"].map(|name| number(&ball, name));
    let near = |found: [f64; 2], expected: [f64; 2]| {
        let off = (0..2).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
        assert!(off < 0.03 * radius, "{found:?} {expected:?}");
    };
    near(runs[0][0], [x, y]);
    near(runs[0][runs[0].len() - 1], [x, y - radius]);
    near(runs[1][0], [x, y + radius]);
    near(runs[1][runs[1].len() - 1], [x, y + radius / 2.0]);
}

#[test]
fn names_stay_names_in_every_chart() {
    let mut story = box_story();
    let names = [
        "</text><script>alert(1)</script>",
        "a\"b'c&d<e>\u{0}\u{1b}\u{fffe}\u{ffff}",
        "]]><!-- \u{202e} \u{1f590}",
        "x\" onload=\"alert(1)",
    ];
    let plan = story.plan.as_mut().expect("a plan");
    for (k, name) in names.iter().enumerate() {
        plan.fingers[k] = (*name).into();
    }
    for (k, joint) in story.scene.hands[0].joints.iter_mut().enumerate() {
        joint.name = names[k % names.len()].into();
    }
    let judged = story.judged.as_mut().expect("judged");
    judged.pairs.iter_mut().for_each(|pair| *pair = (names[0].into(), names[1].into()));
    story.failure = Some(FailureStory {
        kind: "work".into(),
        message: names[0].into(),
        advice: String::new(),
        causes: names.iter().map(|name| CauseStory { reason: (*name).into(), count: 3, share: 0.25 }).collect(),
        nearest_miss: None,
    });
    let mut pictures = charts::all(&story);
    assert_eq!(pictures.len(), 7, "{:?}", pictures.iter().map(|chart| chart.0).collect::<Vec<_>>());
    pictures.push(("roadmap", roadmap_picture(&graph(), names[3])));
    for (name, svg) in &pictures {
        let document = parsed(svg);
        let known = ["svg", "title", "rect", "line", "path", "polygon", "circle", "text", "defs", "pattern"];
        for node in document.descendants().filter(Node::is_element) {
            assert!(known.contains(&node.tag_name().name()), "{name}: {}", node.tag_name().name());
            assert!(node.attributes().all(|attribute| !attribute.name().starts_with("on")), "{name}");
        }
    }
    assert_eq!(charts::all(&story), pictures[..7], "the same again");
}

#[test]
fn causes_are_bars_in_proportion() {
    let cause = |share: f64| CauseStory { reason: "reach".into(), count: (100.0 * share) as u64, share };
    let failure = FailureStory {
        kind: "work".into(),
        message: "none".into(),
        advice: String::new(),
        causes: [0.5, 0.3, 0.2].map(cause).into(),
        nearest_miss: None,
    };
    let svg = charts::causes(&failure).expect("a chart");
    let document = parsed(&svg);
    let bars = document.descendants().filter(|node| node.attribute("fill") == Some("#0072b2"));
    let widths: Vec<f64> = bars.map(|bar| number(&bar, "width")).collect();
    assert_eq!(widths.len(), 3);
    assert!((widths[1] / widths[0] - 0.6).abs() < 1e-3 && (widths[2] / widths[0] - 0.4).abs() < 1e-3, "{widths:?}");
    assert_eq!(charts::causes(&FailureStory { causes: Vec::new(), ..failure }), None);
}

fn graph() -> RoadmapStory {
    let node = |grown: usize, component: usize, angle: f64| RoadmapNode {
        quat_xyzw: [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()],
        component,
        grown,
        angle_to_goal: angle,
    };
    let edge = |a: usize, b: usize, kind| RoadmapEdge { nodes: [a, b], kind };
    RoadmapStory {
        nodes: vec![node(0, 0, 1.5), node(1, 0, 1.0), node(2, 1, 0.7), node(3, 0, 0.1)],
        edges: vec![
            edge(0, 1, RoadmapEdgeKind::Transfer),
            edge(1, 3, RoadmapEdgeKind::TransferRegrasp),
            edge(1, 99, RoadmapEdgeKind::Transfer),
        ],
        solution: vec![0, 1, 3, 1234],
    }
}

#[test]
fn a_roadmap_is_drawn_with_its_solution_and_what_is_not_there_is_left_out() {
    let svg = roadmap_picture(&graph(), "graph");
    let document = parsed(&svg);
    let solution = runs(&path_of_class(&document, "solution"));
    assert_eq!(solution.len(), 1);
    assert_eq!(solution[0].len(), 3);
    // To the right with growth, down toward the goal.
    assert!(solution[0].windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]));
    let dashed = |node: &Node| node.has_tag_name("path") && node.attribute("stroke-dasharray").is_some();
    assert_eq!(document.descendants().filter(dashed).count(), 1);
    roadmap_picture(&RoadmapStory::default(), "empty");
}

#[test]
fn ticks_are_round_few_and_inside() {
    let mut rng = Rng::keyed(5, "ticks", 0);
    for _ in 0..2000 {
        let lower = rng.uniform(-1.0, 1.0) * 10f64.powf(rng.uniform(-4.0, 4.0));
        let scale = Scale::new(lower, lower + 10f64.powf(rng.uniform(-4.0, 4.0)), 0.0, 100.0);
        let n = 2 + rng.below(9);
        let (ticks, decimals) = scale.ticks(n);
        assert!(ticks.len() <= n + 1, "{} of {n}", ticks.len());
        let width = scale.upper - scale.lower;
        assert!(ticks.iter().all(|t| *t >= scale.lower - 1e-6 * width && *t <= scale.upper + 1e-6 * width));
        for pair in ticks.windows(2) {
            let step = pair[1] - pair[0];
            let mantissa = step / 10f64.powf(step.log10().floor() + 1e-9);
            let is_round = [1.0, 2.0, 5.0, 10.0].iter().any(|m| (mantissa - m).abs() < 1e-3);
            assert!(is_round, "step {step}");
            // Written with so many decimals, neighbours differ.
            assert_ne!(format!("{:.decimals$}", pair[0]), format!("{:.decimals$}", pair[1]));
        }
    }
}
