//! Surfaces against brute force, closed forms and each other.

use super::*;
use crate::ConvexHull;
use crate::frame::Vector;
use nalgebra::Unit;
use std::f64::consts::PI;

fn primitives() -> Vec<Shape> {
    vec![
        Shape::Sphere { radius: 0.03 },
        Shape::Capsule { half_length: 0.04, radius: 0.015 },
        Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.05) },
        Shape::Cylinder { half_length: 0.03, radius: 0.02 },
        Shape::Cylinder { half_length: 0.005, radius: 0.04 },
        Shape::Ellipsoid { radii: Vector::new(0.02, 0.035, 0.05) },
        Shape::Ellipsoid { radii: Vector::new(0.03, 0.03, 0.01) },
    ]
}

fn mesh_of(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Shape {
    Shape::Mesh(Arc::new(TriangleMesh::new(vertices, triangles).unwrap()))
}

/// An icosahedron of radius `radius`, cut `levels` times.
fn icosphere(radius: f64, levels: usize) -> Shape {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<Vector> = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        points.extend([Vector::new(0.0, a, b), Vector::new(a, b, 0.0), Vector::new(b, 0.0, a)]);
    }
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in 0..12 {
            for k in 0..12 {
                let near = |a: usize, b: usize| ((points[a] - points[b]).norm() - 2.0).abs() < 1e-9;
                let outward = (points[j] - points[i]).cross(&(points[k] - points[i])).dot(&points[i]) > 0.0;
                if i < j && i < k && near(i, j) && near(j, k) && near(k, i) && outward {
                    triangles.push([points[i], points[j], points[k]]);
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let middle = |p: Vector, q: Vector| (p + q).normalize() * p.norm();
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    soup(triangles.iter().map(|t| t.map(|v| Point::from(v.normalize() * radius))).collect())
}

/// Separate triangles, with corners that are equal to within rounding merged.
fn soup(triangles: Vec<[Point; 3]>) -> Shape {
    let snap = |p: Point| Point::from(p.coords.map(|x| (x * 1e9).round() / 1e9));
    let vertices: Vec<Point> = triangles.iter().flatten().map(|p| snap(*p)).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh_of(vertices, indices)
}

/// A box whose faces are cut into `n` by `n` squares of two triangles.
fn box_mesh(half: Vector, n: usize) -> Vec<[Point; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let at = |i: usize, j: usize| {
                let mut p = Point::origin();
                p[axis] = sign * half[axis];
                p[(axis + 1) % 3] = half[(axis + 1) % 3] * (2.0 * i as f64 / n as f64 - 1.0);
                p[(axis + 2) % 3] = half[(axis + 2) % 3] * (2.0 * j as f64 / n as f64 - 1.0);
                p
            };
            for i in 0..n {
                for j in 0..n {
                    let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                    let mut both = [[a, b, c], [a, c, d]];
                    if sign < 0.0 {
                        both.iter_mut().for_each(|t| t.swap(1, 2));
                    }
                    triangles.extend(both);
                }
            }
        }
    }
    triangles
}

/// A prism over a regular polygon of `n` corners, about z.
fn prism(half_length: f64, radius: f64, n: usize) -> Vec<[Point; 3]> {
    let at = |i: usize, z: f64| {
        let (sin, cos) = (2.0 * PI * i as f64 / n as f64).sin_cos();
        Point::new(radius * cos, radius * sin, z)
    };
    let (h, mut triangles) = (half_length, Vec::new());
    for i in 0..n {
        let (a, b, c, d) = (at(i, -h), at(i + 1, -h), at(i + 1, h), at(i, h));
        triangles.extend([[a, b, c], [a, c, d], [d, c, Point::new(0.0, 0.0, h)], [b, a, Point::new(0.0, 0.0, -h)]]);
    }
    triangles
}

fn moved(triangles: Vec<[Point; 3]>, by: Vector) -> Vec<[Point; 3]> {
    triangles.into_iter().map(|t| t.map(|p| p + by)).collect()
}

fn random_point(rng: &mut Rng, size: f64) -> Point {
    Point::from(Vector::from(std::array::from_fn::<f64, 3, _>(|_| rng.uniform(-size, size))))
}

fn direction(rng: &mut Rng) -> UnitVector {
    Unit::new_normalize(Vector::from(rng.direction()))
}

/// All kinds, each with a name, meshes included.
fn all_shapes() -> Vec<Shape> {
    let mut shapes = primitives();
    shapes.push(icosphere(0.03, 3));
    shapes.push(soup(box_mesh(Vector::new(0.02, 0.03, 0.05), 4)));
    let mut rng = Rng::keyed(3, "hull", 0);
    let points: Vec<Point> = (0..60).map(|_| random_point(&mut rng, 0.04)).collect();
    shapes.push(Shape::Convex(Arc::new(crate::ConvexHull::new(&points).unwrap())));
    shapes
}

#[test]
fn areas_follow_cauchys_formula() {
    // The mean shadow of a convex body is a quarter of its area: cast parallel rays in random directions.
    for shape in all_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(1, "cauchy", 0);
        let (n_rays, size) = (200_000, 0.12);
        let mut hits = 0;
        for _ in 0..n_rays {
            let d = direction(&mut rng);
            let (u, v) = crate::frame::tangents(&d);
            let offset = u.as_ref() * rng.uniform(-size, size) + v.as_ref() * rng.uniform(-size, size);
            hits += usize::from(surface.cast_ray(&Point::from(offset - d.as_ref()), &d).is_some());
        }
        let area = 4.0 * (2.0 * size).powi(2) * hits as f64 / f64::from(n_rays);
        // Six standard deviations of the hit count.
        let error = 6.0 * area / (hits as f64).sqrt();
        assert!((area - surface.area()).abs() < error, "{}: {area} {}", shape.kind(), surface.area());
    }
}

