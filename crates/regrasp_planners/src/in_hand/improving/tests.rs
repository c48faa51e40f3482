//! Bounds against searches without any, and against joints drawn at random.

use super::*;
use crate::in_hand::attempt::search::Search;
use crate::in_hand::improving::cost::{cannot_reach, figures, lower_bound};
use crate::in_hand::roadmap_tests::with_settings;
use crate::in_hand::searching::legs::Legs;
use crate::settings::InHandSettings;
use regrasp_geometry::UnitVector;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::sequence::Motion;
use regrasp_robot::kinematics::finger_ik::Coordinates;

const NO_LIMITS: Limits = Limits { cost: 1e9, n_expanded: 1_000_000 };

/// Gaits on a few tracks along the straight course of `name`.
fn with_gaits(name: &str, n_tracks: usize, test: impl FnOnce(&mut Gaits)) {
    with_settings(name, &InHandSettings::plain(), |search: &mut Search| {
        let poses = [search.start, search.goal];
        let legs = Legs { poses: &poses, start_grasp: None, goal_grasp: None };
        let mut rng = Rng::keyed(1, "gaits", 0);
        let course = straight(search.model(), &legs, &mut rng);
        let (mut tracks, mut alone) = (Vec::new(), Vec::new());
        for finger in 0..search.model().n_fingers() {
            let drawn = draw_tracks(search, &course, finger, DRAWN, &mut rng).unwrap();
            tracks.push(covers(&course, drawn, n_tracks));
            alone.push(Alone::new(&course, &tracks[finger], [None; 2], &search.settings.improvement.cost));
        }
        let contacts = StationContacts::of(search.model(), &course, &tracks);
        let margin = search.model().settings.closure_margin;
        test(&mut Gaits::new(search, &course, &tracks, &contacts, &alone, None, margin));
    });
}

#[test]
fn a_star_finds_what_dijkstra_finds_and_no_edge_gains_more_bound_than_it_costs() {
    for name in ["box_90x.toml", "sphere_90x.toml"] {
        with_gaits(name, 6, |gaits| {
            let guided = gaits.cheapest(NO_LIMITS, 1.0).expect("a gait on these tracks");
            let blind = gaits.cheapest(NO_LIMITS, 0.0).expect("the same");
            assert!((guided.cost - blind.cost).abs() < 1e-9, "{name}: {} and {}", guided.cost, blind.cost);
            assert!(gaits.bound(0) <= guided.cost + 1e-9, "{name}");
            let greedy = gaits.cheapest(NO_LIMITS, GREED).expect("some gait");
            assert!(greedy.cost <= GREED * guided.cost + 1e-9, "{name}: {} of {}", greedy.cost, guided.cost);
            // Every node that Dijkstra's algorithm has seen.
            let (mut n_edges, mut edges) = (0, Vec::new());
            for node in 0..gaits.n_nodes().min(5000) {
                edges.clear();
                gaits.neighbours(node, &mut edges);
                for &(next, cost) in &edges {
                    let (here, there) = (gaits.bound(node), gaits.bound(next));
                    assert!(here <= cost + there + 1e-9, "{name}: {here} > {cost} + {there}");
                    n_edges += 1;
                }
            }
            assert!(n_edges > 100, "{name}: too little was looked at");
        });
    }
}

#[test]
fn what_a_proven_gait_costs_is_no_less_than_the_search_said() {
    with_gaits("box_90x.toml", 10, |gaits| {
        let mut rng = Rng::keyed(2, "proof", 0);
        let solution = gaits.cheapest_proven(NO_LIMITS, GREED, 50, &mut rng).unwrap().expect("a gait that is proven");
        let said = gaits.cheapest(NO_LIMITS, GREED).expect("what is proven is still there").cost;
        let cost = figures(gaits.model(), &CostWeights::default(), &solution.way).cost;
        assert!(said <= cost + 1e-9, "{said} and {cost}");
    });
}

#[test]
fn what_a_finger_reaches_is_never_out_of_its_reach() {
    with_settings("box_180z.toml", &InHandSettings::plain(), |search| {
        let model = search.model();
        let mut rng = Rng::keyed(3, "reach", 0);
        let placement = Placement::from(&search.goal);
        for _ in 0..500 {
            let finger = rng.below(model.n_fingers());
            let ik = model.fingers[finger].ik;
            let chain = ik.chain();
            let joints: Coordinates = chain.lower.iter().zip(&chain.upper).map(|(l, u)| rng.uniform(*l, *u)).collect();
            let tip = placement.point_to_child(&ik.tip(&joints));
            let normal_in_object = UnitVector::new_normalize(rng.direction().into());
            let point_in_object = tip - normal_in_object.into_inner() * model.fingers[finger].tip_radius;
            let contact = Contact { point_in_object, normal_in_object };
            assert!(!cannot_reach(model, finger, &contact, &placement), "{joints:?}");
        }
        let away = Contact {
            point_in_object: Point::new(1.0, 0.0, 0.0),
            normal_in_object: UnitVector::new_normalize(regrasp_geometry::Vector::x()),
        };
        assert!(cannot_reach(model, 0, &away, &placement));
    });
}

#[test]
fn a_bound_with_grasps_at_both_ends_counts_the_fingers_that_must_move() {
    with_settings("box_90x.toml", &InHandSettings::plain(), |search| {
        let poses = [search.start, search.goal];
        search.begin_leg(0, poses[0], poses[1]);
        let way = crate::in_hand::searching::gait::grow(search, None, None).expect("an easy query");
        let model = search.model();
        let moved: std::collections::BTreeSet<usize> = way
            .steps()
            .iter()
            .filter_map(|step| match step.motion() {
                Motion::Regrasp { finger, .. } => Some(*finger),
                Motion::Transfer(_) => None,
            })
            .collect();
        let weights = search.settings.improvement.cost;
        let free = lower_bound(model, &weights, &poses, None, None);
        let given = lower_bound(model, &weights, &poses, Some(way.start()), Some(way.end()));
        assert!(!moved.is_empty() && given >= free + weights.relocation * moved.len() as f64 - 1e-9);
        assert!(given <= figures(model, &weights, &way).cost);
    });
}
