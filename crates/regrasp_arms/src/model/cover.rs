//! Balls that cover the shapes of a robot's links.

use nalgebra::Matrix3;
use regrasp_geometry::collision::{MeshTree, Placed, Placement, Separation, separation};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_robot::Robot;
use regrasp_robot::hand::convex_of;
use std::ops::Range;

/// A ball in the frame of its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverBall {
    /// Centre.
    pub center: Point,
    /// Radius, in metres.
    pub radius: f64,
}

/// Balls and shapes of one link.
#[derive(Debug, Clone)]
pub struct LinkCover {
    /// Balls that together contain all shapes.
    pub balls: Vec<CoverBall>,
    /// Groups of balls that lie together: a ball about each, and which those are.
    pub groups: Vec<(CoverBall, Range<usize>)>,
    /// A ball about all balls: centre and radius.
    pub bound: (Point, f64),
    /// The shapes.
    pub shapes: Vec<PlacedShape>,
    /// True where the shapes are the balls.
    pub is_exact: bool,
}

impl LinkCover {
    /// The same cover at `parent_from_own`.
    #[must_use]
    pub fn moved(&self, parent_from_own: &Pose) -> Self {
        let ball = |ball: &CoverBall| CoverBall { center: parent_from_own * ball.center, ..*ball };
        let shape = |placed: &PlacedShape| PlacedShape {
            parent_from_shape: parent_from_own * placed.parent_from_shape,
            shape: placed.shape.clone(),
        };
        LinkCover {
            balls: self.balls.iter().map(ball).collect(),
            groups: self.groups.iter().map(|(bound, balls)| (ball(bound), balls.clone())).collect(),
            bound: (parent_from_own * self.bound.0, self.bound.1),
            shapes: self.shapes.iter().map(shape).collect(),
            is_exact: self.is_exact,
        }
    }
}

/// Largest edge of the cells that shapes are cut into, in metres.
const CELL: f64 = 0.05;
/// Least number of cells along the longest side of a shape.
const CELLS_ALONG: f64 = 3.0;
/// Most cells along one side.
const MOST_ALONG: f64 = 24.0;

/// The covers of all links, by link id. Links of spheres are their own cover. Meshes stand for their convex hulls.
pub fn covers(robot: &Robot) -> Vec<LinkCover> {
    robot.links.iter().map(|link| cover(&link.collision)).collect()
}

/// The cover of the shapes of one link.
pub fn cover(shapes: &[PlacedShape]) -> LinkCover {
    let convex = |placed: &PlacedShape| PlacedShape {
        parent_from_shape: placed.parent_from_shape,
        // A flat mesh has no hull: its triangles are tested.
        shape: convex_of(&placed.shape).unwrap_or_else(|_| placed.shape.clone()),
    };
    let shapes: Vec<PlacedShape> = shapes.iter().map(convex).collect();
    let mut balls = Vec::new();
    for placed in &shapes {
        let place = |ball: CoverBall| CoverBall { center: placed.parent_from_shape * ball.center, ..ball };
        balls.extend(cover_shape(&placed.shape).into_iter().map(place));
    }
    let is_exact = shapes.iter().all(|placed| matches!(placed.shape, Shape::Sphere { .. }));
    let bound = ball_about(&balls);
    let groups = grouped(&mut balls);
    LinkCover { bound, balls, groups, shapes, is_exact }
}

/// Balls of one group at most.
const GROUP: usize = 8;

/// Puts balls in an order in which those that lie together follow each other, halved along the longest side of their centres' box
/// until groups are small.
fn grouped(balls: &mut [CoverBall]) -> Vec<(CoverBall, Range<usize>)> {
    let mut groups = Vec::new();
    let mut pending = Vec::from_iter((!balls.is_empty()).then_some(0..balls.len()));
    while let Some(range) = pending.pop() {
        let own = &mut balls[range.clone()];
        if own.len() <= GROUP {
            let (center, radius) = ball_about(own);
            groups.push((CoverBall { center, radius }, range));
            continue;
        }
        let corner = |of: fn(&Vector, &Vector) -> Vector| {
            own.iter().map(|ball| ball.center.coords).reduce(|a, b| of(&a, &b)).unwrap_or_else(Vector::zeros)
        };
        let axis = (corner(Vector::sup) - corner(Vector::inf)).imax();
        own.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let middle = range.start + own.len() / 2;
        pending.extend([middle..range.end, range.start..middle]);
    }
    groups
}

/// Balls that contain `shape`, in its frame.
pub fn cover_shape(shape: &Shape) -> Vec<CoverBall> {
    match shape {
        Shape::Sphere { radius } => vec![CoverBall { center: Point::origin(), radius: *radius }],
        Shape::Capsule { half_length, radius } => along_axis(*half_length, *radius),
        _ => in_cells(shape),
    }
}

/// Balls along the axis of a capsule.
fn along_axis(half_length: f64, radius: f64) -> Vec<CoverBall> {
    let n = (2.0 * half_length / radius).ceil().clamp(1.0, 64.0);
    let step = 2.0 * half_length / n;
    let grown = radius.hypot(0.5 * step);
    let middle = (0..n as usize).map(|i| (-half_length + (i as f64 + 0.5) * step, grown));
    // Between two neighbours the wider balls contain the tube; the ends of the capsule are balls of its own radius.
    let ends = [(-half_length, radius), (half_length, radius)];
    let all = middle.chain(ends);
    all.map(|(z, radius)| CoverBall { center: Point::new(0.0, 0.0, z), radius }).collect()
}

