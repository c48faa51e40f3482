//! Poses in which an object stands on a plane by itself.

use crate::frame::tangents;
use crate::{ConvexHull, Point, Shape, UnitVector, Vector};
use nalgebra::{Matrix3, Vector2};

/// Vertices this near to the plane carry the object, in metres.
const ON_PLANE: f64 = 0.2e-3;
/// Poses whose directions differ by less than this are one, in radians.
const SAME_POSE: f64 = 0.05;

/// Corners of the polygon that stands for the rim of a cylinder.
const RIM: usize = 360;
/// Cosine of the largest angle between an upright cylinder and gravity.
const UPRIGHT: f64 = 0.99;

/// A pose in which the object stands.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// Direction of gravity, in the object frame.
    pub down: Vector,
    /// Where the plane is along it.
    pub height: f64,
    /// Angle by which the object can be tilted.
    pub tipping_angle: f64,
}

impl Standing {
    /// How far the centre of mass is inside the polygon of what touches.
    pub fn margin(&self, center_of_mass: &Point) -> f64 {
        self.tipping_angle.tan() * (self.height - self.down.dot(&center_of_mass.coords))
    }
}

/// The poses in which `shape` stands with at least this tipping angle, steadiest first. Balls, capsules and ellipsoids roll; of
/// cylinders the ends count.
pub fn stable_poses(shape: &Shape, center_of_mass: &Point, least_angle: f64) -> Vec<Standing> {
    let mut poses = match shape {
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => Vec::new(),
        Shape::Cuboid { half_extents: h } => {
            let corner = |k: u8| Point::from(Vector::from_fn(|i, _| if k >> i & 1 == 1 { h[i] } else { -h[i] }));
            let corners: Vec<Point> = (0..8).map(corner).collect();
            let axes = (0..3).flat_map(|k| [Vector::ith(k, 1.0), Vector::ith(k, -1.0)]);
            axes.filter_map(|down| standing(&corners, down, center_of_mass)).collect()
        }
        Shape::Cylinder { half_length, radius } => {
            let offset = center_of_mass.coords.xy().norm();
            let end = |side: f64| {
                let above = half_length - side * center_of_mass.z;
                let tipping_angle = (radius - offset).atan2(above);
                Standing { down: Vector::z() * side, height: *half_length, tipping_angle }
            };
            [1.0, -1.0].map(end).into_iter().filter(|pose| pose.tipping_angle > 0.0).collect()
        }
        Shape::Convex(hull) => of_hull(hull, hull.vertices(), center_of_mass),
        Shape::Mesh(mesh) => ConvexHull::new(mesh.vertices())
            .map_or_else(|_| Vec::new(), |hull| of_hull(&hull, mesh.vertices(), center_of_mass)),
    };
    poses.retain(|pose| pose.tipping_angle >= least_angle);
    poses.sort_by(|a, b| b.tipping_angle.total_cmp(&a.tipping_angle));
    let mut kept: Vec<Standing> = Vec::new();
    for pose in poses {
        if kept.iter().all(|other| other.down.dot(&pose.down) < SAME_POSE.cos()) {
            kept.push(pose);
        }
    }
    kept
}

/// How `shape` stands with `down` as the direction of gravity, a unit vector in its frame; none where it tips over or rolls.
pub fn standing_along(shape: &Shape, center_of_mass: &Point, down: &Vector) -> Option<Standing> {
    match shape {
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => None,
        Shape::Cuboid { half_extents: h } => {
            let corner = |k: u8| Point::from(Vector::from_fn(|i, _| if k >> i & 1 == 1 { h[i] } else { -h[i] }));
            standing(&(0..8).map(corner).collect::<Vec<_>>(), *down, center_of_mass)
        }
        Shape::Cylinder { half_length, radius } => {
            let rim = |k: usize| {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / RIM as f64).sin_cos();
                Point::new(radius * cosine, radius * sine, half_length * down.z.signum())
            };
            let points: Vec<Point> = (0..RIM).map(rim).collect();
            standing(&points, *down, center_of_mass).filter(|_| down.z.abs() > UPRIGHT)
        }
        Shape::Convex(hull) => standing(hull.vertices(), *down, center_of_mass),
        Shape::Mesh(mesh) => standing(mesh.vertices(), *down, center_of_mass),
    }
}

