//! Better plans after the first: never worse, accepted, the same on any number of threads, cut at any moment.

use crate::in_hand_methods::scene;
use crate::queries::Queries;
use regrasp_base::Budget;
use regrasp_geometry::{Pose, frame, interpolate_pose};
use regrasp_plan::check::closure::{HeldBody, margin};
use regrasp_plan::check::{CheckSettings, Level};
use regrasp_plan::plan::{Improvement, Waypoint};
use regrasp_plan::{Plan, SegmentKind};
use regrasp_planners::in_hand::{CostWeights, InHandSettings, Method, plan_in_hand, validate_once};
use regrasp_planners::in_hand::{ImprovementSettings, SearchSettings};
use regrasp_scene::{GraspRequest, InHandQuery, LoadedScene};
use std::time::Duration;

fn settings(improve_work: u64) -> InHandSettings {
    InHandSettings {
        improvement: ImprovementSettings { improve_work, ..InHandSettings::plain().improvement },
        ..InHandSettings::plain()
    }
}

/// Plans, and has the plan judged.
fn plan(loaded: &LoadedScene, query: &InHandQuery, settings: &InHandSettings, seed: u64) -> Plan {
    let budget = Budget::work(20_000_000);
    let plan = plan_in_hand(&loaded.view(), query, settings, seed, &budget, &|_| {}).unwrap();
    let report = loaded.judge(query, &plan, &CheckSettings { level: Level::Geometry, ..CheckSettings::default() });
    assert!(report.accepted(), "{} seed {seed}: {:#?}", loaded.scene.name, report.violations);
    assert!(report.min_margin.is_none_or(|margin| margin >= plan.promises.kept_margin - 1e-9), "promises hold");
    assert_eq!(validate_once(&loaded.view(), &plan, settings), Ok(()));
    plan
}

fn improvement(plan: &Plan) -> &Improvement {
    plan.statistics.improvement.as_deref().expect("it was asked for")
}

/// The cost of a plan from what is in its file.
fn cost_of_file(loaded: &LoadedScene, plan: &Plan, weights: &CostWeights) -> f64 {
    let turn_length = loaded.scene.objects[0].radius;
    let (mut relocations, mut object_path, mut joint_path) = (0.0, 0.0, 0.0);
    for segment in &plan.segments {
        relocations += f64::from(u8::from(segment.kind == SegmentKind::Regrasp));
        for pair in segment.waypoints.windows(2) {
            let pose = |waypoint: &Waypoint| Pose::from(&waypoint.world_from_object);
            object_path += frame::pose_distance(&pose(&pair[0]), &pose(&pair[1]), turn_length);
            joint_path += pair[0].joints.iter().zip(&pair[1].joints).map(|(a, b)| (b - a).abs()).sum::<f64>();
        }
    }
    let tightness = plan.promises.required_margin / plan.promises.kept_margin;
    weights.relocation * relocations
        + weights.object_path * object_path
        + weights.joint_path * joint_path
        + weights.margin * tightness
}

#[test]
fn improved_plans_are_the_same_on_any_number_of_threads_and_cost_what_they_say() {
    for name in ["box_90x.toml", "box_180z.toml", "sphere_180x.toml"] {
        let loaded = scene(name);
        let query = loaded.in_hand(1);
        let asked = settings(60_000);
        let improved = plan(&loaded, &query, &asked, 1);
        for n_threads in [2, 8] {
            let again = plan(&loaded, &query, &InHandSettings { n_threads, ..asked.clone() }, 1);
            assert!(improved == again, "{name}: another plan on {n_threads} threads");
        }
        let first = plan(&loaded, &query, &settings(0), 1);
        assert!(first.statistics.improvement.is_none());
        let told = improvement(&improved);
        for (plan, figures) in [(&first, &told.first), (&improved, &told.improved)] {
            let cost = cost_of_file(&loaded, plan, &asked.improvement.cost);
            assert!((cost - figures.cost).abs() < 1e-6, "{name}: {cost} and {figures:?}");
            assert_eq!(plan.statistics.relocations, figures.relocations);
            assert_eq!(plan.statistics.transfers, figures.transfers);
            assert_eq!(plan.promises.kept_margin, figures.kept_margin);
        }
        assert!(told.lower_bound <= told.improved.cost && told.improved.cost <= told.first.cost, "{name}: {told:?}");
        assert!(!improved.statistics.cut_by_time);
        // Work is looked at now and then: the overrun is one step of the search.
        assert!(told.work < 66_000 && improved.statistics.work >= told.work, "{name}: {}", told.work);
    }
}

