//! No two bodies meet at any moment: distances where they are measured, bounds of motion in between.
//!
//! An interval of a step is judged at its middle. Let a point be carried by joints `1 .. n`, of which joint `j` moves by at most `d_j`
//! from the middle to any moment of the interval. Seen from the body that carries joint 1, the point then moves by at most
//! `sum_j c_j`, where `c_j` is `d_j` for a sliding joint, and `2 sin(d_j / 2)` times the point's distance from the axis at the middle for
//! one that turns: undo the joints one after the other, the outermost first; each carries the point from where it is at the middle
//! along its own arc, and those before it are rigid motions. Two items are therefore apart in the whole interval where their distance at
//! the middle is more than the two sums up to the body that both stand on. Else the interval is halved.

use crate::check::robots::crowd::{Ball, Band, Crowd, Row};
use crate::check::robots::items::{Item, Items, Owner, Pair};
use crate::check::robots::motion::{RobotStep, largest_change};
use crate::check::robots::question::Question;
use crate::check::robots::tree::{Frame, Tree};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Clearance, Log};
use crate::robot_plan::{RobotPlan, RobotSegment};
use nalgebra::Translation3;
use regrasp_geometry::reference::{Clearance as Found, distance};
use regrasp_geometry::{Point, Pose, Vector};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// How far a pair is shifted when its distance is not resolved, in metres, and the directions tried.
const NUDGE: f64 = 1e-5;
const NUDGES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
/// More than any rounding of lengths, in metres.
const ROUNDING: f64 = 1e-9;
/// Distances beyond this are not told apart, in metres.
const FARTHEST: f64 = 1.0;

/// Where a robot and what it carries are at one moment.
pub struct Placed<'a> {
    tree: &'a Tree,
    items: &'a Items,
    joints: Vec<f64>,
    frames: Vec<Frame>,
    axes: Vec<Frame>,
    centers: Vec<Point>,
    /// Items that do not stand in the world.
    moving: Vec<usize>,
    crowd: Crowd,
    /// Distances measured so far.
    pub n_distances: u64,
}

impl<'a> Placed<'a> {
    /// Of these items.
    pub fn new(tree: &'a Tree, items: &'a Items) -> Self {
        let centers = items.items.iter().map(|item| item.center).collect();
        let moving = (0..items.items.len()).filter(|&item| !items.items[item].stands).collect();
        let crowd = Crowd::new(items);
        let (joints, frames, axes) = (Vec::new(), Vec::new(), Vec::new());
        Placed { tree, items, joints, frames, axes, centers, moving, crowd, n_distances: 0 }
    }

    /// Moves everything to `joints`.
    pub fn place(&mut self, joints: &[f64]) {
        self.joints.clear();
        self.joints.extend_from_slice(joints);
        self.tree.frames(&self.joints, &mut self.frames, &mut self.axes);
        for &item in &self.moving {
            let of_body = &self.items.items[item];
            self.centers[item] = self.frames[of_body.body].point(&of_body.center);
        }
    }

    fn pose(&self, item: &Item) -> Pose {
        if item.stands { item.frame.pose() } else { self.frames[item.body].then(&item.frame).pose() }
    }

    /// Pose of an item in the world.
    pub fn pose_of(&self, item: usize) -> Pose {
        self.pose(&self.items.items[item])
    }

    /// Fingertips that are in a pair with a carried object: their items, hands and fingers.
    pub fn tips_of_object(&self) -> Vec<(usize, (usize, usize))> {
        let items = self.items.items.iter().enumerate();
        items.filter_map(|(item, one)| Some((item, one.tip_of?))).collect()
    }

    /// True where an item is within `tolerance` of the carried object's shape.
    pub fn is_near_object(&mut self, item: usize, tolerance: f64) -> bool {
        let items = &self.items.items;
        let is_object = |b: &usize| matches!(items[*b].owner, Owner::Carried(_)) && !items[*b].is_hull;
        let Some(object) = (0..items.len()).find(is_object) else { return false };
        let pair = Pair { a: item, b: object, joints_a: 0, joints_b: 0, floor: 0.0 };
        self.gap(&pair) <= tolerance
            && self.measure(&pair, tolerance + ROUNDING).is_some_and(|distance| distance <= tolerance)
    }

