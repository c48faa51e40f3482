//! A rough look at collisions, before the exact one: distances from the object on a grid, and balls inside the links. What hits
//! here hits by far; what does not is asked exactly.

use rayon::prelude::*;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::shape::Shape;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_manipulation::grasp::state::HandJoints;
use regrasp_manipulation::model::{Carrier, Model};
use regrasp_scene::Object;

/// Nodes of the grid, about.
const N_NODES: f64 = 50_000.0;
/// Smallest cell, in metres.
const LEAST_CELL: f64 = 0.0015;
/// Nodes along each side of a block: of blocks far from the object one distance is measured.
const BLOCK: usize = 4;
/// A ball hits by far if it is this deep in the object, in cells: more than interpolation errs nearly everywhere. By hand.
const SLACK: f64 = 0.2;
/// Deepest that this has to be, in metres.
const LEAST_SLACK: f64 = 0.0005;
/// Step of a line on which the hand comes, in metres.
const LINE_STEP: f64 = 0.008;
/// Most joints of a finger.
const MOST_LINKS: usize = regrasp_robot::hand::MAX_FINGER_JOINTS;

/// A ball inside a link.
#[derive(Debug, Clone, Copy)]
struct InnerBall {
    /// Which link of the finger carries it; not used for the palm.
    link: usize,
    center: Point,
    radius: f64,
}

/// Distances from the object, and balls inside the hand.
#[derive(Debug, Clone)]
pub struct Rough {
    grid: DistanceGrid,
    fingers: Vec<Vec<InnerBall>>,
    palm: Vec<InnerBall>,
}

impl Rough {
    /// Prepares the look.
    pub fn new(model: &Model) -> Self {
        let mut fingers = vec![Vec::new(); model.n_fingers()];
        let mut palm = Vec::new();
        for index in 0..model.object {
            if !model.pairs.iter().any(|pair| pair.a == index && pair.b == model.object) {
                continue;
            }
            let body = &model.bodies[index];
            let balls = inner_balls(&body.shape).into_iter();
            let placed = |(center, radius): (Point, f64), link: usize| InnerBall {
                link,
                center: body.carrier_from_body.point(&center),
                radius,
            };
            match &body.carrier {
                Carrier::Finger { finger, link, .. } => fingers[*finger].extend(balls.map(|ball| placed(ball, *link))),
                _ => palm.extend(balls.map(|ball| placed(ball, 0))),
            }
        }
        let largest = fingers.iter().flatten().chain(&palm).map(|ball| ball.radius).fold(0.0, f64::max);
        Rough { grid: DistanceGrid::new(model.view.object, largest), fingers, palm }
    }

    /// True when the palm surely is in the object.
    pub fn palm_hits(&self, object_from_hand: &Placement) -> bool {
        self.palm.iter().any(|ball| self.grid.is_hit(&object_from_hand.point(&ball.center), ball.radius))
    }

    /// True when the hand with these joints surely hits the object on a straight line: the hand ends where it has the object at
    /// `hand_from_object`, and comes along `way`, in the object frame.
    pub fn line_hits(&self, model: &Model, joints: &HandJoints, hand_from_object: &Pose, way: &Vector) -> bool {
        let object_from_hand = Placement::from(&hand_from_object.inverse());
        let n_steps = (way.norm() / LINE_STEP).ceil().max(1.0) as usize;
        let hits = |ball: &InnerBall, carrier: &Placement| {
            let end = object_from_hand.point(&carrier.point(&ball.center));
            (0..=n_steps).any(|k| self.grid.is_hit(&(end - way * (k as f64 / n_steps as f64)), ball.radius))
        };
        let mut frames = [Placement::IDENTITY; MOST_LINKS];
        self.palm.iter().any(|ball| hits(ball, &Placement::IDENTITY))
            || (0..model.n_fingers()).any(|finger| {
                let chain = model.fingers[finger].ik.chain();
                let frames = &mut frames[..chain.joints.len()];
                chain.forward_frames(&joints[finger], frames);
                self.fingers[finger].iter().any(|ball| hits(ball, &frames[ball.link]))
            })
    }

    /// True when a link of `finger` surely is in the object.
    pub fn finger_hits(&self, model: &Model, finger: usize, joints: &[f64], object_from_hand: &Placement) -> bool {
        let chain = model.fingers[finger].ik.chain();
        let mut frames = [Placement::IDENTITY; MOST_LINKS];
        let frames = &mut frames[..chain.joints.len()];
        chain.forward_frames(joints, frames);
        self.fingers[finger].iter().any(|ball| {
            let center = object_from_hand.point(&frames[ball.link].point(&ball.center));
            self.grid.is_hit(&center, ball.radius)
        })
    }
}

