//! Tests of what the methods of Saut 2011 are made of, from inside.

use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::grasps::sample::draw_state;
use crate::in_hand::moving::grasp_path::GraspPath;
use crate::in_hand::searching::visibility::decompose::decompose;
use crate::settings::{BaselineSettings, InHandSettings, Method};
use regrasp_base::Budget;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose};
use regrasp_grasp::{Contact, Grip};
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::model::Model;
use regrasp_plan::check::closure::{HeldBody, margin};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use std::path::Path;
use std::sync::atomic::AtomicUsize;

fn scene(name: &str) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Runs `test` on a search of the bundled scene `name`.
pub(super) fn with_search(name: &str, test: impl FnOnce(&mut Search)) {
    with_settings(name, &InHandSettings { method: Method::Visibility, ..InHandSettings::plain() }, test);
}

/// The same with other settings.
pub(super) fn with_settings(name: &str, settings: &InHandSettings, test: impl FnOnce(&mut Search)) {
    let loaded = scene(name);
    let view = loaded.view();
    let settings = &crate::in_hand::effective(settings).within(&view.limits);
    let model = Model::new(&view, &settings.physics);
    let query = loaded.task().query(0);
    let poses = [*query.start(), *query.goal()];
    let (budget, winner) = (Budget::unlimited(), AtomicUsize::new(usize::MAX));
    let (winner, progress) = (&winner, &|_| {});
    let context = Context { model: &model, settings, seed: 0, budget: &budget, winner, progress };
    test(&mut Search::new(context, poses, 0, u64::MAX));
}

/// Pairs of random grasps with a path between them.
fn linked_pairs(search: &mut Search, n_wanted: usize) -> Vec<(GraspState, GraspState, GraspPath)> {
    let mut found = Vec::new();
    for _ in 0..200 * n_wanted {
        let (Some(a), Some(b)) = (draw_state(search), draw_state(search)) else { continue };
        if let Some(path) = GraspPath::between(search, &a, &b) {
            found.push((a, b, path));
            if found.len() == n_wanted {
                return found;
            }
        }
    }
    panic!("only {} of {n_wanted} pairs see each other", found.len());
}

fn tips_in_object(model: &Model, pose: &Pose, joints: &HandJoints) -> Vec<Point> {
    let tip = |f: usize| Placement::from(pose).point_to_child(&model.fingers[f].ik.tip(&joints[f]));
    (0..model.n_fingers()).map(tip).collect()
}

fn tip_over(model: &Model, finger: usize, contact: &Contact) -> Point {
    contact.point_in_object + contact.normal_in_object.into_inner() * model.fingers[finger].tip_radius
}

#[test]
fn paths_on_the_sphere_follow_great_circles_and_stay_closed_without_any_finger() {
    with_search("sphere_90x.toml", |search| {
        let model = search.model();
        let body = HeldBody {
            center_of_mass: model.view.object.center_of_mass,
            torque_scale: model.frame.torque_scale,
            friction: model.frame.friction,
        };
        for (a, b, path) in linked_pairs(search, 12) {
            for k in 1..8 {
                let t = f64::from(k) / 8.0;
                let state = path.at(model, t).expect("a state of a valid path");
                let tips = tips_in_object(model, &state.world_from_object, &state.joints);
                for f in 0..model.n_fingers() {
                    let (from, to) = (a.contacts[f].point_in_object.coords, b.contacts[f].point_in_object.coords);
                    let angle = from.angle(&to);
                    let on_arc = (from * ((1.0 - t) * angle).sin() + to * (t * angle).sin()) / angle.sin();
                    assert!((state.contacts[f].point_in_object.coords - on_arc).norm() < 1e-9);
                    assert!((tips[f] - tip_over(model, f, &state.contacts[f])).norm() < 1e-8);
                    let others: Vec<Grip> =
                        (0..model.n_fingers()).filter(|&g| g != f).map(|g| model.grip(g, &state.contacts[g])).collect();
                    assert!(margin(&others, &body) > 0.0, "without finger {f} at {t}");
                }
            }
        }
    });
}

