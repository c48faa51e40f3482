//! Which moments are shown.

use super::tips::tip_centers;
use crate::story::SceneStory;
use crate::timeline::{self, TimelineStep};
use regrasp_geometry::Point;
use regrasp_plan::plan::{ContactState, Plan, PoseData, SegmentKind};

/// Why a moment is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The plan begins.
    Start,
    /// A finger is half-way to another contact.
    Relocates,
    /// A finger is half-way from its contact to where it stays free.
    LetsGo,
    /// A finger that was free is half-way to a contact.
    Lands,
    /// A free finger moves, and stays free.
    MovesFreely,
    /// A finger moves on the object, which rolls on another.
    Tracks,
    /// The object moves.
    ObjectMoves,
    /// The plan ends.
    Goal,
}

/// A moment of a plan that is shown.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyFrame {
    /// Place in [`timeline::steps`].
    pub step: usize,
    /// When, in seconds.
    pub time: f64,
    /// Angle by which the object has turned since the start, in radians.
    pub turned: f64,
    /// How far its origin has moved since then, in metres.
    pub moved: f64,
    /// Why.
    pub event: Event,
    /// The finger that moves.
    pub moving: Option<usize>,
    /// The finger that the object rolls on, in tracking.
    pub rolling: Option<usize>,
    /// Centres of the moving finger's tip all along its segment, in the world.
    pub path: Vec<Point>,
    /// In tracking, where each finger touched the object until then, in its frame; else empty.
    pub traces: Vec<Vec<Point>>,
    /// Joint positions.
    pub joints: Vec<f64>,
    /// Pose of the object in the world.
    pub world_from_object: PoseData,
    /// Contacts, one per finger.
    pub contacts: Vec<ContactState>,
}

impl KeyFrame {
    /// What happens, in words.
    pub fn text(&self, finger: Option<&str>, rolling: Option<&str>) -> String {
        let finger = finger.unwrap_or("a finger");
        match self.event {
            Event::Tracks => match rolling {
                Some(rolling) => format!("{finger} moves, {rolling} rolls"),
                None => format!("{finger} moves"),
            },
            Event::Start => "start".into(),
            Event::Relocates => format!("{finger} relocates"),
            Event::LetsGo => format!("{finger} lets go"),
            Event::Lands => format!("{finger} lands"),
            Event::MovesFreely => format!("{finger} moves, free"),
            Event::ObjectMoves => "object moves".into(),
            Event::Goal => "goal".into(),
        }
    }
}

/// At most `n` moments in order of time: start and goal, motions of single fingers (evenly thinned where there are more than
/// fit), and, while there is room, the middle of the longest time in between.
pub fn key_frames(scene: &SceneStory, plan: &Plan, n: usize) -> Vec<KeyFrame> {
    let steps = timeline::steps(plan);
    let regrasps: Vec<usize> =
        (0..plan.segments.len()).filter(|&i| plan.segments[i].kind == SegmentKind::Regrasp).collect();
    let last = steps.len() - 1;
    let mut chosen = vec![0, last];
    for i in thinned(&regrasps, n.saturating_sub(2)) {
        chosen.push(half_way(scene, plan, &steps, i));
    }
    chosen.sort_unstable();
    chosen.dedup();
    while chosen.len() < n
        && let Some(step) = middle_of_longest_gap(&steps, &chosen)
    {
        chosen.push(step);
        chosen.sort_unstable();
    }
    chosen.into_iter().map(|step| key_frame(scene, plan, &steps, step)).collect()
}

/// At most `n` of `items`, evenly spread.
fn thinned(items: &[usize], n: usize) -> Vec<usize> {
    if items.len() <= n {
        return items.to_vec();
    }
    (0..n).map(|k| items[(2 * k + 1) * items.len() / (2 * n)]).collect()
}

