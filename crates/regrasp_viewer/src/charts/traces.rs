//! Where fingers touched the object.

use super::svg::{Anchor, INK, SOFT, Svg, cut};
use crate::palette;
use crate::story::{PieceStory, Role, SceneStory, pack};
use crate::timeline;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::Plan;
use std::collections::BTreeMap;

const WIDTH: f64 = 836.0;
const TOP: f64 = 36.0;
/// Width and height of a view, and the room that the object has in it.
const CELL: [f64; 2] = [262.0, 236.0];
const ROOM: f64 = 196.0;
const LEFT: f64 = 24.0;
const KEY: f64 = 26.0;
/// Points of a trace nearer together than this are one, in units of the sheet.
const FINENESS: f64 = 0.25;
/// Faces that meet at less than this angle, in radians, make no edge.
const FLAT: f64 = 0.01;

/// A view: the axes that point right and up (index, sign), and from where it is.
const VIEWS: [([(usize, f64); 2], &str); 6] = [
    ([(1, 1.0), (2, 1.0)], "from +x"),
    ([(0, -1.0), (2, 1.0)], "from +y"),
    ([(0, 1.0), (1, 1.0)], "from +z"),
    ([(1, -1.0), (2, 1.0)], "from \u{2212}x"),
    ([(0, 1.0), (2, 1.0)], "from \u{2212}y"),
    ([(0, 1.0), (1, -1.0)], "from \u{2212}z"),
];