    /// Pairs of carried objects, first, and a support.
    pub fn pairs_of_support(&self, support: usize) -> Vec<Pair> {
        let is_of = |pair: &&Pair| self.items.items[pair.b].support == Some(support);
        let is_carried = |pair: &&Pair| matches!(self.items.items[pair.a].owner, Owner::Carried(_));
        self.items.pairs.iter().filter(is_of).filter(is_carried).copied().collect()
    }

    /// Distance between the balls of a pair.
    pub fn gap(&self, pair: &Pair) -> f64 {
        let apart = (self.centers[pair.a] - self.centers[pair.b]).norm();
        apart - self.items.items[pair.a].radius - self.items.items[pair.b].radius
    }

    /// Signed distance, negative where they overlap; distances of `most` and more are not told apart. None when unresolved.
    pub fn measure(&mut self, pair: &Pair, most: f64) -> Option<f64> {
        let (a, b) = (&self.items.items[pair.a], &self.items.items[pair.b]);
        let (pose_a, pose_b) = (self.pose(a), self.pose(b));
        self.n_distances += 1;
        let signed = |pose_a: &Pose| match distance(&a.shape, pose_a, &b.shape, &pose_b, most) {
            Found::SeparatedBy(distance) => Some(distance),
            Found::Penetrating(depth) => Some(-depth),
            Found::Unresolved => None,
        };
        signed(&pose_a).or_else(|| {
            NUDGES.iter().find_map(|nudge| {
                let shift = Vector::from(*nudge) * NUDGE;
                signed(&(Translation3::from(shift) * pose_a)).map(|distance| distance - NUDGE)
            })
        })
    }

    /// For every number of joints from an item towards the root, how far its points move at most while each joint of the tree moves
    /// by `changes`, by body. The first entry is zero.
    fn travels(&self, item: usize, changes: &[f64], travels: &mut Vec<f64>) {
        travels.clear();
        travels.push(0.0);
        let (item, center) = (&self.items.items[item], self.centers[item]);
        if item.stands {
            return;
        }
        let (mut at, mut sum) = (item.body, 0.0);
        while let Some(body) = self.tree.body(at) {
            let change = changes[at];
            if change > 0.0 {
                sum += if body.slides {
                    change
                } else {
                    let joint = &self.axes[at];
                    let axis = joint.rotation * body.axis;
                    let arm = axis.cross(&(center.coords - joint.origin)).norm();
                    2.0 * (0.5 * change.min(PI)).sin() * (arm + item.spin_radius)
                };
            }
            travels.push(sum);
            at = body.parent;
        }
    }
}

/// Where a pair comes too close.
struct Breach {
    pair: usize,
    u: f64,
    distance: Option<f64>,
}

/// The intervals of one step.
struct Judge<'a, 'b, 's> {
    scene: &'b mut Placed<'a>,
    step: &'b RobotStep<'s>,
    resolution: f64,
    most_pieces: u64,
    n_pieces: u64,
    breaches: Vec<Breach>,
    /// By item, its travels in the present interval; empty where nobody has asked.
    travels: Vec<Vec<f64>>,
    /// By body, how far its joint moves from the middle of the present interval.
    changes: Vec<f64>,
    /// Joints in that middle.
    joints: Vec<f64>,
}