#[test]
fn ellipsoid_area_matches_quadrature() {
    for radii in [[1.0, 1.0, 1.0], [3.0, 2.0, 1.0], [1.0, 1.0, 0.05], [0.2, 5.0, 5.0], [7.0, 0.3, 0.3]] {
        let r = Vector::from(radii);
        let (mut sum, n) = (0.0, 2000);
        for i in 0..n {
            let z = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
            for j in 0..200 {
                let (sin, cos) = ((f64::from(j) + 0.5) / 200.0 * 2.0 * PI).sin_cos();
                let w = (1.0 - z * z).sqrt();
                sum += Vector::new(w * cos, w * sin, z).component_div(&r).norm();
            }
        }
        let area = sum * r.x * r.y * r.z * 4.0 * PI / (f64::from(n) * 200.0);
        let surface = Surface::of(&Shape::Ellipsoid { radii: r }).unwrap();
        assert!((surface.area() / area - 1.0).abs() < 1e-5, "{radii:?} {area} {}", surface.area());
    }
}

#[test]
fn samples_are_uniform_by_area() {
    // The share of samples in a half-space against the share of area, from rays through the cut-off part: rays through
    // a convex surface, drawn uniformly among lines, hit it uniformly by area.
    for shape in all_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(2, "samples", 0);
        let (size, n) = (0.12, 60_000);
        let cuts: Vec<(UnitVector, f64)> = (0..4).map(|_| (direction(&mut rng), rng.uniform(-0.01, 0.01))).collect();
        let beyond = |p: &Point, cut: &(UnitVector, f64)| usize::from(cut.0.dot(&p.coords) > cut.1);
        let (mut by_sample, mut by_ray, mut n_hits) = ([0; 4], [0; 4], 0);
        for _ in 0..n {
            let p = surface.sample(&mut rng).point_in_object;
            (0..4).for_each(|i| by_sample[i] += beyond(&p, &cuts[i]));
        }
        while n_hits < n {
            let d = direction(&mut rng);
            let (u, v) = crate::frame::tangents(&d);
            let offset = u.as_ref() * rng.uniform(-size, size) + v.as_ref() * rng.uniform(-size, size);
            if let Some(hit) = surface.cast_ray(&Point::from(offset - d.as_ref()), &d) {
                n_hits += 1;
                (0..4).for_each(|i| by_ray[i] += beyond(&hit.point_in_object, &cuts[i]));
            }
        }
        for i in 0..4 {
            let difference = (by_sample[i] as f64 - by_ray[i] as f64) / n as f64;
            assert!(difference.abs() < 6.0 * (0.5 / n as f64).sqrt(), "{} cut {i}: {difference}", shape.kind());
        }
    }
}

