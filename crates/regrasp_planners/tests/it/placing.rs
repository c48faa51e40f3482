//! Start poses that the planner chooses, and grasps that only hold.

use crate::places::{repository, shared_models};
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::{Contact, ContactModel, Grip};
use regrasp_manipulation::model::Model;
use regrasp_plan::check::{CheckSettings, ViolationKind};
use regrasp_plan::plan::{PoseData, SegmentKind};
use regrasp_planners::in_hand::placing::samples::ContactSamples;
use regrasp_planners::in_hand::placing::sizes::sizes;
use regrasp_planners::in_hand::placing::{Places, Tried, place};
use regrasp_planners::{FailureKind, InHandSettings, Progress, plan_in_hand};
use regrasp_robot::import::LoadOptions;
use regrasp_robot::inspect::TipReach;
use regrasp_scene::{HandView, LoadedScene, load_scene_text};
use std::sync::Mutex;

/// A scene of a bundled hand with an object, whose start is open.
fn scene(hand: &str, object: &str, start: &str, turn: &str) -> LoadedScene {
    scene_with(hand, object, start, turn, &LoadOptions::default())
}

/// The same, read with options.
fn scene_with(hand: &str, object: &str, start: &str, turn: &str, options: &LoadOptions) -> LoadedScene {
    let text = format!(
        "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n[hand]\nfile = \"assets/hands/{hand}\"\n\
         [object]\n{object}\nmass = 0.1\nfriction = 0.8\n[start]\n{start}\n[goal]\nturn = {{ {turn} }}\n"
    );
    let path = repository().join("placing.toml");
    load_scene_text(&path, text.into_bytes(), options).unwrap_or_else(|error| panic!("{error}"))
}

const WIDE: &str = "wide_four_finger/hand.toml";
const BOX: &str = "box = { size = [0.05, 0.05, 0.06] }";
const AUTO: &str = "position = \"auto\"";
const TURN: &str = "axis = \"z\", angle_deg = 90";

fn places(loaded: &LoadedScene, seed: u64, budget: &Budget) -> Places {
    let queries = [loaded.in_hand(seed)];
    place(&loaded.view(), &queries, &InHandSettings::default(), (seed, 3), budget, &|_| {})
        .unwrap_or_else(|failure| panic!("{failure}"))
}

#[test]
fn a_place_depends_on_the_seed_alone_and_plans_start_there() {
    let loaded = scene(WIDE, BOX, AUTO, TURN);
    let found = places(&loaded, 3, &Budget::unlimited());
    let again = places(&loaded, 3, &Budget::unlimited());
    let poses = |found: &Places| -> Vec<Pose> { found.places.iter().map(|place| place.world_from_object).collect() };
    assert_eq!(poses(&found), poses(&again));
    assert_ne!(poses(&found), poses(&places(&loaded, 4, &Budget::unlimited())));
    assert!(found.places[0].is_solved(), "{:?}", found.tried);
    // Several threads search together what one does after the other, also where work runs out on the way.
    for max_work in [u64::MAX, found.tried.work - 20_000, found.tried.work / 2] {
        let [one, three] = [1, 3].map(|n_threads| {
            let settings = InHandSettings { n_threads, ..InHandSettings::default() };
            let queries = [loaded.in_hand(3)];
            place(&loaded.view(), &queries, &settings, (3, 3), &Budget::work(max_work), &|_| {}).unwrap()
        });
        assert_eq!((poses(&one), &one.tried), (poses(&three), &three.tried));
    }
    // From the place that was found, plans with other seeds are found with little work, and accepted.
    let start = found.places[0].world_from_object;
    for seed in 10..13 {
        let query = loaded.in_hand(seed).started_at(&start);
        let plan =
            plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), seed, &Budget::work(400_000), &|_| {})
                .unwrap_or_else(|failure| panic!("{failure}"));
        let report = loaded.judge(&query, &plan, &CheckSettings::default());
        assert!(report.accepted(), "{:?}", report.violations);
    }
}

