//! Starts whose fingertips have come to rest nearer to an edge than the scene lets plans put them. Distances are those of the box itself: a
//! point lies on one pair of faces, and an edge is where it would lie on a second one.

use crate::{observation, own_plan, path, session};
use regrasp::Failure;
use regrasp::base::Budget;
use regrasp::geometry::Pose;
use regrasp::plan::ContactMode;
use regrasp::plan::check::{CheckSettings, ViolationKind};
use regrasp::plan::plan::{ContactState, Plan, Waypoint};
use regrasp::planners::in_hand::starting::ProjectionLimits;
use regrasp::robot::LoadOptions;
use regrasp::scene::{LoadedScene, load_scene_text};
use regrasp::session::{Session, Touching};

const HALF: [f64; 3] = [0.025, 0.025, 0.030];
const EDGE_DISTANCE: f64 = 0.004;

/// The box of 50 x 50 x 60 mm; contacts keep so far from its edges.
fn loaded(edge_distance: f64) -> LoadedScene {
    let path = path("box_90x.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text.replace("friction = 0.8", &format!("friction = 0.8\nedge_distance = {edge_distance}"));
    load_scene_text(&path, text.into_bytes(), &LoadOptions::default()).unwrap()
}

/// How far contacts that a plan chooses are off the surface at most, in metres.
const CHOSEN: f64 = 1e-6;
/// The same for a start: a tip that is observed touches as it stands where it is no farther off (`regrasp_manipulation::ends::given`).
const OBSERVED: f64 = 5e-6;

/// How far a point that is no farther than `off` from a face is from the nearest edge.
fn edge_distance_of(point: [f64; 3], off: f64) -> f64 {
    let mut inside: Vec<f64> = point.iter().zip(HALF).map(|(x, half)| half - x.abs()).collect();
    inside.sort_by(f64::total_cmp);
    assert!(inside[0].abs() <= off, "{point:?} is on a face");
    inside[1]
}

/// For every finger that holds, how far its contact is from the nearest edge.
fn edge_distances(waypoint: &Waypoint, off: f64) -> Vec<Option<f64>> {
    let held = waypoint.contacts.iter().map(|contact| match contact.mode {
        ContactMode::Free => None,
        _ => contact.point_in_object,
    });
    held.map(|point| point.map(|point| edge_distance_of(point, off))).collect()
}

/// Waypoints of a plan that may put fingertips as near to edges as 0.2 mm: those at which the nearest one is between the distances `near`.
fn careless(seed: u64, near: [f64; 2]) -> Vec<Waypoint> {
    let loaded = loaded(0.0002);
    let plan = own_plan(&loaded, seed);
    assert_eq!(kinds(&session(&loaded), &plan), [], "seed {seed}");
    let is_near = |waypoint: &&Waypoint| {
        let nearest = edge_distances(waypoint, CHOSEN).into_iter().flatten().fold(f64::INFINITY, f64::min);
        near[0] < nearest && nearest < near[1]
    };
    let ends = plan.segments.iter().flat_map(|segment| [&segment.waypoints[0], segment.waypoints.last().unwrap()]);
    ends.filter(is_near).cloned().collect()
}

/// A plan from `waypoint` to `goal`.
fn back(session: &Session, goal: &Pose, waypoint: &Waypoint, seed: u64) -> Result<Plan, Failure> {
    let start = session.project(&observation(waypoint), &ProjectionLimits::default())?;
    session.plan(&start, goal, seed, &Budget::work(2_000_000), &|_| {})
}

fn kinds(session: &Session, plan: &Plan) -> Vec<ViolationKind> {
    session.check(plan, &CheckSettings::default()).violations.iter().map(|violation| violation.kind).collect()
}

#[test]
fn a_fingertip_that_came_to_rest_near_an_edge_goes_away_from_it_or_lifts() {
    let strict = loaded(EDGE_DISTANCE);
    let session = session(&strict);
    let query = strict.task().query(0);
    let (mut n_plans, mut n_rolled, mut n_nearer, mut n_landed, mut n_back) = (0, 0, 0, 0, 0);
    for seed in 0..30 {
        let near = careless(seed, [0.25 * EDGE_DISTANCE, EDGE_DISTANCE - 2e-4]);
        let Some(waypoint) = near.first() else { continue };
        let Ok(plan) = back(&session, query.start(), waypoint, seed) else { continue };
        n_plans += 1;
        assert_eq!(kinds(&session, &plan), [], "seed {seed}");
        let all: Vec<Vec<Option<f64>>> = plan
            .segments
            .iter()
            .flat_map(|segment| &segment.waypoints)
            .map(|waypoint| edge_distances(waypoint, CHOSEN))
            .collect();
        for finger in 0..all[0].len() {
            let mut has_lifted = false;
            for pair in all.windows(2) {
                let [was, now] = [pair[0][finger], pair[1][finger]];
                has_lifted |= now.is_none();
                let Some(now) = now.filter(|now| *now < EDGE_DISTANCE - 1e-9) else { continue };
                assert!(!has_lifted, "seed {seed}: finger {finger} landed {now} from an edge");
                assert!(now >= was.unwrap() - 1e-9, "seed {seed}: finger {finger} from {was:?} to {now}");
                n_rolled += usize::from(now > was.unwrap() + 1e-9);
            }
        }
        // Fingertips that keep still are as near as they were all along.
        let first = all[0].iter().flatten().copied().fold(f64::INFINITY, f64::min);
        assert!((0.25 * EDGE_DISTANCE - 1e-5..EDGE_DISTANCE).contains(&first), "{first}");

        // The judge takes nobody's word for it: the same plan where nothing was observed, and one that comes nearer.
        let mut unasked = plan.clone();
        unasked.asked = None;
        assert!(kinds(&session, &unasked).contains(&ViolationKind::ContactTooNearEdge), "seed {seed}");
        let finger = all[0].iter().position(|distance| *distance == Some(first)).unwrap();
        let mut nearer = plan.clone();
        let segment = &mut nearer.segments[0];
        let moved = segment.waypoints.last_mut().unwrap();
        if moved.contacts[finger].mode != ContactMode::Free {
            let point = moved.contacts[finger].point_in_object.as_mut().unwrap();
            towards_the_edge(point, edge_distance_of(*point, CHOSEN) - first + 1e-4);
            assert!(kinds(&session, &nearer).contains(&ViolationKind::ContactTooNearEdge), "seed {seed}");
            n_nearer += 1;
        }
        // And one that lands where it was allowed to begin.
        let mut landed = plan.clone();
        let mut has_lifted = false;
        let ways = landed.segments.iter_mut().flat_map(|segment| &mut segment.waypoints);
        let again = ways.map(|waypoint| &mut waypoint.contacts[finger]).find(|contact| {
            has_lifted |= contact.mode == ContactMode::Free;
            has_lifted && contact.mode != ContactMode::Free
        });
        if let Some(contact) = again {
            let begun = &plan.segments[0].waypoints[0].contacts[finger];
            (contact.point_in_object, contact.normal_in_object) = (begun.point_in_object, begun.normal_in_object);
            assert!(kinds(&session, &landed).contains(&ViolationKind::ContactTooNearEdge), "seed {seed}");
            n_landed += 1;
        }
        // And one that goes away from the edge and comes back to where it was.
        let mut back_again = plan.clone();
        let mut ways = back_again.segments.iter_mut().flat_map(|segment| &mut segment.waypoints);
        let begun = ways.next().unwrap().contacts[finger];
        let held = ways.map(|waypoint| &mut waypoint.contacts[finger]).take_while(|c| c.mode != ContactMode::Free);
        let gone = |contact: &&mut _| edge_distance_of(point_of(contact), CHOSEN) > first + 1e-4;
        if let Some(contact) = held.skip_while(|contact| !gone(contact)).nth(1) {
            (contact.point_in_object, contact.normal_in_object) = (begun.point_in_object, begun.normal_in_object);
            assert!(kinds(&session, &back_again).contains(&ViolationKind::ContactTooNearEdge), "seed {seed}");
            n_back += 1;
        }
    }
    let counts = [n_plans, n_rolled, n_nearer, n_landed, n_back];
    assert!(counts.iter().zip([8, 1, 5, 5, 2]).all(|(n, least)| *n >= least), "{counts:?}");
}

fn point_of(contact: &ContactState) -> [f64; 3] {
    contact.point_in_object.unwrap()
}

/// Moves a point on a face by `distance` towards the edge that is nearest.
fn towards_the_edge(point: &mut [f64; 3], distance: f64) {
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| (HALF[a] - point[a].abs()).total_cmp(&(HALF[b] - point[b].abs())));
    let axis = axes[1];
    point[axis] += distance.copysign(point[axis]);
}

