//! Sequences of motions meet exactly, and what arrives somewhere arrives exactly there.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Tally;
use crate::in_hand::grasps::candidate::Candidate;
use crate::in_hand::grasps::choose::choose_grasp;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::grasps::sample::{draw_state, draw_state_at};
use crate::in_hand::regrasping::change::{
    Arrival, change_grasp, change_grasp_over, regrasp_transfer, transfer_regrasp,
};
use crate::in_hand::regrasping::unlock::{draw_bound_finger, unlock};
use crate::in_hand::roadmap_tests::{with_search, with_settings};
use crate::in_hand::searching::shorten::shorten;
use crate::settings::InHandSettings;
use regrasp_base::Rng;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::{GraspState, Moment};
use regrasp_manipulation::model::releasable;

/// `state` with one finger in another posture at the same contact: a little off, as redundant fingers come back to a pose.
fn other_postures(state: &GraspState) -> Vec<GraspState> {
    let mut found = Vec::new();
    for finger in 0..state.joints.len() {
        for (joint, shift) in [(0, 0.01), (1, -0.01), (2, 0.01), (2, -0.01)] {
            let mut other = state.clone();
            other.joints[finger][joint] += shift;
            found.push(other);
        }
    }
    found
}

fn wait_at(state: &GraspState) -> Moment {
    state.moment()
}

#[test]
fn a_change_between_postures_at_the_same_contacts_arrives_exactly_or_not_at_all() {
    with_search("sphere_90x.toml", |search| {
        let mut rng = Rng::keyed(3, "postures", 0);
        let (mut n_pairs, mut n_arrived) = (0, 0);
        for _ in 0..40 {
            let Some(from) = draw_state(search) else { continue };
            for to in other_postures(&from) {
                n_pairs += 1;
                for local_method in [transfer_regrasp, regrasp_transfer] {
                    let Some(way) = local_method(search, &from, &to, Arrival::Exact, &mut rng) else { continue };
                    n_arrived += 1;
                    assert!(*way.start() == from && *way.end() == to, "from exactly one posture to exactly the other");
                }
            }
        }
        assert!(n_pairs >= 20 && n_arrived >= 5, "too little was tried: {n_arrived} of {n_pairs}");
    });
}

#[test]
fn rounding_at_an_arrival_is_taken_out_and_more_than_rounding_is_moved() {
    with_search("sphere_90x.toml", |search| {
        let mut rng = Rng::keyed(4, "rounding", 0);
        let mut n_settled = 0;
        for _ in 0..100 {
            let Some(from) = draw_state(search) else { continue };
            let mut to = from.clone();
            to.joints.iter_mut().flatten().for_each(|joint| *joint += 1e-8 * (rng.unit() - 0.5));
            let Some(way) = transfer_regrasp(search, &from, &to, Arrival::Exact, &mut rng) else { continue };
            n_settled += 1;
            assert!(*way.end() == to && way.steps().len() == 1, "{:?}", way.steps().len());
        }
        assert!(n_settled >= 10, "too little was tried: {n_settled}");
    });
}

#[test]
fn shortcuts_between_two_visits_of_a_pose_leave_no_gap() {
    with_search("sphere_90x.toml", |search| {
        let mut n_tried = 0;
        for _ in 0..40 {
            let Some(first) = draw_state(search) else { continue };
            for second in other_postures(&first) {
                // Motions that need not be feasible: only where they begin and end matters here. The pose is visited twice,
                // with the same contacts and another posture, and the motion after it begins in that one.
                let mut way = Sequence::at(first.clone());
                way.push_transfer(vec![wait_at(&first)]);
                way.push_transfer(vec![wait_at(&second)]);
                way.push_transfer(vec![wait_at(&second)]);
                let end = way.end().clone();
                shorten(search, &mut way, Arrival::Exact);
                n_tried += 1;
                assert!(*way.start() == first && *way.end() == end);
                assert!(way.reversed().reversed() == way, "each motion begins where the one before ends");
            }
        }
        assert!(n_tried >= 20, "too little was tried: {n_tried}");
    });
}