/// A book in the Allegro hand: of the poses that the estimate puts first sixteen have a grasp, and no short search finds a turn from them.
#[test]
fn where_the_best_estimates_lead_to_no_turn_places_are_looked_for_elsewhere() {
    let Some(models) = shared_models() else { return };
    let mut options = LoadOptions::default();
    options.resolve.packages = vec![("models".to_owned(), models)];
    let loaded = scene_with("allegro_right/hand.toml", "box = { size = [0.2, 0.06, 0.03] }", AUTO, TURN, &options);
    let [one, three] = [1, 3].map(|n_threads| {
        let settings = InHandSettings { n_threads, ..InHandSettings::default() };
        place(&loaded.view(), &[loaded.in_hand(0)], &settings, (0, 3), &Budget::unlimited(), &|_| {}).unwrap()
    });
    assert!(one.tried.looked_at > 48 && one.tried.solved > 0, "{:?}", one.tried);
    assert_eq!(one.tried, three.tried);
    let query = loaded.in_hand(1).started_at(&one.places[0].world_from_object);
    let plan = plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 1, &Budget::work(2_000_000), &|_| {})
        .unwrap_or_else(|failure| panic!("{failure}"));
    let report = loaded.judge(&query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "{:?}", report.violations);
}

#[test]
fn whoever_waits_for_a_place_hears_what_was_tried() {
    let loaded = scene(WIDE, "sphere = { radius = 0.03 }", AUTO, TURN);
    let heard = Mutex::new(Vec::new());
    let told = |tried: &Tried| heard.lock().unwrap().push(tried.clone());
    let settings = InHandSettings::default();
    let found =
        place(&loaded.view(), &[loaded.in_hand(3)], &settings, (3, 3), &Budget::unlimited(), &told).unwrap().tried;
    let heard = heard.into_inner().unwrap();
    assert!(heard.len() as u64 > found.probed && heard.windows(2).all(|pair| pair[0].work < pair[1].work));
    // The last word is what was tried in all, but for how many poses turned out well.
    let last = heard.last().unwrap();
    assert_eq!(Tried { solved: 0, ..last.clone() }, Tried { solved: 0, ..found });
    // So does who waits for a plan whose start is open: before the first search there are no nodes, but work.
    let works = Mutex::new(Vec::new());
    let listen = |progress: Progress| works.lock().unwrap().push((progress.nodes, progress.work));
    plan_in_hand(&loaded.view(), &loaded.in_hand(3), &settings, 3, &Budget::work(3_000_000), &listen).unwrap();
    assert!(works.into_inner().unwrap().iter().any(|&(nodes, work)| nodes == 0 && work > 0));
}

#[test]
fn an_open_start_is_planned_and_the_checker_judges_the_start_that_the_plan_names() {
    let loaded = scene(WIDE, "sphere = { radius = 0.03 }", AUTO, TURN);
    let query = loaded.in_hand(2);
    let plan_of = |n_threads| {
        let settings = InHandSettings { n_threads, ..InHandSettings::default() };
        plan_in_hand(&loaded.view(), &query, &settings, 2, &Budget::work(3_000_000), &|_| {}).unwrap()
    };
    let plan = plan_of(1);
    assert_eq!(plan.segments, plan_of(3).segments);
    let settings = CheckSettings::default();
    let kinds = |plan: &regrasp_plan::Plan, query| -> Vec<ViolationKind> {
        loaded.judge(query, plan, &settings).violations.iter().map(|violation| violation.kind).collect()
    };
    assert_eq!(kinds(&plan, &query), []);
    // A plan that names another start than its first waypoint has.
    let mut moved = plan.clone();
    moved.start.position[0] += 0.001;
    assert!(kinds(&moved, &query).contains(&ViolationKind::StartMismatch));
    // A goal that does not follow from the start.
    let mut elsewhere = plan.clone();
    elsewhere.goal.position[2] += 0.001;
    assert!(kinds(&elsewhere, &query).contains(&ViolationKind::GoalMismatch));
    // The whole plan moved into the palm: the goal follows, and the object is where it cannot be.
    let mut sunk = plan.clone();
    let sink = |pose: &mut PoseData| pose.position[2] -= 0.05;
    sink(&mut sunk.start);
    sink(&mut sunk.goal);
    sunk.segments.iter_mut().flat_map(|segment| &mut segment.waypoints).for_each(|w| sink(&mut w.world_from_object));
    let found = kinds(&sunk, &query);
    assert!(!found.contains(&ViolationKind::StartMismatch) && !found.is_empty(), "{found:?}");
}

