//! A saved roadmap answers queries with plans that the checker accepts, comes back from its bytes as it was, and is refused
//! where it is broken or was built for something else.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_plan::check::{CheckSettings, Level};
use regrasp_plan::plan::{Plan, SegmentKind, Waypoint};
use regrasp_planners::in_hand::SearchSettings;
use regrasp_planners::in_hand::roadmap::{
    BuildSettings, GraspRoadmap, QueryMemory, Region, RoadmapPlanner, build_roadmap, seal,
};
use regrasp_planners::in_hand::{InHandSettings, PhysicsSettings, ReleaseRule, TransferMode};
use regrasp_robot::{ChainJoint, ContactModel, LinkId, Tip, TipShape};
use regrasp_scene::{LoadedScene, Obstacle, Scene};
use std::path::Path;

fn small_roadmap(loaded: &LoadedScene, n_threads: usize) -> GraspRoadmap {
    roadmap_with(loaded, InHandSettings { n_threads, ..InHandSettings::default() })
}

fn roadmap_with(loaded: &LoadedScene, settings: InHandSettings) -> GraspRoadmap {
    let query = loaded.in_hand(0);
    let region = Region::around(&query.poses(), &loaded.scene.objects[0].center_of_mass, 0.005, 1.0);
    let build = BuildSettings { places: 40, grasps: 60, neighbours: 12, ..BuildSettings::default() };
    build_roadmap(&loaded.view(), &region, &build, &settings, 3, &Budget::unlimited(), &|_| {})
        .unwrap_or_else(|failure| panic!("{failure}"))
}

#[test]
fn answers_are_accepted_and_the_graph_grows_by_them() {
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    let roadmap = small_roadmap(&loaded, 1);
    let view = loaded.view();
    let planner = RoadmapPlanner::new(path, &roadmap, &view).expect("built for this scene");
    let (mut memory, mut last) = (QueryMemory::default(), None);
    for seed in 0..20 {
        let query = planner.random_query(seed);
        let answer = planner.plan(&query, seed, &Budget::work(1_000_000), &mut memory);
        let answer = answer.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        let report =
            loaded.judge(&query, &answer.plan, &CheckSettings { level: Level::Motion, ..CheckSettings::default() });
        assert!(report.accepted(), "seed {seed}: {report:#?}");
        let again =
            planner.plan(&query, seed, &Budget::work(1_000_000), &mut QueryMemory::default()).expect("answered");
        assert!(again.plan == answer.plan, "seed {seed}: memory changes the answer");
        last = Some(answer);
    }
    let before = roadmap.census();
    let grown = roadmap.clone().grown_by(&last.expect("one answer"));
    assert!(grown.census().places > before.places && grown.census().nodes > before.nodes);
    let read = GraspRoadmap::from_bytes(path, &grown.to_bytes()).expect("grown graphs are whole");
    assert_eq!(read.census(), grown.census());
}

#[test]
fn an_outline_has_the_components_of_the_graph_and_its_transfers_between_places() {
    let loaded = scene("sphere_90x.toml");
    let roadmap = small_roadmap(&loaded, 1);
    let (census, outline) = (roadmap.census(), roadmap.outline());
    assert_eq!(outline.n_components(), census.components.len());
    assert!(outline.nodes.len() >= census.places_covered && outline.nodes.len() <= census.nodes);
    assert!(!outline.edges.is_empty() && outline.edges.len() <= census.transfers);
    for edge in &outline.edges {
        let [a, b] = edge.nodes.map(|node| &outline.nodes[node]);
        assert!(a.component == b.component && a.world_from_object != b.world_from_object);
    }
    assert!(outline.edges.is_sorted_by(|a, b| a < b), "an edge twice");
}

