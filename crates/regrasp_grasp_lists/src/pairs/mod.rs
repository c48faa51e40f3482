//! Double grasps: one hand takes the object from the other (Saut 2010, sec. IV-B).
//!
//! Of the first list those grasps count in which the hand, on its way in and in the grasp, hits nothing around the object's start; of
//! the second list those that hit nothing around its goal. A pair counts when the hands hit each other neither in the grasps, nor while
//! the second hand comes, nor while the first one leaves.

/// A hand on its way.
mod moving;

use crate::{Failure, FailureKind, view_of, whole_hand};
use moving::{Standing, Way, are_apart};
use rayon::prelude::*;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::list::{DoubleGrasp, GraspList, ListedGrasp};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::settings::PhysicsSettings;
use regrasp_robot::Hand;
use regrasp_robot::hand::convex_of;
use regrasp_scene::Object;

/// Where the object is while a hand comes to it, or leaves it.
#[derive(Debug, Clone)]
pub struct Context {
    /// The object's pose.
    pub world_from_object: Pose,
    /// What is around it, supports too, placed in the world. A mesh counts as its hull.
    pub surroundings: Vec<PlacedShape>,
    /// Index of the list's stable pose in which the object stands: grasps in which the hand would come below the support are
    /// dropped at a glance.
    pub stable_pose: Option<usize>,
    /// The robot's base, for its score. None: all grasps are as natural.
    pub robot_base: Option<Point>,
}

impl Default for Context {
    fn default() -> Self {
        Context { world_from_object: Pose::identity(), surroundings: Vec::new(), stable_pose: None, robot_base: None }
    }
}

/// One of the hands.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// The hand.
    pub hand: &'a Hand,
    /// The object.
    pub object: &'a Object,
    /// Its grasps.
    pub list: &'a GraspList,
    /// Where it meets the object alone: the start for the first hand, the goal for the second.
    pub context: &'a Context,
}

/// The pairs of two lists.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pairs {
    /// Grasps of each list that hit nothing of the surroundings.
    pub clear: [usize; 2],
    /// Pairs of those in which the hands hit each other.
    pub hands_touch: usize,
    /// The others, best score first.
    pub pairs: Vec<DoubleGrasp>,
}

/// The double grasps of two lists. The same on any number of threads.
///
/// Errors: lists of different objects, hands without an inside.
pub fn pair_grasps(first: &Side, second: &Side, n_threads: usize) -> Result<Pairs, Failure> {
    let refused = |problem: String, advice: &str| Failure::bare(FailureKind::Impossible, problem, advice);
    let advice = "make both lists with the same object, mass and scale";
    let records = [&first.list.object, &second.list.object];
    if records[0].name != records[1].name || records[0].center_of_mass != records[1].center_of_mass {
        return Err(refused(format!("the lists are of \"{}\" and \"{}\"", records[0].name, records[1].name), advice));
    }
    let whole = |side: &Side| {
        whole_hand::whole_hand(side.hand)
            .map_err(|problem| refused(problem, "give the link a collision shape with an inside"))
    };
    let hands = [whole(first)?, whole(second)?];
    let views = [view_of(&hands[0], first.object), view_of(&hands[1], second.object)];
    let physics = PhysicsSettings { forces: None, ..PhysicsSettings::default() };
    let models = [Model::new(&views[0], &physics), Model::new(&views[1], &physics)];
    let surroundings = [convex(first.context)?, convex(second.context)?];
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads.max(1))
        .build()
        .map_err(|error| refused(format!("no threads: {error}"), "ask for fewer threads"))?;
    threads.install(|| {
        let ways = [ways_of(first, &models[0], &surroundings[0]), ways_of(second, &models[1], &surroundings[1])];
        let try_pair = |(i, a): &(usize, Way), (j, b): &(usize, Way)| -> Option<DoubleGrasp> {
            let (held, taken) = (a.bodies(2.0), b.bodies(2.0));
            let is_free = are_apart(&held, &taken) && b.avoids(&held) && a.avoids(&taken);
            is_free.then(|| {
                let [one, other] = [&first.list.grasps[*i], &second.list.grasps[*j]];
                let robot = natural(first.context, one).min(natural(second.context, other));
                DoubleGrasp { first: *i, second: *j, score: 0.0, quality: one.score.min(other.score), robot }
            })
        };
        let found: Vec<Vec<DoubleGrasp>> =
            ways[0].par_iter().map(|a| ways[1].iter().filter_map(|b| try_pair(a, b)).collect()).collect();
        let mut pairs: Vec<DoubleGrasp> = found.into_iter().flatten().collect();
        let clear = [ways[0].len(), ways[1].len()];
        let hands_touch = clear[0] * clear[1] - pairs.len();
        normalise(&mut pairs);
        pairs.sort_by(|a, b| b.score.total_cmp(&a.score).then((a.first, a.second).cmp(&(b.first, b.second))));
        Ok(Pairs { clear, hands_touch, pairs })
    })
}