#[test]
fn a_fingertip_on_the_edge_itself_is_no_start() {
    let strict = loaded(EDGE_DISTANCE);
    let session = session(&strict);
    let mut n_refused = 0;
    for seed in 0..12 {
        for waypoint in careless(seed, [0.0, 0.25 * EDGE_DISTANCE - 1e-4]) {
            // Without room to move the fingertip away.
            let limits = ProjectionLimits { distance: 1e-5, turn: 1e-3, ..ProjectionLimits::default() };
            let failure = session.project(&observation(&waypoint), &limits).unwrap_err();
            assert!(failure.message.contains("nearer to an edge than 0.001 m"), "{}", failure.message);
            let (edge, after) = failure.message.split_once("; with finger \"").unwrap();
            let named = after.split_once("\" lifted off, ").unwrap().0;
            assert!(edge.contains(&format!("finger \"{named}\" touches nearer to an edge")), "{}", failure.message);
            n_refused += 1;
        }
    }
    assert!(n_refused >= 3, "only {n_refused}");
}

/// Where the other fingers hold the object, a fingertip on an edge is lifted off: the start has it free, and a plan leads on from there.
#[test]
fn a_fingertip_on_an_edge_is_lifted_off_where_the_others_hold() {
    let strict = loaded(EDGE_DISTANCE);
    let session = session(&strict);
    let query = strict.task().query(0);
    let (mut n_lifted, mut n_plans) = (0, 0);
    for seed in 0..30 {
        for waypoint in careless(seed, [0.0, 0.25 * EDGE_DISTANCE - 1e-4]) {
            // Room to lift off, and seldom enough to move away from the edge.
            let limits = ProjectionLimits { distance: 0.0007, turn: 0.02, ..ProjectionLimits::default() };
            let Ok(start) = session.project(&observation(&waypoint), &limits) else { continue };
            let on_edge: Vec<bool> = edge_distances(&waypoint, CHOSEN)
                .into_iter()
                .map(|distance| distance.is_some_and(|distance| distance < 0.25 * EDGE_DISTANCE - 1e-4))
                .collect();
            let holds: Vec<bool> = start.touching.iter().map(|touching| *touching == Touching::Holds).collect();
            // One that could be moved away far enough holds.
            n_lifted += on_edge.iter().zip(&holds).filter(|(on_edge, holds)| **on_edge && !**holds).count();
            let Ok(plan) = session.plan(&start, query.start(), seed, &Budget::work(1_000_000), &|_| {}) else {
                continue;
            };
            assert_eq!(kinds(&session, &plan), [], "seed {seed}");
            let first = edge_distances(&plan.segments[0].waypoints[0], OBSERVED);
            for (finger, distance) in first.iter().enumerate() {
                assert_eq!(distance.is_some(), holds[finger], "seed {seed}, finger {finger}");
                assert!(distance.is_none_or(|distance| distance > 0.25 * EDGE_DISTANCE - 1e-6), "seed {seed}");
            }
            n_plans += usize::from(on_edge.iter().zip(&holds).any(|(on_edge, holds)| *on_edge && !*holds));
        }
    }
    assert!(n_lifted >= 3 && n_plans >= 2, "lifted {n_lifted}, planned {n_plans}");
}