/// Every triangle of the hull as a face to stand on; all vertices of the object count.
fn of_hull(hull: &ConvexHull, vertices: &[Point], center_of_mass: &Point) -> Vec<Standing> {
    let corners = hull.vertices();
    let mut poses = Vec::new();
    for triangle in hull.triangles() {
        let [a, b, c] = triangle.map(|i| corners[i as usize]);
        let Some(down) = (b - a).cross(&(c - a)).try_normalize(1e-16) else { continue };
        // Outwards, however the hull is wound.
        let down = if down.dot(&(a - center_of_mass)) < 0.0 { -down } else { down };
        // Only where the centre of mass stands over about this triangle: of a finely divided hull these are few.
        let foot = center_of_mass + down * down.dot(&(a - center_of_mass));
        let radius = [a, b, c].map(|p| (p - foot).norm()).into_iter().fold(0.0, f64::max);
        let longest = [(b - a).norm(), (c - b).norm(), (a - c).norm()].into_iter().fold(0.0, f64::max);
        if radius > 2.0 * longest + 20.0 * ON_PLANE {
            continue;
        }
        poses.extend(standing(vertices, down, center_of_mass));
    }
    poses
}

/// The pose with `down` as the direction of gravity, if the centre of mass is over the polygon of what touches.
fn standing(vertices: &[Point], down: Vector, center_of_mass: &Point) -> Option<Standing> {
    let height = vertices.iter().map(|p| down.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
    let turn = frame_of(&down);
    let flat = |p: &Point| -> Vector2<f64> { (turn.transpose() * (p - center_of_mass)).xy() };
    let touching: Vec<Vector2<f64>> =
        vertices.iter().filter(|p| down.dot(&p.coords) > height - ON_PLANE).map(flat).collect();
    let polygon = convex_polygon(touching);
    if polygon.len() < 3 {
        return None;
    }
    let distance = (0..polygon.len())
        .map(|k| {
            let (from, to) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            let along = (to - from).normalize();
            // Counter-clockwise: the inside is on the left.
            along.x * -from.y - along.y * -from.x
        })
        .fold(f64::INFINITY, f64::min);
    let above = height - down.dot(&center_of_mass.coords);
    (distance > 0.0 && above > 0.0).then(|| Standing { down, height, tipping_angle: distance.atan2(above) })
}

/// A frame with `down` as its third axis.
fn frame_of(down: &Vector) -> Matrix3<f64> {
    let (x, y) = tangents(&UnitVector::new_unchecked(*down));
    Matrix3::from_columns(&[x.into_inner(), y.into_inner(), *down])
}

/// The convex polygon around points, counter-clockwise (Andrew's monotone chain).
pub fn convex_polygon(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_left = |a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>| (b - a).perp(&(c - b)) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while chain.len() >= 2 && !turns_left(&chain[chain.len() - 2], &chain[chain.len() - 1], &point) {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut polygon = chain(&mut points.iter().copied());
    polygon.extend(chain(&mut points.iter().rev().copied()));
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_stands_on_its_six_faces_and_tips_over_its_nearest_edge() {
        let shape = Shape::Cuboid { half_extents: Vector::new(0.01, 0.02, 0.03) };
        let poses = stable_poses(&shape, &Point::origin(), 0.01);
        assert_eq!(poses.len(), 6);
        assert!((poses[0].tipping_angle - 2f64.atan2(1.0)).abs() < 1e-12);
        assert!((poses[5].tipping_angle - 1f64.atan2(3.0)).abs() < 1e-12);
        assert_eq!(stable_poses(&shape, &Point::origin(), 0.4).len(), 4);
        // The centre of mass stands beside two faces.
        assert_eq!(stable_poses(&shape, &Point::new(0.0, 0.019, 0.0), 0.2).len(), 2);
        let tilted = |angle: f64| Vector::new(angle.sin(), 0.0, -angle.cos());
        let upright = standing_along(&shape, &Point::origin(), &tilted(0.001)).unwrap();
        assert!((upright.margin(&Point::origin()) - 0.01).abs() < 1e-4);
        assert!(standing_along(&shape, &Point::origin(), &tilted(0.1)).is_none());
        let cylinder = Shape::Cylinder { half_length: 0.02, radius: 0.03 };
        let end = standing_along(&cylinder, &Point::origin(), &tilted(0.0)).unwrap();
        assert!((end.margin(&Point::origin()) - 0.03).abs() < 1e-4);
        assert!(standing_along(&cylinder, &Point::origin(), &Vector::x()).is_none());
        assert!(stable_poses(&Shape::Sphere { radius: 0.03 }, &Point::origin(), 0.0).is_empty());
        assert_eq!(stable_poses(&Shape::Cylinder { half_length: 0.02, radius: 0.03 }, &Point::origin(), 0.0).len(), 2);
    }
}
