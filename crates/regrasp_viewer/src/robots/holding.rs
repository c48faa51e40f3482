//! Who holds the object when, in plans of pick and place.

use crate::palette;
use regrasp_plan::RobotPlan;
use regrasp_plan::robot_plan::RobotSegment;

/// A row of the task chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Holding {
    /// A hand or a support.
    pub name: String,
    /// True for a hand of the plan.
    pub is_hand: bool,
    /// From when until when it holds, in seconds.
    pub bars: Vec<[f64; 2]>,
}

/// Colour of supports.
const SUPPORT: &str = "#9a8f80";

impl Holding {
    /// Its colour, as the row with this number.
    pub fn color(&self, row: usize) -> &'static str {
        if self.is_hand { palette::color(row) } else { SUPPORT }
    }
}

/// What happens between two segments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// A hand takes the object from a support.
    Grasp,
    /// A hand takes the object while another hand holds it.
    Exchange,
    /// A hand puts the object on a support.
    Place,
    /// A hand lets go.
    Release,
    /// The object leaves a support.
    Lift,
}

/// A holder joins or leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// When, in seconds.
    pub time: f64,
    /// The holder that joins or leaves.
    pub holder: String,
    /// What happens.
    pub kind: EventKind,
}

/// First and last time of a segment, in seconds.
pub fn span(segment: &RobotSegment) -> [f64; 2] {
    let time = |at: Option<&regrasp_plan::robot_plan::RobotWaypoint>| at.map_or(0.0, |waypoint| waypoint.time);
    [time(segment.waypoints.first()), time(segment.waypoints.last())]
}

/// Names of those that hold any object of the plan in a segment.
fn holders(segment: &RobotSegment) -> Vec<&str> {
    segment.held_by.values().flatten().map(String::as_str).collect()
}

fn is_hand(plan: &RobotPlan, name: &str) -> bool {
    plan.hands.iter().any(|hand| hand.name == name)
}

/// Hands of the plan, then supports in the order in which they first hold.
pub fn rows(plan: &RobotPlan) -> Vec<Holding> {
    let mut names: Vec<&str> = plan.hands.iter().map(|hand| hand.name.as_str()).collect();
    for name in plan.segments.iter().flat_map(holders) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let row = |name: &str| {
        let mut bars: Vec<[f64; 2]> = Vec::new();
        let mut held_before = false;
        for segment in &plan.segments {
            let [from, until] = span(segment);
            let holds = holders(segment).contains(&name);
            match bars.last_mut().filter(|_| held_before && holds) {
                Some(bar) => bar[1] = until,
                None if holds => bars.push([from, until]),
                None => {}
            }
            held_before = holds;
        }
        Holding { name: name.to_owned(), is_hand: is_hand(plan, name), bars }
    };
    names.into_iter().map(row).collect()
}

/// Who joins or leaves, in the order of time.
pub fn events(plan: &RobotPlan) -> Vec<Event> {
    let mut found = Vec::new();
    for pair in plan.segments.windows(2) {
        let [before, after] = [holders(&pair[0]), holders(&pair[1])];
        let time = span(&pair[1])[0];
        let joining = after.iter().filter(|name| !before.contains(name)).map(|name| {
            let kind = match (is_hand(plan, name), before.iter().any(|other| is_hand(plan, other))) {
                (true, true) => EventKind::Exchange,
                (true, false) => EventKind::Grasp,
                (false, _) => EventKind::Place,
            };
            (name, kind)
        });
        let leaving = before.iter().filter(|name| !after.contains(name)).map(|name| {
            let kind = if is_hand(plan, name) { EventKind::Release } else { EventKind::Lift };
            (name, kind)
        });
        for (name, kind) in joining.chain(leaving) {
            found.push(Event { time, holder: (*name).to_owned(), kind });
        }
    }
    found
}

/// When each finger of a hand touches the object, in seconds.
pub fn finger_bars(plan: &RobotPlan, hand: &str, finger: &str) -> Vec<[f64; 2]> {
    let mut bars: Vec<[f64; 2]> = Vec::new();
    let mut touched_before = false;
    for waypoint in plan.waypoints() {
        let touches = waypoint.contacts.iter().any(|contact| contact.hand == hand && contact.finger == finger);
        match bars.last_mut().filter(|_| touched_before && touches) {
            Some(bar) => bar[1] = waypoint.time,
            None if touches => bars.push([waypoint.time, waypoint.time]),
            None => {}
        }
        touched_before = touches;
    }
    bars
}

/// A moment that a storyboard shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// When, in seconds.
    pub time: f64,
    /// What happens.
    pub caption: String,
}

/// Carries that are shorter are no step of their own, in seconds.
const SHORT: f64 = 0.3;

/// The steps of a task: its start and end, every event but lifts, and the middle of every carry.
pub fn steps(plan: &RobotPlan) -> Vec<Step> {
    let Some(first) = plan.waypoints().next() else { return Vec::new() };
    let mut steps = vec![Step { time: first.time, caption: "start".into() }];
    for event in events(plan) {
        let caption = match event.kind {
            EventKind::Grasp | EventKind::Exchange => format!("{} grasps", event.holder),
            EventKind::Place => format!("on {}", event.holder),
            EventKind::Release => format!("{} lets go", event.holder),
            EventKind::Lift => continue,
        };
        steps.push(Step { time: event.time, caption });
    }
    for segment in &plan.segments {
        let ([from, until], held) = (span(segment), holders(segment));
        if until - from > SHORT && held.len() == 1 && is_hand(plan, held[0]) {
            let moves = segment.waypoints.first().map(|w| &w.world_from_objects)
                != segment.waypoints.last().map(|w| &w.world_from_objects);
            if moves {
                steps.push(Step { time: 0.5 * (from + until), caption: format!("{} carries", held[0]) });
            }
        }
    }
    steps.push(Step { time: first.time + plan.duration(), caption: "end".into() });
    steps.sort_by(|a, b| a.time.total_cmp(&b.time));
    steps
}
