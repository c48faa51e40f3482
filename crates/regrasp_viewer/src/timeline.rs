//! A plan read along time: waypoints of all segments in a row, and what every finger does meanwhile.

use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::plan::{ContactMode, Plan, Segment, SegmentKind, Waypoint};

/// One waypoint, with the segment it belongs to. The waypoint that two segments share comes twice, as in the plan.
#[derive(Debug, Clone, Copy)]
pub struct TimelineStep<'p> {
    /// Index of the segment.
    pub segment: usize,
    /// The waypoint.
    pub waypoint: &'p Waypoint,
}

/// All waypoints, segment by segment: the order of every series of one number per waypoint.
pub fn steps(plan: &Plan) -> Vec<TimelineStep<'_>> {
    let mut steps = Vec::new();
    for (segment, data) in plan.segments.iter().enumerate() {
        steps.extend(data.waypoints.iter().map(|waypoint| TimelineStep { segment, waypoint }));
    }
    steps
}

/// First and last time of the plan, in seconds.
pub fn span(plan: &Plan) -> (f64, f64) {
    let first = plan.segments.first().and_then(|segment| segment.waypoints.first());
    let last = plan.segments.last().and_then(|segment| segment.waypoints.last());
    (first.map_or(0.0, |w| w.time), last.map_or(0.0, |w| w.time))
}

/// First and last time of a segment, in seconds.
pub fn segment_span(segment: &Segment) -> (f64, f64) {
    let at = |waypoint: Option<&Waypoint>| waypoint.map_or(0.0, |w| w.time);
    (at(segment.waypoints.first()), at(segment.waypoints.last()))
}

/// Indices of all fingers that move in a segment, in the order in which it names them.
pub fn moving_fingers(plan: &Plan, segment: &Segment) -> Vec<usize> {
    let index = |name: &String| plan.fingers.iter().position(|finger| finger == name);
    segment.moving_fingers().filter_map(index).collect()
}

/// Index of the finger that moves in a segment, of several the first.
pub fn moving_finger(plan: &Plan, segment: &Segment) -> Option<usize> {
    let name = segment.moving_finger.as_ref()?;
    plan.fingers.iter().position(|finger| finger == name)
}

/// Index of the finger that the object rolls on in a segment of tracking.
pub fn rolling_finger(plan: &Plan, segment: &Segment) -> Option<usize> {
    let name = segment.rolling_finger.as_ref()?;
    plan.fingers.iter().position(|finger| finger == name)
}

/// Angle by which the object is turned at a waypoint, from where it started, in radians.
pub fn turned(plan: &Plan, waypoint: &Waypoint) -> f64 {
    let [start, now] = start_and(plan, waypoint);
    start.rotation.angle_to(&now.rotation)
}

/// How far the object's origin is at a waypoint from where it started, in metres.
pub fn moved(plan: &Plan, waypoint: &Waypoint) -> f64 {
    let [start, now] = start_and(plan, waypoint);
    (now.translation.vector - start.translation.vector).norm()
}

fn start_and(plan: &Plan, waypoint: &Waypoint) -> [Pose; 2] {
    let start = plan.segments.first().and_then(|segment| segment.waypoints.first()).unwrap_or(waypoint);
    [start, waypoint].map(|w| Pose::from(&w.world_from_object))
}

/// What a finger does for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doing {
    /// Holds at one point.
    Holds,
    /// Holds and rolls, or twists where it touches.
    Rolls,
    /// Holds and slides; it may roll and twist meanwhile.
    Slides,
    /// Moves from contact to contact, or away, or to one.
    Moves,
    /// Is free while another finger or the object moves.
    Waits,
}

impl Doing {
    /// True while the finger touches the object.
    pub fn holds(self) -> bool {
        matches!(self, Doing::Holds | Doing::Rolls | Doing::Slides)
    }
}

/// What a finger does between two neighbouring waypoints of a segment at which it holds: in tracking the mode of the first
/// one, else rolling where both say so.
fn while_holding(kind: SegmentKind, before: ContactMode, mode: ContactMode) -> Doing {
    match before {
        _ if kind != SegmentKind::Tracking && before != mode => Doing::Holds,
        before if before.slides() => Doing::Slides,
        ContactMode::Fixed | ContactMode::Free => Doing::Holds,
        _ => Doing::Rolls,
    }
}

/// A stretch of time in which a finger does one thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// What it does.
    pub doing: Doing,
    /// From when, in seconds.
    pub from: f64,
    /// Until when, in seconds.
    pub until: f64,
}

/// What `finger` does, from the beginning of the plan to its end, without gaps. A moving finger holds until the last
/// waypoint at which it still does, and again from the first at which it does again.
pub fn stretches(plan: &Plan, finger: usize) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = Vec::new();
    let mut push = |doing: Doing, from: f64, until: f64| match found.last_mut() {
        Some(last) if last.doing == doing => last.until = until,
        _ => found.push(Stretch { doing, from, until }),
    };
    let mut last: Option<(f64, ContactMode)> = None;
    for segment in &plan.segments {
        let moves = segment.kind == SegmentKind::Regrasp && moving_finger(plan, segment) == Some(finger);
        for (k, waypoint) in segment.waypoints.iter().enumerate() {
            let mode = waypoint.contacts.get(finger).map_or(ContactMode::Free, |contact| contact.mode);
            if let Some((time, before)) = last {
                let holds = mode != ContactMode::Free && before != ContactMode::Free;
                // Between two segments everything rests.
                let doing = match (holds, k > 0) {
                    (true, true) => while_holding(segment.kind, before, mode),
                    (true, false) => Doing::Holds,
                    (false, true) if moves => Doing::Moves,
                    (false, _) => Doing::Waits,
                };
                push(doing, time, waypoint.time);
            }
            last = Some((waypoint.time, mode));
        }
    }
    found
}

