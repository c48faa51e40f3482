//! Flat fingertips: a pad that tips over on a flat face has its contact at one rim, and a degree later at the other. Plans say what happens
//! in between, or the checker finds forces there that do not balance.

use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::Vector;
use regrasp_plan::check::{CheckSettings, ViolationKind, check};
use regrasp_plan::plan::Waypoint;
use regrasp_plan::{Plan, SegmentKind};
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, Query, load_scene};
use std::fmt::Write;

/// How many times as much as is allowed counts as clearly too much: contacts left out are where slower steps had them.
const CLEARLY: f64 = 1.2;

/// Four fingers of three joints about a palm, whose tips are boxes of 10 x 16 x 20 mm.
fn urdf() -> String {
    let solid = |name: &str, geometry: &str, z: f64| {
        format!(
            "<link name=\"{name}\"><collision><origin xyz=\"0 0 {z}\"/><geometry>{geometry}</geometry></collision></link>\n"
        )
    };
    let cylinder = |radius: f64, length: f64| format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>");
    let mut text = "<robot name=\"pads\">\n".to_owned() + &solid("palm", &cylinder(0.065, 0.018), 0.005);
    for k in 0..4 {
        let around = std::f64::consts::FRAC_PI_2 * f64::from(k);
        let (x, y, turn) = (0.055 * around.cos(), 0.055 * around.sin(), around + std::f64::consts::PI);
        let links = [
            ("base", "<sphere radius=\"0.009\"/>".to_owned(), 0.0),
            ("lower", cylinder(0.008, 0.039), 0.0255),
            ("upper", cylinder(0.008, 0.04), 0.022),
            ("tip", "<box size=\"0.01 0.016 0.02\"/>".to_owned(), 0.006),
        ];
        for (name, geometry, z) in links {
            text += &solid(&format!("{name}_{k}"), &geometry, z);
        }
        let mut joint = |[parent, child]: [String; 2], origin: String, axis: &str, limits: [f64; 2]| {
            let [low, high] = limits;
            let _ = writeln!(
                text,
                "<joint name=\"{child}_joint\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{origin}\
                 <axis xyz=\"{axis}\"/><limit lower=\"{low}\" upper=\"{high}\" effort=\"2\" velocity=\"5\"/></joint>"
            );
        };
        let of = |name: &str| format!("{name}_{k}");
        let up = |z: f64| format!("<origin xyz=\"0 0 {z}\"/>");
        let at = format!("<origin xyz=\"{x} {y} 0.02\" rpy=\"0 0 {turn}\"/>");
        joint(["palm".into(), of("base")], at, "1 0 0", [-0.7, 0.7]);
        joint([of("base"), of("lower")], up(0.012), "0 1 0", [-0.6, 1.2]);
        joint([of("lower"), of("upper")], up(0.057), "0 1 0", [-0.2, 1.9]);
        let _ = writeln!(
            text,
            "<joint name=\"tip_{k}_joint\" type=\"fixed\"><parent link=\"upper_{k}\"/><child link=\"tip_{k}\"/>{}</joint>",
            up(0.049)
        );
    }
    text + "</robot>\n"
}

fn scene() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("hand.urdf", &urdf());
    let mut hand =
        "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\nbase_link = \"palm\"\n".to_owned();
    for k in 0..4 {
        let _ = write!(
            hand,
            "[[fingers]]\nname = \"f{k}\"\ntip_link = \"tip_{k}\"\ntip = {{ shape = \"mesh\", center = [0, 0, 0.011] }}\n\
             rest = {{ base_{k}_joint = 0.0, lower_{k}_joint = 0.3, upper_{k}_joint = 0.9 }}\n"
        );
    }
    write("hand.toml", &hand);
    write(
        "scene.toml",
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"hand.toml\"\n[object]\nname = \"cube\"\n\
         box = { size = [0.045, 0.045, 0.045] }\nmass = 0.1\nfriction = 0.8\n[start]\nposition = [-0.0045, -0.003, 0.1151]\n\
         quat_xyzw = [0.08990059, -0.70738357, -0.69487727, 0.09312321]\n[goal]\nturn = { axis = \"z\", angle_deg = 90 }\n",
    );
    load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn forces_balance_between_waypoints_where_pads_tip_over() {
    let loaded = scene();
    let mut all = [0; 2];
    for seed in 0..4 {
        let (view, query) = (loaded.view(), loaded.in_hand(seed));
        let plan = plan_in_hand(&view, &query, &InHandSettings::default(), seed, &Budget::work(400_000), &|_| {})
            .unwrap_or_else(|failure| panic!("{seed}: {failure}"));
        let query = loaded.task().query(seed);
        let report = check((&loaded.scene, &loaded.state), Some(&query), &plan, &CheckSettings::default());
        assert!(report.accepted(), "{seed}: {report:#?}");
        let seen = plans_without_the_moments_between_are_rejected(&loaded, &query, &plan);
        (0..2).for_each(|k| all[k] += seen[k]);
    }
    let [n_expected, n_elsewhere] = all;
    assert!(n_expected > 3 && n_elsewhere > 0, "{all:?}");
}

