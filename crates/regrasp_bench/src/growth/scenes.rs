//! The scene files of the points, with the files that they name.

use super::{Curve, Point, ellipsoid, hand, obstacles};
use regrasp_base::files::write_atomic;
use std::io;
use std::path::{Path, PathBuf};

/// Half axes of the ellipsoid, in metres.
const RADII: [f64; 3] = [0.030, 0.028, 0.034];
/// Torsion radius of soft fingertips, in metres; as in `assets/hands/soft_pair`.
const TORSION_RADIUS: f64 = 0.005;
/// Seed of the obstacles: which ones there are is no part of the trial.
const OBSTACLE_SEED: u64 = 0;

/// Writes the scene of a point into `folder`, which exists, with its hand and mesh; returns the scene file.
pub fn write_scene(point: &Point, folder: &Path) -> io::Result<PathBuf> {
    let n_fingers = if point.curve == Curve::Fingers { point.size as usize } else { 4 };
    let urdf = format!("hand_{n_fingers}.urdf");
    let hand_file = format!("hand_{n_fingers}.toml");
    write_atomic(&folder.join(&urdf), hand::urdf(n_fingers).as_bytes())?;
    write_atomic(&folder.join(&hand_file), hand::hand_toml(&urdf, n_fingers).as_bytes())?;
    let mesh_file = format!("{}_{}.stl", point.object, point.size);
    if point.curve == Curve::Triangles {
        write_atomic(&folder.join(&mesh_file), &ellipsoid::stl(RADII, point.size as usize))?;
    }
    let path = folder.join(scene_name(point)).with_extension("toml");
    write_atomic(&path, scene_toml(point, &hand_file, &mesh_file).as_bytes())?;
    Ok(path)
}

/// Points that differ in threads only have one scene.
fn scene_name(point: &Point) -> String {
    let Point { curve, object, size } = point;
    match curve {
        Curve::Threads => format!("threads_{object}"),
        _ => format!("{}_{object}_{size}", curve.name()),
    }
}

