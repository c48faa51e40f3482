//! Geodesics against closed forms, against graphs with many points per edge, and primitives against their meshes.

use super::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Upper bound of the distance that falls to it: Dijkstra over `cuts` points per edge (Lanthier et al. 2001).
fn by_graph(mesh: &MeshSurface, a: &SurfacePoint, b: &SurfacePoint, cuts: usize) -> f64 {
    let mut nodes: Vec<Point> = vec![a.point_in_object, b.point_in_object];
    let mut of_triangle: Vec<Vec<usize>> = vec![Vec::new(); mesh.n_triangles()];
    of_triangle[a.facet as usize].push(0);
    of_triangle[b.facet as usize].push(1);
    for i in 0..mesh.n_triangles() {
        for k in 0..3 {
            let j = mesh.topology.neighbours[i][k];
            if (j as usize) < i {
                continue;
            }
            let corners = mesh.corners(i as u32);
            for cut in 0..=cuts {
                let share = cut as f64 / cuts as f64;
                let node = nodes.len();
                nodes.push(corners[k] + (corners[(k + 1) % 3] - corners[k]) * share);
                of_triangle[i].push(node);
                if let Some(list) = of_triangle.get_mut(j as usize) {
                    list.push(node);
                }
            }
        }
    }
    // Ends of edges at the same vertex are the same place.
    let mut of_node: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for (i, list) in of_triangle.iter().enumerate() {
        list.iter().for_each(|&node| of_node[node].push(i));
    }
    let mut distance = vec![f64::INFINITY; nodes.len()];
    let mut heap = BinaryHeap::from([Reverse((0u64, 0usize))]);
    distance[0] = 0.0;
    while let Some(Reverse((bits, i))) = heap.pop() {
        let d = f64::from_bits(bits);
        if i == 1 {
            return d;
        }
        if d > distance[i] {
            continue;
        }
        for &triangle in &of_node[i] {
            for &j in &of_triangle[triangle] {
                let next = d + (nodes[j] - nodes[i]).norm();
                if next < distance[j] {
                    distance[j] = next;
                    heap.push(Reverse((next.to_bits(), j)));
                }
            }
        }
    }
    f64::INFINITY
}

/// The path starts and ends where it should, stays on the surface, has the length it says and constant speed.
fn check_path(surface: &Surface, path: &Geodesic, a: &SurfacePoint, b: &SurfacePoint) {
    assert!((path.at(0.0).point_in_object - a.point_in_object).norm() < 1e-9);
    assert!((path.at(1.0).point_in_object - b.point_in_object).norm() < 1e-9);
    let n = 2000;
    let points: Vec<SurfacePoint> = (0..=n).map(|i| path.at(f64::from(i) / f64::from(n))).collect();
    let mut length = 0.0;
    for pair in points.windows(2) {
        let step = (pair[1].point_in_object - pair[0].point_in_object).norm();
        assert!(step < 1.1 * path.length() / f64::from(n) + 1e-12, "{step} {}", path.length());
        length += step;
    }
    assert!((length - path.length()).abs() < 1e-3 * path.length() + 1e-9, "{length} {}", path.length());
    for p in points.iter().step_by(50) {
        assert!(surface.signed_distance(&p.point_in_object).abs() < 1e-9);
    }
}

#[test]
fn on_a_sphere_it_is_the_great_circle() {
    let surface = Surface::of(&Shape::Sphere { radius: 0.03 }).unwrap();
    let mut rng = Rng::keyed(1, "geodesic", 0);
    for _ in 0..100 {
        let (a, b) = (surface.sample(&mut rng), surface.sample(&mut rng));
        let path = surface.geodesic(&a, &b).unwrap();
        let angle = a.normal_in_object.angle(&b.normal_in_object);
        assert!((path.length() - 0.03 * angle).abs() < 1e-12);
        check_path(&surface, &path, &a, &b);
    }
    let a = surface.sample(&mut rng);
    let opposite = surface.project(&Point::from(-a.point_in_object.coords));
    assert!(surface.geodesic(&a, &opposite).is_none());
    assert_eq!(surface.geodesic(&a, &a).unwrap().length(), 0.0);
}

#[test]
fn on_an_icosphere_it_is_nearly_the_great_circle() {
    for levels in 1..=4 {
        let surface = Surface::of(&icosphere(0.03, levels)).unwrap();
        let mut rng = Rng::keyed(2, "geodesic", levels as u64);
        for _ in 0..200 {
            let (a, b) = (surface.sample(&mut rng), surface.sample(&mut rng));
            let path = surface.geodesic(&a, &b).unwrap();
            let exact = 0.03 * a.point_in_object.coords.angle(&b.point_in_object.coords);
            let faceting = 1.0 - 0.11 * 0.25f64.powi(levels as i32 - 1);
            let ratio = path.length() / exact;
            assert!(ratio < 1.02 && ratio > faceting, "level {levels}: {ratio}");
            check_path(&surface, &path, &a, &b);
        }
    }
}