#[test]
fn nearest_points_are_on_the_surface_and_nothing_is_nearer() {
    for shape in all_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(3, "project", 0);
        let samples: Vec<Point> = (0..20_000).map(|_| surface.sample(&mut rng).point_in_object).collect();
        for round in 0..400 {
            let mut p = random_point(&mut rng, 0.08);
            // Points in the symmetry planes and on the axes are the hard ones.
            if round % 4 == 1 {
                p[round / 4 % 3] = 0.0;
            } else if round % 4 == 2 {
                let k = round / 4 % 3;
                (p[(k + 1) % 3], p[(k + 2) % 3]) = (0.0, 0.0);
            }
            let q = surface.project(&p);
            let distance = (q.point_in_object - p).norm();
            assert!(surface.signed_distance(&q.point_in_object).abs() < 1e-12, "{} {p}", shape.kind());
            assert!((surface.signed_distance(&p).abs() - distance).abs() < 1e-12);
            // However far the surface is thought to be at most.
            for reach in [f64::INFINITY, 2.0 * distance, distance, 0.5 * distance] {
                let (foot, signed) = surface.kind.project_signed(&p, reach);
                let apart = (foot.point_in_object - p).norm() - distance;
                assert!(apart.abs() < 1e-12 && signed == surface.signed_distance(&p), "{} {p} {reach}", shape.kind());
            }
            let nearest = samples.iter().map(|s| (s - p).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest > distance - 1e-12, "{} {p}: {nearest} {distance}", shape.kind());
            assert!(nearest < distance + 2e-3, "{} {p}: {nearest} {distance}", shape.kind());
            assert!((q.normal_in_object.norm() - 1.0).abs() < 1e-12);
            if matches!(shape, Shape::Sphere { .. } | Shape::Ellipsoid { .. } | Shape::Capsule { .. }) {
                let across = (p - q.point_in_object).cross(&q.normal_in_object).norm();
                assert!(across < 1e-9 * distance.max(0.01), "{} {p}: {across}", shape.kind());
            }
        }
    }
}

#[test]
fn rays_stop_where_the_sign_of_the_distance_changes_first() {
    for shape in all_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(4, "rays", 0);
        let (mut n_hits, mut n_misses) = (0, 0);
        for _ in 0..3000 {
            let (origin, d) = (random_point(&mut rng, 0.06), direction(&mut rng));
            let start = surface.signed_distance(&origin);
            match surface.cast_ray(&origin, &d) {
                Some(hit) => {
                    n_hits += 1;
                    let t = (hit.point_in_object - origin).norm();
                    assert!((origin + d.as_ref() * t - hit.point_in_object).norm() < 1e-12);
                    assert!(surface.signed_distance(&hit.point_in_object).abs() < 1e-12);
                    for i in 1..40 {
                        let at = origin + d.as_ref() * (t * f64::from(i) / 40.0);
                        assert!(surface.signed_distance(&at) * start >= -1e-18, "{}", shape.kind());
                    }
                    if !matches!(shape, Shape::Mesh(_) | Shape::Convex(_)) {
                        assert_eq!(hit.normal_in_object.dot(&d) > 0.0, start < 0.0, "{}", shape.kind());
                    }
                }
                None => {
                    n_misses += 1;
                    for i in 0..400 {
                        let at = origin + d.as_ref() * (f64::from(i) * 0.0005);
                        assert!(surface.signed_distance(&at) > -1e-9, "{}", shape.kind());
                    }
                }
            }
        }
        assert!(n_hits > 100 && n_misses > 30, "{} {n_hits} {n_misses}", shape.kind());
    }
}

#[test]
fn axis_parallel_rays_through_box_mesh_edges_hit() {
    let surface = Surface::of(&soup(box_mesh(Vector::repeat(0.5), 4))).unwrap();
    for i in -2..=2 {
        for j in -2..=2 {
            // Through vertices and edges, and within the planes of bounding boxes.
            let origin = Point::new(f64::from(i) * 0.25, f64::from(j) * 0.25, 2.0);
            let hit = surface.cast_ray(&origin, &-Vector::z_axis());
            assert!(hit.is_some(), "{origin}");
            assert!((hit.unwrap().point_in_object.z - 0.5).abs() < 1e-12);
        }
    }
}

#[test]
fn a_box_mesh_is_the_box() {
    let half = Vector::new(0.02, 0.03, 0.05);
    let exact = Surface::of(&Shape::Cuboid { half_extents: half }).unwrap();
    for n in [1, 3] {
        let mesh = Surface::of(&soup(box_mesh(half, n))).unwrap();
        let mut rng = Rng::keyed(5, "box", n as u64);
        assert!((mesh.area() - exact.area()).abs() < 1e-12);
        for _ in 0..2000 {
            let p = random_point(&mut rng, 0.08);
            assert!((mesh.signed_distance(&p) - exact.signed_distance(&p)).abs() < 1e-12);
            let (s, t) = (mesh.sample(&mut rng), mesh.sample(&mut rng));
            let on_box = exact.project(&s.point_in_object);
            assert!((s.normal_in_object.into_inner() - on_box.normal_in_object.into_inner()).norm() < 1e-9);
            assert!((mesh.crease_distance(&s) - exact.crease_distance(&on_box)).abs() < 1e-9);
            assert_eq!(mesh.same_face(&s, &t), on_box.facet == exact.project(&t.point_in_object).facet);
            assert!(mesh.curvature(&s)[0].abs() < 1e-6);
        }
    }
}

