//! One step between two waypoints: where everything is in between, and how far it can have come.

use crate::check::between::Between;
use crate::check::bodies::{Bodies, Carrier, Item, OBJECT, Pair};
use crate::check::kinematics::{Rates, pose_of};
use crate::check::pose::pose_difference;
use crate::plan::Waypoint;
use nalgebra::Translation3;
use regrasp_geometry::reference::{Clearance, distance, point_distance};
use regrasp_geometry::{Point, Pose, Vector};

/// Farther apart than this, pairs are not measured exactly, in metres.
const SEARCH_DISTANCE: f64 = 0.03;

/// Poses of a carrier that are kept for a step.
const MOST_POSES: usize = 256;

/// How far a pair is shifted when its distance is not resolved, in metres, and the directions tried.
const NUDGE: f64 = 1e-5;
const NUDGES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];

/// A step between two waypoints. Its parameter is the share of its time, from 0 to 1.
pub struct WaypointStep<'a> {
    bodies: &'a Bodies,
    motion: Between<'a>,
    object: ObjectRates,
    /// Per carrier, the poses asked for so far.
    poses: Vec<Vec<(f64, Pose)>>,
    /// Per carrier, whether it moves at all in this step.
    moves: Vec<bool>,
    /// Per item, its bounds in the world.
    rates: Vec<Rates>,
    /// Distances measured so far.
    pub n_distances: u64,
    /// Pieces of motion looked at so far.
    pub n_pieces: u64,
    /// Pieces that may be looked at.
    pub most_pieces: u64,
}

impl<'a> WaypointStep<'a> {
    /// The step from one waypoint to the next.
    pub fn new(bodies: &'a Bodies, from: &'a Waypoint, to: &'a Waypoint) -> Self {
        let motion = Between::new(from, to);
        let joints = motion.joint_bounds();
        let object = ObjectRates::new(&motion, from, to);
        let moves: Vec<bool> = bodies
            .carriers
            .iter()
            .map(|carrier| match carrier {
                Carrier::Link(path) => path.moves(&joints),
                Carrier::Object => object.shift > 0.0 || object.turn > 0.0,
                Carrier::World => false,
            })
            .collect();
        let rates = bodies
            .items
            .iter()
            .map(|item| match &bodies.carriers[item.carrier] {
                _ if !moves[item.carrier] => Rates::default(),
                Carrier::Link(path) => {
                    let center = item.center;
                    path.rates(&center, item.spin_radius, &joints)
                }
                Carrier::Object => object.of_points_within(item.center.coords.norm() + item.spin_radius),
                Carrier::World => Rates::default(),
            })
            .collect();
        WaypointStep {
            bodies,
            motion,
            object,
            poses: vec![Vec::new(); bodies.carriers.len()],
            moves,
            rates,
            n_distances: 0,
            n_pieces: 0,
            most_pieces: u64::MAX,
        }
    }

    /// Pose of a carrier in the world.
    pub fn pose(&mut self, carrier: usize, t: f64) -> Pose {
        if let Some((_, pose)) = self.poses[carrier].iter().rev().find(|(at, _)| *at == t) {
            return *pose;
        }
        let pose = match &self.bodies.carriers[carrier] {
            Carrier::Link(path) => pose_of(&path.world_from_link(&self.motion.joints_at(t))),
            Carrier::Object => self.motion.object_at(t),
            Carrier::World => Pose::identity(),
        };
        // What is looked for is among the last; a long search would cost more than the pose.
        if self.poses[carrier].len() < MOST_POSES {
            self.poses[carrier].push((t, pose));
        }
        pose
    }

    /// Centre of the item's ball in the world.
    pub fn center(&mut self, item: usize, t: f64) -> Point {
        let item = &self.bodies.items[item];
        self.pose(item.carrier, t) * item.center
    }

    /// Speed of an item's fastest point, in metres per step.
    pub fn speed(&self, item: usize) -> f64 {
        self.rates[item].speed
    }

    /// True when the two items do not move.
    pub fn rests(&self, pair: &Pair) -> bool {
        let moves = |item: usize| self.moves[self.bodies.items[item].carrier];
        !moves(pair.a) && !moves(pair.b)
    }