#[test]
fn bytes_come_back_and_do_not_depend_on_threads() {
    let loaded = scene("sphere_90x.toml");
    let bytes = small_roadmap(&loaded, 1).to_bytes();
    assert!(bytes == small_roadmap(&loaded, 3).to_bytes(), "threads change the graph");
    let read = GraspRoadmap::from_bytes(Path::new("a"), &bytes).expect("its own bytes");
    assert!(read.to_bytes() == bytes);
}

#[test]
fn broken_bytes_are_refused() {
    let loaded = scene("sphere_90x.toml");
    let roadmap = small_roadmap(&loaded, 1);
    let path = Path::new("sphere.roadmap");
    let view = loaded.view();
    let true_planner = RoadmapPlanner::new(path, &roadmap, &view).expect("built for this scene");
    let bytes = roadmap.to_bytes();
    for cut in (0..bytes.len()).step_by(bytes.len() / 97) {
        assert!(GraspRoadmap::from_bytes(path, &bytes[..cut]).is_err(), "{cut} bytes");
    }
    for at in (0..bytes.len()).step_by(bytes.len() / 211) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0x41;
        assert!(GraspRoadmap::from_bytes(path, &flipped).is_err(), "byte {at}");
        // With the checksum made good again nothing may panic, whatever it says.
        seal(&mut flipped);
        let Ok(wrong) = GraspRoadmap::from_bytes(path, &flipped) else { continue };
        let Ok(planner) = RoadmapPlanner::new(path, &wrong, &view) else { continue };
        for seed in 0..4 {
            let query = true_planner.random_query(seed);
            let _ = planner.plan(&query, seed, &Budget::work(20_000), &mut QueryMemory::default());
        }
    }
}

/// A scene with one thing changed, and the code that it must be refused with.
type Change = (&'static str, fn(&mut Scene), &'static str);

const CHANGES: [Change; 22] = [
    ("friction", |scene| scene.objects[0].friction *= 0.5, "R612"),
    ("object size", |scene| scene.objects[0].shape = Shape::Sphere { radius: 0.0321 }, "R611"),
    ("object kind", |scene| scene.objects[0].shape = Shape::Cuboid { half_extents: Vector::repeat(0.03) }, "R611"),
    ("center of mass", |scene| scene.objects[0].center_of_mass.x += 1e-4, "R611"),
    ("edge distance", |scene| scene.objects[0].edge_distance += 1e-4, "R611"),
    ("crease angle", |scene| scene.objects[0].crease_angle += 0.1, "R611"),
    ("an obstacle", |scene| scene.obstacles.push(plate()), "R613"),
    ("a soft fingertip", |scene| tip(scene).contact = ContactModel::SoftFinger { torsion_radius: 0.005 }, "R614"),
    ("a slippery fingertip", |scene| tip(scene).contact = ContactModel::Frictionless, "R614"),
    ("tip radius", |scene| tip(scene).shape = TipShape::Sphere { radius: 0.0079 }, "R610"),
    ("tip shape", |scene| tip(scene).shape = TipShape::Point, "R610"),
    ("tip center", |scene| tip(scene).center_in_body.z += 1e-4, "R610"),
    ("link length", |scene| joint(scene).parent_from_joint.translation.x += 1e-4, "R610"),
    ("joint axis", |scene| joint(scene).axis = -joint(scene).axis, "R610"),
    ("coupling", |scene| joint(scene).drive.terms[0].1 = 0.9, "R610"),
    ("coupling offset", |scene| joint(scene).drive.offset = 0.1, "R610"),
    ("lower limit", |scene| scene.hands[0].hand.fingers[1].chain.lower[0] += 1e-3, "R610"),
    ("upper limit", |scene| scene.hands[0].hand.fingers[1].chain.upper[2] -= 1e-3, "R610"),
    ("finger name", |scene| scene.hands[0].hand.fingers[3].name.push('s'), "R610"),
    ("finger shapes", |scene| drop(scene.hands[0].hand.fingers[0].shapes.pop()), "R610"),
    ("palm", |scene| scene.hands[0].hand.palm[0].placed.parent_from_shape.translation.z -= 1e-3, "R610"),
    ("pairs that may touch", |scene| assert!(scene.hands[0].hand.allowed_pairs.insert((LinkId(0), LinkId(5)))), "R610"),
];

