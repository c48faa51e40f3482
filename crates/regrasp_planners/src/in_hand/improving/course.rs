//! Ways of the object along which gaits are looked for.

use crate::in_hand::moving::step::n_steps;
use crate::in_hand::searching::legs::Solution;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, interpolate_pose};
use regrasp_manipulation::grasp::sequence::Motion;
use regrasp_manipulation::model::Model;

/// Steps between stations. By hand: 12 degrees of a turn of the box.
const STATION_STEPS: usize = 3;

/// A way of the object from start to goal, in steps no longer than the planner's.
#[derive(Debug, Clone)]
pub struct Course {
    /// Object poses, one per moment.
    pub poses: Vec<Pose>,
    /// The same.
    pub placements: Vec<Placement>,
    /// Moments at which fingers may be relocated, ascending; the first and the last are among them.
    pub stations: Vec<usize>,
    /// Index in `stations` of every way pose.
    pub way_stations: Vec<usize>,
}

/// A pose that a course passes.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// The pose.
    pub pose: Pose,
    /// True when fingers may be relocated there.
    pub is_station: bool,
    /// True when it is a way pose of the query.
    pub is_way_pose: bool,
}

impl Corner {
    /// A corner that is a station.
    pub fn station(pose: Pose) -> Self {
        Corner { pose, is_station: true, is_way_pose: false }
    }
}

impl Course {
    /// From `start` from corner to corner, the last of which is the goal.
    pub fn through(model: &Model, start: Pose, corners: &[Corner]) -> Self {
        let mut course =
            Course { poses: vec![start], placements: Vec::new(), stations: vec![0], way_stations: Vec::new() };
        for (index, corner) in corners.iter().enumerate() {
            let from = course.poses[course.poses.len() - 1];
            if corner.pose != from {
                let n = n_steps(model, &from, &corner.pose, model.settings.step);
                for k in 1..=n {
                    let is_there = k == n;
                    course.poses.push(if is_there {
                        corner.pose
                    } else {
                        interpolate_pose(&from, &corner.pose, k as f64 / n as f64)
                    });
                    let due = course.poses.len() - 1 - course.last_station() >= STATION_STEPS;
                    if due && !is_there {
                        course.stations.push(course.poses.len() - 1);
                    }
                }
            }
            let here = course.poses.len() - 1;
            let must = corner.is_station || corner.is_way_pose || index + 1 == corners.len();
            if (must || here - course.last_station() >= STATION_STEPS) && course.last_station() != here {
                course.stations.push(here);
            }
            if corner.is_way_pose {
                course.way_stations.push(course.stations.len() - 1);
            }
        }
        course.placements = course.poses.iter().map(Placement::from).collect();
        course
    }

    fn last_station(&self) -> usize {
        self.stations[self.stations.len() - 1]
    }

    /// The way that the object takes in a plan, with stations where the plan relocates.
    pub fn of(model: &Model, solution: &Solution) -> Self {
        let way = &solution.way;
        let mut corners = Vec::new();
        let mut way_poses = solution.steps_to_way.iter().peekable();
        let mut mark = |corners: &mut Vec<Corner>, n_done: usize, pose: Pose| {
            while way_poses.next_if(|&&n| n == n_done).is_some() {
                corners.push(Corner { pose, is_station: true, is_way_pose: true });
            }
        };
        mark(&mut corners, 0, way.start().world_from_object);
        for (index, step) in way.steps().iter().enumerate() {
            if let Motion::Transfer(moments) = step.motion() {
                for (k, moment) in moments.iter().enumerate() {
                    let is_station = k + 1 == moments.len();
                    corners.push(Corner { pose: moment.world_from_object, is_station, is_way_pose: false });
                }
            }
            mark(&mut corners, index + 1, step.end().world_from_object);
        }
        Course::through(model, way.start().world_from_object, &corners)
    }

    /// Index of the last station.
    pub fn last(&self) -> usize {
        self.stations.len() - 1
    }
}