/// Signed distances from the object at the nodes of a grid about it.
#[derive(Debug, Clone)]
struct DistanceGrid {
    low: Point,
    cell: f64,
    counts: [usize; 3],
    distances: Vec<f32>,
    slack: f64,
}

impl DistanceGrid {
    /// A grid that reaches `beyond` from the object.
    fn new(object: &Object, beyond: f64) -> Self {
        let (low, high) = object.shape.bounds();
        let (low, high) = (low - Vector::repeat(beyond), high + Vector::repeat(beyond));
        let size = high - low;
        let cell = (size.product() / N_NODES).cbrt().max(LEAST_CELL);
        let counts: [usize; 3] = std::array::from_fn(|k| (size[k] / cell).ceil() as usize + 1);
        let blocks = counts.map(|n| n.div_ceil(BLOCK));
        let surface = &object.surface;
        let at = |node: [usize; 3]| low + Vector::from(node.map(|n| n as f64)) * cell;
        let half = 0.5 * (BLOCK - 1) as f64 * cell;
        // Columns of blocks side by side; their values do not depend on who works them out.
        let columns: Vec<Vec<([usize; 3], f32)>> = (0..blocks[0] * blocks[1])
            .into_par_iter()
            .map(|column| {
                let mut found = Vec::new();
                for third in 0..blocks[2] {
                    let first = [column / blocks[1], column % blocks[1], third].map(|n| n * BLOCK);
                    let middle = at(first) + Vector::repeat(half);
                    let in_middle = surface.signed_distance(&middle);
                    let is_far = in_middle - half * 3f64.sqrt() > beyond;
                    for n in 0..BLOCK.pow(3) {
                        let node = [n / (BLOCK * BLOCK), n / BLOCK % BLOCK, n % BLOCK];
                        let node: [usize; 3] = std::array::from_fn(|k| first[k] + node[k]);
                        if (0..3).any(|k| node[k] >= counts[k]) {
                            continue;
                        }
                        let point = at(node);
                        let distance = match is_far {
                            true => in_middle - (point - middle).norm(),
                            false => surface.signed_distance(&point),
                        };
                        found.push((node, distance as f32));
                    }
                }
                found
            })
            .collect();
        let mut distances = vec![0.0; counts.iter().product()];
        for (node, distance) in columns.into_iter().flatten() {
            distances[(node[0] * counts[1] + node[1]) * counts[2] + node[2]] = distance;
        }
        DistanceGrid { low, cell, counts, distances, slack: (SLACK * cell).max(LEAST_SLACK) }
    }

    /// True when a ball surely is in the object.
    #[inline]
    fn is_hit(&self, center: &Point, radius: f64) -> bool {
        self.distance(center).is_some_and(|distance| distance + self.slack < radius)
    }

    /// About the distance of `point` from the object, negative inside; none outside the grid.
    #[inline]
    fn distance(&self, point: &Point) -> Option<f64> {
        let scaled = (point - self.low) / self.cell;
        if (0..3).any(|k| !(scaled[k] >= 0.0 && scaled[k] < (self.counts[k] - 1) as f64)) {
            return None;
        }
        let [i, j, k] = [scaled.x as usize, scaled.y as usize, scaled.z as usize];
        let (x, y, z) = (scaled.x - i as f64, scaled.y - j as f64, scaled.z - k as f64);
        let first = (i * self.counts[1] + j) * self.counts[2] + k;
        let along_z = |index: usize| {
            let (a, b) = (f64::from(self.distances[index]), f64::from(self.distances[index + 1]));
            a + (b - a) * z
        };
        let along_y = |index: usize| {
            let (a, b) = (along_z(index), along_z(index + self.counts[2]));
            a + (b - a) * y
        };
        let (a, b) = (along_y(first), along_y(first + self.counts[1] * self.counts[2]));
        Some(a + (b - a) * x)
    }
}

