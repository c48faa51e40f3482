//! A hand of three fingers with flat pads, two beside each other and one across, as grippers in factories have: coupled to one joint a finger, or
//! with every joint driven by itself and two fingers that turn aside. Such a hand holds a box by closing on it.

use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_manipulation::model::Model;
use regrasp_plan::Plan;
use regrasp_plan::check::CheckSettings;
use regrasp_planners::in_hand::placing::place;
use regrasp_planners::in_hand::{InHandSettings, plan_in_hand};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::f64::consts::PI;
use std::fmt::Write;

/// Joints of a phalanx after the first: where they follow it when they are coupled, and their limits.
const FOLLOWERS: [(&str, &str, f64, [f64; 2]); 2] =
    [("middle", "0 0 0.057", 0.6, [-0.2, 1.57]), ("last", "0 0 0.039", -0.5, [-1.22, 0.2])];

fn urdf(is_coupled: bool) -> String {
    let mut text = String::from("<robot name=\"pinching\">");
    let mut link = |name: &str, size: &str, middle: &str| {
        let _ = write!(
            text,
            "<link name=\"{name}\"><inertial><mass value=\"0.1\"/><inertia ixx=\"1e-4\" iyy=\"1e-4\" izz=\"1e-4\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>\
             </inertial><collision><origin xyz=\"{middle}\"/><geometry><box size=\"{size}\"/></geometry></collision></link>"
        );
    };
    link("palm", "0.12 0.1 0.08", "0 0 -0.045");
    for finger in ["left", "right", "thumb"] {
        link(&format!("{finger}_first"), "0.022 0.024 0.05", "0 0 0.028");
        link(&format!("{finger}_middle"), "0.02 0.022 0.032", "0 0 0.02");
        link(&format!("{finger}_last"), "0.018 0.02 0.03", "0 0 0.018");
    }
    for finger in ["left", "right"].into_iter().filter(|_| !is_coupled) {
        link(&format!("{finger}_knuckle"), "0.02 0.02 0.02", "0 0 0");
    }
    let mut joint = |name: &str, [parent, child]: [&str; 2], origin: &str, [low, high]: [f64; 2], mimic: &str| {
        let axis = if name.ends_with("knuckle") { "0 0 1" } else { "0 1 0" };
        let _ = write!(
            text,
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin {origin}/><axis xyz=\"{axis}\"/>\
             <limit lower=\"{low}\" upper=\"{high}\" effort=\"30\" velocity=\"2\"/>{mimic}</joint>"
        );
    };
    for (finger, x, y, turn) in
        [("left", -0.045, 0.036, 0.0), ("right", -0.045, -0.036, 0.0), ("thumb", 0.045, 0.0, PI)]
    {
        let first = format!("{finger}_first");
        let knuckle = format!("{finger}_knuckle");
        let turns_aside = !is_coupled && finger != "thumb";
        if turns_aside {
            joint(&knuckle, ["palm", &knuckle], &format!("xyz=\"{x} {y} 0\""), [-0.19, 0.19], "");
        }
        let (base, origin) = match turns_aside {
            true => (knuckle.as_str(), "xyz=\"0 0 0.01\"".to_owned()),
            false => ("palm", format!("xyz=\"{x} {y} 0.01\" rpy=\"0 0 {turn}\"")),
        };
        joint(&first, [base, &first], &origin, [-0.3, 1.2], "");
        let mut parent = first.clone();
        for (which, xyz, multiplier, limits) in FOLLOWERS {
            let child = format!("{finger}_{which}");
            let mimic = format!("<mimic joint=\"{first}\" multiplier=\"{multiplier}\"/>");
            let mimic = if is_coupled { mimic.as_str() } else { "" };
            joint(&child, [&parent, &child], &format!("xyz=\"{xyz}\""), limits, mimic);
            parent = child;
        }
    }
    text + "</robot>"
}

/// The hand with a box of this size, at a height over the palm or where the planner wants it.
fn scene(is_coupled: bool, size: [f64; 3], start: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("hand.urdf", &urdf(is_coupled));
    let mut hand =
        "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\nbase_link = \"palm\"\n".to_owned();
    for finger in ["left", "right", "thumb"] {
        let _ = write!(
            hand,
            "[[fingers]]\nname = \"{finger}\"\ntip_link = \"{finger}_last\"\ntip = {{ shape = \"mesh\", center = [0, 0, 0.024] }}\n\
             rest = {{ {finger}_first = 0.2 }}\n"
        );
    }
    write("hand.toml", &hand);
    let text = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"hand.toml\"\n[object]\nname = \"box\"\n\
         box = {{ size = {size:?} }}\nmass = 0.1\nfriction = 0.8\n[start]\nposition = {start}\n[goal]\nturn = {{ axis = \"z\", angle_deg = 90 }}\n"
    );
    write("scene.toml", &text);
    load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A plan that only holds, judged.
fn hold(loaded: &LoadedScene, position: Option<regrasp_geometry::Pose>, budget: &Budget) -> Plan {
    let query = loaded.in_hand(0).held();
    let query = position.map_or(query.clone(), |pose| query.started_at(&pose));
    let plan = plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 0, budget, &|_| {});
    let plan = plan.unwrap_or_else(|failure| panic!("{failure}"));
    let report = loaded.judge(&query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "{:#?}", report.violations);
    plan
}

/// Fingers of four joints reach points, but hardly any posture drawn for one is clear of a box that fills the hand: before they closed on it, too,
/// a search of this work found no grasp.
#[test]
fn fingers_that_reach_points_close_on_a_large_box_too() {
    let loaded = scene(false, [0.06, 0.11, 0.06], "[0, 0, 0.135]");
    let view = loaded.view();
    let settings = InHandSettings::default();
    assert_eq!(Model::new(&view, &settings.physics).closing_fingers(), 0b100, "only the thumb reaches no points");
    let plan = hold(&loaded, None, &Budget::work(400_000));
    assert!(plan.segments[0].waypoints[0].contacts.iter().all(|contact| contact.point_in_object.is_some()));
}

/// Of coupled fingers each comes to one place only, and few of the contacts that are spread over a box are there.
#[test]
fn places_for_coupled_fingers_are_where_they_close_on_the_object() {
    let loaded = scene(true, [0.05, 0.13, 0.05], "\"auto\"");
    let (view, query, settings) = (loaded.view(), loaded.in_hand(0).held(), InHandSettings::default());
    let settings = InHandSettings { n_threads: 2, ..settings };
    let found = place(&view, std::slice::from_ref(&query), &settings, (0, 1), &Budget::unlimited(), &|_| {});
    let found = found.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(found.tried.poses > 9_500, "the estimate found it: this test wants a harder box ({:?})", found.tried);
    hold(&loaded, Some(found.places[0].world_from_object), &Budget::work(400_000));
}