    /// Distance between the chords' ends: how far the two can have come nearer from `t0` to `t1`, judged by where they
    /// are at these two moments only.
    pub fn chord(&mut self, pair: &Pair, t0: f64, t1: f64) -> f64 {
        if self.bodies.items[pair.b].carrier == OBJECT {
            // Seen from the object, so that what travels with it is at rest.
            let item = &self.bodies.items[pair.a];
            let mut seen = |t: f64| self.pose(OBJECT, t).inverse() * self.pose(item.carrier, t);
            return chord_of(item, &seen(t0), &seen(t1));
        }
        let mut sum = 0.0;
        for item in [pair.a, pair.b] {
            let item = &self.bodies.items[item];
            if self.moves[item.carrier] {
                let (p0, p1) = (self.pose(item.carrier, t0), self.pose(item.carrier, t1));
                sum += chord_of(item, &p0, &p1);
            }
        }
        sum
    }

    /// How far a point of the pair can stray from its chord in an interval of length one; in one of length `h` it is
    /// `h^2` times that.
    pub fn stray(&mut self, pair: &Pair) -> f64 {
        let (a, b) = (self.rates[pair.a], self.rates[pair.b]);
        if self.bodies.items[pair.b].carrier != OBJECT {
            return (a.acceleration + b.acceleration) / 8.0;
        }
        let origin = self.pose(OBJECT, 0.0) * Point::origin();
        let arm = (self.center(pair.a, 0.0) - origin).norm() + self.bodies.items[pair.a].spin_radius;
        self.object.acceleration_seen(&a, arm) / 8.0
    }

    /// Joints at `t`.
    pub fn joints(&self, t: f64) -> Vec<f64> {
        self.motion.joints_at(t)
    }

    /// Distance between the balls that contain the two items: a lower bound of theirs.
    pub fn ball_distance(&mut self, pair: &Pair, t: f64) -> f64 {
        let gap = (self.center(pair.a, t) - self.center(pair.b, t)).norm();
        gap - self.bodies.items[pair.a].radius - self.bodies.items[pair.b].radius
    }

    /// Signed distance of the two items, negative when they overlap, cut at a search distance; None when unresolved.
    ///
    /// A ball against the object is asked for its centre's distance, which is as good at touching as elsewhere.
    pub fn measure(&mut self, pair: &Pair, t: f64) -> Option<f64> {
        let (a, b) = (&self.bodies.items[pair.a], &self.bodies.items[pair.b]);
        let pose_a = self.pose(a.carrier, t) * a.carrier_from_shape;
        let pose_b = self.pose(b.carrier, t) * b.carrier_from_shape;
        self.n_distances += 1;
        if a.spin_radius == 0.0 && pair.tip_of.is_some() {
            let center = Point::from(pose_a.translation.vector);
            return Some(point_distance(&b.shape, &pose_b, &center) - a.radius).filter(|distance| distance.is_finite());
        }
        let signed = |pose_a: &Pose| match distance(&a.shape, pose_a, &b.shape, &pose_b, SEARCH_DISTANCE) {
            Clearance::SeparatedBy(distance) => Some(distance),
            Clearance::Penetrating(depth) => Some(-depth),
            Clearance::Unresolved => None,
        };
        // A shift changes the distance by at most its length, and a pair that is hard to tell is easier beside it.
        signed(&pose_a).or_else(|| {
            NUDGES.iter().find_map(|nudge| {
                let shift = Vector::from(*nudge) * NUDGE;
                signed(&(Translation3::from(shift) * pose_a)).map(|distance| distance - NUDGE)
            })
        })
    }
}

/// How the object moves in a step: bounds, per step.
#[derive(Debug, Clone, Copy)]
pub struct ObjectRates {
    /// Speed of its origin, in metres.
    pub shift: f64,
    /// Angular speed, in radians.
    pub turn: f64,
    /// Acceleration of its origin.
    shift_bend: f64,
    /// Angular acceleration.
    turn_bend: f64,
}

impl ObjectRates {
    /// Bounds for the motion from one waypoint to the next.
    pub fn new(motion: &Between, from: &Waypoint, to: &Waypoint) -> Self {
        let (shift, turn) = pose_difference(&from.world_from_object, &to.world_from_object);
        let (slope, bend) = (motion.sigma().largest_slope(), motion.sigma().largest_bend());
        ObjectRates { shift: shift * slope, turn: turn * slope, shift_bend: shift * bend, turn_bend: turn * bend }
    }