fn tip(scene: &mut Scene) -> &mut Tip {
    &mut scene.hands[0].hand.fingers[2].tip
}

fn joint(scene: &mut Scene) -> &mut ChainJoint {
    &mut scene.hands[0].hand.fingers[1].chain.joints[2]
}

fn plate() -> Obstacle {
    let placed = PlacedShape {
        parent_from_shape: Pose::translation(0.3, 0.0, 0.0),
        shape: Shape::Cuboid { half_extents: Vector::repeat(0.01) },
    };
    Obstacle { name: "plate".into(), placed, mesh_body: None }
}

#[test]
fn whatever_decides_what_is_feasible_is_refused_when_it_changed() {
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    let roadmap = GraspRoadmap::from_bytes(path, &small_roadmap(&loaded, 1).to_bytes()).expect("its own bytes");
    for (what, change, code) in CHANGES {
        let mut changed = loaded.clone();
        change(&mut changed.scene);
        let refused = roadmap.refuse_other_scene(path, &changed.view()).expect_err(what);
        let codes: Vec<&str> = refused.diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
        assert_eq!(codes, [code], "{what}: {refused}");
    }
    let mut soft = loaded.clone();
    tip(&mut soft.scene).contact = ContactModel::SoftFinger { torsion_radius: 0.005 };
    let text = roadmap.refuse_other_scene(path, &soft.view()).expect_err("soft").to_string();
    let name = &soft.scene.hands[0].hand.fingers[2].name;
    for part in [&format!("\"{name}\""), "\"point\"", "\"soft_finger\" with torsion_radius 0.005", "fix: "] {
        assert!(text.contains(part), "{part} in {text}");
    }
    // The torsion radius counts, and comes back from the file.
    // A soft fingertip that rolls reaches no place of this small graph exactly: contacts stay.
    let defaults = InHandSettings::default();
    let physics = PhysicsSettings { transfer: TransferMode::Fixed, ..defaults.physics.clone() };
    let of_soft = roadmap_with(&soft, InHandSettings { physics, n_threads: 1, ..defaults });
    let built = GraspRoadmap::from_bytes(path, &of_soft.to_bytes()).expect("its own bytes");
    assert!(built.refuse_other_scene(path, &soft.view()).is_ok());
    let mut softer = soft.clone();
    tip(&mut softer.scene).contact = ContactModel::SoftFinger { torsion_radius: 0.006 };
    let text = built.refuse_other_scene(path, &softer.view()).expect_err("softer").to_string();
    assert!(text.contains("R614") && text.contains("0.005") && text.contains("0.006"), "{text}");
    // What decides nothing may change.
    let mut same = loaded.clone();
    same.scene.objects[0].mass *= 2.0;
    same.scene.objects[0].name = "ball".into();
    same.scene.name = "another file".into();
    assert!(roadmap.refuse_other_scene(path, &same.view()).is_ok());
    for other in ["box_90x.toml", "tight_sphere_180z.toml"] {
        assert!(roadmap.refuse_other_scene(path, &scene(other).view()).is_err(), "{other}");
    }
}

