//! Meshes are solids, contacts lie on the mesh, tips are all that their links are, and given grasps are put right by one
//! tolerance: in planner and checker alike.

use crate::places::repository;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::{Point, Surface, Vector};
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Report, ViolationKind};
use regrasp_planners::in_hand::{InHandSettings, moved_fingers, plan_in_hand};
use regrasp_planners::{Failure, FailureKind};
use regrasp_robot::LoadOptions;
use regrasp_robot::tip::TipShape;
use regrasp_scene::{GRASP_TOLERANCE, GraspRequest, InHandQuery, LoadedScene, Object, load_scene};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::PathBuf;

type Triangles = (Vec<Point>, Vec<[u32; 3]>);

/// A folder of files that make a scene; gone when it is dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("regrasp-solids-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    fn write_mesh(&self, name: &str, (vertices, triangles): &Triangles) {
        let mut text = String::new();
        for p in vertices {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        for [a, b, c] in triangles {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        }
        self.write(name, &text);
    }

    /// The scene of an object in the wide hand, or in one of this folder.
    fn load(&self, hand: Option<&str>, object: &str, goal: &str, more: &str) -> LoadedScene {
        let wide = repository().join("assets/hands/wide_four_finger/hand.toml");
        let hand = hand.map_or(wide, |name| self.0.join(name));
        let text = format!(
            "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = {:?}\n[object]\nname = \"thing\"\n\
             {object}\nmass = 0.1\nfriction = 0.8\ncenter_of_mass = [0, 0, 0]\n[start]\nposition = [0, 0, 0.078]\n[goal]\n\
             turn = {goal}\n{more}",
            hand.display().to_string()
        );
        self.write("scene.toml", &text);
        load_scene(&self.0.join("scene.toml"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TURN: &str = "{ axis = \"x\", angle_deg = 90 }";

fn plan_for(loaded: &LoadedScene, query: &InHandQuery, seed: u64) -> Result<Plan, Failure> {
    plan_in_hand(&loaded.view(), query, &InHandSettings::default(), seed, &Budget::work(2_000_000), &|_| {})
}

fn judge(loaded: &LoadedScene, query: &InHandQuery, plan: &Plan) -> Report {
    loaded.judge(query, plan, &CheckSettings::default())
}

/// Plans some seeds; every plan is accepted.
fn all_are_accepted(loaded: &LoadedScene, seeds: u64) -> Vec<Plan> {
    let mut plans = Vec::new();
    for seed in 0..seeds {
        let query = loaded.in_hand(seed);
        let plan = plan_for(loaded, &query, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        let report = judge(loaded, &query, &plan);
        assert!(report.accepted(), "seed {seed}: {:#?}", report.violations);
        plans.push(plan);
    }
    plans
}

fn cuboid(center: [f64; 3], half: [f64; 3]) -> Triangles {
    let sign = |i: usize, k: usize| if i >> k & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |i: usize| Point::from(Vector::from_fn(|k, _| center[k] + sign(i, k) * half[k]));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A closed body of revolution about z through rings of (radius, height), the caps first.
fn revolved(rings: &[(f64, f64)]) -> Triangles {
    let n = 48;
    let ring = |&(radius, z): &(f64, f64)| {
        (0..n).map(move |k| {
            let (sin, cos) = (f64::from(k) / f64::from(n) * TAU).sin_cos();
            Point::new(radius * cos, radius * sin, z)
        })
    };
    let mut vertices: Vec<Point> = rings.iter().flat_map(ring).collect();
    let (low, high) = (vertices.len() as u32, vertices.len() as u32 + 1);
    let last = n * (rings.len() as u32 - 1);
    vertices.extend([rings[0].1, rings[rings.len() - 1].1].map(|z| Point::new(0.0, 0.0, z)));
    let of = |k: u32| (k, (k + 1) % n);
    let mut triangles: Vec<[u32; 3]> =
        (0..n).map(of).flat_map(|(a, b)| [[low, b, a], [high, last + a, last + b]]).collect();
    for row in (0..rings.len() as u32 - 1).map(|row| row * n) {
        triangles.extend(
            (0..n).map(of).flat_map(|(a, b)| [[row + a, row + b, row + n + b], [row + a, row + n + b, row + n + a]]),
        );
    }
    (vertices, triangles)
}

fn joined(parts: &[Triangles]) -> Triangles {
    let mut all: Triangles = (Vec::new(), Vec::new());
    for (vertices, triangles) in parts {
        let first = all.0.len() as u32;
        all.0.extend(vertices);
        all.1.extend(triangles.iter().map(|corners| corners.map(|i| i + first)));
    }
    all
}

const SPHERE: &str = "sphere = { radius = 0.032 }";

fn obstacle(file: &str) -> String {
    format!("[[obstacles]]\nname = \"block\"\nmesh = {{ file = \"{file}\" }}\nposition = [0, 0, 0]\n")
}

#[test]
fn what_starts_inside_a_mesh_is_refused_before_any_search() {
    let folder = Folder::new("inside");
    folder.write_mesh("large.obj", &cuboid([0.0; 3], [0.5; 3]));
    // One triangle of twelve is missing: small holes are closed.
    let (vertices, triangles) = cuboid([0.0; 3], [0.5; 3]);
    folder.write_mesh("holed.obj", &(vertices, triangles[1..].to_vec()));
    folder.write_mesh("wide.obj", &cuboid([0.0; 3], [0.12; 3]));
    // Beneath the object, about the palm and the beginnings of the fingers.
    folder.write_mesh("low.obj", &cuboid([0.0, 0.0, -0.2], [0.4, 0.4, 0.23]));
    let scenes = [
        (folder.load(None, SPHERE, TURN, &obstacle("large.obj")), ["thing", "block"]),
        (folder.load(None, SPHERE, TURN, &obstacle("holed.obj")), ["thing", "block"]),
        (folder.load(None, "mesh = { file = \"wide.obj\" }", TURN, ""), ["thing", "palm"]),
        (folder.load(None, SPHERE, TURN, &obstacle("low.obj")), ["palm", "block"]),
    ];
    for (loaded, names) in &scenes {
        let failure = plan_for(loaded, &loaded.in_hand(0), 0).unwrap_err();
        assert_eq!((failure.kind, failure.statistics.work), (FailureKind::StartInvalid, 0), "{failure}");
        assert!(names.iter().all(|name| failure.message.contains(name)), "{failure}");
    }
    // A plan made without the obstacles is rejected with them.
    let without = folder.load(None, SPHERE, TURN, "");
    let query = without.in_hand(0);
    let plan = plan_for(&without, &query, 0).unwrap();
    assert!(judge(&without, &query, &plan).accepted());
    for (loaded, _) in scenes.iter().take(2) {
        let report = judge(loaded, &query, &plan);
        assert!(report.violations.iter().any(|violation| violation.kind == ViolationKind::Collision), "{report:?}");
    }
}

#[test]
fn contacts_of_an_object_with_a_hull_lie_on_its_mesh() {
    let folder = Folder::new("hull");
    // Narrow in the middle: the hull is up to 10 mm off the wall.
    let rings: Vec<(f64, f64)> = (-15..=15)
        .map(|k| {
            let z = f64::from(k) * 0.002;
            (0.028 - 0.004 * (std::f64::consts::PI * z / 0.03).cos(), z)
        })
        .collect();
    folder.write_mesh("waist.obj", &revolved(&rings));
    let turn = "{ axis = \"z\", angle_deg = 45 }";
    let loaded = folder.load(None, "mesh = { file = \"waist.obj\", solid = \"hull\" }", turn, "");
    let object = &loaded.scene.objects[0];
    for plan in all_are_accepted(&loaded, 3) {
        for contact in plan.segments.iter().flat_map(|s| &s.waypoints).flat_map(|w| &w.contacts) {
            let Some(point) = contact.point_in_object.map(Point::from) else { continue };
            let off = (object.surface.project(&point).point_in_object - point).norm();
            assert!(off < 1e-5, "{off}");
        }
    }
    // Plans that touch the hull, where there is air, are rejected.
    let hull = object.hull.clone().unwrap();
    let as_hull = Object {
        surface: Surface::with_crease_angle(&hull, object.crease_angle).unwrap(),
        shape: hull,
        hull: None,
        mesh_body: None,
        ..object.clone()
    };
    let mut of_hull = loaded.clone();
    of_hull.scene.objects[0] = as_hull;
    for seed in 0..3 {
        let query = of_hull.in_hand(seed);
        let plan = plan_for(&of_hull, &query, seed).unwrap();
        assert!(judge(&of_hull, &query, &plan).accepted());
        let report = judge(&loaded, &query, &plan);
        assert!(
            report.violations.iter().any(|violation| violation.kind == ViolationKind::ContactOffSurface),
            "seed {seed}: {:?}",
            report.violations
        );
    }
}

/// The normal of a point that touches a mesh is that of the triangle that it touches, not of the smooth surface that the mesh stands for.
#[test]
fn fingertips_that_are_points_hold_curved_meshes() {
    let folder = Folder::new("points");
    let ring = |k: i32| (f64::from(k) / 24.0 * TAU / 2.0).sin_cos();
    let rings: Vec<(f64, f64)> = (1..24).map(ring).map(|(sin, cos)| (0.032 * sin, -0.032 * cos)).collect();
    let (vertices, triangles) = revolved(&rings);
    folder.write_mesh("ball.obj", &(vertices.clone(), triangles.clone()));
    let hand = std::fs::read_to_string(repository().join("assets/hands/wide_four_finger/hand.toml")).unwrap();
    let urdf = repository().join("assets/hands/wide_four_finger/hand.urdf");
    // A needle of 1 mm on each of the balls.
    let hand = hand
        .replace(
            "shape = \"sphere\", radius = 0.005, center = [0, 0, 0]",
            "shape = \"point\", position = [0, 0, 0.006]",
        )
        .replace("\"hand.urdf\"", &format!("{:?}", urdf.display().to_string()));
    folder.write("needles.toml", &hand);
    let loaded = folder.load(Some("needles.toml"), "mesh = { file = \"ball.obj\" }", TURN, "");
    assert!(loaded.scene.hands[0].hand.fingers.iter().all(|finger| finger.tip.shape == TipShape::Point));
    let faces: Vec<([Point; 3], Vector)> = triangles
        .iter()
        .map(|corners| corners.map(|corner| vertices[corner as usize]))
        .map(|[a, b, c]| ([a, b, c], (b - a).cross(&(c - a)).normalize()))
        .collect();
    for plan in all_are_accepted(&loaded, 4) {
        let contacts =
            plan.segments.iter().flat_map(|segment| &segment.waypoints).flat_map(|waypoint| &waypoint.contacts);
        for (point, normal) in contacts.filter_map(|contact| contact.point_in_object.zip(contact.normal_in_object)) {
            let is_of_a_face = faces.iter().any(|([a, _, _], face)| {
                (Point::from(point) - a).dot(face).abs() < 1e-9 && face.angle(&Vector::from(normal)) < 1e-6
            });
            assert!(is_of_a_face, "{point:?} {normal:?}");
        }
    }
}

/// A hand without geometry is accepted, and the checker says what it has not tested.
#[test]
fn fingers_without_geometry_are_named() {
    let folder = Folder::new("bare");
    let assets = repository().join("assets/hands/wide_four_finger");
    let urdf = std::fs::read_to_string(assets.join("hand.urdf")).unwrap();
    folder.write("hand.toml", &std::fs::read_to_string(assets.join("hand.toml")).unwrap());
    for bare in [&[] as &[&str], &["north"], &["east", "north", "west", "south"]] {
        let (mut link, mut is_left_out, mut kept) = ("", false, String::new());
        for line in urdf.lines() {
            link = line.split("<link name=\"").nth(1).unwrap_or(link);
            is_left_out |= line.contains("<collision>") && bare.iter().any(|name| link.starts_with(name));
            if !is_left_out {
                kept += line;
                kept.push('\n');
            }
            is_left_out &= !line.contains("</collision>");
        }
        folder.write("hand.urdf", &kept);
        let loaded = folder.load(Some("hand.toml"), SPHERE, TURN, "");
        let query = loaded.in_hand(0);
        let report = judge(&loaded, &query, &plan_for(&loaded, &query, 0).unwrap());
        assert!(report.accepted(), "{report:#?}");
        let told = |name: &&str| report.assumed.iter().any(|line| line.contains(&format!("\"{name}\"")));
        assert!(bare.iter().all(told) && report.assumed.len() == usize::from(!bare.is_empty()), "{:?}", report.assumed);
        assert!(bare.len() != 1 || !told(&"east"), "{:?}", report.assumed);
    }
}

#[test]
fn parts_that_overlap_keep_the_edges_that_the_checker_sees() {
    let folder = Folder::new("parts");
    // Cylinders of one radius, each 4 mm into the next: the rims lie in the walls.
    let part = |low: f64, high: f64| revolved(&[(0.028, low), (0.028, high)]);
    folder.write_mesh("stack.obj", &joined(&[part(-0.04, -0.012), part(-0.016, 0.016), part(0.012, 0.04)]));
    all_are_accepted(&folder.load(None, "mesh = { file = \"stack.obj\" }", TURN, ""), 6);
    let turn = "{ axis = \"z\", angle_deg = 60 }";
    let object = "mesh = { file = \"stack.obj\" }\nedge_distance = 0.002";
    all_are_accepted(&folder.load(None, object, turn, ""), 6);
}

#[test]
fn what_stands_out_of_a_tip_touches_first() {
    let folder = Folder::new("tips");
    let assets = repository().join("assets/hands/wide_four_finger");
    let read = |name: &str| std::fs::read_to_string(assets.join(name)).unwrap();
    let (urdf, hand) = (read("hand.urdf"), read("hand.toml"));
    // The last links are the tips, without the balls at their ends; each capsule or box ends 1 to 1.5 mm beyond the declared ball.
    let ball = "<collision>\n      <geometry><sphere radius=\"0.005\"/></geometry>\n    </collision>";
    let bone = "<origin xyz=\"0 0 0.025\"/>\n      <geometry><capsule radius=\"0.004\" length=\"0.05\"/></geometry>";
    assert!(urdf.contains(ball) && urdf.contains(bone));
    let bones = [
        "<origin xyz=\"0 0 0.026\"/><geometry><capsule radius=\"0.0045\" length=\"0.052\"/></geometry>",
        "<origin xyz=\"0 0 0.025\"/><geometry><capsule radius=\"0.0056\" length=\"0.047\"/></geometry>",
        "<origin xyz=\"0 0 0.027\"/><geometry><box size=\"0.008 0.008 0.054\"/></geometry>",
    ];
    for other in bones {
        folder.write("hand.urdf", &urdf.replace(ball, "").replace(bone, other));
        let tips = hand.replace("_tip\"", "_distal\"").replace("center = [0, 0, 0]", "center = [0, 0, 0.05]");
        folder.write("hand.toml", &tips);
        all_are_accepted(&folder.load(Some("hand.toml"), SPHERE, TURN, ""), 3);
        if other.contains("capsule") {
            all_are_accepted(&folder.load(Some("hand.toml"), "box = { size = [0.06, 0.06, 0.06] }", TURN, ""), 2);
        }
    }
}

#[test]
fn given_grasps_that_nearly_touch_are_put_right_and_others_refused() {
    let folder = Folder::new("given");
    folder.write_mesh("round.obj", &revolved(&[(0.028, -0.03), (0.028, 0.03)]));
    let turn = "{ axis = \"z\", angle_deg = 30 }";
    for object in [SPHERE, "box = { size = [0.06, 0.06, 0.06] }", "mesh = { file = \"round.obj\" }"] {
        let loaded = folder.load(None, object, turn, "");
        let automatic = loaded.in_hand(0);
        let first = plan_for(&loaded, &automatic, 0).unwrap();
        let start = &first.segments[0].waypoints[0];
        let mut n_moved = 0;
        for trial in 0..8 {
            // Every joint off by up to 2 mrad: tips by up to 0.3 mm.
            let off = |k: usize| 2e-3 * f64::sin(7.3 * (k + 1) as f64 + 2.1 * f64::from(trial));
            let joints: Vec<f64> = start.joints.iter().enumerate().map(|(k, q)| q + off(k)).collect();
            let query = InHandQuery { start_grasp: GraspRequest::Joints(joints), ..automatic.clone() };
            let plan = match plan_for(&loaded, &query, 1) {
                Ok(plan) => plan,
                Err(failure) => {
                    // Said before any search, with the finger and the distance.
                    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::StartInvalid, 0), "{failure}");
                    assert!(failure.message.contains("finger") || failure.message.contains("grasp"), "{failure}");
                    continue;
                }
            };
            let report = judge(&loaded, &query, &plan);
            assert!(report.accepted(), "{object}, trial {trial}: {:#?}", report.violations);
            let moved = moved_fingers(&loaded.view(), &query.into(), &plan);
            assert!(moved.iter().all(|one| one.end == "start" && one.distance <= GRASP_TOLERANCE), "{moved:?}");
            n_moved += moved.len();
        }
        assert!(n_moved >= 8, "{object}: {n_moved}");

        // Points beside the surface by less than the tolerance, then by more.
        let contacts = |away: f64| {
            let shifted = start.contacts.iter().map(|contact| {
                let (point, normal) = (contact.point_in_object.unwrap(), contact.normal_in_object.unwrap());
                Point::from(Vector::from(point) + Vector::from(normal) * away)
            });
            InHandQuery { start_grasp: GraspRequest::Contacts(shifted.collect()), ..automatic.clone() }
        };
        let near = contacts(0.3e-3);
        let plan = plan_for(&loaded, &near, 1).unwrap_or_else(|failure| panic!("{object}: {failure}"));
        assert!(judge(&loaded, &near, &plan).accepted(), "{object}");
        let moved = moved_fingers(&loaded.view(), &near.into(), &plan);
        // On facets the tip's ball slides a little sideways until it touches.
        let distances = if object.contains("mesh") { 0.29e-3..=GRASP_TOLERANCE } else { 0.28e-3..=0.32e-3 };
        assert!(moved.len() == 4 && moved.iter().all(|one| distances.contains(&one.distance)), "{moved:?}");
        let failure = plan_for(&loaded, &contacts(0.8e-3), 1).unwrap_err();
        assert_eq!((failure.kind, failure.statistics.work), (FailureKind::StartInvalid, 0));
        let words = if object.contains("mesh") { "mm off the surface" } else { "0.80 mm off the surface" };
        assert!(failure.message.contains(words) && failure.message.contains("finger"), "{failure}");
        // A plan that begins elsewhere does not answer the query.
        let report = judge(&loaded, &contacts(0.8e-3), &plan);
        assert!(report.violations.iter().any(|violation| violation.kind == ViolationKind::StartMismatch));
    }
}