#[test]
fn what_does_not_meet_is_not_joined() {
    with_search("sphere_90x.toml", |search| {
        let states: Vec<GraspState> = (0..200).filter_map(|_| draw_state(search)).take(3).collect();
        let [a, b, c] = states.try_into().expect("three grasps");
        let mut a_to_b = Sequence::at(a.clone());
        a_to_b.push_transfer(vec![wait_at(&b)]);
        assert!(*a_to_b.end() == b, "a transfer ends where its last moment is, contacts included");
        let mut nearly = a_to_b.end().clone();
        nearly.joints[0][0] += 1e-15_f64.max(nearly.joints[0][0].abs() * f64::EPSILON);
        assert!(a_to_b.clone().then(Sequence::at(nearly.clone())).is_none(), "one bit apart is apart");
        assert!(a_to_b.clone().then(Sequence::at(a_to_b.end().clone())).is_some());

        let mut way = a_to_b.clone();
        way.push_transfer(vec![wait_at(&c)]);
        let mut detour = Sequence::at(a);
        detour.push_transfer(vec![nearly.moment()]);
        let before = way.clone();
        assert!(!way.replace(0..=0, detour.clone()) && way == before, "a detour to another end is refused");
        assert!(!way.replace(1..=1, detour.clone()) && way == before, "a detour from another start is refused");
        assert!(way.replace(0..=1, detour.clone()) && way == detour, "the end of all may change");
    });
}

#[test]
fn transfers_in_a_row_are_joined_and_nothing_else_changes() {
    with_search("sphere_90x.toml", |search| {
        let mut rng = Rng::keyed(5, "row", 0);
        let state = std::iter::repeat_with(|| draw_state(search)).take(40).flatten().next().expect("a grasp");
        let way =
            regrasp_transfer(search, &state, &state, Arrival::Exact, &mut rng).unwrap_or(Sequence::at(state.clone()));
        let mut long = way.clone();
        long.push_transfer(vec![wait_at(&state), wait_at(&state)]);
        long.push_transfer(vec![wait_at(&state)]);
        long.push_regrasp(0, Some(state.contacts[0]), vec![state.joints[0].clone()]);
        long.push_transfer(vec![wait_at(&state)]);
        let joined = long.clone().with_transfers_joined();
        assert_eq!(joined.steps().len() + 1, long.steps().len());
        assert!(joined.start() == long.start() && joined.end() == long.end());
        assert!(joined.clone().with_transfers_joined() == joined);
    });
}

#[test]
fn a_third_grasp_leads_from_one_to_another_where_none_does_directly() {
    with_search("box_90x.toml", |search| {
        let mut rng = Rng::keyed(5, "third grasp", 0);
        let (mut n_direct, mut n_over) = (0, 0);
        for _ in 0..400 {
            let Some(from) = draw_state(search) else { continue };
            let Some(to) = draw_state_at(search, &from.world_from_object) else { continue };
            let here = Sequence::at(from.clone());
            let direct = change_grasp(search, &here, &to, Arrival::Exact, &mut rng);
            let mut pool = Pool::new(&from.world_from_object, &search.goal, search.model().n_fingers());
            let Some(way) = change_grasp_over(search, &here, &to, &mut pool, &mut rng) else {
                assert!(direct.is_none(), "what goes directly goes");
                continue;
            };
            n_direct += u32::from(direct.is_some());
            n_over += u32::from(direct.is_none());
            assert!(*way.start() == from && *way.end() == to, "from exactly one grasp to exactly the other");
            for (index, step) in way.steps().iter().enumerate() {
                let Motion::Regrasp { finger, .. } = step.motion() else { panic!("the object moves") };
                let (before, model) = (way.state_before(index), search.model());
                let others = before.holding & !(1 << finger);
                let asked = model.settings.closure_margin;
                assert!(model.closure_margin(&before.contacts, others) >= asked, "the others hold meanwhile");
                assert!(model.closure_margin(&step.end().contacts, step.end().holding) >= asked, "all hold afterwards");
            }
        }
        assert!(n_direct >= 5 && n_over >= 5, "too little was tried: {n_direct} directly, {n_over} over others");
    });
}

