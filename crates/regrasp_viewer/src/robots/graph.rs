//! A super graph (Saut 2010, sec. V-A) in its scene: where it brings the wrists, from behind the robot and from above.

use crate::charts::svg::{Anchor, INK, SOFT, Svg, fixed};
use crate::palette;
use nalgebra::Vector2;
use regrasp_geometry::stable::convex_polygon;
use regrasp_geometry::{Point, Pose, Shape};

const WIDTH: f64 = 836.0;
const LEFT: f64 = 24.0;
const TOP: f64 = 48.0;
/// Between the two views, and above each of them.
const GAP: f64 = 34.0;
/// Neither view is higher than this.
const HIGHEST: f64 = 520.0;
const EXCHANGE: &str = "#111111";
/// Edges in one path.
const PER_PATH: usize = 40;

/// What is drawn. Lengths in metres, in the world.
#[derive(Debug, Clone, Default)]
pub struct WristGraph {
    /// Name of each arm, and where its wrist is at every node.
    pub arms: Vec<(String, Vec<Point>)>,
    /// Motions, by indices of nodes.
    pub edges: Vec<[usize; 2]>,
    /// Where one hand can give the object to another one: between both wrists.
    pub exchanges: Vec<Point>,
    /// Corners of a box about each body that rests.
    pub still: Vec<[Point; 8]>,
}

/// Corners of the box about a shape, in the world.
pub fn corners(shape: &Shape, world_from_shape: &Pose) -> [Point; 8] {
    let (low, high) = shape.bounds();
    std::array::from_fn(|k| {
        let of = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        world_from_shape * Point::new(of(0), of(1), of(2))
    })
}

/// One of the two views.
struct View {
    name: &'static str,
    /// Which coordinate of the world goes up.
    up: usize,
    /// The picture's place of the left upper corner, and that corner in the view, in metres.
    at: [f64; 2],
    corner: [f64; 2],
    scale: f64,
    height: f64,
}

impl View {
    /// A point in metres: to the right, and up. The robot's left is on the left.
    fn flat(&self, point: &Point) -> [f64; 2] {
        [-point.y, point[self.up]]
    }

    fn place(&self, point: &Point) -> [f64; 2] {
        self.place_flat(self.flat(point))
    }

    fn place_flat(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.at[0] + (x - self.corner[0]) * self.scale, self.at[1] + (self.corner[1] - y) * self.scale]
    }
}

/// The picture: bodies that rest in grey, a colour per arm, exchanges as black rings.
pub fn wrist_graph(graph: &WristGraph, title: &str) -> String {
    let points = || {
        let of_arms = graph.arms.iter().flat_map(|(_, points)| points);
        of_arms.chain(&graph.exchanges).chain(graph.still.iter().flatten())
    };
    let range = |value: &dyn Fn(&Point) -> f64| {
        let (low, high) =
            points().map(value).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if low <= high { (low - 0.05, high + 0.05) } else { (0.0, 1.0) }
    };
    let across = range(&|point| -point.y);
    let ups = [2, 0].map(|up| range(&|point| point[up]));
    let highest = ups.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    let scale = ((WIDTH - 2.0 * LEFT) / (across.1 - across.0)).min(HIGHEST / highest);
    let heights = ups.map(|(low, high)| (high - low) * scale);
    let second = TOP + heights[0] + GAP;
    let view = |name, k: usize, up, top| View {
        name,
        up,
        at: [LEFT, top],
        corner: [across.0, ups[k].1],
        scale,
        height: heights[k],
    };
    let views = [view("from behind", 0, 2, TOP), view("from above", 1, 0, second)];
    let bottom = second + heights[1];
    let mut svg = Svg::new(WIDTH, bottom + 52.0);
    svg.text(title, [LEFT, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    for view in &views {
        draw(&mut svg, graph, view, (across.1 - across.0) * scale);
    }
    key(&mut svg, graph, scale, bottom + 22.0);
    svg.finish(title)
}

fn draw(svg: &mut Svg, graph: &WristGraph, view: &View, width: f64) {
    svg.text(view.name, [view.at[0], view.at[1] - 6.0], Anchor::Start, SOFT, "font-size=\"11\"");
    for corners in &graph.still {
        let flat = corners.iter().map(|corner| Vector2::from(view.flat(corner))).collect();
        let outline: Vec<[f64; 2]> =
            convex_polygon(flat).into_iter().map(|corner| view.place_flat(corner.into())).collect();
        svg.polygon(&outline, "#d9d9d9", "fill-opacity=\"0.6\" stroke=\"#9a9a9a\" stroke-width=\"0.8\"");
    }
    let many = (graph.edges.len() as f64 / 300.0).max(1.0);
    let opacity = (0.6 / many.sqrt()).clamp(0.08, 0.5);
    let radius =
        (34.0 / (graph.arms.first().map_or(1, |(_, points)| points.len().max(1)) as f64).sqrt()).clamp(1.0, 4.0);
    for (index, (_, points)) in graph.arms.iter().enumerate() {
        let mut lines = Vec::new();
        for edge in &graph.edges {
            let [Some(a), Some(b)] = edge.map(|node| points.get(node)) else { continue };
            if (a - b).norm() > 1e-6 {
                lines.extend([Some(view.place(a)), Some(view.place(b)), None]);
            }
        }
        for some in lines.chunks(3 * PER_PATH) {
            svg.path(some, palette::color(index), 0.6, &format!("stroke-opacity=\"{opacity:.2}\""));
        }
        points.iter().for_each(|point| svg.disc(view.place(point), radius, palette::color(index), ""));
    }
    for point in &graph.exchanges {
        svg.disc(view.place(point), 3.0, "none", &format!("stroke=\"{EXCHANGE}\" stroke-width=\"1.2\""));
    }
    svg.rect(view.at, [width, view.height], "none", "stroke=\"#9a9a9a\" stroke-width=\"1\"");
}

fn key(svg: &mut Svg, graph: &WristGraph, scale: f64, y: f64) {
    let mut x = LEFT;
    let mut tell = |svg: &mut Svg, text: String, mark: &dyn Fn(&mut Svg, [f64; 2])| {
        mark(svg, [x + 5.0, y]);
        svg.text(&text, [x + 15.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
        x += 36.0 + 6.0 * text.len() as f64;
    };
    for (index, (name, points)) in graph.arms.iter().enumerate() {
        let color = palette::color(index);
        tell(svg, format!("wrist of {name} (nodes: {})", points.len()), &|svg, at| svg.disc(at, 4.5, color, ""));
    }
    tell(svg, format!("motions: {}", graph.edges.len()), &|svg, [x, y]| {
        svg.line([x - 5.0, y], [x + 5.0, y], SOFT, 1.0, "")
    });
    if !graph.exchanges.is_empty() {
        let ring = format!("stroke=\"{EXCHANGE}\" stroke-width=\"1.2\"");
        tell(svg, format!("exchanges: {}", graph.exchanges.len()), &|svg, at| svg.disc(at, 3.0, "none", &ring));
    }
    let length = 0.5;
    svg.line([LEFT, y + 18.0], [LEFT + length * scale, y + 18.0], INK, 1.5, "");
    let text = format!("{} m", fixed(length, 1));
    svg.text(&text, [LEFT + length * scale + 6.0, y + 22.0], Anchor::Start, SOFT, "font-size=\"11\"");
}