#[test]
fn curvature_is_the_turn_of_the_normal() {
    for shape in primitives() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(6, "curvature", 0);
        for _ in 0..300 {
            let p = surface.sample(&mut rng);
            if surface.crease_distance(&p) < 1e-4 {
                continue;
            }
            if let Shape::Capsule { half_length, .. } = shape
                && (p.point_in_object.z.abs() - half_length).abs() < 1e-4
            {
                continue;
            }
            // The Weingarten map by central differences, in tangent coordinates.
            let (u, v) = crate::frame::tangents(&p.normal_in_object);
            let step = 1e-6;
            let turn = |along: &UnitVector| {
                let at =
                    |s: f64| surface.project(&(p.point_in_object + along.as_ref() * s)).normal_in_object.into_inner();
                (at(step) - at(-step)) / (2.0 * step)
            };
            let (du, dv) = (turn(&u), turn(&v));
            let trace = du.dot(&u) + dv.dot(&v);
            let determinant = du.dot(&u) * dv.dot(&v) - du.dot(&v) * dv.dot(&u);
            let [k1, k2] = surface.curvature(&p);
            assert!(k1 >= k2);
            assert!((k1 + k2 - trace).abs() < 1e-3 * (1.0 + trace.abs()), "{} {k1} {k2} {trace}", shape.kind());
            assert!((k1 * k2 - determinant).abs() < 1e-3 * (1.0 + trace * trace), "{}", shape.kind());
            let operator = surface.shape_operator(&p);
            for (along, turned) in [(&u, du), (&v, dv)] {
                assert!((operator * along.as_ref() - turned).norm() < 1e-3 * (1.0 + k1.abs()), "{}", shape.kind());
            }
            assert!(
                (operator * p.normal_in_object.as_ref()).norm() < 1e-9
                    && (operator - operator.transpose()).norm() < 1e-9
            );
        }
    }
}

#[test]
fn mesh_curvature_approaches_that_of_the_smooth_shape() {
    let surface = Surface::of(&icosphere(0.03, 3)).unwrap();
    let mut rng = Rng::keyed(7, "curvature", 1);
    for _ in 0..300 {
        let [k1, k2] = surface.curvature(&surface.sample(&mut rng));
        assert!((k1 * 0.03 - 1.0).abs() < 0.1 && (k2 * 0.03 - 1.0).abs() < 0.1, "{k1} {k2}");
    }
    let radii = Vector::new(0.03, 0.02, 0.04);
    let smooth = Surface::of(&Shape::Ellipsoid { radii }).unwrap();
    let mut faceted = icosphere(1.0, 4);
    if let Shape::Mesh(mesh) = &faceted {
        faceted = Shape::Mesh(std::sync::Arc::new(mesh.scaled(radii).unwrap()));
    }
    let mesh = Surface::of(&faceted).unwrap();
    for _ in 0..300 {
        let p = mesh.sample(&mut rng);
        let (operator, expected) =
            (mesh.shape_operator(&p), smooth.shape_operator(&smooth.project(&p.point_in_object)));
        assert!((operator - expected).norm() < 0.12 * expected.norm(), "{operator} {expected}");
        let [k1, k2] = mesh.curvature(&p);
        assert!((operator.trace() - k1 - k2).abs() < 1e-9 * k1);
    }
}

#[test]
fn a_settled_ball_touches_and_does_not_penetrate() {
    for shape in all_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let mut rng = Rng::keyed(8, "settle", 0);
        for _ in 0..500 {
            let near = surface.sample(&mut rng);
            let radius = rng.uniform(0.002, 0.015);
            let contact = surface.settle(&near, radius).expect("a convex solid can be touched anywhere");
            let center = contact.point_in_object + contact.normal_in_object.as_ref() * radius;
            assert!((surface.signed_distance(&center) - radius).abs() < 2e-9, "{}", shape.kind());
            assert!((surface.project(&center).point_in_object - contact.point_in_object).norm() < 1e-6);
            if !matches!(shape, Shape::Mesh(_) | Shape::Convex(_)) {
                assert!((contact.point_in_object - near.point_in_object).norm() < 1e-9, "{}", shape.kind());
            }
            // A point touches where it is, with the normal of the smallest of balls.
            let point = surface.settle(&near, 0.0).unwrap();
            let smallest = surface.settle(&near, 1e-6).unwrap();
            assert_eq!((point.point_in_object, point.facet), (near.point_in_object, near.facet));
            assert!(point.normal_in_object.angle(&smallest.normal_in_object) < 1e-3, "{}", shape.kind());
        }
    }
}

