//! The way of the object's rotation vectors in space.

use super::svg::{Anchor, GRID, INK, SOFT, Scale, Svg, cut, fixed};
use crate::palette;
use crate::timeline;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::Plan;

const WIDTH: f64 = 836.0;
const HEIGHT: f64 = 500.0;
/// Where the drawing may be: left, right, top, bottom.
const ROOM: [f64; 4] = [60.0, 640.0, 50.0, 450.0];
/// From where it is seen: turned about z by the azimuth, from above by the elevation, in radians.
const AZIMUTH: f64 = -0.95;
const ELEVATION: f64 = 0.42;
/// Free room around the path on the plane, in radians.
const MARGIN: f64 = 0.15;
/// The way on the plane.
const SHADOW: &str = "#9a9a9a";

/// The path of the object's orientation as in figures 10 to 18 of Cherif 1999: rotation vectors of the object in the world, in
/// radians, seen from obliquely above, with their projection on the plane of x and y; coloured by the finger that moves, start
/// and goal marked. None for a plan without waypoints.
pub fn orientation_path(plan: &Plan) -> Option<String> {
    let vectors = timeline::rotation_vectors(plan);
    let (start, end) = (*vectors.first()?, *vectors.last()?);
    let goal = timeline::nearest_vector(&Pose::from(&plan.goal).rotation.scaled_axis(), &end);
    let space = Space::around(vectors.iter().chain([&goal]));
    let mut svg = Svg::new(WIDTH, HEIGHT);
    svg.text("Orientation path", [24.0, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    let asked = Pose::from(&plan.start).rotation.angle_to(&Pose::from(&plan.goal).rotation);
    let lengths = format!(
        "rotation vectors [rad]; turned {:.1}\u{b0} along the path, asked for {:.1}\u{b0}",
        timeline::angle_along(plan).to_degrees(),
        asked.to_degrees()
    );
    svg.text(&lengths, [WIDTH - 24.0, 19.0], Anchor::End, SOFT, "font-size=\"11\"");
    space.draw(&mut svg);
    let shadow = |v: &Vector| space.at(&Vector::new(v.x, v.y, 0.0));
    let on_plane: Vec<Option<[f64; 2]>> = vectors.iter().map(|v| Some(shadow(v))).collect();
    svg.path(&on_plane, SHADOW, 1.6, "class=\"projection\"");
    for (v, foot) in [(&start, shadow(&start)), (&goal, shadow(&goal))] {
        svg.line(space.at(v), foot, SHADOW, 0.8, "stroke-dasharray=\"2 3\"");
    }
    let mut first = 0;
    for segment in &plan.segments {
        let own = &vectors[first..first + segment.waypoints.len()];
        first += segment.waypoints.len();
        let color = timeline::moving_finger(plan, segment).map_or(INK, palette::color);
        let points: Vec<Option<[f64; 2]>> = own.iter().map(|v| Some(space.at(v))).collect();
        svg.path(&points, color, 2.4, "class=\"path\"");
    }
    svg.disc(space.at(&start), 5.0, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.8\" class=\"start\"");
    let [x, y] = space.at(&goal);
    let diamond = [[x, y - 7.0], [x + 7.0, y], [x, y + 7.0], [x - 7.0, y]];
    svg.polygon(&diamond, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.8\" class=\"goal\"");
    key(&mut svg, plan);
    Some(svg.finish("Path of the object's orientation in the space of rotation vectors"))
}

fn key(svg: &mut Svg, plan: &Plan) {
    let x = ROOM[1] + 36.0;
    let mut y = 90.0;
    svg.disc([x, y], 5.0, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.8\"");
    svg.text("start", [x + 16.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    y += 22.0;
    let diamond = [[x, y - 7.0], [x + 7.0, y], [x, y + 7.0], [x - 7.0, y]];
    svg.polygon(&diamond, "#ffffff", "stroke=\"#222222\" stroke-width=\"1.8\"");
    svg.text("goal", [x + 16.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    let named =
        plan.fingers.iter().enumerate().map(|(k, name)| (palette::color(k), format!("{} moves", cut(name, 14))));
    for (color, text) in named.chain([(SHADOW, "on the plane of x, y".to_owned())]) {
        y += 22.0;
        svg.line([x - 8.0, y], [x + 8.0, y], color, 2.4, "");
        svg.text(&text, [x + 16.0, y + 4.0], Anchor::Start, SOFT, "font-size=\"11\"");
    }
}

/// The part of the space of rotation vectors that is drawn, and where it lies on the sheet.
struct Space {
    low: Vector,
    high: Vector,
    /// Units of the sheet per radian.
    scale: f64,
    /// Where the origin lies.
    origin: [f64; 2],
}

impl Space {
    /// The smallest box with some room on the plane of x and y that holds `vectors` and reaches to that plane.
    fn around<'v>(vectors: impl Iterator<Item = &'v Vector>) -> Self {
        let infinite = Vector::repeat(f64::INFINITY);
        let (mut low, mut high) = vectors.fold((infinite, -infinite), |(low, high), v| (low.inf(v), high.sup(v)));
        let margin = Vector::new(MARGIN, MARGIN, 0.0);
        (low, high) = (low - margin, high + margin);
        (low.z, high.z) = (low.z.min(0.0), high.z.max(0.0));
        let mut space = Space { low, high, scale: 1.0, origin: [0.0; 2] };
        let corners: Vec<[f64; 2]> = (0..8).map(|k| space.at(&space.corner(k))).collect();
        let range = |axis: usize| {
            let values = corners.iter().map(|corner| corner[axis]);
            (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, right), (top, bottom)) = (range(0), range(1));
        let scale = ((ROOM[1] - ROOM[0]) / (right - left)).min((ROOM[3] - ROOM[2]) / (bottom - top));
        let middle = [(ROOM[0] + ROOM[1]) / 2.0, (ROOM[2] + ROOM[3]) / 2.0];
        space.origin = [middle[0] - scale * (left + right) / 2.0, middle[1] - scale * (top + bottom) / 2.0];
        space.scale = scale;
        space
    }

    fn corner(&self, k: usize) -> Vector {
        let pick = |axis: usize| if k >> axis & 1 == 0 { self.low[axis] } else { self.high[axis] };
        Vector::new(pick(0), pick(1), pick(2))
    }

    /// Place on the sheet: a parallel projection.
    fn at(&self, v: &Vector) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(AZIMUTH);
        let (sine_up, cosine_up) = libm::sincos(ELEVATION);
        let right = -sine * v.x + cosine * v.y;
        let up = cosine_up * v.z - sine_up * (cosine * v.x + sine * v.y);
        [self.origin[0] + self.scale * right, self.origin[1] - self.scale * up]
    }

    /// The plane of x and y as a rectangle with a grid, the axes along its near edges, and that of z.
    fn draw(&self, svg: &mut Svg) {
        let (low, high) = (self.low, self.high);
        let flat = |x: f64, y: f64| self.at(&Vector::new(x, y, 0.0));
        let corners = [flat(low.x, low.y), flat(high.x, low.y), flat(high.x, high.y), flat(low.x, high.y)];
        svg.polygon(&corners, "#fafafa", "stroke=\"#888888\" stroke-width=\"1\"");
        let small = "font-size=\"10\"";
        let (ticks, decimals) = Scale::new(low.x, high.x, 0.0, 1.0).ticks(6);
        for x in ticks {
            svg.line(flat(x, low.y), flat(x, high.y), GRID, 0.8, "");
            let [at_x, at_y] = flat(x, low.y);
            svg.text(&fixed(x, decimals), [at_x - 6.0, at_y + 12.0], Anchor::End, SOFT, small);
        }
        let (ticks, decimals) = Scale::new(low.y, high.y, 0.0, 1.0).ticks(6);
        for y in ticks {
            svg.line(flat(low.x, y), flat(high.x, y), GRID, 0.8, "");
            let [at_x, at_y] = flat(high.x, y);
            svg.text(&fixed(y, decimals), [at_x + 6.0, at_y + 12.0], Anchor::Start, SOFT, small);
        }
        let foot = Vector::new(low.x, high.y, low.z);
        let top = Vector::new(low.x, high.y, high.z);
        svg.line(self.at(&foot), self.at(&top), SOFT, 1.0, "");
        let (ticks, decimals) = Scale::new(low.z, high.z, 0.0, 1.0).ticks(5);
        for z in ticks {
            let [x, y] = self.at(&Vector::new(low.x, high.y, z));
            svg.line([x, y], [x + 4.0, y], SOFT, 1.0, "");
            svg.text(&fixed(z, decimals), [x + 8.0, y + 4.0], Anchor::Start, SOFT, small);
        }
        let middle = (low + high) / 2.0;
        let [x, y] = flat(middle.x, low.y);
        svg.text("x", [x - 34.0, y + 28.0], Anchor::Middle, INK, "");
        let [x, y] = flat(high.x, middle.y);
        svg.text("y", [x + 34.0, y + 28.0], Anchor::Middle, INK, "");
        let [x, y] = self.at(&top);
        svg.text("z", [x, y - 8.0], Anchor::Middle, INK, "");
    }
}
