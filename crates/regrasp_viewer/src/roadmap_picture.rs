//! A manipulation graph in the plane, like figure 4 of Saut 2011: how near to the goal each node is, against when it was made.

use crate::charts::svg::{Anchor, GRID, INK, SOFT, Scale, Svg, fixed};
use crate::palette;
use crate::story::{RoadmapEdgeKind, RoadmapNode, RoadmapStory};

const WIDTH: f64 = 836.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 812.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 394.0;
const HEIGHT: f64 = 470.0;
/// Components with a colour of their own; the rest are grey.
const COLORED: usize = 6;
const REST: &str = "#b9b9b9";
const SOLUTION: &str = "#111111";

/// The graph: order of growth to the right, angle to the goal upward, a colour per component, transfers as lines,
/// transfer-regrasp edges dashed, the solution over it.
///
/// Edges and nodes of a solution that the graph does not have are left out.
pub fn roadmap_picture(roadmap: &RoadmapStory, title: &str) -> String {
    let n = roadmap.nodes.len();
    let last = roadmap.nodes.iter().map(|node| node.grown).max().unwrap_or(0);
    let highest = roadmap.nodes.iter().map(|node| node.angle_to_goal.to_degrees()).fold(1.0, f64::max);
    let growth = Scale::new(0.0, (last.max(1)) as f64 * 1.02, LEFT, RIGHT);
    let angles = Scale::new(0.0, highest * 1.04, BOTTOM, TOP);
    let place = |node: &RoadmapNode| [growth.at(node.grown as f64), angles.at(node.angle_to_goal.to_degrees())];
    let mut svg = Svg::new(WIDTH, HEIGHT);
    svg.text(title, [LEFT, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    axes(&mut svg, &growth, &angles);
    draw_edges(&mut svg, roadmap, &place);
    let radius = (34.0 / (n.max(1) as f64).sqrt()).clamp(1.3, 4.0);
    // Small components last: they are what is looked for.
    let mut order: Vec<&RoadmapNode> = roadmap.nodes.iter().collect();
    order.sort_by_key(|node| (node.component, node.grown));
    for node in order {
        svg.disc(place(node), radius, color(node.component), "");
    }
    let way: Vec<[f64; 2]> = roadmap.solution.iter().filter_map(|&node| roadmap.nodes.get(node)).map(place).collect();
    if let (Some(start), Some(goal)) = (way.first(), way.last()) {
        let points: Vec<Option<[f64; 2]>> = way.iter().copied().map(Some).collect();
        svg.path(&points, "#ffffff", 5.0, "stroke-opacity=\"0.8\"");
        svg.path(&points, SOLUTION, 2.4, "class=\"solution\"");
        way.iter().for_each(|at| svg.disc(*at, radius.max(2.2), SOLUTION, ""));
        for (at, name) in [(start, "start"), (goal, "goal")] {
            svg.disc(*at, 5.5, "#ffffff", &format!("stroke=\"{SOLUTION}\" stroke-width=\"2\""));
            let (anchor, shift) = if at[0] > RIGHT - 60.0 { (Anchor::End, -9.0) } else { (Anchor::Start, 9.0) };
            svg.text_on_lines(name, [at[0] + shift, at[1] - 7.0], anchor, INK, "font-weight=\"bold\"");
        }
    }
    svg.rect([LEFT, TOP], [RIGHT - LEFT, BOTTOM - TOP], "none", "stroke=\"#9a9a9a\" stroke-width=\"1\"");
    key(&mut svg, roadmap, !way.is_empty());
    svg.finish(title)
}

fn color(component: usize) -> &'static str {
    if component < COLORED { palette::color(component) } else { REST }
}

fn axes(svg: &mut Svg, growth: &Scale, angles: &Scale) {
    let (ticks, decimals) = angles.ticks(7);
    for tick in ticks {
        let y = angles.at(tick);
        svg.line([LEFT, y], [RIGHT, y], GRID, 1.0, "");
        let number = format!("{}\u{b0}", fixed(tick, decimals));
        svg.text(&number, [LEFT - 6.0, y + 4.0], Anchor::End, SOFT, "font-size=\"11\"");
    }
    for tick in growth.ticks(8).0.into_iter().filter(|tick| tick.fract() == 0.0) {
        let x = growth.at(tick);
        svg.line([x, BOTTOM], [x, BOTTOM + 4.0], SOFT, 1.0, "");
        svg.text(&fixed(tick, 0), [x, BOTTOM + 16.0], Anchor::Middle, SOFT, "font-size=\"11\"");
    }
    svg.text("order of growth", [(LEFT + RIGHT) / 2.0, BOTTOM + 31.0], Anchor::Middle, SOFT, "font-size=\"11\"");
    let (x, y) = (20.0, (TOP + BOTTOM) / 2.0);
    let turn = format!("font-size=\"11\" transform=\"rotate(-90 {x} {y})\"");
    svg.text("angle to the goal", [x, y], Anchor::Middle, SOFT, &turn);
}

/// Edges in one path; where paths lie over each other the picture grows darker, which one path does not do by itself.
const PER_PATH: usize = 40;

/// Edges by kind and component.
fn draw_edges(svg: &mut Svg, roadmap: &RoadmapStory, place: &dyn Fn(&RoadmapNode) -> [f64; 2]) {
    let many = (roadmap.edges.len() as f64 / 300.0).max(1.0);
    let opacity = (0.6 / many.sqrt()).clamp(0.10, 0.5);
    let width = (0.9 / many.powf(0.25)).max(0.45);
    for kind in [RoadmapEdgeKind::Transfer, RoadmapEdgeKind::TransferRegrasp] {
        for component in 0..=COLORED {
            let mut points = Vec::new();
            for edge in roadmap.edges.iter().filter(|edge| edge.kind == kind) {
                let [Some(a), Some(b)] = edge.nodes.map(|node| roadmap.nodes.get(node)) else { continue };
                if a.component.min(COLORED) == component {
                    points.extend([Some(place(a)), Some(place(b)), None]);
                }
            }
            let dashes = match kind {
                RoadmapEdgeKind::Transfer => "",
                RoadmapEdgeKind::TransferRegrasp => " stroke-dasharray=\"5 3\"",
            };
            for some in points.chunks(3 * PER_PATH) {
                svg.path(some, color(component), width, &format!("stroke-opacity=\"{opacity:.2}\"{dashes}"));
            }
        }
    }
}

fn key(svg: &mut Svg, roadmap: &RoadmapStory, has_solution: bool) {
    let n_components = roadmap.nodes.iter().map(|node| node.component + 1).max().unwrap_or(0);
    let size = |component: usize| roadmap.nodes.iter().filter(|node| node.component == component).count();
    let y = BOTTOM + 50.0;
    let mut x = LEFT;
    for component in 0..n_components.min(COLORED) {
        svg.disc([x + 5.0, y], 4.5, color(component), "");
        let text = if component == 0 { format!("largest component: {}", size(0)) } else { size(component).to_string() };
        svg.text(&text, [x + 13.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        x += 26.0 + 6.0 * text.len() as f64;
    }
    if n_components > COLORED {
        svg.disc([x + 5.0, y], 4.5, REST, "");
        let more = format!("{} more", n_components - COLORED);
        svg.text(&more, [x + 13.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    }
    let count = |kind| roadmap.edges.iter().filter(|edge| edge.kind == kind).count();
    let mut x = LEFT;
    let y = y + 19.0;
    let mut line = |text: String, color: &str, width: f64, more: &str| {
        svg.line([x, y], [x + 22.0, y], color, width, more);
        svg.text(&text, [x + 28.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        x += 52.0 + 5.8 * text.len() as f64;
    };
    line(format!("transfer ({})", count(RoadmapEdgeKind::Transfer)), "#666666", 1.2, "");
    let regrasps = count(RoadmapEdgeKind::TransferRegrasp);
    if regrasps > 0 {
        line(format!("transfer and regrasp ({regrasps})"), "#666666", 1.2, "stroke-dasharray=\"5 3\"");
    }
    if has_solution {
        line("solution".into(), SOLUTION, 2.4, "");
    }
}