/// A grasp at the start that lets some fingers go, but not all, and which.
fn draw_partly_bound(search: &mut Search) -> Option<(GraspState, u32)> {
    let pose = search.start;
    let mut pool = Pool::new(&pose, &search.goal, search.model().n_fingers());
    let options: Vec<Vec<Candidate>> =
        (0..search.model().n_fingers()).map(|finger| pool.any(search, finger, 1)).collect();
    if options.iter().any(Vec::is_empty) {
        return None;
    }
    let state = choose_grasp(search, &pose, &options, None)?;
    let released = releasable(search.model(), &state.contacts, state.holding);
    (released != state.holding).then_some((state, released))
}

#[test]
fn a_bound_finger_is_moved_last_and_only_where_the_others_hold() {
    with_settings("box_90x.toml", &InHandSettings::plain(), |search| {
        let (mut n_alone, mut n_prepared) = (0, 0);
        for round in 0..400 {
            let Some((from, _)) = draw_partly_bound(search) else { continue };
            let finger = round % search.model().n_fingers();
            let mut pool = Pool::new(&from.world_from_object, &search.goal, search.model().n_fingers());
            let Some(way) = unlock(search, &from, finger, &mut pool) else { continue };
            assert!(*way.start() == from);
            for (index, step) in way.steps().iter().enumerate() {
                let Motion::Regrasp { finger: moved, .. } = step.motion() else { panic!("the object moves") };
                assert_eq!(*moved == finger, index + 1 == way.steps().len(), "it moves once, at the end");
                let (before, model) = (way.state_before(index), search.model());
                let others = before.holding & !(1 << moved);
                assert!(model.closure_margin(&before.contacts, others) >= model.settings.closure_margin);
            }
            assert!(way.end().contact(finger) != from.contact(finger));
            n_alone += u32::from(way.steps().len() == 1);
            n_prepared += u32::from(way.steps().len() > 1);
        }
        assert!(n_alone >= 5 && n_prepared >= 5, "too little was tried: {n_alone} at once, {n_prepared} after others");
    });
}

#[test]
fn a_finger_is_bound_only_once_enough_grasps_were_seen_that_do_not_let_it_go() {
    with_settings("box_90x.toml", &InHandSettings::plain(), |search| {
        let model = search.model();
        let drawn = (0..500).find_map(|_| draw_partly_bound(search));
        let (state, released) = drawn.expect("a grasp that lets only some fingers go");
        let options: Vec<Vec<Candidate>> =
            (0..model.n_fingers()).map(|finger| vec![Candidate::present(&state, finger)]).collect();
        let mut table = ClosureTable::new(model, &options);
        table.n_releasable(&options.iter().map(|_| 0).collect());
        // Drawing takes note as well.
        search.tally = Tally::default();
        for _ in 0..99 {
            search.tally.note_releases(table.releases(), &state.world_from_object);
        }
        assert!((0..200).all(|_| draw_bound_finger(search).is_none()), "too few were seen");
        search.tally.note_releases(table.releases(), &state.world_from_object);
        let drawn: Vec<Option<usize>> = (0..200).map(|_| draw_bound_finger(search)).collect();
        let fingers = drawn.iter().flatten().fold(0, |bits, finger| bits | 1 << finger);
        assert_eq!(fingers, state.holding & !released, "those that are bound, and no other");
        assert!(drawn.iter().any(Option::is_none), "other extensions go on");
    });
}
