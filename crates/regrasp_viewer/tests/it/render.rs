//! The renderer against closed forms, and the same bytes again.

use nalgebra::UnitQuaternion;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_viewer::render::raster::{NONE, Samples};
use regrasp_viewer::render::shade::Layer;
use regrasp_viewer::render::{Camera, Look, Paint, Picture, PlacedSurface, Surface, png_file, render};
use regrasp_viewer::story::tessellate::{Triangles, tessellate};
use std::sync::Arc;

const SIZE: usize = 240;

fn camera() -> Camera {
    Camera::looking(&Vector::new(0.3, 1.0, -0.4), &Point::origin(), 1.0, 500.0, [SIZE as f64 / 2.0; 2])
}

fn model(triangles: &Triangles, pose: Pose, color: [f64; 3], body: u32) -> PlacedSurface {
    PlacedSurface {
        world_from_surface: pose,
        surface: Arc::new(Surface::of(triangles)),
        paint: Paint::Plain(color),
        body,
    }
}

fn seen(models: &[PlacedSurface]) -> Samples {
    Samples::of(models, &camera(), SIZE, SIZE)
}

fn random_pose(rng: &mut Rng) -> Pose {
    let mut draw = |reach: f64| Vector::from_fn(|_, _| rng.uniform(-reach, reach));
    Pose::from_parts(draw(0.02).into(), UnitQuaternion::from_scaled_axis(draw(3.0)))
}

#[test]
fn a_ball_covers_the_disc_that_it_should() {
    for radius in [0.03, 0.08, 0.15] {
        let samples = seen(&[model(&tessellate(&Shape::Sphere { radius }), Pose::identity(), [1.0; 3], 0)]);
        let covered = samples.triangle.iter().filter(|&&t| t != NONE).count() as f64;
        // The cone that touches the ball has half the angle asin(radius / distance).
        let in_picture = 500.0 * radius / (1.0 - radius * radius).sqrt();
        let expected = std::f64::consts::PI * in_picture * in_picture;
        assert!(covered < 1.005 * expected && covered > 0.985 * expected, "{radius}: {covered} of {expected}");
    }
}