#[test]
fn more_work_never_makes_a_plan_worse() {
    let loaded = scene("box_180x.toml");
    let query = loaded.in_hand(2);
    let mut last = f64::INFINITY;
    for work in [1, 3_000, 20_000, 30_000, 60_000, 120_000] {
        let plan = plan(&loaded, &query, &settings(work), 2);
        let told = improvement(&plan);
        assert!(told.improved.cost <= told.first.cost.min(last), "{work}: {told:?}, {last} before");
        last = told.improved.cost;
    }
    assert!(last < 6.0, "so much work brings something: {last}");
}

#[test]
fn time_only_cuts_and_the_plan_says_so() {
    let loaded = scene("box_180x.toml");
    let query = loaded.in_hand(3);
    let first = plan(&loaded, &query, &settings(0), 3);
    let none_left = Budget { improve_for: Some(Duration::ZERO), ..Budget::work(20_000_000) };
    let cut = plan_in_hand(&loaded.view(), &query, &settings(u64::MAX), 3, &none_left, &|_| {}).unwrap();
    assert!(cut.statistics.cut_by_time && cut.segments == first.segments);
    let little = Budget { improve_for: Some(Duration::from_millis(300)), ..Budget::work(20_000_000) };
    let cut = plan_in_hand(&loaded.view(), &query, &settings(u64::MAX), 3, &little, &|_| {}).unwrap();
    assert!(cut.statistics.cut_by_time && improvement(&cut).improved.cost <= improvement(&cut).first.cost);
    assert!(
        loaded.judge(&query, &cut, &CheckSettings { level: Level::Geometry, ..CheckSettings::default() }).accepted()
    );
}

#[test]
fn relocations_of_boxes_fall_by_half() {
    let (mut first, mut improved) = (0, 0);
    for name in ["box_90x.toml", "box_180z.toml", "box_180x.toml"] {
        let loaded = scene(name);
        for seed in 0..3 {
            let plan = plan(&loaded, &loaded.in_hand(seed), &settings(200_000), seed);
            first += improvement(&plan).first.relocations;
            improved += improvement(&plan).improved.relocations;
        }
    }
    assert!(2 * improved <= first, "{first} relocations, then {improved}");
}

/// Default settings, in which fingertips roll.
fn rolling(improve_work: u64) -> InHandSettings {
    let improvement = ImprovementSettings { improve_work, ..ImprovementSettings::default() };
    InHandSettings { improvement, ..InHandSettings::default() }
}

fn plan_rolling(loaded: &LoadedScene, query: &InHandQuery, settings: &InHandSettings, seed: u64) -> Plan {
    let plan = plan_in_hand(&loaded.view(), query, settings, seed, &Budget::work(5_000_000), &|_| {}).unwrap();
    let report = loaded.judge(query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "{} seed {seed}: {:#?}", loaded.scene.name, report.violations);
    assert_eq!(validate_once(&loaded.view(), &plan, settings), Ok(()));
    plan
}

#[test]
fn rolling_fingertips_keep_their_contacts_longer_in_improved_plans() {
    let (mut first, mut improved) = (0, 0);
    for name in ["box_90x.toml", "box_180z.toml", "box_180x.toml"] {
        let loaded = scene(name);
        for seed in 0..2 {
            let plan = plan_rolling(&loaded, &loaded.in_hand(seed), &rolling(300_000), seed);
            let told = improvement(&plan);
            assert!(told.improved.cost <= told.first.cost, "{name} seed {seed}: {told:?}");
            first += told.first.relocations;
            improved += told.improved.relocations;
        }
    }
    assert!(10 * improved <= 7 * first, "{first} relocations, then {improved}");
}