/// When a finger lets go and when it lands, in seconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Marks {
    /// Times at which it lets go.
    pub lifts: Vec<f64>,
    /// Times at which it lands.
    pub lands: Vec<f64>,
}

/// When `finger` lets go and lands.
pub fn marks(plan: &Plan, finger: usize) -> Marks {
    let mut marks = Marks::default();
    let on = |stretch: &Stretch| stretch.doing.holds();
    let stretches = stretches(plan, finger);
    // A finger may let go in the first moment, and land in the last.
    let ends = [
        plan.segments.first().and_then(|s| s.waypoints.first()),
        plan.segments.last().and_then(|s| s.waypoints.last()),
    ];
    let [held_first, held_last] = ends.map(|w| w.and_then(|w| w.contacts.get(finger)).is_some_and(|c| c.holds()));
    if let Some(first) = stretches.first().filter(|first| held_first && !on(first)) {
        marks.lifts.push(first.from);
    }
    for pair in stretches.windows(2) {
        match (on(&pair[0]), on(&pair[1])) {
            (true, false) => marks.lifts.push(pair[1].from),
            (false, true) => marks.lands.push(pair[1].from),
            _ => {}
        }
    }
    if let Some(last) = stretches.last().filter(|last| held_last && !on(last)) {
        marks.lands.push(last.until);
    }
    marks
}

/// Contact point of a finger at a waypoint, in the world; none while it is free.
pub fn contact_point(waypoint: &Waypoint, finger: usize) -> Option<Point> {
    let contact = waypoint.contacts.get(finger).filter(|contact| contact.holds())?;
    Some(Pose::from(&waypoint.world_from_object) * Point::from(contact.point_in_object?))
}

/// Which fingers move and roll for a while, in tracking.
#[derive(Debug, Clone, PartialEq)]
pub struct Roles {
    /// The fingers that move.
    pub moving: Vec<usize>,
    /// The resting finger that the object rolls on.
    pub rolling: Option<usize>,
    /// From when, in seconds.
    pub from: f64,
    /// Until when, in seconds.
    pub until: f64,
}

/// The roles of fingers along the tracking segments of a plan; neighbours with the same ones are one.
pub fn roles(plan: &Plan) -> Vec<Roles> {
    let mut found: Vec<Roles> = Vec::new();
    for segment in &plan.segments {
        let is_tracking = segment.kind == SegmentKind::Tracking;
        let (moving, rolling) = (moving_fingers(plan, segment), rolling_finger(plan, segment));
        let (from, until) = segment_span(segment);
        match found.last_mut() {
            Some(last) if is_tracking && last.moving == moving && last.rolling == rolling => last.until = until,
            _ if is_tracking => found.push(Roles { moving, rolling, from, until }),
            _ => {}
        }
    }
    found
}

/// Rotation vectors of the object in the world, one for each of [`steps`]: of the vectors of an orientation (they differ by
/// whole turns about its axis), the shortest at the first step, then the nearest to the one before.
pub fn rotation_vectors(plan: &Plan) -> Vec<Vector> {
    let mut found: Vec<Vector> = Vec::new();
    for step in steps(plan) {
        let shortest = Pose::from(&step.waypoint.world_from_object).rotation.scaled_axis();
        found.push(found.last().map_or(shortest, |before| nearest_vector(&shortest, before)));
    }
    found
}

/// The rotation vector of the same orientation as `vector` that is nearest to `to`.
pub fn nearest_vector(vector: &Vector, to: &Vector) -> Vector {
    let Some(axis) = vector.try_normalize(1e-12) else {
        // No turn: whole turns about any axis; those about that of `to` are nearest.
        let turns = (to.norm() / std::f64::consts::TAU).round();
        return to.try_normalize(1e-12).map_or(*vector, |axis| axis * (turns * std::f64::consts::TAU));
    };
    let turns = ((to.dot(&axis) - vector.norm()) / std::f64::consts::TAU).round();
    vector + axis * (turns * std::f64::consts::TAU)
}

/// Angle by which the object turns all along the plan: the sum of those between neighbouring waypoints, in radians.
pub fn angle_along(plan: &Plan) -> f64 {
    let steps = steps(plan);
    let rotation = |step: &TimelineStep| Pose::from(&step.waypoint.world_from_object).rotation;
    steps.windows(2).map(|pair| rotation(&pair[0]).angle_to(&rotation(&pair[1]))).sum()
}

/// Where a finger touches at each of [`steps`]: contact point and outward normal, in the object frame; none while it is free.
pub fn trace(plan: &Plan, finger: usize) -> Vec<Option<(Point, Vector)>> {
    let at = |step: &TimelineStep| {
        let contact = step.waypoint.contacts.get(finger).filter(|contact| contact.holds())?;
        Some((Point::from(contact.point_in_object?), Vector::from(contact.normal_in_object?)))
    };
    steps(plan).iter().map(at).collect()
}
