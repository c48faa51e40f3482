//! Distance of contacts from the object's sharp edges, by closed forms and by looking at every edge.

use crate::check::surface::distance_to_edge;
use regrasp_geometry::{Point, Shape, Vector};
use std::f64::consts::PI;

/// How far beside an edge one looks whether it is hidden in the solid, in metres.
const BESIDE: f64 = 1e-6;

/// The sharp edges of a shape.
#[derive(Debug)]
pub enum Edges<'a> {
    /// None: balls, capsules, ellipsoids.
    Smooth,
    /// The twelve edges of a box.
    Cuboid(Vector),
    /// The two rims of a cylinder: half length and radius.
    Cylinder(f64, f64),
    /// Edges that are open, belong to more than two triangles, or fold by more than an angle.
    Triangles {
        /// Where the corners are.
        vertices: &'a [Point],
        /// All triangles.
        triangles: &'a [[u32; 3]],
        /// The sharp ones.
        sharp: Vec<SharpEdge>,
    },
}

/// A sharp edge and the direction that halves the outside angle, or any other across an open edge.
#[derive(Debug)]
pub struct SharpEdge {
    ends: [Point; 2],
    across: Vector,
}

impl<'a> Edges<'a> {
    /// The edges of `shape`; those of meshes and hulls that fold by more than `crease_angle` radians.
    pub fn of(shape: &'a Shape, crease_angle: f64) -> Self {
        match shape {
            Shape::Cuboid { half_extents } => Edges::Cuboid(*half_extents),
            Shape::Cylinder { half_length, radius } => Edges::Cylinder(*half_length, *radius),
            Shape::Convex(hull) => of_triangles(hull.vertices(), hull.triangles(), crease_angle),
            Shape::Mesh(mesh) => of_triangles(mesh.vertices(), mesh.triangles(), crease_angle),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => Edges::Smooth,
        }
    }

    /// Distance of a point of the surface from the nearest edge, if it is below `limit`; else some value that is not.
    ///
    /// Edges of one part of a mesh that lie inside another part do not count: no finger can touch them.
    pub fn distance(&self, point: &Point, limit: f64) -> f64 {
        match self {
            Edges::Smooth => f64::INFINITY,
            Edges::Cuboid(half_extents) => {
                // On a face, the nearest edge is as far as the second-nearest face.
                let mut inside: Vec<f64> = (half_extents - point.coords.abs()).iter().copied().collect();
                inside.sort_by(f64::total_cmp);
                inside[1]
            }
            Edges::Cylinder(half_length, radius) => {
                (point.coords.xy().norm() - radius).hypot(point.z.abs() - half_length)
            }
            Edges::Triangles { vertices, triangles, sharp } => {
                let mut near: Vec<(f64, &SharpEdge)> = sharp
                    .iter()
                    .map(|edge| (distance_to_edge(point, &edge.ends[0], &edge.ends[1]), edge))
                    .filter(|(distance, _)| *distance < limit)
                    .collect();
                near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
                let seen = near.iter().find(|(_, edge)| !is_hidden(edge, point, vertices, triangles));
                seen.map_or(f64::INFINITY, |(distance, _)| *distance)
            }
        }
    }
}

fn of_triangles<'a>(vertices: &'a [Point], triangles: &'a [[u32; 3]], crease_angle: f64) -> Edges<'a> {
    // Ends of each edge and the corner opposite to it, of every triangle.
    let sides = triangles.iter().flat_map(|&[a, b, c]| {
        [(a, b, c), (b, c, a), (c, a, b)].map(|(from, to, apex)| ([from.min(to), from.max(to)], apex))
    });
    let mut sides: Vec<([u32; 2], u32)> = sides.collect();
    sides.sort_by_key(|(ends, _)| *ends);
    let mut sharp = Vec::new();
    for edge in sides.chunk_by(|(ends, _), (others, _)| ends == others) {
        let [from, to] = edge[0].0.map(|i| vertices[i as usize]);
        // Directions into the triangles, square to the edge; opposite ones are a flat surface, however it is wound.
        let along = (to - from).normalize();
        let inward: Vec<Vector> = edge
            .iter()
            .filter_map(|&(_, apex)| {
                let arm = vertices[apex as usize] - from;
                (arm - along * arm.dot(&along)).try_normalize(0.0)
            })
            .collect();
        let is_smooth = matches!(&inward[..], [one, other] if PI - one.angle(other) <= crease_angle);
        if !is_smooth {
            let sum: Vector = inward.iter().sum();
            let across = sum.try_normalize(1e-9).unwrap_or_else(|| along.cross(&inward[0]).normalize());
            sharp.push(SharpEdge { ends: [from, to], across });
        }
    }
    Edges::Triangles { vertices, triangles, sharp }
}