impl Judge<'_, '_, '_> {
    /// The whole step, of all pairs that `is_active`.
    fn whole(&mut self, is_active: impl Fn(&usize) -> bool) {
        self.place(0.0, 1.0);
        let mut active: Vec<usize> = self.scene.crowd.others.iter().copied().filter(&is_active).collect();
        for index in 0..self.scene.crowd.bands.len() {
            let Band { item, joints, .. } = self.scene.crowd.bands[index];
            let travel = self.travel(item, joints);
            let crowd = &self.scene.crowd;
            let (center, radius) = (self.scene.centers[item], self.scene.items.items[item].radius);
            let is_near = |ball: &Ball, floor: f64| ball.gap(&center, radius) <= floor + travel + ROUNDING;
            let band = &crowd.bands[index];
            if !is_near(&band.ball, band.floor) {
                continue;
            }
            for row in crowd.rows[band.rows.clone()].iter().filter(|row| is_near(&row.ball, row.floor)) {
                active.extend(crowd.pairs(row).iter().copied().filter(&is_active));
            }
        }
        active.sort_unstable();
        self.pairs(0.0, 1.0, &active);
    }

    fn interval(&mut self, first: f64, last: f64, active: &[usize]) {
        if self.n_pieces > self.most_pieces {
            return;
        }
        self.place(first, last);
        self.pairs(first, last, active);
    }

    /// Places everything in the middle of an interval.
    fn place(&mut self, first: f64, last: f64) {
        let middle = 0.5 * (first + last);
        self.step.joints_at(middle, &mut self.joints);
        self.scene.place(&self.joints);
        let tree = self.scene.tree;
        self.changes.clear();
        self.changes.extend((0..tree.n_bodies()).map(|k| {
            tree.body(k).map_or(0.0, |body| largest_change(&self.step.of_drive(&body.drive), first, middle, last))
        }));
        for &item in &self.scene.moving {
            self.travels[item].clear();
        }
    }

    /// How far points of an item move at most in the present interval, as the body sees it from which `joints` joints lead to it.
    fn travel(&mut self, item: usize, joints: usize) -> f64 {
        if self.scene.items.items[item].stands {
            return 0.0;
        }
        if self.travels[item].is_empty() {
            self.scene.travels(item, &self.changes, &mut self.travels[item]);
        }
        self.travels[item][joints]
    }

    /// Judges pairs in an interval in whose middle everything is placed.
    fn pairs(&mut self, first: f64, last: f64, active: &[usize]) {
        self.n_pieces += 1 + active.len() as u64 / 64;
        if self.n_pieces > self.most_pieces {
            return;
        }
        let middle = 0.5 * (first + last);
        let mut left = Vec::new();
        for &index in active {
            if self.breaches.iter().any(|breach| breach.pair == index) {
                continue;
            }
            let pair = self.scene.items.pairs[index];
            let travel = self.travel(pair.a, pair.joints_a) + self.travel(pair.b, pair.joints_b);
            let needed = pair.floor + travel + ROUNDING;
            if self.scene.gap(&pair) > needed {
                continue;
            }
            self.n_pieces += 1;
            match self.scene.measure(&pair, needed.max(0.0) + self.resolution) {
                Some(distance) if distance > needed || (travel == 0.0 && distance > pair.floor) => {}
                Some(distance) if distance > pair.floor && travel > 0.5 * self.resolution => left.push(index),
                distance => self.breaches.push(Breach { pair: index, u: middle, distance }),
            }
        }
        if !left.is_empty() {
            self.interval(first, middle, &left);
            self.interval(middle, last, &left);
        }
    }
}

/// Judges all pairs along the plan. Returns the smallest clearance at a waypoint and the number of distances measured.
pub fn check_apart(
    question: &Question,
    items: &Items,
    plan: &RobotPlan,
    settings: &CheckSettings,
    log: &mut Log,
) -> (Option<Clearance>, u64) {
    let mut scene = Placed::new(&question.tree, items);
    let mut clearance: Option<Clearance> = None;
    for s in 0..plan.segments.len() {
        if !check_segment(&mut scene, &plan.segments[s], s, settings, log, &mut clearance) {
            break;
        }
    }
    (clearance, scene.n_distances)
}

/// Judges all pairs along segment `s`. Takes over the smallest clearance at a waypoint where it is smaller than the one known. False
/// when there is no work left.
pub fn check_segment(
    scene: &mut Placed,
    segment: &RobotSegment,
    s: usize,
    settings: &CheckSettings,
    log: &mut Log,
    clearance: &mut Option<Clearance>,
) -> bool {
    let items = scene.items;
    let mut is_reported = vec![false; items.pairs.len()];
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        note_clearance(scene, &waypoint.joints, Moment::at(s, w), clearance);
    }
    for (w, ends) in segment.waypoints.windows(2).enumerate() {
        let step = RobotStep::new(&ends[0], &ends[1]);
        // What stands all through the segment is judged once.
        let is_new = |pair: &Pair| w == 0 || !(items.items[pair.a].stands && items.items[pair.b].stands);
        let is_active = |&index: &usize| !is_reported[index] && is_new(&items.pairs[index]);
        let mut judge = Judge {
            scene,
            step: &step,
            resolution: settings.resolution,
            most_pieces: log.work.left(),
            n_pieces: 0,
            breaches: Vec::new(),
            travels: vec![Vec::new(); items.items.len()],
            changes: Vec::new(),
            joints: Vec::new(),
        };
        judge.whole(is_active);
        let (n_pieces, breaches) = (judge.n_pieces, judge.breaches);
        for breach in breaches {
            is_reported[breach.pair] = true;
            let at = Moment { segment: s, waypoint: w, fraction: breach.u };
            log.push(violation(items, &items.pairs[breach.pair], at, &breach));
        }
        if !log.work.spend(n_pieces, "collisions") {
            return false;
        }
    }
    true
}