#[test]
fn a_plan_from_a_given_grasp_is_shortened_and_keeps_that_grasp_and_the_way_poses() {
    let loaded = scene("box_90x.toml");
    let free = loaded.in_hand(3);
    let found = plan_rolling(&loaded, &free, &rolling(0), 3);
    let ends = [&found.segments[0].waypoints[0], found.segments.last().unwrap().waypoints.last().unwrap()];
    let mut query = free.clone();
    query.start_grasp = GraspRequest::Joints(ends[1].joints.clone());
    (query.world_from_object_start, query.world_from_object_goal) =
        (free.world_from_object_goal, free.world_from_object_start);
    let mut aside = interpolate_pose(&free.world_from_object_start, &free.world_from_object_goal, 0.5);
    aside.translation.vector.x += 0.004;
    for way in [vec![], vec![aside]] {
        query.world_from_object_way = way;
        let plan = plan_rolling(&loaded, &query, &rolling(0), 5);
        assert_eq!(plan.way_poses.len(), query.world_from_object_way.len());
        assert_eq!(plan.segments[0].waypoints[0].joints, ends[1].joints, "not one bit off");
        if plan.n_relocations() >= 2 {
            assert!(improvement(&plan).improved.cost <= improvement(&plan).first.cost);
        }
        let mut as_found = rolling(0);
        as_found.improvement.shorten_share = 0.0;
        let long = plan_rolling(&loaded, &query, &as_found, 5);
        assert!(long.statistics.improvement.is_none() && plan.n_relocations() <= long.n_relocations());
    }
}

#[test]
fn given_grasps_and_way_poses_stay() {
    let loaded = scene("box_90x.toml");
    let free = loaded.in_hand(4);
    let found = plan(&loaded, &free, &settings(0), 4);
    let waypoints = |plan: &Plan| -> Vec<Waypoint> {
        plan.segments.iter().flat_map(|segment| segment.waypoints.iter().cloned()).collect()
    };
    let own = waypoints(&found);
    let (first, last) = (&own[0].joints, &own[own.len() - 1].joints);
    let mut query = free.clone();
    (query.start_grasp, query.goal_grasp) = (GraspRequest::Joints(first.clone()), GraspRequest::Joints(last.clone()));
    let improved = plan(&loaded, &query, &settings(100_000), 4);
    let all = waypoints(&improved);
    assert!(all[0].joints == *first && all[all.len() - 1].joints == *last, "not one bit off");

    let (start, goal) = (free.world_from_object_start, free.world_from_object_goal);
    let mut aside = interpolate_pose(&start, &goal, 0.5);
    aside.translation.vector.x += 0.004;
    query.world_from_object_way = vec![aside, start, start];
    for request in [GraspRequest::Automatic, query.start_grasp.clone()] {
        query.start_grasp = request.clone();
        query.goal_grasp = GraspRequest::Automatic;
        let improved = plan(&loaded, &query, &settings(100_000), 4);
        assert_eq!(improved.way_poses.len(), 3, "the checker has looked at where they are");
        let told = improvement(&improved);
        assert!(told.improved.cost < told.first.cost, "{told:?}");
    }
}

#[test]
fn the_weights_decide_what_is_better() {
    let loaded = scene("box_180x.toml");
    let query = loaded.in_hand(5);
    let margins = CostWeights { margin: 20.0, ..CostWeights::default() };
    let tight = plan(&loaded, &query, &settings(300_000), 5);
    let wide = plan(
        &loaded,
        &query,
        &InHandSettings {
            improvement: ImprovementSettings { cost: margins, ..settings(300_000).improvement },
            ..settings(300_000)
        },
        5,
    );
    assert!(improvement(&wide).improved.kept_margin > improvement(&wide).first.kept_margin, "{:?}", improvement(&wide));
    assert!(improvement(&tight).improved.relocations < improvement(&tight).first.relocations);
}