#[test]
fn a_ball_in_a_groove_touches_both_walls_and_one_in_a_slit_is_refused() {
    // Two boxes side by side on a third: a slot of width 2 cm and depth 4 cm.
    let mut triangles = moved(box_mesh(Vector::new(0.01, 0.02, 0.02), 3), Vector::new(-0.02, 0.0, 0.02));
    triangles.extend(moved(box_mesh(Vector::new(0.01, 0.02, 0.02), 3), Vector::new(0.02, 0.0, 0.02)));
    triangles.extend(moved(box_mesh(Vector::new(0.04, 0.03, 0.01), 3), Vector::new(0.0, 0.0, -0.0099)));
    let surface = Surface::of(&soup(triangles)).unwrap();
    assert!(surface.mesh().unwrap().repairs().triangles_inside > 0);
    let floor = surface.cast_ray(&Point::new(0.003, 0.001, 0.1), &-Vector::z_axis()).unwrap();
    assert!((floor.point_in_object.z - 0.0001).abs() < 1e-9);
    let contact = surface.settle(&floor, 0.008).unwrap();
    let center = contact.point_in_object + contact.normal_in_object.as_ref() * 0.008;
    assert!((surface.signed_distance(&center) - 0.008).abs() < 2e-9);
    assert!(center.x.abs() < 0.002 + 1e-9);
    assert_eq!(surface.settle(&floor, 0.012), None);
}

/// In a round hole, of 24 walls, a ball that is too wide is pushed from one wall straight to the wall opposite.
#[test]
fn a_ball_that_is_wider_than_a_hole_is_refused_after_few_looks() {
    let wall = |k: usize, radius: f64, z: f64| {
        let (sine, cosine) = (std::f64::consts::TAU * k as f64 / 24.0).sin_cos();
        Point::new(radius * cosine, radius * sine, z)
    };
    let mut triangles = Vec::new();
    for k in 0..24 {
        for (from, to) in [
            ((0.02, 0.0), (0.02, 0.08)),
            ((0.02, 0.08), (0.03, 0.08)),
            ((0.03, 0.08), (0.03, 0.0)),
            ((0.03, 0.0), (0.02, 0.0)),
        ] {
            let [a, b] = [k, k + 1].map(|k| wall(k, from.0, from.1));
            let [c, d] = [k + 1, k].map(|k| wall(k, to.0, to.1));
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    let surface = Surface::of(&soup(triangles)).unwrap();
    let inside = surface.cast_ray(&Point::new(0.001, 0.0005, 0.041), &Vector::x_axis()).unwrap();
    assert!(inside.normal_in_object.x < -0.9, "{:?}", inside.normal_in_object);
    let mut n_measured = 0;
    assert!(surface.settle_counted(&inside, 0.015, &mut n_measured).is_some() && n_measured < 10, "{n_measured}");
    let mut n_measured = 0;
    assert_eq!(surface.settle_counted(&inside, 0.025, &mut n_measured), None);
    assert!(n_measured < 10, "{n_measured}");
}

#[test]
fn what_lies_inside_other_parts_is_never_sampled() {
    let half = Vector::repeat(0.03);
    let mut triangles = box_mesh(half, 2);
    // A cavity wound inwards, and a box that sticks out half.
    triangles.extend(box_mesh(half * 0.5, 2).into_iter().map(|[a, b, c]| [a, c, b]));
    triangles.extend(moved(box_mesh(half * 0.4, 2), Vector::new(0.03, 0.001, 0.002)));
    let surface = Surface::of(&soup(triangles)).unwrap();
    assert!(surface.mesh().unwrap().repairs().triangles_inside >= 48);
    let mut rng = Rng::keyed(9, "nested", 0);
    let inside_big = |p: &Point| p.coords.abs().max() < 0.03 - 1e-6;
    let inside_small = |p: &Point| (p - Point::new(0.03, 0.001, 0.002)).abs().max() < 0.012 - 1e-6;
    let mut n_out = 0;
    for _ in 0..5000 {
        let p = surface.sample(&mut rng).point_in_object;
        assert!(!inside_big(&p) && !inside_small(&p), "{p}");
        n_out += usize::from(p.x > 0.031);
    }
    assert!(n_out > 100);
}

#[test]
fn winding_is_put_right() {
    let half = Vector::new(0.02, 0.03, 0.05);
    let mut triangles: Vec<[Point; 3]> = box_mesh(half, 2).into_iter().map(|[a, b, c]| [a, c, b]).collect();
    triangles[5].swap(0, 1);
    let surface = Surface::of(&soup(triangles)).unwrap();
    let repairs = surface.mesh().unwrap().repairs();
    assert_eq!((repairs.triangles_turned, repairs.parts_turned), (1, 1));
    assert!(surface.signed_distance(&Point::origin()) < -0.019);
}

#[test]
fn bad_lengths_are_refused() {
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Surface::of(&Shape::Sphere { radius }), Err(SurfaceError::Length { .. })));
    }
    // A Moebius strip.
    let n = 12;
    let at = |i: usize, side: f64| {
        let (angle, turn) = (2.0 * PI * i as f64 / n as f64, PI * i as f64 / n as f64);
        let r = 1.0 + side * 0.3 * turn.cos();
        Point::new(r * angle.cos(), r * angle.sin(), side * 0.3 * turn.sin())
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        let (a, b, c, d) = (at(i, 1.0), at(i, -1.0), at(i + 1, 1.0), at(i + 1, -1.0));
        triangles.extend([[a, b, c], [b, d, c]]);
    }
    assert!(matches!(Surface::of(&soup(triangles)), Err(SurfaceError::NotOrientable { .. })));
}