#[test]
fn on_a_box_it_is_the_shortest_unrolling() {
    // The spider and the fly (Dudeney 1903): 40 across five faces of a room 30 by 12 by 12.
    let room = Surface::of(&Shape::Cuboid { half_extents: Vector::new(15.0, 6.0, 6.0) }).unwrap();
    let spider = room.project(&Point::new(-15.1, 0.0, 5.0));
    let fly = room.project(&Point::new(15.1, 0.0, -5.0));
    assert!((room.geodesic(&spider, &fly).unwrap().length() - 40.0).abs() < 1e-9);

    let half = Vector::new(0.02, 0.03, 0.05);
    let exact = Surface::of(&Shape::Cuboid { half_extents: half }).unwrap();
    let coarse = Surface::of(&soup(box_mesh(half, 1))).unwrap();
    let fine = Surface::of(&soup(box_mesh(half, 8))).unwrap();
    let mut rng = Rng::keyed(3, "geodesic", 0);
    let (mut worst, mut n_equal) = (1.0f64, 0);
    for _ in 0..200 {
        let (a, b) = (exact.sample(&mut rng), exact.sample(&mut rng));
        let path = exact.geodesic(&a, &b).unwrap();
        check_path(&exact, &path, &a, &b);
        let project = |s: &Surface, p: &SurfacePoint| s.project(&p.point_in_object);
        let graph = by_graph(coarse.mesh().unwrap(), &project(&coarse, &a), &project(&coarse, &b), 100);
        assert!(path.length() <= graph + 1e-9 && path.length() > 0.99 * graph, "{} {graph}", path.length());
        for mesh in [&coarse, &fine] {
            let (on_a, on_b) = (project(mesh, &a), project(mesh, &b));
            let on_mesh = mesh.geodesic(&on_a, &on_b).unwrap();
            check_path(mesh, &on_mesh, &on_a, &on_b);
            let ratio = on_mesh.length() / path.length();
            assert!(ratio > 1.0 - 1e-6, "{ratio}");
            worst = worst.max(ratio);
            n_equal += usize::from(ratio < 1.0 + 1e-6);
        }
    }
    assert!(worst < 1.25 && n_equal > 340, "worst ratio {worst}, equal {n_equal} of 400");
}

/// A wavy ball with hills and hollows.
fn wavy(levels: usize) -> Shape {
    let Shape::Mesh(ball) = icosphere(1.0, levels) else { unreachable!("an icosphere is a mesh") };
    let wave = |p: &Point| p * (0.03 * (1.0 + 0.35 * (3.0 * p.x).sin() * (4.0 * p.y).cos() + 0.2 * (5.0 * p.z).sin()));
    mesh_of(ball.vertices().iter().map(wave).collect(), ball.triangles().to_vec())
}

#[test]
fn on_a_wavy_mesh_it_is_near_the_graphs_distance() {
    let surface = Surface::of(&wavy(3)).unwrap();
    let mesh = surface.mesh().unwrap();
    let mut rng = Rng::keyed(4, "geodesic", 0);
    let mut ratios = Vec::new();
    for _ in 0..60 {
        let (a, b) = (surface.sample(&mut rng), surface.sample(&mut rng));
        let path = surface.geodesic(&a, &b).unwrap();
        check_path(&surface, &path, &a, &b);
        ratios.push(path.length() / by_graph(mesh, &a, &b, 12));
    }
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[0] > 0.97 && ratios[30] < 1.0 + 1e-3, "{ratios:?}");
    assert!(ratios[59] < 1.05, "{ratios:?}");
}

#[test]
fn on_round_primitives_it_is_that_of_a_fine_mesh() {
    // The mesh cuts off the corners of a box, so that one is left out here.
    for shape in primitives().into_iter().filter(|shape| !matches!(shape, Shape::Cuboid { .. })) {
        let surface = Surface::of(&shape).unwrap();
        if let Shape::Cylinder { half_length, radius } = shape {
            compare(&surface, &Surface::of(&soup(prism(half_length, radius, 256))).unwrap());
            continue;
        }
        // The surface as a mesh: an icosphere projected, radially from within.
        let Shape::Mesh(ball) = icosphere(1.0, 5) else { unreachable!("an icosphere is a mesh") };
        let vertex = |p: &Point| {
            surface.cast_ray(&Point::origin(), &UnitVector::new_normalize(p.coords)).unwrap().point_in_object
        };
        let mesh = Surface::of(&mesh_of(ball.vertices().iter().map(vertex).collect(), ball.triangles().to_vec()));
        compare(&surface, &mesh.unwrap());
    }
}

fn compare(surface: &Surface, mesh: &Surface) {
    let mut rng = Rng::keyed(5, "geodesic", 0);
    let (mut longest, mut worst): (f64, f64) = (0.0, 0.0);
    for _ in 0..100 {
        let (a, b) = (surface.sample(&mut rng), surface.sample(&mut rng));
        if (a.point_in_object - b.point_in_object).norm() < 0.01 {
            continue;
        }
        let Some(path) = surface.geodesic(&a, &b) else { continue };
        check_path(surface, &path, &a, &b);
        let on = |p: &SurfacePoint| mesh.project(&p.point_in_object);
        let ratio = path.length() / mesh.geodesic(&on(&a), &on(&b)).unwrap().length();
        longest = longest.max(ratio);
        worst = worst.max(1.0 / ratio);
    }
    // Ours may be shorter than the mesh's, which can be caught on the wrong side, but not longer.
    assert!(longest < 1.004, "{surface:?}: {longest}");
    assert!(worst < 1.1, "{surface:?}: {worst}");
}

#[test]
fn parts_that_do_not_hang_together_have_no_path() {
    let half = Vector::repeat(0.01);
    let mut triangles = box_mesh(half, 1);
    triangles.extend(moved(box_mesh(half, 1), Vector::new(0.1, 0.0, 0.0)));
    let surface = Surface::of(&soup(triangles)).unwrap();
    let a = surface.project(&Point::new(-1.0, 0.0, 0.0));
    let b = surface.project(&Point::new(1.0, 0.0, 0.0));
    assert!(surface.geodesic(&a, &b).is_none());
}