/// Traces of the contacts on the object as in figures 10 to 18 of Cherif 1999, in the object's frame, seen from six sides: what
/// faces away is left out. None where the object's shape is not known, or no finger touches.
pub fn traces(plan: &Plan, scene: &SceneStory) -> Option<String> {
    let body = ObjectOutline::of(scene)?;
    let center = nalgebra::center(&body.low, &body.high);
    let scale = ROOM / (body.high - body.low).max();
    let traces: Vec<Vec<Option<(Point, Vector)>>> = (0..plan.fingers.len()).map(|f| timeline::trace(plan, f)).collect();
    if traces.iter().flatten().all(Option::is_none) {
        return None;
    }
    let mut svg = Svg::new(WIDTH, TOP + 2.0 * CELL[1] + KEY);
    svg.text("Traces of the contacts on the object", [LEFT, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    let more = "in the object's frame; what faces away is left out";
    svg.text(more, [WIDTH - LEFT, 19.0], Anchor::End, SOFT, "font-size=\"11\"");
    for (k, (axes, name)) in VIEWS.iter().enumerate() {
        let corner = [LEFT + CELL[0] * (k % 3) as f64, TOP + CELL[1] * (k / 3) as f64];
        let middle = [corner[0] + CELL[0] / 2.0, corner[1] + CELL[1] / 2.0 - 8.0];
        let view = View { axes: axes.map(|(axis, sign)| Vector::ith(axis, sign)), center, scale, middle };
        body.draw(&mut svg, &view);
        for (finger, trace) in traces.iter().enumerate() {
            draw(&mut svg, &view, trace, palette::color(finger), &format!("trace{finger} view{k}"));
        }
        svg.text(name, [middle[0], corner[1] + CELL[1] - 8.0], Anchor::Middle, SOFT, "font-size=\"11\"");
    }
    key(&mut svg, plan);
    Some(svg.finish("Traces of the contacts on the object"))
}

/// A parallel projection.
struct View {
    /// Directions to the right and up.
    axes: [Vector; 2],
    center: Point,
    scale: f64,
    middle: [f64; 2],
}

impl View {
    fn at(&self, point: &Point) -> [f64; 2] {
        let out = point - self.center;
        let [right, up] = [0, 1].map(|k| self.scale * out.dot(&self.axes[k]));
        [self.middle[0] + right, self.middle[1] - up]
    }

    /// True where a surface with this outward normal is seen.
    fn sees(&self, normal: &Vector) -> bool {
        self.axes[0].cross(&self.axes[1]).dot(normal) > 0.0
    }
}

/// What is seen of a trace, with its first contact as a ring and its last as a disc.
fn draw(svg: &mut Svg, view: &View, trace: &[Option<(Point, Vector)>], color: &str, class: &str) {
    let place = |touch: &Option<(Point, Vector)>| touch.filter(|(_, n)| view.sees(n)).map(|(point, _)| view.at(&point));
    let mut points: Vec<Option<[f64; 2]>> = Vec::new();
    for (k, touch) in trace.iter().enumerate() {
        let here = place(touch);
        let is_near = |at: [f64; 2], before: [f64; 2]| (at[0] - before[0]).hypot(at[1] - before[1]) < FINENESS;
        match (here, points.last()) {
            // Where the trace turns away, its last point seen is kept.
            (Some(at), Some(Some(before)))
                if is_near(at, *before) && k + 1 < trace.len() && place(&trace[k + 1]).is_some() => {}
            (None, Some(None)) => {}
            _ => points.push(here),
        }
    }
    svg.path(&points, color, 1.8, &format!("class=\"{class}\""));
    if let Some(at) = trace.first().and_then(place) {
        svg.disc(at, 3.6, "#ffffff", &format!("stroke=\"{color}\" stroke-width=\"1.6\""));
    }
    if let Some(at) = trace.last().and_then(place) {
        svg.disc(at, 3.6, color, "stroke=\"#ffffff\" stroke-width=\"1\"");
    }
}

fn key(svg: &mut Svg, plan: &Plan) {
    let y = TOP + 2.0 * CELL[1] + 6.0;
    let room = (WIDTH - 2.0 * LEFT - 190.0) / plan.fingers.len().max(1) as f64;
    for (finger, name) in plan.fingers.iter().enumerate() {
        let x = LEFT + room * finger as f64;
        svg.line([x, y], [x + 18.0, y], palette::color(finger), 2.5, "");
        svg.text(&cut(name, (room / 7.0) as usize), [x + 23.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    }
    let x = WIDTH - LEFT - 170.0;
    svg.disc([x, y], 3.6, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.6\"");
    svg.text("first contact", [x + 9.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    svg.disc([x + 92.0, y], 3.6, INK, "");
    svg.text("last contact", [x + 101.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
}

/// The object's surface, in its frame.
struct ObjectOutline {
    corners: Vec<Point>,
    /// Edges between faces: two corners, and the normals of the faces that meet.
    edges: Vec<([usize; 2], [Vector; 2])>,
    low: Point,
    high: Point,
}

impl ObjectOutline {
    /// What planner and checker keep apart of the object; none where it cannot be read.
    fn of(scene: &SceneStory) -> Option<Self> {
        let mut body =
            ObjectOutline { corners: Vec::new(), edges: Vec::new(), low: Point::origin(), high: Point::origin() };
        let is_object = |piece: &&PieceStory| scene.is_moved_object(piece.on) && piece.role == Role::Collision;
        for piece in scene.pieces.iter().filter(is_object) {
            let mesh = scene.meshes.get(piece.mesh)?;
            let (vertices, triangles) = pack::unpack(mesh)?;
            let (from_mesh, first) = (Pose::from(&piece.from_mesh), body.corners.len());
            body.corners.extend(vertices.iter().map(|v| from_mesh * v));
            if mesh.smooth_below == 0.0 {
                let triangles = triangles.iter().map(|t| t.map(|i| first + i as usize));
                body.add_edges(triangles.collect());
            }
        }
        let first = *body.corners.first()?;
        (body.low, body.high) = body.corners.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        Some(body)
    }

    fn add_edges(&mut self, triangles: Vec<[usize; 3]>) {
        let mut open: BTreeMap<[usize; 2], Vector> = BTreeMap::new();
        for [a, b, c] in triangles {
            let [p, q, r] = [a, b, c].map(|i| self.corners[i]);
            let Some(normal) = (q - p).cross(&(r - p)).try_normalize(0.0) else { continue };
            for (i, j) in [(a, b), (b, c), (c, a)] {
                match open.remove(&[j, i]) {
                    Some(other) if other.angle(&normal) > FLAT => self.edges.push(([i, j], [normal, other])),
                    Some(_) => {}
                    None => drop(open.insert([i, j], normal)),
                }
            }
        }
    }

    /// The outline of a convex object, and the edges that are seen.
    fn draw(&self, svg: &mut Svg, view: &View) {
        let outline = outline(self.corners.iter().map(|corner| view.at(corner)).collect());
        svg.polygon(&outline, "#f4f1ea", "stroke=\"#888888\" stroke-width=\"1.2\" class=\"outline\"");
        for ([i, j], normals) in &self.edges {
            if normals.iter().any(|normal| view.sees(normal)) {
                svg.line(view.at(&self.corners[*i]), view.at(&self.corners[*j]), "#cfc8b8", 0.8, "");
            }
        }
    }
}

/// The convex hull of points in the plane (Andrew's monotone chain), counter-clockwise in axes of which the second points up.
fn outline(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}