/// True where two hands do not hit each other: in the grasps, while the second one comes, and while the first one leaves. Each with the
/// model of its hand and object.
pub fn are_hands_apart((first, held): (&Model, &ListedGrasp), (second, taken): (&Model, &ListedGrasp)) -> bool {
    let ways = [Way::new(first.view.hand, first, held), Way::new(second.view.hand, second, taken)];
    let [one, other] = [ways[0].bodies(2.0), ways[1].bodies(2.0)];
    are_apart(&one, &other) && ways[1].avoids(&one) && ways[0].avoids(&other)
}

/// Shapes around the object, convex.
fn convex(context: &Context) -> Result<Vec<PlacedShape>, Failure> {
    let one = |placed: &PlacedShape| {
        let shape = convex_of(&placed.shape).map_err(|error| {
            Failure::bare(
                FailureKind::Impossible,
                format!("a shape around the object: {error}"),
                "take a shape with an inside",
            )
        })?;
        let object_from_shape = context.world_from_object.inverse() * placed.parent_from_shape;
        Ok(PlacedShape { parent_from_shape: object_from_shape, shape })
    };
    context.surroundings.iter().map(one).collect()
}

/// The grasps of a list that hit nothing of the surroundings, with their ways.
fn ways_of<'m>(side: &Side, model: &'m Model<'m>, surroundings: &[PlacedShape]) -> Vec<(usize, Way<'m>)> {
    let standing: Vec<Standing> = surroundings
        .iter()
        .map(|placed| Standing::new(&placed.shape, Placement::from(&placed.parent_from_shape)))
        .collect();
    let clear = |(index, grasp): (usize, &ListedGrasp)| {
        if side.context.stable_pose.is_some_and(|pose| !grasp.stable_poses.contains(&pose)) {
            return None;
        }
        let way = Way::new(side.hand, model, grasp);
        (are_apart(&way.bodies(2.0), &standing) && way.avoids(&standing)).then_some((index, way))
    };
    side.list.grasps.iter().enumerate().filter_map(clear).collect()
}

/// Cosine of the angle between the direction in which the hand comes and the direction from the robot's base to the object
/// (Saut 2010, sec. V-C).
fn natural(context: &Context, grasp: &ListedGrasp) -> f64 {
    let Some(base) = context.robot_base else { return 0.0 };
    let comes = context.world_from_object.rotation * Vector::from(grasp.approach.direction_in_object);
    let towards = context.world_from_object.translation.vector - base.coords;
    towards.try_normalize(1e-9).map_or(0.0, |towards| towards.dot(&comes))
}

/// Both scores normalised over all pairs to 0..1, and summed; one that is the same in all pairs counts as 1.
fn normalise(pairs: &mut [DoubleGrasp]) {
    let range = |of: fn(&DoubleGrasp) -> f64, pairs: &[DoubleGrasp]| {
        let ends =
            pairs.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        move |x: f64| if ends.1 - ends.0 > 1e-12 { (x - ends.0) / (ends.1 - ends.0) } else { 1.0 }
    };
    let (quality, robot) = (range(|pair| pair.quality, pairs), range(|pair| pair.robot, pairs));
    for pair in pairs {
        pair.score = quality(pair.quality) + robot(pair.robot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_normalised_over_all_pairs() {
        let pair = |quality, robot| DoubleGrasp { first: 0, second: 0, score: 0.0, quality, robot };
        let mut pairs = [pair(0.2, -1.0), pair(0.6, 0.0), pair(0.4, 1.0)];
        normalise(&mut pairs);
        let scores = pairs.map(|pair| pair.score);
        assert!((scores[0] - 0.0).abs() < 1e-12 && (scores[1] - 1.5).abs() < 1e-12 && (scores[2] - 1.5).abs() < 1e-12);
        let mut same = [pair(0.3, 0.0), pair(0.3, 0.0)];
        normalise(&mut same);
        assert!(same.iter().all(|pair| pair.score == 2.0));
    }
}
