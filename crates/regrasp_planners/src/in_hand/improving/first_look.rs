//! A first look at queries that give the start grasp: trees for a moment, then gaits along whole courses.
//!
//! A course is searched through as a whole, as where plans are improved: every order in which fingers may change their contacts along it is
//! considered, where trees see one relocation after the other. So a short plan is often found at once where trees need long, because
//! the given grasp lets few fingers go. What trees find at once is shorter still, so they look first.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::improving::{Lay, WHOLE, round};
use crate::in_hand::regrasping::change::CASUAL;
use crate::in_hand::searching::legs::{Legs, Solution, plan_legs};
use crate::settings::Method;
use regrasp_base::Rng;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_plan::plan::PlanFigures;

/// Numbers of the two searches, none of which another search for a part has.
const COURSES: usize = usize::MAX;
const TREES: usize = usize::MAX - 1;
/// Work of the trees, as a share of that for courses. By hand.
const TREES_SHARE: f64 = 1.0 / 3.0;
/// One course of so many is straight, the others are bent at random.
const ONE_STRAIGHT_OF: u64 = 3;

/// Of a plan that is not known yet: any costs less.
const UNKNOWN: PlanFigures = PlanFigures {
    relocations: 0,
    transfers: 0,
    object_path: 0.0,
    joint_path: 0.0,
    kept_margin: 0.0,
    cost: f64::INFINITY,
};

/// A plan from a given start grasp, if a first look finds one. `search` is the attempt that looks; it goes on with its own trees.
///
/// None without a given start grasp, where nothing moves, where the work for it is 0, and where fingertips do not roll or restrict
/// how the object may move: courses are not searched for those.
pub fn first_look(search: &mut Search, legs: &Legs) -> Option<Solution> {
    let (model, settings) = (search.model(), search.settings);
    let start = legs.start_grasp?;
    let most_work = settings.search.courses_work;
    let restricts = (0..model.n_fingers()).any(|finger| model.restricts_motion(finger));
    let is_for_courses = model.any_rolls() && model.may_release && !restricts && !search.holds_only;
    if settings.method != Method::Gait || most_work == 0 || !is_for_courses {
        return None;
    }
    let work = ((most_work as f64 * TREES_SHARE) as u64).min(search.work_left());
    let by_trees = beside(search, TREES, work, |trees| plan_legs(trees, legs));
    if by_trees.is_ok() {
        return by_trees.ok();
    }
    let work = most_work.min(search.work_left());
    let resting = Solution { way: Sequence::at(start.clone()), steps_to_way: Vec::new() };
    beside(search, COURSES, work, |courses| {
        // Other tracks can stand in for a relocation that is hard to make.
        courses.workspace.rrt_iterations = model.settings.rrt_iterations / CASUAL;
        for number in 0_u64.. {
            let lay = if number.is_multiple_of(ONE_STRAIGHT_OF) { Lay::Straight } else { Lay::Bent };
            let mut rng = Rng::child(&courses.rng, "course", number);
            if let Some((solution, _)) = round(courses, legs, &resting, &UNKNOWN, (lay, WHOLE), &mut rng)? {
                return Ok(solution);
            }
            courses.check()?;
        }
        Err(Stop::Restart)
    })
    .ok()
}

/// What another search with so much work finds; its work counts as that of `search`.
fn beside<T>(search: &mut Search, number: usize, work: u64, find: impl FnOnce(&mut Search) -> T) -> T {
    let mut beside = search.for_detour(number, work);
    let found = find(&mut beside);
    search.workspace.work += beside.workspace.work;
    search.n_samples += beside.n_samples;
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_hand::roadmap_tests::with_settings;
    use crate::settings::{InHandSettings, SearchSettings};

    /// Two ends of a plan of a wide hand: a look from its first grasp ends at the goal, begins in that grasp, and takes no more work
    /// than it may; without work there is no look, and none without a given grasp.
    #[test]
    fn a_look_goes_from_the_given_grasp_to_the_goal_within_its_work() {
        let with = |courses_work: u64, test: &dyn Fn(&mut Search)| {
            let search = SearchSettings { courses_work, ..SearchSettings::default() };
            with_settings("box_90x.toml", &InHandSettings { search, ..InHandSettings::default() }, |search| {
                test(search)
            });
        };
        let default = SearchSettings::default().courses_work;
        with(default, &|search| {
            let poses = [search.start, search.goal];
            let free = Legs { poses: &poses, start_grasp: None, goal_grasp: None };
            assert!(first_look(search, &free).is_none());
            let grasp = plan_legs(search, &free).unwrap().way.start().clone();
            let legs = Legs { start_grasp: Some(&grasp), ..free };
            let before = search.workspace.work;
            let way = first_look(search, &legs).expect("a plan").way;
            assert_eq!(way.start().world_from_object, search.start);
            assert_eq!(way.start().joints, grasp.joints);
            assert_eq!(way.end().world_from_object, search.goal);
            let spent = search.workspace.work - before;
            assert!(spent > 0 && spent < 2 * default, "{spent}");
        });
        with(0, &|search| {
            let poses = [search.start, search.goal];
            let free = Legs { poses: &poses, start_grasp: None, goal_grasp: None };
            let grasp = plan_legs(search, &free).unwrap().way.start().clone();
            let before = search.workspace.work;
            assert!(first_look(search, &Legs { start_grasp: Some(&grasp), ..free }).is_none());
            assert_eq!(search.workspace.work, before);
        });
    }
}