#[test]
fn an_orientation_that_the_scene_gives_is_kept_and_checked() {
    let start = "position = \"auto\"\nrotation_vector = [0.0, 0.0, 0.5]";
    let loaded = scene(WIDE, BOX, start, TURN);
    let query = loaded.in_hand(0);
    let given = nalgebra::UnitQuaternion::from_scaled_axis(Vector::z() * 0.5);
    let plan =
        plan_in_hand(&loaded.view(), &query, &InHandSettings::default(), 0, &Budget::work(5_000_000), &|_| {}).unwrap();
    assert!(Pose::from(&plan.start).rotation.angle_to(&given) < 1e-9);
    assert!(loaded.judge(&query, &plan, &CheckSettings::default()).accepted());
    let mut turned = plan;
    let other = Pose::from(&turned.start).rotation * nalgebra::UnitQuaternion::from_scaled_axis(Vector::z() * 0.01);
    turned.start = PoseData::from(&Pose::from_parts(Pose::from(&turned.start).translation, other));
    let report = loaded.judge(&query, &turned, &CheckSettings::default());
    assert!(report.violations.iter().any(|violation| violation.kind == ViolationKind::StartMismatch));
}

/// Three hard fingertips hold a ball, and can never change their grasp.
#[test]
fn hands_that_cannot_let_go_can_hold() {
    let loaded = scene("three_fingertips/hand.toml", "sphere = { radius = 0.1 }", AUTO, TURN);
    let (turn, settings) = (loaded.in_hand(0), InHandSettings::default());
    let budget = Budget::work(2_000_000);
    let refused = plan_in_hand(&loaded.view(), &turn, &settings, 0, &budget, &|_| {}).unwrap_err();
    assert_eq!(refused.kind, FailureKind::Impossible, "{refused}");
    assert_eq!(refused.statistics.work, 0, "refused before any search");
    let hold = turn.held();
    assert!(hold.stays() && !turn.stays());
    let plan = plan_in_hand(&loaded.view(), &hold, &settings, 0, &budget, &|_| {}).unwrap_or_else(|f| panic!("{f}"));
    let report = loaded.judge(&hold, &plan, &CheckSettings::default());
    assert!(report.accepted(), "{:?}", report.violations);
    let [segment] = plan.segments.as_slice() else { panic!("{} segments", plan.segments.len()) };
    assert_eq!(segment.kind, SegmentKind::Transfer);
    let first = &segment.waypoints[0];
    assert!(
        segment.waypoints.iter().all(|w| w.joints == first.joints && w.world_from_object == first.world_from_object)
    );
    // The contact forces carry the weight: here substituted by hand.
    let force = |axis: usize| -> f64 {
        first.contacts.iter().filter_map(|contact| contact.force_in_object).map(|force| force[axis]).sum()
    };
    let world_from_object = Pose::from(&plan.start);
    let sum = world_from_object.rotation * Vector::new(force(0), force(1), force(2));
    assert!((sum - Vector::z() * (0.1 * 9.80665)).norm() < 1e-6, "{sum:?}");
}

/// A ball as large as the whole hand.
#[test]
fn objects_that_do_not_fit_are_told_with_causes() {
    let loaded = scene(WIDE, "sphere = { radius = 0.4 }", AUTO, TURN);
    let failure =
        place(&loaded.view(), &[loaded.in_hand(0)], &InHandSettings::default(), (0, 1), &Budget::unlimited(), &|_| {})
            .unwrap_err();
    assert_eq!(failure.kind, FailureKind::StartInvalid);
    assert!(failure.message.contains("400 mm") && !failure.advice.is_empty(), "{failure}");
}