#[test]
fn depths_are_those_of_rays_that_meet_the_ball() {
    let radius = 0.1;
    let samples = seen(&[model(&tessellate(&Shape::Sphere { radius }), Pose::identity(), [1.0; 3], 0)]);
    let camera = camera();
    let mut compared = 0;
    for row in (0..SIZE).step_by(3) {
        for column in (0..SIZE).step_by(3) {
            let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
            let (a, b, c) = (ray.norm_squared(), ray.dot(&camera.eye.coords), camera.eye.coords.norm_squared());
            let root = b * b - a * (c - radius * radius);
            // Not where the ball is seen at a flat angle.
            if root < 0.15 * b * b * radius * radius {
                continue;
            }
            let depth = (-b - root.sqrt()) / a;
            let found = 1.0 / samples.inverse_depth[row * SIZE + column];
            assert!((found - depth).abs() < 0.01 * radius, "{column} {row}: {found} {depth}");
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn of_two_overlapping_squares_the_nearer_one_shows() {
    let square = Triangles {
        vertices: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]| Point::new(x * 0.1, 0.0, z * 0.1))
            .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        smooth_below: 0.0,
    };
    let straight = Camera::looking(&Vector::y(), &Point::origin(), 1.0, 500.0, [SIZE as f64 / 2.0; 2]);
    let at = |x: f64, y: f64, body: u32| model(&square, Pose::translation(x, y, 0.0), [1.0; 3], body);
    for order in [[0, 1], [1, 0]] {
        let pair = [at(-0.05, 0.1, 0), at(0.05, -0.1, 1)];
        let models: Vec<PlacedSurface> = order.iter().map(|&k| pair[k].clone()).collect();
        let samples = Samples::of(&models, &straight, SIZE, SIZE);
        let body = |column: usize| match samples.triangle[SIZE / 2 * SIZE + column] {
            NONE => None,
            number => Some(models[number as usize / 2].body),
        };
        // The far one ends at 500 * 0.05 / 1.1 left and 500 * 0.15 / 1.1 right of the middle, the near one begins at
        // 500 * 0.05 / 0.9 left.
        assert_eq!(body(120 - 60), Some(0));
        assert_eq!(body(120 - 20), Some(1));
        assert_eq!(body(120 + 20), Some(1));
        assert_eq!(body(120 + 75), Some(1));
        assert_eq!(body(120 - 75), None);
    }
}

#[test]
fn closed_convex_bodies_have_no_holes_and_no_ragged_rows() {
    let mut rng = Rng::keyed(3, "render", 0);
    let shapes = [
        Shape::Sphere { radius: 0.1 },
        Shape::Cuboid { half_extents: Vector::new(0.05, 0.1, 0.08) },
        Shape::Cylinder { half_length: 0.08, radius: 0.06 },
        Shape::Capsule { half_length: 0.06, radius: 0.05 },
    ];
    for shape in &shapes {
        let triangles = tessellate(shape);
        for _ in 0..25 {
            let samples = seen(&[model(&triangles, random_pose(&mut rng), [1.0; 3], 0)]);
            for row in samples.triangle.chunks(SIZE) {
                let Some(first) = row.iter().position(|&t| t != NONE) else { continue };
                let last = row.iter().rposition(|&t| t != NONE).expect("there is a first");
                assert!(row[first..=last].iter().all(|&t| t != NONE), "a hole in a {}", shape.kind());
            }
        }
    }
}

#[test]
fn two_triangles_with_a_common_edge_share_no_sample() {
    let mut rng = Rng::keyed(4, "render", 1);
    for _ in 0..300 {
        let mut point = || Point::new(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2));
        let (a, b) = (point(), point());
        let ends = [point(), point()];
        let alone = ends.map(|c| {
            let one = Triangles { vertices: vec![a, b, c], triangles: vec![[0, 1, 2]], smooth_below: 0.0 };
            seen(&[model(&one, Pose::identity(), [1.0; 3], 0)])
        });
        let places = [a, b, ends[0], ends[1]].map(|p| camera().see(&p));
        let side = |k: usize| {
            let (a, b, c) = (places[0], places[1], places[k]);
            (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
        };
        if side(2) * side(3) >= 0.0 {
            continue; // Both on one side: they overlap.
        }
        let both = |k: usize| alone.iter().filter(|samples| samples.triangle[k] != NONE).count();
        assert!((0..SIZE * SIZE).all(|k| both(k) < 2), "a sample of both");
    }
}

fn still_life(supersampling: usize) -> Picture {
    let solid = vec![
        model(&tessellate(&Shape::Sphere { radius: 0.08 }), Pose::identity(), [0.8, 0.3, 0.2], 0),
        model(
            &tessellate(&Shape::Cuboid { half_extents: Vector::new(0.1, 0.1, 0.01) }),
            Pose::translation(0.0, 0.0, -0.09),
            [0.6; 3],
            1,
        ),
    ];
    let pane = model(
        &tessellate(&Shape::Cuboid { half_extents: Vector::new(0.05, 0.002, 0.1) }),
        Pose::translation(0.05, -0.12, 0.0),
        [0.2, 0.4, 0.8],
        2,
    );
    let layers = [Layer { models: vec![pane], in_front: 0.4, hidden: 0.0, is_framed: true }];
    let look =
        Look { supersampling, occlusion_radius: 0.04, shadows_within: Some((Point::origin(), 0.2)), outline: 1.0 };
    render(&solid, &layers, &camera(), SIZE, SIZE, &look)
}

#[test]
fn a_picture_is_the_same_again_and_on_other_threads() {
    let first = still_life(2);
    let others: Vec<Picture> = std::thread::scope(|scope| {
        let running: Vec<_> = (0..3).map(|_| scope.spawn(|| still_life(2))).collect();
        running.into_iter().map(|thread| thread.join().expect("it renders")).collect()
    });
    assert!(others.iter().all(|other| *other == first));
    assert_eq!(png_file::encode(&first), png_file::encode(&others[0]));
}

#[test]
fn what_is_far_from_everything_stays_white_and_the_ball_is_its_colour() {
    let picture = still_life(2);
    let pixel = |x: usize, y: usize| <[u8; 3]>::try_from(&picture.rgb[3 * (y * SIZE + x)..][..3]).expect("three bytes");
    assert_eq!(pixel(2, 2), [255; 3]);
    let [r, g, b] = pixel(SIZE / 2 - 15, SIZE / 2 - 10);
    assert!(r > g && g > b && r > 90, "{r} {g} {b}");
}

#[test]
fn a_png_file_holds_the_picture() {
    let picture = still_life(1);
    let bytes = png_file::encode(&picture);
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG file");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("a picture");
    assert_eq!((info.width as usize, info.height as usize), (SIZE, SIZE));
    assert_eq!(pixels[..info.buffer_size()], picture.rgb);
}