fn scene_toml(point: &Point, hand_file: &str, mesh_file: &str) -> String {
    let contact = match point.curve {
        // Three hard fingers cannot hold while one of them is away; all sizes have the same tips.
        Curve::Fingers => format!("contact = \"soft_finger\"\ntorsion_radius = {TORSION_RADIUS}\n"),
        _ => String::new(),
    };
    let shape = match point.object {
        "sphere" => "sphere = { radius = 0.032 }".to_owned(),
        "box" => "box = { size = [0.050, 0.050, 0.060] }".to_owned(),
        // With few triangles edges fold by more than the default allows; no size has creases.
        _ => format!("mesh = {{ file = \"{mesh_file}\" }}\ncrease_angle_deg = 90"),
    };
    let start = match point.curve {
        // The queries of a batch differ.
        Curve::Threads => "position_within = 0.003\n",
        _ => "",
    };
    let turn = match point.curve {
        // 90 degrees about x are one transfer for three soft fingers, and a batch of them is over too soon to be timed.
        Curve::Fingers | Curve::Threads => "{ axis = \"z\", angle_deg = 180 }",
        Curve::Triangles | Curve::Obstacles => "{ axis = \"x\", angle_deg = 90 }",
    };
    let obstacles = match point.curve {
        Curve::Obstacles => obstacles::obstacles_toml(point.size as usize, OBSTACLE_SEED),
        _ => String::new(),
    };
    let size = match point.curve {
        Curve::Threads => "a batch over threads".to_owned(),
        _ => format!("{} {}", point.size, point.curve.name()),
    };
    format!(
        "# {}, {size}; written by `regrasp growth`.\n\
         format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n\n\
         [hand]\nfile = \"{hand_file}\"\n{contact}\n\
         [object]\nname = \"{}\"\n{shape}\nmass = 0.1\nfriction = 0.8\n{obstacles}\n\
         [start]\nposition = [0.0, 0.0, 0.078]\n{start}\n\
         [goal]\nturn = {turn}\n",
        point.object, point.object
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::Shape;
    use regrasp_robot::hand::Finger;
    use regrasp_scene::load_scene;
    use std::f64::consts::{PI, TAU};
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn loaded(point: Point) -> regrasp_scene::LoadedScene {
        static N_FOLDERS: AtomicUsize = AtomicUsize::new(0);
        let unique = (std::process::id(), N_FOLDERS.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(format!("regrasp_growth_{}_{unique:?}", scene_name(&point)));
        std::fs::create_dir_all(&folder).unwrap();
        let path = write_scene(&point, &folder).unwrap();
        let loaded = load_scene(&path, &Default::default()).unwrap_or_else(|error| panic!("{point:?}: {error}"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(loaded.notes.is_empty(), "{point:?}: {:?}", loaded.notes);
        loaded
    }

    #[test]
    fn hands_have_as_many_soft_tips_as_asked_evenly_placed() {
        for size in Curve::Fingers.sizes().iter().copied() {
            let hand = loaded(Point { curve: Curve::Fingers, object: "sphere", size }).scene.hands.remove(0).hand;
            assert_eq!(hand.fingers.len(), size as usize);
            let tip = |finger: &Finger| {
                let mut poses = Vec::new();
                finger.chain.forward(&finger.rest, &mut poses);
                poses.last().unwrap() * finger.tip.center_in_body
            };
            let first = tip(&hand.fingers[0]);
            for (index, finger) in hand.fingers.iter().enumerate() {
                // The first, turned about z by its share of a full turn.
                let (sin, cos) = (TAU * index as f64 / size as f64).sin_cos();
                let turned = [cos * first.x - sin * first.y, sin * first.x + cos * first.y, first.z];
                let tip = tip(finger);
                assert!((0..3).all(|k| (tip[k] - turned[k]).abs() < 1e-9), "{size}, {index}: {tip} {turned:?}");
                assert_eq!(finger.tip.contact.name(), "soft_finger");
            }
        }
    }

    #[test]
    fn the_finger_is_that_of_the_bundled_hand() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/six_finger_sphere_90x.toml");
        let bundled = load_scene(&path, &Default::default()).unwrap().scene.hands.remove(0).hand;
        let written = loaded(Point { curve: Curve::Fingers, object: "sphere", size: 6 }).scene.hands.remove(0).hand;
        assert_eq!(bundled.fingers.len(), written.fingers.len());
        for (a, b) in bundled.fingers.iter().zip(&written.fingers) {
            assert_eq!((&a.chain.lower, &a.chain.upper, &a.rest), (&b.chain.lower, &b.chain.upper, &b.rest));
            assert_eq!((&a.tip.shape, a.tip.center_in_body), (&b.tip.shape, b.tip.center_in_body));
            let parts = |finger: &Finger| -> Vec<_> {
                finger.shapes.iter().map(|shape| (shape.body, shape.placed.clone(), shape.is_tip)).collect()
            };
            assert_eq!(parts(a), parts(b));
            let tip = |finger: &Finger| finger.ik.tip(&finger.rest);
            assert!((tip(a) - tip(b)).norm() < 1e-9, "{} {}", a.name, b.name);
        }
    }

    #[test]
    fn every_point_but_the_large_ones_is_a_scene_that_loads() {
        for point in Curve::ALL.into_iter().flat_map(|curve| curve.points(10_000)) {
            let scene = loaded(point).scene;
            let n_obstacles = if point.curve == Curve::Obstacles { point.size as usize } else { 0 };
            assert_eq!(scene.obstacles.len(), n_obstacles);
            if let Shape::Mesh(mesh) = &scene.objects[0].shape {
                assert!(point.curve == Curve::Triangles && mesh.statistics().is_watertight());
                assert_eq!(mesh.triangles().len(), point.size as usize);
                let exact = 4.0 / 3.0 * PI * RADII.iter().product::<f64>();
                let missing = 1.0 - mesh.signed_volume() / exact;
                assert!(missing > 0.0 && missing < 15.0 / point.size as f64, "{point:?}: {missing}");
            }
        }
    }

    #[test]
    fn fewer_obstacles_are_the_first_of_more_and_none_is_in_the_palm() {
        let [few, many] = [10, 100].map(|size| loaded(Point { curve: Curve::Obstacles, object: "box", size }).scene);
        for (a, b) in few.obstacles.iter().zip(&many.obstacles) {
            assert_eq!((&a.name, &a.placed), (&b.name, &b.placed));
        }
        for obstacle in &many.obstacles {
            let (center, radius) = obstacle.placed.shape.bounding_sphere();
            let center = obstacle.placed.parent_from_shape * center;
            assert!(center.z - radius > 0.0, "{} at {center}", obstacle.name);
        }
    }
}
