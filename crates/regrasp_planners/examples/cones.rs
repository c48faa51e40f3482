//! What pyramids of four sides lose against the exact friction cones, in tracking: `docs/reference/tracking.md` has the table.
//!
//!     cargo run --release -p regrasp_planners --example cones
//!
//! Grasps of the football, along plans and drawn at random, each with every choice of the moving and the rolling finger and
//! both ways that the object can then turn (Cherif 1999, eq. 9, to first order): do forces balance the weight?
#![allow(clippy::print_stdout)]

use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::wrench::ForceLimits;
use regrasp_planners::TrackingSettings;
use regrasp_planners::tracking::forces::{Choice, Load, Pressing, balance};
use regrasp_planners::tracking::{Cones, plan_tracking};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::load_scene;
use std::error::Error;
use std::path::Path;

const PLANS: u64 = 10;
const RANDOM_GRASPS: usize = 20_000;
/// Of the football, in metres.
const RADII: [f64; 3] = [0.09, 0.09, 0.12];
/// Angular velocity, in radians per second (Cherif 1999, table 3: 1.43 degrees).
const TURN: f64 = 0.025;

/// A grasp: points and normals, and the weight, in the object frame.
struct Grasp {
    contacts: Vec<(Point, Vector)>,
    weight: Vector,
}

#[derive(Default)]
struct Counts {
    asked: u64,
    pyramids: u64,
    cones: u64,
    /// In the cones only.
    lost: u64,
    /// In the pyramids only, too near to a limit for the solver in the cones.
    band: u64,
    /// In pyramids and in cones, in seconds.
    times: [f64; 2],
}

impl Counts {
    fn line(&self, name: &str) -> String {
        let share = |part: u64, of: u64| 100.0 * part as f64 / of.max(1) as f64;
        format!(
            "| {name} | {} | {} | {} | {} ({:.2} %) | {} ({:.2} %) | {:.1}, {:.1} |",
            self.asked,
            self.pyramids,
            self.cones,
            self.lost,
            share(self.lost, self.cones),
            self.band,
            share(self.band, self.pyramids),
            1e6 * self.times[0] / self.asked as f64,
            1e6 * self.times[1] / self.asked as f64,
        )
    }
}

/// The fingers as they move while the object turns on `rolling`, `way` round; none where nothing tells how.
fn pressing(grasp: &Grasp, moving: usize, rolling: usize, way: f64) -> Option<Vec<Pressing>> {
    let pivot = grasp.contacts[rolling].0;
    let others = || (0..grasp.contacts.len()).filter(|&finger| finger != moving && finger != rolling);
    // Resting fingertips stay on the object: its points there move across their normals.
    let mut turn = Vector::zeros();
    let rows: Vec<Vector> =
        others().map(|finger| (grasp.contacts[finger].0 - pivot).cross(&grasp.contacts[finger].1)).collect();
    if let [a, b] = rows[..] {
        turn = a.cross(&b).try_normalize(1e-9)? * (way * TURN);
    }
    let mut all = Vec::new();
    for (finger, (point, normal)) in grasp.contacts.iter().enumerate() {
        let object_velocity = turn.cross(&(point - pivot));
        let slides_along = match others().any(|other| other == finger) {
            true => Some(-(object_velocity - normal * normal.dot(&object_velocity)).try_normalize(1e-9)?),
            false => None,
        };
        all.push(Pressing { point: *point, normal: *normal, slides_along, object_velocity });
    }
    Some(all)
}

fn ask(grasp: &Grasp, load: &Load, counts: &mut Counts) {
    let n = grasp.contacts.len();
    for (moving, rolling) in (0..n).flat_map(|m| (0..n).map(move |r| (m, r))).filter(|(m, r)| m != r) {
        for way in [1.0, -1.0] {
            let Some(contacts) = pressing(grasp, moving, rolling, way) else { continue };
            let load = Load { weight: grasp.weight, ..*load };
            let begin = cpu_time::ThreadTime::now();
            let pyramids = balance(&contacts, &load, None, Choice::Any).is_ok();
            let between = cpu_time::ThreadTime::now();
            let cones = balance(&contacts, &Load { cones: Cones::Exact, ..load }, None, Choice::Any).is_ok();
            counts.times[0] += between.duration_since(begin).as_secs_f64();
            counts.times[1] += between.elapsed().as_secs_f64();
            counts.asked += 1;
            counts.pyramids += u64::from(pyramids);
            counts.cones += u64::from(cones);
            counts.lost += u64::from(cones && !pyramids);
            counts.band += u64::from(pyramids && !cones);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/football.toml");
    let loaded = load_scene(&path, &LoadOptions::default())?;
    let object = &loaded.scene.objects[0];
    let settings = TrackingSettings::default();
    let Some(forces) = settings.in_hand.physics.forces else { return Err("no forces".into()) };
    let [least, largest] = forces.normal_force;
    let load = Load {
        weight: Vector::zeros(),
        center_of_mass: object.center_of_mass,
        torque_scale: RADII[2],
        friction: object.friction,
        sliding_friction: object.friction,
        limits: ForceLimits {
            least,
            largest,
            squeeze: forces.squeeze,
            squeeze_weight: forces.squeeze_weight,
            cone_weight: forces.cone_weight,
        },
        cones: Cones::Pyramid,
    };
    let gravity = Vector::new(0.0, 0.0, -9.80665) * object.mass;
    println!("| grasps | with roles | in pyramids | in cones | in cones only | in pyramids only | microseconds |");
    println!("|---|---|---|---|---|---|---|");

    let mut along_plans = Counts::default();
    for seed in 0..PLANS {
        let budget = Budget::work(10_000_000);
        let plan = plan_tracking(
            &loaded.view(),
            loaded.task().query(seed).as_tracking().unwrap(),
            &settings,
            seed,
            &budget,
            &|_| {},
        )
        .map_err(|failure| failure.message)?;
        for waypoint in plan.segments.iter().flat_map(|segment| &segment.waypoints) {
            let point = |state: &regrasp_plan::plan::ContactState| {
                Some((Point::from(state.point_in_object?), Vector::from(state.normal_in_object?)))
            };
            let contacts = waypoint.contacts.iter().filter_map(point).collect();
            let weight = regrasp_geometry::Pose::from(&waypoint.world_from_object).rotation.inverse() * gravity;
            ask(&Grasp { contacts, weight }, &load, &mut along_plans);
        }
    }
    println!("{}", along_plans.line(&format!("along {PLANS} plans of F-1")));

    let mut at_random = Counts::default();
    let mut rng = Rng::keyed(1, "cones", 0);
    for _ in 0..RANDOM_GRASPS {
        let contact = |rng: &mut Rng| {
            let point = Vector::from(rng.direction()).component_mul(&Vector::from(RADII));
            let normal = point.component_div(&Vector::from(RADII.map(|radius| radius * radius))).normalize();
            (Point::from(point), normal)
        };
        let contacts = (0..4).map(|_| contact(&mut rng)).collect();
        let weight = Vector::from(rng.direction()) * gravity.norm();
        ask(&Grasp { contacts, weight }, &load, &mut at_random);
    }
    println!("{}", at_random.line(&format!("{RANDOM_GRASPS} at random")));
    Ok(())
}