mod geodesics;

/// What is nearest stays so when the point that sees it moves a little: as far from a plane, a line or a point as before, towards who sees it.
#[test]
fn what_is_nearest_is_as_far_from_a_plane_a_line_or_a_point() {
    let half_extents = Vector::new(0.03, 0.02, 0.01);
    let corners: Vec<Point> = (0..8)
        .map(|k| Vector::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - Vector::repeat(1.0))
        .map(|sign| Point::from(sign.component_mul(&half_extents)))
        .collect();
    let hull = Shape::Convex(ConvexHull::new(&corners).unwrap().into());
    let (half_length, radius) = (0.015, 0.012);
    let mut rng = Rng::keyed(3, "facing", 0);
    // Which of the three kinds a shape has, and whether there are places without any.
    for (shape, kinds, has_others) in [
        (Shape::Cuboid { half_extents }, [true, true, true], false),
        (hull, [true, true, true], false),
        (Shape::Sphere { radius }, [false, false, true], false),
        (Shape::Cylinder { half_length, radius }, [true, true, false], true),
        (Shape::Capsule { half_length, radius }, [false, true, true], false),
        (Shape::Ellipsoid { radii: half_extents }, [false; 3], true),
    ] {
        let surface = Surface::of(&shape).unwrap();
        let (mut seen, mut n_others) = ([0; 3], 0);
        for _ in 0..300 {
            let from = Point::from(Vector::from(rng.direction()) * 0.05);
            let (foot, distance) = surface.project_signed(&from);
            if distance < 1e-3 {
                continue;
            }
            let Some((facing, place)) = surface.facing(&foot, &from) else {
                n_others += 1;
                continue;
            };
            // The nearest point of the plane, the line or the point.
            let core = |point: &Point| match facing {
                Facing::Face(normal) => point - normal.as_ref() * normal.dot(&(point - place)),
                Facing::Edge(along) => place + along.as_ref() * along.dot(&(point - place)),
                Facing::Corner => place,
            };
            let away = (foot.point_in_object - core(&from)).norm();
            let moved = from + Vector::from(rng.direction()) * 1e-6;
            let expected = core(&moved) + (moved - core(&moved)).normalize() * away;
            let found = surface.project_signed(&moved).0.point_in_object;
            seen[match facing {
                Facing::Face(_) => 0,
                Facing::Edge(_) => 1,
                Facing::Corner => 2,
            }] += 1;
            assert!((found - expected).norm() < 1e-12, "{shape:?}: {facing:?} {found} {expected}");
        }
        assert_eq!(seen.map(|n| n > 10), kinds, "{shape:?}: {seen:?}");
        assert_eq!(n_others > 10, has_others, "{shape:?}: {n_others}");
    }
}