/// What the forces at two waypoints, in a straight line from one to the other, leave unbalanced about the centre of the cube at the
/// contacts of a waypoint between them, as a share of what fingers press and of the object's radius.
fn imbalance(ends: [&Waypoint; 2], between: &Waypoint) -> f64 {
    let share = (between.time - ends[0].time) / (ends[1].time - ends[0].time);
    let (mut moment, mut pressing) = (Vector::zeros(), 0.0);
    for (f, contact) in between.contacts.iter().enumerate() {
        let force = |end: &Waypoint| end.contacts[f].force_in_object.map_or_else(Vector::zeros, Vector::from);
        let force = force(ends[0]).lerp(&force(ends[1]), share);
        let (point, normal) = (contact.point_in_object.map(Vector::from), contact.normal_in_object.map(Vector::from));
        let (Some(point), Some(normal)) = (point, normal) else { continue };
        moment += point.cross(&force);
        pressing -= force.dot(&normal);
    }
    moment.norm() / (f64::sqrt(0.75) * 0.045) / pressing
}

/// The plan with longer steps, in which contacts sweep over the object: forces balance at both ends, and the checker looks between them, not
/// half-way alone. Where forces leave clearly too much at the contacts of the moments left out it rejects the plan for that, and where clearly little, it does not. How many such plans
/// there are, and of how many it is said to be elsewhere than at waypoints and half-way.
fn plans_without_the_moments_between_are_rejected(loaded: &LoadedScene, query: &Query, plan: &Plan) -> [usize; 2] {
    let settings = CheckSettings::default();
    let [mut n_expected, mut n_elsewhere] = [0; 2];
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, segment)| segment.kind == SegmentKind::Transfer) {
        for first in (0..segment.waypoints.len().saturating_sub(4)).step_by(2) {
            let ends = [first, first + 4].map(|w| &segment.waypoints[w].contacts);
            let travel = |f: usize| {
                let [a, b] = ends.map(|contacts| contacts[f].point_in_object.map(Vector::from));
                Some((b? - a?).norm())
            };
            if (0..4).filter_map(travel).all(|travel| travel < 6e-3) {
                continue;
            }
            let mut broken = plan.clone();
            broken.segments[s].waypoints.drain(first + 1..first + 4);
            let report = check((&loaded.scene, &loaded.state), Some(query), &broken, &CheckSettings::default());
            let unbalanced =
                report.violations.iter().filter(|violation| violation.kind == ViolationKind::ForceUnbalanced);
            let messages: Vec<&str> = unbalanced.map(|violation| violation.message.as_str()).collect();
            let ends = [&segment.waypoints[first], &segment.waypoints[first + 4]];
            let between = &segment.waypoints[first + 1..first + 4];
            let left = between.iter().map(|waypoint| imbalance(ends, waypoint)).fold(0.0, f64::max);
            if left > CLEARLY * settings.half_way_imbalance {
                n_expected += 1;
                assert!(!messages.is_empty(), "segment {s}, from waypoint {first}: {left} is left");
            } else if left < settings.half_way_imbalance / CLEARLY {
                assert!(messages.is_empty(), "segment {s}, from waypoint {first}: {left} is left");
            }
            n_elsewhere += usize::from(messages.iter().any(|message| message.contains(" of the way to the next")));
        }
    }
    [n_expected, n_elsewhere]
}