/// True when the point of the edge that is nearest to `point` has the solid on both sides.
fn is_hidden(edge: &SharpEdge, point: &Point, vertices: &[Point], triangles: &[[u32; 3]]) -> bool {
    let along = edge.ends[1] - edge.ends[0];
    let share = ((point - edge.ends[0]).dot(&along) / along.norm_squared()).clamp(0.05, 0.95);
    let on_edge = edge.ends[0] + along * share;
    [BESIDE, -BESIDE]
        .iter()
        .all(|step| winding_number(&(on_edge + edge.across * *step), vertices, triangles).abs() > 0.5)
}

/// Solid angle of all triangles over 4 pi (Jacobson et al. 2013; Van Oosterom and Strackee 1983).
fn winding_number(at: &Point, vertices: &[Point], triangles: &[[u32; 3]]) -> f64 {
    let half_angle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| vertices[i as usize] - at);
        let [p, q, r] = [a.norm(), b.norm(), c.norm()];
        a.dot(&b.cross(&c)).atan2(p * q * r + a.dot(&b) * r + b.dot(&c) * p + c.dot(&a) * q)
    };
    triangles.iter().map(half_angle).sum::<f64>() / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::import::read_mesh;
    use regrasp_geometry::{Surface, TriangleMesh};
    use std::io::Write;
    use std::path::{Path, PathBuf};
    use std::sync::Arc;

    const CREASE_ANGLE: f64 = PI / 6.0;

    /// A box of half extents `half` about `center`, twelve triangles.
    fn box_triangles(center: Vector, half: Vector, vertices: &mut Vec<Point>, triangles: &mut Vec<[u32; 3]>) {
        let first = vertices.len() as u32;
        for i in 0..8u32 {
            let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            vertices.push(Point::from(center + half.component_mul(&Vector::new(sign(0), sign(1), sign(2)))));
        }
        for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            triangles.extend([[a, b, c], [a, c, d]].map(|corners: [u32; 3]| corners.map(|i| i + first)));
        }
    }

    fn mesh(boxes: &[(Vector, Vector)]) -> Shape {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (center, half) in boxes {
            box_triangles(*center, *half, &mut vertices, &mut triangles);
        }
        Shape::Mesh(Arc::new(TriangleMesh::new(vertices, triangles).unwrap()))
    }

    #[test]
    fn the_triangles_of_a_box_have_the_edges_of_the_box() {
        let half = Vector::new(0.02, 0.03, 0.04);
        let (cuboid, mesh) = (Shape::Cuboid { half_extents: half }, mesh(&[(Vector::zeros(), half)]));
        let surface = Surface::of(&cuboid).unwrap();
        let (by_form, by_triangles) = (Edges::of(&cuboid, CREASE_ANGLE), Edges::of(&mesh, CREASE_ANGLE));
        let mut rng = Rng::keyed(1, "edges", 0);
        for _ in 0..500 {
            let point = surface.sample(&mut rng).point_in_object;
            let (a, b) = (by_form.distance(&point, 1.0), by_triangles.distance(&point, 1.0));
            assert!((a - b).abs() < 1e-12, "{point} {a} {b}");
        }
    }

    #[test]
    fn edges_inside_another_part_do_not_count() {
        // A beam through a block: its rims lie 5 mm under the faces of the block.
        let block = (Vector::zeros(), Vector::repeat(0.03));
        let beam = (Vector::zeros(), Vector::new(0.025, 0.01, 0.01));
        let both = mesh(&[block, beam]);
        let alone = mesh(&[block]);
        let point = Point::new(0.03, 0.01, 0.0);
        assert!((Edges::of(&both, CREASE_ANGLE).distance(&point, 1.0) - 0.02).abs() < 1e-12);
        assert!((Edges::of(&alone, CREASE_ANGLE).distance(&point, 1.0) - 0.02).abs() < 1e-12);
    }

    /// A closed cylinder along z from `low` to `high`, with its caps before or after its sides.
    fn cylinder(radius: f64, [low, high]: [f64; 2], caps_first: bool, parts: &mut (Vec<Point>, Vec<[u32; 3]>)) {
        let (vertices, triangles) = parts;
        let (first, n) = (vertices.len() as u32, 24);
        for height in [low, high] {
            vertices.extend((0..n).map(|k| {
                let (sin, cos) = (f64::from(k) / f64::from(n) * 2.0 * PI).sin_cos();
                Point::new(radius * cos, radius * sin, height)
            }));
        }
        vertices.extend([Point::new(0.0, 0.0, low), Point::new(0.0, 0.0, high)]);
        let of = |k: u32| (k, (k + 1) % n);
        let sides = (0..n).map(of).flat_map(|(a, b)| [[a, b, n + b], [a, n + b, n + a]]);
        let caps = (0..n).map(of).flat_map(|(a, b)| [[2 * n, b, a], [2 * n + 1, n + a, n + b]]);
        let all: Vec<[u32; 3]> = if caps_first { caps.chain(sides).collect() } else { sides.chain(caps).collect() };
        triangles.extend(all.iter().map(|corners| corners.map(|i| i + first)));
    }

    #[test]
    fn the_surface_of_overlapping_parts_misses_no_edge_that_is_seen_here() {
        let mut rng = Rng::keyed(4, "edges", 0);
        let mut n_near = 0;
        for trial in 0..24 {
            let mut parts = (Vec::new(), Vec::new());
            if trial % 2 == 0 {
                // Cylinders of one radius, each a little way into the next: rims lie in the wall of another part.
                let mut at = -0.04;
                for _ in 0..3 {
                    let end = at + rng.uniform(0.02, 0.03);
                    cylinder(0.025, [at, end], rng.chance(0.5), &mut parts);
                    at = end - rng.uniform(0.002, 0.006);
                }
            } else {
                for _ in 0..3 {
                    let half = Vector::from_fn(|_, _| rng.uniform(0.01, 0.03));
                    let center = Vector::from_fn(|_, _| rng.uniform(-0.015, 0.015));
                    box_triangles(center, half, &mut parts.0, &mut parts.1);
                }
            }
            let shape = Shape::Mesh(Arc::new(TriangleMesh::new(parts.0, parts.1).unwrap()));
            let surface = Surface::with_crease_angle(&shape, CREASE_ANGLE).unwrap();
            let edges = Edges::of(&shape, CREASE_ANGLE);
            for _ in 0..150 {
                let at = surface.sample(&mut rng);
                let (theirs, ours) = (surface.crease_distance(&at), edges.distance(&at.point_in_object, 0.01));
                assert!(ours >= 0.01 || theirs <= ours + 1e-9, "{trial} {} {theirs} {ours}", at.point_in_object);
                n_near += usize::from(ours < 0.004);
            }
        }
        assert!(n_near > 300, "{n_near}");
    }

    #[test]
    fn scanned_objects_have_the_edges_that_their_surfaces_have() {
        let models = std::env::var_os("REGRASP_MODELS").map(PathBuf::from).or_else(|| {
            Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|up| up.join("shared/models")).find(|p| p.is_dir())
        });
        let Some(models) = models else {
            // Past the capture of test output, so that the log says it.
            let _ = writeln!(std::io::stderr(), "SKIPPED: no shared models");
            return;
        };
        for name in ["ycb_013_apple/mesh.obj", "ycb_077_rubiks_cube/mesh.obj", "robosuite_small/can.stl"] {
            let path = models.join("objects").join(name);
            let shape = Shape::Mesh(Arc::new(read_mesh(&path, &std::fs::read(&path).unwrap()).unwrap()));
            let surface = Surface::with_crease_angle(&shape, CREASE_ANGLE).unwrap();
            let edges = Edges::of(&shape, CREASE_ANGLE);
            let mut rng = Rng::keyed(2, "edges", 0);
            for _ in 0..50 {
                let at = surface.sample(&mut rng);
                let (a, b) = (surface.crease_distance(&at), edges.distance(&at.point_in_object, f64::INFINITY));
                assert!(a == b || (a - b).abs() < 1e-9, "{name} {} {a} {b}", at.point_in_object);
            }
        }
    }
}