    /// Bounds for points of the object that are no farther than `reach` from its origin.
    pub fn of_points_within(&self, reach: f64) -> Rates {
        Rates {
            speed: self.shift + self.turn * reach,
            acceleration: self.shift_bend + (self.turn * self.turn + self.turn_bend) * reach,
            jerk: f64::INFINITY,
        }
    }

    /// Bound of the acceleration, seen from the object, of points that move in the world within `rates`, and are `arm` from the
    /// object's origin when the step begins.
    ///
    /// The second derivative of `R^T (p - o)` with angular velocity `w` is
    /// `p'' - o'' - w' x (p - o) - 2 w x (p' - o') + w x (w x (p - o))`, turned.
    pub fn acceleration_seen(&self, rates: &Rates, arm: f64) -> f64 {
        let relative = rates.speed + self.shift;
        let arm = arm + relative;
        rates.acceleration
            + self.shift_bend
            + 2.0 * self.turn * relative
            + (self.turn * self.turn + self.turn_bend) * arm
    }

    /// Bound of the speed of the same points, seen from the object.
    pub fn speed_seen(&self, rates: &Rates, arm: f64) -> f64 {
        let relative = rates.speed + self.shift;
        relative + self.turn * (arm + relative)
    }
}

fn chord_of(item: &Item, from: &Pose, to: &Pose) -> f64 {
    let shift = (to * item.center - from * item.center).norm();
    if item.spin_radius == 0.0 {
        return shift;
    }
    let (p, q) = (from.rotation.coords, to.rotation.coords);
    let q = if p.dot(&q) < 0.0 { -q } else { q };
    // The chord of a turn by angle x at radius one is 2 sin(x / 2); |p - q| = 2 sin(x / 4).
    let quarter = (0.5 * (p - q).norm()).min(1.0);
    shift + item.spin_radius * 4.0 * quarter * (1.0 - quarter * quarter).sqrt()
}

/// Where a pair comes too close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breach {
    /// When, in the step.
    pub t: f64,
    /// Signed distance there; none when it could not be resolved.
    pub distance: Option<f64>,
}

/// Certifies that `pair` stays farther apart than `floor` from `t0` to `t1`, given a lower bound of its distance at `t0`.
///
/// Ok: a lower bound at `t1`. For any time between, distance at an end minus the way from there bounds the distance;
/// the two ways together are at most the chord plus twice the stray.
pub fn certify(
    step: &mut WaypointStep,
    pair: &Pair,
    (t0, t1): (f64, f64),
    bound: f64,
    floor: f64,
    resolution: f64,
) -> Result<f64, Breach> {
    let whole_stray = step.stray(pair);
    certify_piece(step, pair, (t0, t1), (bound, None), whole_stray, floor, resolution)
}

fn certify_piece(
    step: &mut WaypointStep,
    pair: &Pair,
    (t0, t1): (f64, f64),
    (bound, known_end): (f64, Option<f64>),
    whole_stray: f64,
    floor: f64,
    resolution: f64,
) -> Result<f64, Breach> {
    step.n_pieces += 1;
    if step.n_pieces > step.most_pieces {
        return Err(Breach { t: t0, distance: None });
    }
    let chord = step.chord(pair, t0, t1);
    let stray = whole_stray * (t1 - t0) * (t1 - t0);
    let needed = floor + chord + stray;
    if bound > needed {
        return Ok(known_end.unwrap_or(bound - chord));
    }
    let ball = step.ball_distance(pair, t0);
    if ball > needed {
        return Ok(known_end.unwrap_or(ball - chord));
    }
    let mut measure = |t: f64| match step.measure(pair, t) {
        Some(distance) if distance > floor => Ok(distance),
        distance => Err(Breach { t, distance }),
    };
    let start = measure(t0)?;
    if start > needed {
        return Ok(known_end.unwrap_or(start - chord));
    }
    let end = match known_end {
        Some(end) => end,
        None => measure(t1)?,
    };
    if 0.5 * (start + end - chord) - stray > floor {
        return Ok(end);
    }
    if chord + 2.0 * stray < resolution {
        return Err(Breach { t: t0, distance: Some(start.min(end)) });
    }
    let middle = 0.5 * (t0 + t1);
    let at_middle = certify_piece(step, pair, (t0, middle), (start, None), whole_stray, floor, resolution)?;
    certify_piece(step, pair, (middle, t1), (at_middle, Some(end)), whole_stray, floor, resolution)
}