#[test]
fn the_methods_of_the_paper_are_improved_under_their_release_rule() {
    let loaded = scene("sphere_90x.toml");
    let asked = InHandSettings { method: Method::Visibility, ..settings(200_000) };
    let plan = plan(&loaded, &loaded.in_hand(6), &asked, 6);
    let told = improvement(&plan);
    assert!(told.improved.cost < told.first.cost, "{told:?}");
    let recorded: InHandSettings = serde_json::from_value(plan.settings.clone()).unwrap();
    let object = &loaded.scene.objects[0];
    for segment in &plan.segments {
        let contacts: Vec<_> = segment.waypoints[0]
            .contacts
            .iter()
            .map(|contact| {
                let point = contact.point_in_object.unwrap().into();
                let normal = regrasp_geometry::UnitVector::new_normalize(contact.normal_in_object.unwrap().into());
                regrasp_grasp::Contact { point_in_object: point, normal_in_object: normal }
            })
            .collect();
        let frame = regrasp_grasp::GraspFrame {
            center_of_mass: object.center_of_mass,
            torque_scale: object.radius,
            friction: object.friction,
        };
        for away in 0..contacts.len() {
            let others: Vec<_> = (0..contacts.len()).filter(|&f| f != away).map(|f| contacts[f]).collect();
            let others: [_; 3] = others.try_into().expect("a hand of four");
            let margin = regrasp_grasp::closure::three::prove(&others, &frame).map_or(0.0, |(margin, _)| margin);
            assert!(margin >= recorded.physics.closure_margin, "finger {away} could not be let go: {margin}");
        }
    }
}

/// Closure margin of the grasp that a plan ends with, by the checker's own bound.
fn margin_at_end(loaded: &LoadedScene, plan: &Plan) -> f64 {
    let end = plan.segments.last().unwrap().waypoints.last().unwrap();
    let grips: Vec<_> = end
        .contacts
        .iter()
        .filter_map(|contact| Some((contact.point_in_object?, contact.normal_in_object?)))
        .map(|(point, normal)| regrasp_grasp::Grip {
            contact: regrasp_grasp::Contact {
                point_in_object: point.into(),
                normal_in_object: regrasp_geometry::UnitVector::new_normalize(normal.into()),
            },
            model: regrasp_grasp::ContactModel::Point,
        })
        .collect();
    margin(&grips, &HeldBody::of(&loaded.scene.objects[0], plan))
}

#[test]
fn plans_end_with_the_margin_that_is_asked_for_and_given_grasps_stay() {
    let loaded = scene("sphere_90x.toml");
    let (mut n_weak, mut n_better) = (0, 0);
    for seed in 0..12 {
        let query = loaded.in_hand(seed);
        let as_found = plan(&loaded, &query, &settings(0), seed);
        let before = margin_at_end(&loaded, &as_found);
        let mut asked = settings(0);
        asked.improvement.end_margin = 0.08;
        let better = plan(&loaded, &query, &asked, seed);
        let after = margin_at_end(&loaded, &better);
        if before >= 0.08 {
            assert_eq!(better.segments, as_found.segments, "nothing to be mended");
            continue;
        }
        n_weak += 1;
        n_better += u32::from(after >= 0.08);
        let n_more = better.n_relocations() - as_found.n_relocations();
        assert!(after >= 0.08 || n_more == 0, "seed {seed}: {n_more} more relocations, from {before} to {after}");
        assert_eq!(better.segments[..as_found.segments.len()], as_found.segments[..], "what leads there stays");
        let again = plan(&loaded, &query, &InHandSettings { n_threads: 8, ..asked.clone() }, seed);
        assert!(again == better, "seed {seed}: another plan on 8 threads");

        // Who names the grasp at the goal gets that.
        let last = as_found.segments.last().unwrap().waypoints.last().unwrap().joints.clone();
        let given = InHandQuery { goal_grasp: GraspRequest::Joints(last.clone()), ..query };
        let there = plan(&loaded, &given, &asked, seed);
        assert_eq!(there.segments.last().unwrap().waypoints.last().unwrap().joints, last, "not one bit off");
    }
    assert!(n_weak >= 4 && 2 * n_better >= n_weak, "{n_better} of {n_weak}");
}