/// Closure of spread contacts, against the margin that planners ask for, set by set.
#[test]
fn shares_of_closed_sets_are_those_of_counting() {
    let loaded = scene(WIDE, BOX, AUTO, TURN);
    let view: HandView = loaded.view();
    let model = Model::new(&view, &InHandSettings::default().physics);
    let mut rng = Rng::keyed(5, "samples", 0);
    let samples = ContactSamples::draw(&model, &mut rng);
    let n = samples.contacts.len();
    assert!(n > 50);
    for _ in 0..5 {
        let sets: [u64; 3] = std::array::from_fn(|_| rng.bits() & rng.bits() & rng.bits() & ((1 << (n - 1)) - 1));
        let members = |set: u64| (0..n).filter(move |k| set & (1 << k) != 0);
        let mut n_closed = 0;
        for i in members(sets[0]) {
            for j in members(sets[1]) {
                for k in members(sets[2]) {
                    let grips =
                        [i, j, k].map(|which| Grip { contact: samples.contacts[which], model: ContactModel::Point });
                    let margin =
                        regrasp_grasp::closure::closure_margin(&grips, &model.frame, model.settings.closure_margin);
                    let distinct = i != j && j != k && i != k;
                    n_closed += usize::from(distinct && margin >= model.settings.closure_margin);
                }
            }
        }
        let share = samples.share_of_triples(sets);
        assert!((share * (n as f64).powi(3) - n_closed as f64).abs() < 1e-6, "{share} {n_closed}");
    }
    let on_surface = |contact: &Contact| loaded.view().object.surface.signed_distance(&contact.point_in_object).abs();
    assert!(samples.contacts.iter().all(|contact| on_surface(contact) < 1e-9));
}

/// Balls that are said to fit are held where the table says, each in a plan that the checker accepts.
#[test]
fn balls_that_fit_are_held_where_the_table_says() {
    let hand = regrasp_robot::import::load_hand(&repository().join("assets/hands").join(WIDE), &LoadOptions::default());
    let hand = hand.unwrap().hand;
    let reach = TipReach::sample(&hand, 12_000, &mut Rng::keyed(0, "room", 0));
    let balls = sizes(&hand, &reach, &InHandSettings::default(), 0).unwrap();
    assert_eq!(balls, sizes(&hand, &reach, &InHandSettings::default(), 0).unwrap());
    assert!(balls.iter().any(|ball| ball.lets_go && ball.radius == 0.03), "{balls:?}");
    for ball in &balls {
        let Some([x, y, z]) = ball.center else { continue };
        let object = format!("sphere = {{ radius = {} }}", ball.radius);
        let loaded = scene(WIDE, &object, &format!("position = [{x}, {y}, {z}]"), TURN);
        let (hold, settings) = (loaded.in_hand(0).held(), InHandSettings::default());
        let plan = plan_in_hand(&loaded.view(), &hold, &settings, 0, &Budget::work(200_000), &|_| {})
            .unwrap_or_else(|failure| panic!("{ball:?}: {failure}"));
        let report = loaded.judge(&hold, &plan, &CheckSettings::default());
        assert!(report.accepted(), "{ball:?}: {:?}", report.violations);
    }
}

/// The ball is lifted until it can no longer be held: the advice there names a pose nearby, and the ball is held at that.
#[test]
fn a_start_without_a_grasp_is_answered_with_a_pose_that_has_one() {
    let settings = InHandSettings::default();
    let hold_at = |position: &str| {
        let start = format!("position = [{position}]");
        let loaded = scene(WIDE, "sphere = { radius = 0.03 }", &start, TURN);
        plan_in_hand(&loaded.view(), &loaded.in_hand(0).held(), &settings, 0, &Budget::work(20_000), &|_| {})
    };
    let lifted = (0..30).map(|k| format!("0.0, 0.0, {:.3}", 0.08 + 0.005 * f64::from(k)));
    let failure =
        lifted.map(|position| hold_at(&position)).find_map(Result::err).expect("somewhere it is out of reach");
    assert_eq!(failure.kind, FailureKind::WorkSpent);
    let named = failure.advice.split(['[', ']']).nth(1).unwrap_or_else(|| panic!("{}", failure.advice));
    assert!(hold_at(named).is_ok(), "{named}: {}", failure.advice);
}