/// Balls about the cells of a grid that the shape meets.
fn in_cells(shape: &Shape) -> Vec<CoverBall> {
    let (low, high) = shape.bounds();
    let size = high - low;
    let edge = CELL.min(size.max() / CELLS_ALONG).max(size.max() / MOST_ALONG);
    let n = size.map(|side| (side / edge).ceil().clamp(1.0, MOST_ALONG));
    let cell = size.component_div(&n);
    let tree = match shape {
        Shape::Mesh(mesh) => Some(MeshTree::new(mesh)),
        _ => None,
    };
    let mut balls = Vec::new();
    for i in 0..n.x as usize {
        for j in 0..n.y as usize {
            for k in 0..n.z as usize {
                let index = Vector::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                let center = low + index.component_mul(&cell);
                if is_met(shape, tree.as_ref(), &center, &cell) {
                    balls.push(CoverBall { center, radius: 0.5 * cell.norm() });
                }
            }
        }
    }
    balls
}

fn is_met(shape: &Shape, tree: Option<&MeshTree>, center: &Point, cell: &Vector) -> bool {
    let half_extents = (cell * 0.5).map(|half: f64| half.max(1e-9));
    let cuboid = Shape::Cuboid { half_extents };
    let at = Placement { rotation: Matrix3::identity(), translation: center.coords };
    if let Some(tree) = tree {
        return !tree.is_outside(&cuboid, &Point::origin(), &at, 0.0, &mut 0.0);
    }
    let answer = separation(
        Placed { shape: &cuboid, at: &at },
        Placed { shape, at: &Placement::IDENTITY },
        1e-9,
        1e-9,
        &mut Vector::zeros(),
        &mut [0; 2],
    );
    !matches!(answer, Separation::SeparatedBy(_))
}

/// A small ball about balls: centre and radius.
pub fn ball_about(balls: &[CoverBall]) -> (Point, f64) {
    let corner = |sign: f64| {
        let reach = |ball: &CoverBall| ball.center.coords + Vector::repeat(sign * ball.radius);
        let corners = balls.iter().map(reach);
        corners.reduce(|a, b| if sign < 0.0 { a.inf(&b) } else { a.sup(&b) }).unwrap_or_else(Vector::zeros)
    };
    let mut center = Point::from((corner(-1.0) + corner(1.0)) * 0.5);
    let reach = |center: &Point| {
        let far = balls.iter().map(|ball| ((ball.center - center).norm() + ball.radius, ball));
        far.max_by(|a, b| a.0.total_cmp(&b.0)).map_or((0.0, Vector::zeros()), |(far, ball)| (far, ball.center - center))
    };
    let mut best = (center, reach(&center).0);
    // Towards what is farthest, by smaller and smaller steps (Badoiu, Clarkson 2003).
    for round in 1..100 {
        center += reach(&center).1 / f64::from(round + 1);
        let now = reach(&center).0;
        if now < best.1 {
            best = (center, now);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn groups_hold_each_ball_once() {
        let mut rng = Rng::keyed(4, "groups", 0);
        for n in [0, 1, 8, 9, 16, 17, 300] {
            let mut balls: Vec<CoverBall> = (0..n)
                .map(|_| {
                    let center = Point::from(Vector::from_fn(|_, _| rng.uniform(-0.3, 0.3)));
                    CoverBall { center, radius: rng.uniform(0.01, 0.05) }
                })
                .collect();
            let groups = grouped(&mut balls);
            let mut next = 0;
            for (bound, range) in &groups {
                assert_eq!(range.start, next);
                assert!((1..=GROUP).contains(&range.len()));
                next = range.end;
                let far = balls[range.clone()].iter().map(|ball| (ball.center - bound.center).norm() + ball.radius);
                assert!(far.fold(0.0, f64::max) <= bound.radius + 1e-12);
            }
            assert_eq!(next, n);
        }
    }

    #[test]
    fn covers_contain_their_shapes() {
        let mut rng = Rng::keyed(3, "cover", 0);
        let shapes = [
            Shape::Capsule { half_length: 0.15, radius: 0.04 },
            Shape::Cuboid { half_extents: Vector::new(0.05, 0.12, 0.02) },
            Shape::Cylinder { half_length: 0.1, radius: 0.06 },
            Shape::Ellipsoid { radii: Vector::new(0.1, 0.05, 0.02) },
        ];
        for shape in &shapes {
            let balls = cover_shape(shape);
            let (center, radius) = ball_about(&balls);
            for ball in &balls {
                assert!((ball.center - center).norm() + ball.radius <= radius + 1e-12);
            }
            let mut n_inside = 0;
            let (low, high) = shape.bounds();
            while n_inside < 500 {
                let p = Point::new(rng.uniform(low.x, high.x), rng.uniform(low.y, high.y), rng.uniform(low.z, high.z));
                let point = Shape::Sphere { radius: 1e-9 };
                let at = Placement { rotation: Matrix3::identity(), translation: p.coords };
                let found = separation(
                    Placed { shape: &point, at: &at },
                    Placed { shape, at: &Placement::IDENTITY },
                    1e-9,
                    1e-9,
                    &mut Vector::zeros(),
                    &mut [0; 2],
                );
                let is_inside = !matches!(found, Separation::SeparatedBy(_));
                if is_inside {
                    n_inside += 1;
                    let is_covered = balls.iter().any(|ball| (p - ball.center).norm() <= ball.radius + 1e-8);
                    assert!(is_covered, "{shape:?} {p}");
                }
            }
        }
    }
}