/// The way back of a plan, from the grasp in which it ends.
fn way_back(query: &InHandQuery, plan: &Plan) -> InHandQuery {
    let end = plan.segments.last().unwrap().waypoints.last().unwrap();
    InHandQuery {
        world_from_object_start: Pose::from(&end.world_from_object),
        world_from_object_goal: query.world_from_object_start,
        start_grasp: GraspRequest::Joints(end.joints.clone()),
        ..query.clone()
    }
}

#[test]
fn plans_from_a_given_grasp_are_shortened_by_their_relocations() {
    let loaded = scene("box_180z.toml");
    let budget = Budget::work(20_000_000);
    let asked = |shorten_relocation| InHandSettings {
        improvement: ImprovementSettings { shorten_relocation, ..ImprovementSettings::default() },
        ..InHandSettings::default()
    };
    let find = |query: &InHandQuery, settings: &InHandSettings, seed| {
        let plan = plan_in_hand(&loaded.view(), query, settings, seed, &budget, &|_| {}).unwrap();
        let report = loaded.judge(query, &plan, &CheckSettings::default());
        assert!(report.accepted(), "seed {seed}: {:#?}", report.violations);
        plan
    };
    let (mut before, mut after) = (0, 0);
    for seed in 0..6 {
        let query = loaded.in_hand(seed);
        let there = find(&query, &asked(0), seed);
        assert!(there.segments == find(&query, &asked(10_000), seed).segments, "its start grasp is not given");
        let back = way_back(&query, &there);
        let (usual, shorter) = (find(&back, &asked(0), seed), find(&back, &asked(10_000), seed));
        let (told, first) = (improvement(&shorter), improvement(&usual).first.relocations);
        assert_eq!(told.first.relocations, first, "the same plan is shortened");
        assert!(told.work >= 10_000 * first, "{} for {first} relocations", told.work);
        before += usual.n_relocations();
        after += shorter.n_relocations();
    }
    assert!(after < before, "{before} relocations, then {after}");
}

#[test]
fn a_search_ends_without_a_plan_where_its_own_work_is_spent_and_better_plans_have_the_rest() {
    let budget = Budget::work(400_000);
    let asked = |search_work| InHandSettings {
        advise: false,
        search: SearchSettings { search_work, ..SearchSettings::default() },
        ..settings_of_execution()
    };
    let hopeless = scene("out_of_reach.toml");
    for (search_work, spent) in [(None, 400_000), (Some(30_000), 30_000)] {
        let failure = plan_in_hand(&hopeless.view(), &hopeless.in_hand(0), &asked(search_work), 0, &budget, &|_| {});
        let failure = failure.unwrap_err();
        let work = failure.statistics.work;
        assert!((spent..spent + 5_000).contains(&work), "{work} where {search_work:?} are allowed");
        assert_eq!(failure.advice.contains("search_work"), search_work.is_some(), "{}", failure.advice);
        assert_eq!(failure.advice.contains("--max-work"), search_work.is_none(), "{}", failure.advice);
    }
    let loaded = scene("box_90x.toml");
    let query = loaded.in_hand(3);
    let plan = plan_in_hand(&loaded.view(), &query, &asked(Some(30_000)), 3, &budget, &|_| {}).unwrap();
    assert!(loaded.judge(&query, &plan, &CheckSettings::default()).accepted());
    assert!(plan.statistics.work >= 100_000, "{}", plan.statistics.work);
}

/// Every plan is made better with 100,000 configurations.
fn settings_of_execution() -> InHandSettings {
    let improvement = ImprovementSettings { improve_work: 100_000, ..ImprovementSettings::default() };
    InHandSettings { improvement, ..InHandSettings::default() }
}