#[test]
fn settings_that_decide_what_is_feasible_are_refused_when_they_changed() {
    type Change = (&'static str, fn(&mut InHandSettings));
    const CHANGES: [Change; 7] = [
        ("closure_margin", |settings| settings.physics.closure_margin = 0.01),
        ("release_rule", |settings| settings.search.release_rule = ReleaseRule::EverywhereEveryFinger),
        ("step", |settings| settings.physics.step *= 2.0),
        ("clearance", |settings| settings.physics.clearance *= 2.0),
        ("contact_allowance", |settings| settings.physics.contact_allowance *= 0.5),
        ("limit_margin", |settings| settings.physics.limit_margin *= 2.0),
        ("joint_step", |settings| settings.physics.joint_step *= 0.5),
    ];
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    let roadmap = small_roadmap(&loaded, 1);
    for (name, change) in CHANGES {
        let mut settings = roadmap.about().settings.clone();
        change(&mut settings);
        let refused = roadmap.refuse_other_settings(path, &settings).expect_err(name);
        assert_eq!(refused.diagnostics.len(), 1, "{refused}");
        let text = refused.to_string();
        assert!(text.contains("R615") && text.contains(name), "{text}");
    }
    let mut less = roadmap.about().settings.clone();
    less.physics.closure_margin *= 0.5;
    assert!(roadmap.refuse_other_settings(path, &less).is_ok(), "the roadmap keeps more than is asked");
    let searching = InHandSettings {
        n_threads: 7,
        search: SearchSettings { shortcuts: 99, candidates: 2, ..roadmap.about().settings.clone().search },
        ..roadmap.about().settings.clone()
    };
    assert!(roadmap.refuse_other_settings(path, &searching).is_ok());
}

/// The graph's forces and times are those that are computed anew where they may not be used: with other speeds the positions of
/// the same motions come out, and all that does not depend on speed.
#[test]
fn stored_forces_are_those_that_are_computed_anew() {
    let loaded = scene("box_90x.toml");
    let path = Path::new("box.roadmap");
    let roadmap = small_roadmap(&loaded, 2);
    let view = loaded.view();
    let speed = roadmap.about().settings.physics.speed;
    let stored = RoadmapPlanner::new(path, &roadmap, &view).expect("built for this scene");
    let slower = regrasp_planners::in_hand::SpeedSettings { largest_speed: 0.5 * speed.largest_speed, ..speed };
    let anew = RoadmapPlanner::of_agreed(&roadmap, &view, &slower);
    let (mut memory, mut n_waypoints, mut n_joined) = (QueryMemory::default(), 0, 0);
    for seed in 0..12 {
        let query = stored.random_query(seed);
        let budget = Budget::work(5_000_000);
        let [quick, slow] = [&stored, &anew].map(|planner| {
            let answer = planner.plan(&query, seed, &budget, &mut memory);
            answer.unwrap_or_else(|failure| panic!("seed {seed}: {failure}")).plan
        });
        for plan in [&quick, &slow] {
            let settings = CheckSettings { level: Level::Motion, ..CheckSettings::default() };
            let report = loaded.judge(&query, plan, &settings);
            assert!(report.accepted(), "seed {seed}: {report:#?}");
        }
        assert!((quick.promises.kept_margin - slow.promises.kept_margin).abs() < 1e-12, "seed {seed}");
        assert_eq!(quick.statistics.relocations, slow.statistics.relocations);
        let last_time = |plan: &Plan| plan.segments.last().unwrap().waypoints.last().unwrap().time;
        assert!(last_time(&slow) > last_time(&quick), "half the speed takes longer");
        // Transfers in a row are one segment in the one, several in the other: its first waypoints are there once.
        let waypoints = |plan: &Plan| -> Vec<Waypoint> {
            let mut all: Vec<Waypoint> = Vec::new();
            let mut before = None;
            for segment in &plan.segments {
                let goes_on = before == Some(SegmentKind::Transfer) && segment.kind == SegmentKind::Transfer;
                all.extend(segment.waypoints.iter().skip(usize::from(goes_on)).cloned());
                before = Some(segment.kind);
            }
            all
        };
        n_joined += quick.segments.len() - slow.segments.len();
        let (quick, slow) = (waypoints(&quick), waypoints(&slow));
        assert_eq!(quick.len(), slow.len(), "seed {seed}");
        for (a, b) in quick.iter().zip(&slow) {
            assert!(a.joints == b.joints, "the same motion");
            for (own, other) in a.contacts.iter().zip(&b.contacts) {
                assert!(own.mode == other.mode && own.point_in_object == other.point_in_object);
                let forces = [own, other].map(|state| Vector::from(state.force_in_object.unwrap_or_default()));
                assert!((forces[0] - forces[1]).norm() < 1e-3, "seed {seed}: {forces:?}");
            }
            n_waypoints += 1;
        }
    }
    assert!(n_waypoints > 500 && n_joined > 0, "{n_waypoints} {n_joined}: the test asks too little");
}

/// Rolling motions that a query found are kept with forces and times, and used by the next one.
#[test]
fn rolling_links_are_kept_and_used_again() {
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    let mut roadmap = small_roadmap(&loaded, 1);
    let view = loaded.view();
    let mut memory = QueryMemory::default();
    let mut ask = |roadmap: &GraspRoadmap, seed: u64| {
        let planner = RoadmapPlanner::new(path, roadmap, &view).expect("built for this scene");
        let query = planner.random_query(seed);
        let answer = planner.plan(&query, seed, &Budget::work(1_000_000), &mut memory).expect("answered");
        let settings = CheckSettings { level: Level::Motion, ..CheckSettings::default() };
        let report = loaded.judge(&query, &answer.plan, &settings);
        assert!(report.accepted(), "seed {seed}: {report:#?}");
        answer
    };
    let (mut first, mut later) = (0, 0);
    for seed in 0..15 {
        let answer = ask(&roadmap, seed);
        first += answer.plan.statistics.work;
        let before = roadmap.census();
        roadmap = roadmap.grown_by(&answer);
        assert!(roadmap.census().transfers >= before.transfers + 2, "both links are kept");
    }
    for seed in 0..15 {
        later += ask(&roadmap, seed).plan.statistics.work;
    }
    assert!(2 * later < first, "{first} {later}");
}

/// Each answer is added; asked again, the graph has it. Hard queries, which take a detour at first, most of all.
#[test]
fn later_queries_use_what_earlier_ones_found() {
    let loaded = scene("sphere_90x.toml");
    let path = Path::new("sphere.roadmap");
    // Contacts that stay: what was found then comes out again as it was.
    let defaults = InHandSettings::default();
    let physics = PhysicsSettings { transfer: TransferMode::Fixed, ..defaults.physics.clone() };
    let mut roadmap = roadmap_with(&loaded, InHandSettings { physics, ..defaults });
    let mut memory = QueryMemory::default();
    let view = loaded.view();
    let mut ask = |roadmap: &GraspRoadmap, seed: u64| {
        let planner = RoadmapPlanner::new(path, roadmap, &view).expect("built for this scene");
        let query = planner.random_query(seed);
        let answer = planner.plan(&query, seed, &Budget::work(1_000_000), &mut memory).expect("answered");
        let report =
            loaded.judge(&query, &answer.plan, &CheckSettings { level: Level::Geometry, ..CheckSettings::default() });
        assert!(report.accepted(), "seed {seed}: {report:#?}");
        answer
    };
    let (mut first, mut later) = (Vec::new(), Vec::new());
    for seed in 0..30 {
        let answer = ask(&roadmap, seed);
        first.push(answer.plan.statistics.work);
        roadmap = roadmap.grown_by(&answer);
    }
    assert_eq!(roadmap.about().n_grown, 30);
    for seed in 0..30 {
        later.push(ask(&roadmap, seed).plan.statistics.work);
    }
    let (first_sum, later_sum): (u64, u64) = (first.iter().sum(), later.iter().sum());
    assert!(3 * later_sum < first_sum, "{first:?}\n{later:?}");
    assert!(first.iter().any(|&work| work > 300), "no query took a detour: {first:?}");
    assert!(later.iter().all(|&work| work < 300), "{later:?}");
}
