//! Margin and clearance at every waypoint, for charts: the numbers whose smallest the report has.

use crate::check::bodies::{Bodies, Pair};
use crate::check::closure::{Certificate, HeldBody, certified_margin, margin_by};
use crate::check::model::CheckedHand;
use crate::check::motion::WaypointStep;
use crate::check::promises::{Holder, grips_of, holders};
use crate::check::roles::{is_free_throughout, moving_finger};
use crate::check::{CheckSettings, Log, form_is_sound};
use crate::plan::{Plan, Segment, SegmentKind, Waypoint};
use regrasp_scene::Manipulation;
use std::collections::BTreeMap;

/// With more fingers than this, whose subsets are many, the cone programs are not solved at every waypoint.
const SOLVED_UP_TO: usize = 6;
/// Margins of different contacts that a certificate then may prove one after the other before they are solved again.
const SOLVED_EVERY: usize = 8;
/// What a certificate proves is taken where it is at least this share of the last margin solved for.
const SHARE_TAKEN: f64 = 0.98;

/// The nearest pair of things that must not touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Distance, in metres; negative when they overlap. What is farther apart than 3 cm may count as nearer than it is.
    pub distance: f64,
    /// Index in [`Along::pairs`].
    pub pair: usize,
}

/// One entry per waypoint, all segments joined in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Along {
    /// Closure margin of the fingers that hold, in a regrasp without the one that moves: a proven lower bound as in the
    /// report, and zero where no closure was proved, and in tracking, where none is judged. Of more than six fingers that
    /// roll, what forces found at one of the waypoints before prove: maybe less than could be proved, at least 98 % of the
    /// margin there.
    pub margin: Vec<f64>,
    /// The nearest pair; none where a distance is not resolved, or nothing must be kept apart.
    pub clearance: Vec<Option<Nearest>>,
    /// Names of the pairs.
    pub pairs: Vec<[String; 2]>,
}

/// Margin and clearance along `plan`. Err with a message when the plan is not of this scene, or its form is broken.
pub fn along(task: &Manipulation, plan: &Plan) -> Result<Along, String> {
    let model = CheckedHand::new(task)?;
    let mut log = Log { most_per_kind: CheckSettings::default().most_per_kind, ..Log::default() };
    if !form_is_sound(&model, plan, &mut log) {
        let first = log.found.first().map(ToString::to_string);
        return Err(first.unwrap_or_else(|| "the plan's form is broken".into()));
    }
    let bodies = Bodies::new(task, &model)?;
    let mut along = Along::default();
    let mut margins = Margins { body: HeldBody::of(task.object(), plan), known: BTreeMap::new(), last: None };
    let mut clearances = Clearances { bodies: &bodies, names: BTreeMap::new(), nearest: 0 };
    for segment in &plan.segments {
        let moving = moving_finger(&model, segment);
        let judged = clearances.judged_in(segment);
        for waypoint in &segment.waypoints {
            along.margin.push(match segment.kind {
                SegmentKind::Tracking => 0.0,
                _ => margins.of(&model, &holders(&model, moving, waypoint)),
            });
            let nearest = clearances.at(waypoint, &judged);
            along.clearance.push(nearest.map(|(distance, pair)| Nearest { distance, pair }));
        }
    }
    let mut names: Vec<([String; 2], usize)> = clearances.names.into_iter().collect();
    names.sort_by_key(|(_, index)| *index);
    along.pairs = names.into_iter().map(|(names, _)| names).collect();
    Ok(along)
}

/// The last certificate, the margin it came with, and how often it was used since.
struct Solved {
    fingers: Vec<usize>,
    certificate: Certificate,
    margin: f64,
    used: usize,
}

struct Margins {
    body: HeldBody,
    /// By fingers and contacts that hold.
    known: BTreeMap<Vec<(usize, [u64; 6])>, f64>,
    last: Option<Solved>,
}

impl Margins {
    fn of(&mut self, model: &CheckedHand, holders: &[Holder]) -> f64 {
        let key: Vec<(usize, [u64; 6])> = holders.iter().map(Holder::key).collect();
        if let Some(margin) = self.known.get(&key) {
            return *margin;
        }
        let grips = grips_of(model, holders);
        let fingers: Vec<usize> = holders.iter().map(|holder| holder.finger).collect();
        let is_near = |last: &&mut Solved| last.fingers == fingers && last.used < SOLVED_EVERY;
        if let Some(last) = self.last.as_mut().filter(|last| fingers.len() > SOLVED_UP_TO && is_near(last)) {
            let proven = margin_by(&last.certificate, &grips, &self.body);
            if proven >= SHARE_TAKEN * last.margin {
                last.used += 1;
                self.known.insert(key, proven);
                return proven;
            }
        }
        let solved = certified_margin(&grips, &self.body);
        let margin = solved.as_ref().map_or(0.0, |(margin, _)| *margin);
        self.last = solved.map(|(margin, certificate)| Solved { fingers, certificate, margin, used: 0 });
        self.known.insert(key, margin);
        margin
    }
}

struct Clearances<'a> {
    bodies: &'a Bodies,
    /// Index of the pair of names.
    names: BTreeMap<[String; 2], usize>,
    /// The pair that was nearest at the waypoint before: likely to be again.
    nearest: usize,
}

impl Clearances<'_> {
    /// Indices of the pairs that must not touch in a segment: all but fingertips that hold, land or lift, and the object.
    fn judged_in(&self, segment: &Segment) -> Vec<usize> {
        let is_apart = |pair: &Pair| pair.tip_of.is_none_or(|f| is_free_throughout(segment, f));
        (0..self.bodies.pairs.len()).filter(|&index| is_apart(&self.bodies.pairs[index])).collect()
    }

    /// Distance of the nearest pair and the index of its names.
    fn at(&mut self, waypoint: &Waypoint, judged: &[usize]) -> Option<(f64, usize)> {
        let mut step = WaypointStep::new(self.bodies, waypoint, waypoint);
        let mut best: Option<(f64, usize)> = None;
        let likely = judged.iter().copied().filter(|&index| index == self.nearest);
        for index in likely.chain(judged.iter().copied().filter(|&index| index != self.nearest)) {
            let pair = &self.bodies.pairs[index];
            let least = best.map_or(f64::INFINITY, |(distance, _)| distance);
            if step.ball_distance(pair, 0.0) >= least {
                continue;
            }
            let distance = step.measure(pair, 0.0)?;
            if distance < least {
                best = Some((distance, index));
            }
        }
        let (distance, index) = best?;
        self.nearest = index;
        let pair = &self.bodies.pairs[index];
        let names = [pair.a, pair.b].map(|item| self.bodies.items[item].name.clone());
        let next = self.names.len();
        Some((distance, *self.names.entry(names).or_insert(next)))
    }
}
