//! Who holds: names, kinds and order of segments.

use super::{Breeder, one_of};
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_plan::robot_plan::{RobotPlan, RobotSegmentKind};
use std::collections::BTreeSet;

impl Breeder<'_> {
    pub(super) fn break_holders(&mut self) {
        let object = self.plan.objects[0].clone();
        let n_segments = self.plan.segments.len();
        let supports: Vec<String> = self.scene.supports.iter().map(|support| support.body.name.clone()).collect();
        let hands: Vec<String> = self.plan.hands.iter().map(|hand| hand.name.clone()).collect();
        let all: Vec<&String> = supports.iter().chain(&hands).collect();
        self.add("held by another in one segment", &[Kind::WrongHolder], |plan, rng| {
            let holders = plan.segments[rng.below(n_segments)].held_by.get_mut(&object)?;
            let k = rng.below(holders.len());
            let others: Vec<&String> = all.iter().copied().filter(|name| **name != holders[k]).collect();
            holders[k] = one_of(rng, &others)?.clone();
            Some(())
        });
        self.add("held by one more in one segment", &[Kind::WrongHolder, Kind::Unsupported], |plan, rng| {
            let holders = plan.segments[rng.below(n_segments)].held_by.get_mut(&object)?;
            let others: Vec<&String> = all.iter().copied().filter(|name| !holders.contains(name)).collect();
            holders.push(one_of(rng, &others)?.clone());
            Some(())
        });
        self.add("a holder left out in one segment", &[Kind::WrongHolder], |plan, rng| {
            let holders = plan.segments[rng.below(n_segments)].held_by.get_mut(&object)?;
            let k = rng.below(holders.len());
            holders.remove(k);
            Some(())
        });
        let shared = self.segments(|s| self.hands_in(s).len() == 2 || self.holders(&self.plan.segments[s]).len() == 2);
        self.add("a hand left out with its contacts in a moment of rest", &[Kind::WrongHolder], |plan, rng| {
            let segment = &mut plan.segments[one_of(rng, &shared)?];
            let holders = segment.held_by.get_mut(&object)?;
            let name = holders.iter().find(|name| hands.contains(name))?.clone();
            holders.retain(|holder| *holder != name);
            let waypoints = segment.waypoints.iter_mut();
            waypoints.for_each(|waypoint| waypoint.contacts.retain(|contact| contact.hand != name));
            Some(())
        });
        self.add(
            "another kind of segment",
            &[Kind::WrongHolder, Kind::JointMovesAtRest, Kind::Collision],
            |plan, rng| {
                use RobotSegmentKind::{Approach, Carry, Grasp, Regrasp, Release, Retreat, Transfer, Transit};
                let segment = &mut plan.segments[rng.below(n_segments)];
                let others: &[RobotSegmentKind] = match segment.kind {
                    // What another arm does meanwhile does not make a carry of a retreat, nor the other way round.
                    Approach | Retreat => &[Grasp, Release],
                    Transit => &[Carry, Grasp, Release],
                    Grasp => &[Carry, Release, Transit],
                    Release => &[Carry, Grasp, Transit],
                    Carry => &[Grasp, Release],
                    Transfer | Regrasp => &[Carry, Grasp, Release, Transit],
                };
                segment.kind = one_of(rng, others)?;
                Some(())
            },
        );
        // What two hands do is said of the other one.
        if let [first, second] = hands.as_slice() {
            self.add("grasps swapped between hands", &[Kind::WrongHolder, Kind::ContactOffTip], |plan, _| {
                let swap = |name: &mut String| match &*name {
                    n if n == first => name.clone_from(second),
                    n if n == second => name.clone_from(first),
                    _ => {}
                };
                for segment in &mut plan.segments {
                    segment.held_by.get_mut(&object)?.iter_mut().for_each(swap);
                    let waypoints = segment.waypoints.iter_mut().flat_map(|waypoint| &mut waypoint.contacts);
                    waypoints.for_each(|contact| swap(&mut contact.hand));
                }
                Some(())
            });
        }
        self.break_exchanges();
    }

    fn break_exchanges(&mut self) {
        let exchanges = self.exchanges();
        self.add("exchange left out", &[Kind::WrongHolder], |plan, rng| {
            plan.segments.remove(one_of(rng, &exchanges)?);
            Some(())
        });
        // The receiver's fingers are open again as soon as it holds alone.
        let joiners: Vec<(usize, usize)> = self
            .segments(|s| self.kind(s) == RobotSegmentKind::Grasp)
            .into_iter()
            .filter_map(|s| Some((s, self.segments(|later| later > s + 1).first().copied()?)))
            .collect();
        let opened: BTreeSet<Kind> = [Kind::GraspChanges, Kind::ContactOffTip, Kind::WrongHolder].into();
        let opened: Vec<Kind> = opened.into_iter().collect();
        self.add("a hand that has just grasped opens", &opened, |plan, rng| {
            let (grasp, from) = one_of(rng, &joiners)?;
            open_from(plan, grasp, from)
        });
        let releases = self.segments(|s| self.kind(s) == RobotSegmentKind::Release && s > 0);
        self.add("a hand lets go one waypoint early", &opened, |plan, rng| {
            let s = one_of(rng, &releases)?;
            let later = plan.segments[s].waypoints.get(1)?.joints.clone();
            let before = plan.segments[s - 1].waypoints.last_mut()?;
            before.joints.clone_from(&later);
            plan.segments[s].waypoints[0].joints = later;
            Some(())
        });
        self.add("a hand lets go in the segment before", &[Kind::WrongHolder, Kind::GraspChanges], |plan, rng| {
            let s = one_of(rng, &releases)?;
            // The release comes first, and the moment of rest after it.
            let [a, b] = [plan.segments[s - 1].clone(), plan.segments[s].clone()];
            let starts = [a.waypoints[0].time, a.waypoints.last()?.time, b.waypoints[0].time];
            let mut early = b;
            let shift = starts[0] - starts[2];
            early.waypoints.iter_mut().for_each(|waypoint| waypoint.time += shift);
            let (end, open) = (early.waypoints.last()?.time, early.waypoints.last()?.joints.clone());
            let mut late = a;
            let shift = end - late.waypoints[0].time;
            for waypoint in &mut late.waypoints {
                waypoint.time += shift;
                waypoint.joints.clone_from(&open);
            }
            (plan.segments[s - 1], plan.segments[s]) = (early, late);
            Some(())
        });
    }
}

/// Opens the fingers that a grasp closes, in all segments from one on: they are as at the begin of the grasp.
fn open_from(plan: &mut RobotPlan, grasp: usize, from: usize) -> Option<()> {
    let segment = &plan.segments[grasp];
    let (open, closed) = (segment.waypoints.first()?.joints.clone(), segment.waypoints.last()?.joints.clone());
    let moved: Vec<usize> = (0..open.len()).filter(|&k| (open[k] - closed[k]).abs() > 1e-6).collect();
    for segment in &mut plan.segments[from..] {
        for waypoint in &mut segment.waypoints {
            moved.iter().for_each(|&k| waypoint.joints[k] = open[k]);
        }
    }
    (!moved.is_empty()).then_some(())
}