/// The waypoint of a segment at which its moving finger has made half of its way.
fn half_way(scene: &SceneStory, plan: &Plan, steps: &[TimelineStep], segment: usize) -> usize {
    let first = steps.iter().position(|step| step.segment == segment).unwrap_or(0);
    let path = tip_path(scene, plan, segment);
    let mut lengths = vec![0.0];
    for pair in path.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let half = lengths[lengths.len() - 1] / 2.0;
    let off = |k: usize| (lengths[k] - half).abs();
    first + (0..lengths.len()).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

/// Centres of the tip of the finger that moves in a segment, in the world; empty if none does.
fn tip_path(scene: &SceneStory, plan: &Plan, segment: usize) -> Vec<Point> {
    let segment = &plan.segments[segment];
    let Some(finger) = timeline::moving_finger(plan, segment) else { return Vec::new() };
    segment.waypoints.iter().map(|w| tip_centers(scene, &w.joints)[finger]).collect()
}

/// The waypoint nearest to the middle of the longest time without a chosen one; none if every waypoint is chosen, or the
/// rest passes at no other time.
fn middle_of_longest_gap(steps: &[TimelineStep], chosen: &[usize]) -> Option<usize> {
    let time = |k: usize| steps[k].waypoint.time;
    let gap = |pair: &&[usize]| time(pair[1]) - time(pair[0]);
    let with_room = chosen.windows(2).filter(|pair| pair[1] > pair[0] + 1 && gap(pair) > 0.0);
    // The first of the longest.
    let longest = with_room.fold(None, |best: Option<&[usize]>, pair| match best {
        Some(best) if gap(&best) >= gap(&pair) => Some(best),
        _ => Some(pair),
    })?;
    let middle = (time(longest[0]) + time(longest[1])) / 2.0;
    let off = |k: usize| (time(k) - middle).abs();
    (longest[0] + 1..longest[1]).min_by(|&a, &b| off(a).total_cmp(&off(b)))
}

fn key_frame(scene: &SceneStory, plan: &Plan, steps: &[TimelineStep], step: usize) -> KeyFrame {
    let TimelineStep { segment, waypoint } = steps[step];
    let data = &plan.segments[segment];
    let is_end = step == 0 || step + 1 == steps.len();
    let moving = timeline::moving_finger(plan, data).filter(|_| !is_end);
    let holds = |end: usize, finger: usize| data.waypoints[end].contacts[finger].holds();
    let event = match (step, moving) {
        (0, _) => Event::Start,
        (_, _) if is_end => Event::Goal,
        (_, Some(_)) if data.kind == SegmentKind::Tracking => Event::Tracks,
        (_, Some(finger)) => match (holds(0, finger), holds(data.waypoints.len() - 1, finger)) {
            (true, true) => Event::Relocates,
            (true, false) => Event::LetsGo,
            (false, true) => Event::Lands,
            (false, false) => Event::MovesFreely,
        },
        (_, None) => Event::ObjectMoves,
    };
    KeyFrame {
        step,
        time: waypoint.time,
        turned: timeline::turned(plan, waypoint),
        moved: timeline::moved(plan, waypoint),
        event,
        moving,
        rolling: timeline::rolling_finger(plan, data).filter(|_| !is_end),
        path: if moving.is_some() { tip_path(scene, plan, segment) } else { Vec::new() },
        traces: match data.kind {
            SegmentKind::Tracking => (0..plan.fingers.len()).map(|finger| trace_until(plan, finger, step)).collect(),
            SegmentKind::Transfer | SegmentKind::Regrasp => Vec::new(),
        },
        joints: waypoint.joints.clone(),
        world_from_object: waypoint.world_from_object,
        contacts: waypoint.contacts.clone(),
    }
}

/// Contacts of a finger up to a step, in the object frame.
fn trace_until(plan: &Plan, finger: usize, step: usize) -> Vec<Point> {
    timeline::trace(plan, finger).into_iter().take(step + 1).flatten().map(|(point, _)| point).collect()
}