/// Takes over the smallest distance of a pair that must be apart, where it is smaller than the one known.
pub fn note_clearance(scene: &mut Placed, joints: &[f64], at: Moment, clearance: &mut Option<Clearance>) {
    scene.place(joints);
    let items = scene.items;
    let known = clearance.as_ref().map_or(FARTHEST, |known| known.distance);
    let crowd = &scene.crowd;
    let gap_of = |ball: &Ball, item: usize| ball.gap(&scene.centers[item], items.items[item].radius);
    let is_judged = |index: &usize| items.pairs[*index].floor >= 0.0;
    let of_pair = |&index: &usize| Near { gap: scene.gap(&items.pairs[index]), what: What::Pair(index) };
    let bands = crowd.bands.iter().enumerate();
    let bands = bands.map(|(index, band)| Near { gap: gap_of(&band.ball, band.item), what: What::Band(index) });
    let near = crowd.others.iter().filter(|index| is_judged(index)).map(of_pair).chain(bands);
    let near: Vec<Reverse<Near>> = near.filter(|near| near.gap < known).map(Reverse).collect();
    // Only few are taken: no need to sort all. Bands and rows are opened when they are the nearest left.
    let mut near = BinaryHeap::from(near);
    let mut least = known;
    while let Some(Reverse(Near { gap, what })) = near.pop() {
        if gap >= least {
            break;
        }
        let crowd = &scene.crowd;
        let index = match what {
            What::Band(index) => {
                let band = &crowd.bands[index];
                let gap_of = |row: &Row| row.ball.gap(&scene.centers[band.item], items.items[band.item].radius);
                let rows = band.rows.clone();
                let rows = rows.map(|row| Near { gap: gap_of(&crowd.rows[row]), what: What::Row(row) });
                near.extend(rows.filter(|near| near.gap < least).map(Reverse));
                continue;
            }
            What::Row(row) => {
                let pairs = crowd.pairs(&crowd.rows[row]).iter();
                let of_pair = |&pair: &usize| Near { gap: scene.gap(&items.pairs[pair]), what: What::Pair(pair) };
                let pairs = pairs.filter(|&&pair| items.pairs[pair].floor >= 0.0).map(of_pair);
                near.extend(pairs.filter(|near| near.gap < least).map(Reverse));
                continue;
            }
            What::Pair(index) => index,
        };
        let pair = &items.pairs[index];
        if let Some(distance) = scene.measure(pair, least.max(1e-3)).filter(|distance| *distance < least) {
            least = distance;
            let pair = [pair.a, pair.b].map(|item| items.items[item].name.clone());
            *clearance = Some(Clearance { distance, pair, at });
        }
    }
}

/// What may be near: all that stands in a band or row may be as near as its ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    /// A band, by its index.
    Band(usize),
    /// A row, by its index.
    Row(usize),
    /// A pair, by its index.
    Pair(usize),
}

/// What may be near, and the distance between the balls, in metres; ordered by that, then by what it is.
struct Near {
    gap: f64,
    what: What,
}

impl Ord for Near {
    fn cmp(&self, other: &Self) -> Ordering {
        self.gap.total_cmp(&other.gap).then(self.what.cmp(&other.what))
    }
}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Near {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Near {}

fn violation(items: &Items, pair: &Pair, at: Moment, breach: &Breach) -> Violation {
    let names = [pair.a, pair.b].map(|item| items.items[item].name.as_str());
    let who = format!("\"{}\" and \"{}\"", names[0], names[1]);
    let message = match breach.distance {
        Some(distance) if distance <= 0.0 => format!("{who} overlap by {:.3e} m", -distance),
        Some(distance) if distance <= pair.floor => {
            format!("{who} are {distance:.3e} m apart, {:.3e} m is promised", pair.floor)
        }
        Some(distance) => format!("{who} are only {distance:.3e} m apart, too near to tell in motion"),
        None => format!("the distance of {who} could not be resolved, which counts as collision"),
    };
    let amount = breach.distance.map_or(f64::NAN, |distance| -distance);
    Violation::new(Kind::Collision, message).when(at).subjects(names).amount(amount, -pair.floor)
}