/// Balls inside a convex shape that fill much of it, in its frame. Radius zero: points.
fn inner_balls(shape: &Shape) -> Vec<(Point, f64)> {
    let lattice = |room: Vector, radius: f64| {
        let counts: [usize; 3] = std::array::from_fn(|k| (2.0 * room[k] / radius).ceil() as usize + 1);
        let along = |k: usize, n: usize| match counts[k] {
            1 => 0.0,
            count => room[k] * (2.0 * n as f64 / (count - 1) as f64 - 1.0),
        };
        let mut balls = Vec::new();
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                balls.extend((0..counts[2]).map(|k| (Point::new(along(0, i), along(1, j), along(2, k)), radius)));
            }
        }
        balls
    };
    match shape {
        Shape::Sphere { radius } => vec![(Point::origin(), *radius)],
        Shape::Capsule { half_length, radius } => lattice(Vector::new(0.0, 0.0, *half_length), *radius),
        Shape::Cuboid { half_extents } => {
            let radius = half_extents.min();
            let corners = (0..8).map(|n| Vector::from_fn(|k, _| if n >> k & 1 == 1 { 1.0 } else { -1.0 }));
            let corners = corners.map(|corner| (Point::from(half_extents.component_mul(&corner)), 0.0));
            lattice(half_extents - Vector::repeat(radius), radius).into_iter().chain(corners).collect()
        }
        Shape::Cylinder { half_length, radius } => {
            let inner = radius.min(*half_length);
            lattice(Vector::new(0.0, 0.0, half_length - inner), inner)
        }
        Shape::Ellipsoid { radii } => vec![(Point::origin(), radii.min())],
        Shape::Convex(hull) => {
            let middle = shape.middle();
            let every = hull.vertices().len().div_ceil(MOST_VERTICES);
            let corners = hull.vertices().iter().step_by(every);
            corners.flat_map(|corner| [0.4, 0.95].map(|share| (middle + (corner - middle) * share, 0.0))).collect()
        }
        Shape::Mesh(_) => Vec::new(),
    }
}

/// Most vertices of a polyhedron that are looked at.
const MOST_VERTICES: usize = 24;

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::collision::support::support_value;
    use regrasp_geometry::hull::ConvexHull;
    use regrasp_robot::import::LoadOptions;
    use std::path::Path;
    use std::sync::Arc;

    #[test]
    fn balls_are_inside_their_shapes() {
        let mut rng = Rng::keyed(1, "inner balls", 0);
        let corners: Vec<Point> = (0..60).map(|_| Point::from(Vector::from(rng.direction()) * 0.03)).collect();
        let shapes = [
            Shape::Sphere { radius: 0.01 },
            Shape::Capsule { half_length: 0.03, radius: 0.008 },
            Shape::Cuboid { half_extents: Vector::new(0.06, 0.04, 0.015) },
            Shape::Cylinder { half_length: 0.03, radius: 0.01 },
            Shape::Cylinder { half_length: 0.004, radius: 0.03 },
            Shape::Ellipsoid { radii: Vector::new(0.01, 0.02, 0.03) },
            Shape::Convex(Arc::new(ConvexHull::new(&corners).unwrap())),
        ];
        for shape in &shapes {
            let balls = inner_balls(shape);
            assert!(!balls.is_empty());
            for (center, radius) in balls {
                for _ in 0..50 {
                    let direction = Vector::from(rng.direction());
                    let over = center.coords.dot(&direction) + radius - support_value(shape, &direction, &mut 0);
                    assert!(over < 1e-9, "{}: {over}", shape.kind());
                }
            }
        }
    }

    /// What hits here is in the object, and of balls that are deep in it most hit.
    #[test]
    fn what_hits_is_in_the_object() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let options = LoadOptions::default();
        for scene in
            ["scenes/box_90x.toml", "scenes/sphere_90x.toml", "scenes/pencil.toml", "scenes/two_arms/justin_horse.toml"]
        {
            let scene =
                regrasp_scene::load_scene(&root.join(scene), &options).unwrap_or_else(|error| panic!("{error}"));
            let object = &scene.scene.objects[0];
            let grid = DistanceGrid::new(object, 0.02);
            let (low, high) = object.shape.bounds();
            let (low, size) = (low - Vector::repeat(0.01), high - low + Vector::repeat(0.02));
            let mut rng = Rng::keyed(2, "rough", 0);
            let (mut n_hits, mut n_false, mut n_deep, mut n_missed) = (0, 0, 0, 0);
            for _ in 0..20_000 {
                let share = Vector::new(rng.unit(), rng.unit(), rng.unit());
                let (center, radius) = (low + size.component_mul(&share), 0.02 * rng.unit());
                let distance = object.surface.signed_distance(&center);
                let is_hit = grid.is_hit(&center, radius);
                n_hits += usize::from(is_hit);
                n_false += usize::from(is_hit && distance >= radius);
                let is_deep = distance < radius - 2.0 * grid.slack;
                n_deep += usize::from(is_deep);
                n_missed += usize::from(is_deep && !is_hit);
            }
            assert!(n_hits > 500 && n_false * 1000 <= n_hits, "{}: {n_false} of {n_hits}", object.name);
            assert!(n_deep > 500 && n_missed * 100 <= n_deep, "{}: {n_missed} of {n_deep}", object.name);
        }
    }
}