#[test]
fn paths_on_the_box_cross_no_edge_where_they_may_not() {
    let plain = InHandSettings { method: Method::Visibility, ..InHandSettings::plain() };
    let baselines = BaselineSettings { edge_crossings: false, ..plain.baselines.clone() };
    with_settings("box_90x.toml", &InHandSettings { baselines, ..plain }, |search| {
        let model = search.model();
        let object = &model.view.object;
        for (a, b, path) in linked_pairs(search, 3) {
            for k in 1..8 {
                let t = f64::from(k) / 8.0;
                let state = path.at(model, t).expect("a state of a valid path");
                for f in 0..model.n_fingers() {
                    let (from, to) = (a.contacts[f], b.contacts[f]);
                    assert!(from.normal_in_object.dot(&to.normal_in_object) > 1.0 - 1e-9, "one face");
                    // On one face of a box the shortest way is straight.
                    let straight = from.point_in_object + (to.point_in_object - from.point_in_object) * t;
                    let point = state.contacts[f].point_in_object;
                    assert!((point - straight).norm() < 1e-9);
                    assert!(object.surface.crease_distance(&object.surface.project(&point)) >= object.edge_distance);
                }
            }
        }
    });
}

#[test]
fn contacts_jump_over_edges_and_never_come_near_them() {
    with_search("box_90x.toml", |search| {
        let model = search.model();
        let object = &model.view.object;
        let mut n_crossing = 0;
        for _ in 0..40 {
            for (a, b, path) in linked_pairs(search, 1) {
                let crosses = |f: usize| a.contacts[f].normal_in_object.dot(&b.contacts[f].normal_in_object) < 0.5;
                n_crossing += (0..model.n_fingers()).filter(|&f| crosses(f)).count();
                for k in 1..64 {
                    // Between two steps of which a jump lies there may be no state to go on from.
                    let Some(state) = path.at(model, f64::from(k) / 64.0) else { continue };
                    for contact in &state.contacts {
                        let at = object.surface.project(&contact.point_in_object);
                        assert!(object.surface.crease_distance(&at) >= object.edge_distance);
                    }
                }
            }
            if n_crossing > 0 {
                return;
            }
        }
        panic!("no path of 40 crosses an edge");
    });
}

/// Every motion of `way` does what its kind may do: transfers hold all contacts, regrasps move one finger and nothing
/// else, and each begins where the one before ended.
fn assert_feasible(model: &Model, way: &Sequence) {
    let mut state = way.start();
    for step in way.steps() {
        match step.motion() {
            Motion::Transfer(moments) => {
                assert!(step.end().contacts == state.contacts);
                for moment in moments {
                    let tips = tips_in_object(model, &moment.world_from_object, &moment.joints);
                    for (f, tip) in tips.iter().enumerate() {
                        assert!((tip - tip_over(model, f, &state.contacts[f])).norm() < 1e-6);
                    }
                }
                let last = moments.last().expect("a transfer has an end");
                assert!(last.world_from_object == step.end().world_from_object && last.joints == step.end().joints);
            }
            Motion::Regrasp { finger, path } => {
                assert!(step.end().world_from_object == state.world_from_object);
                assert!(path.last() == Some(&step.end().joints[*finger]));
                for f in (0..model.n_fingers()).filter(|f| f != finger) {
                    assert!(step.end().contacts[f] == state.contacts[f] && step.end().joints[f] == state.joints[f]);
                }
            }
        }
        state = step.end();
    }
}

#[test]
fn decomposed_paths_are_feasible_motions_between_their_ends_forwards_and_backwards() {
    with_search("tight_sphere_180z.toml", |search| {
        let model = search.model();
        let (mut n_decomposed, mut n_divided) = (0, 0);
        for (a, b, path) in linked_pairs(search, 12) {
            let Some(way) = decompose(search, &path, &a, &b).expect("no limits") else { continue };
            n_decomposed += 1;
            let transfers = way.steps().iter().filter(|step| matches!(step.motion(), Motion::Transfer(_)));
            n_divided += usize::from(transfers.count() > 1);
            assert_feasible(model, &way);
            assert!(*way.start() == a && *way.end() == b, "from exactly one grasp to exactly the other");
            let back = way.reversed();
            assert_feasible(model, &back);
            assert!(*back.start() == b && *back.end() == a);
            assert!(back.reversed() == way, "backwards twice is forwards");
        }
        assert!(n_decomposed >= 10, "the reduction property: {n_decomposed} of 12");
        assert!(n_divided >= 1, "no path had to be divided: the test asks too little");
    });
}
