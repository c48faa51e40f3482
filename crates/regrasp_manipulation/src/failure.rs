//! Why no plan was found: a result, with causes and the nearest miss, not an error.

use crate::grasp::state::MAX_FINGERS;
use crate::outline::Outline;
use crate::robot_miss::RobotMiss;
use regrasp_base::Interrupt;
use regrasp_plan::plan::{PoseData, Statistics};
use regrasp_scene::HandView;
use serde::Serialize;

/// What kind of failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureKind {
    /// The start is not valid as asked: collision, reach, contact or closure. Decided before any search.
    StartInvalid,
    /// The goal is not valid as asked. Decided before any search.
    GoalInvalid,
    /// A way pose is not valid as asked. Decided before any search.
    WayInvalid,
    /// The settings make no sense. Decided before any search.
    SettingsInvalid,
    /// This hand can never do it with these contacts, for a reason that needs no search.
    Impossible,
    /// A roadmap does not lead from start to goal: not a proof.
    NotConnected,
    /// The work budget is used up: not a proof.
    WorkSpent,
    /// The time limit has passed: not a proof.
    TimeLimit,
    /// The caller asked to stop.
    Interrupted,
}

impl From<Interrupt> for FailureKind {
    fn from(interrupt: Interrupt) -> Self {
        match interrupt {
            Interrupt::WorkSpent => FailureKind::WorkSpent,
            Interrupt::Deadline => FailureKind::TimeLimit,
            Interrupt::Cancelled => FailureKind::Interrupted,
        }
    }
}

/// One reason for which attempts failed, and how often.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// The reason, in words: `finger "index" cannot reach a new contact`.
    pub reason: String,
    /// How many attempts failed for it.
    pub count: u64,
    /// Share of all failed attempts.
    pub share: f64,
}

/// The pose nearest to the goal, or to the end of the leg that failed, that was reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NearestMiss {
    /// The object's pose there.
    pub world_from_object: PoseData,
    /// Angle left to the goal or the end of the leg, in radians.
    pub angle_left: f64,
    /// Distance left to it, in metres.
    pub distance_left: f64,
    /// Joint positions there, in the order of `Hand::joint_names`.
    pub joints: Vec<f64>,
}

/// No plan, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Kind.
    pub kind: FailureKind,
    /// One or two sentences that say what happened, with names and numbers.
    pub message: String,
    /// One line of advice; may be empty.
    pub advice: String,
    /// Causes, commonest first.
    pub causes: Vec<Cause>,
    /// Number of the leg that failed, from 1; none for a query without way poses, or before any search.
    pub leg: Option<usize>,
    /// The nearest that the search came to the goal (or to the end of that leg), if it got anywhere.
    pub nearest_miss: Option<Box<NearestMiss>>,
    /// The nearest miss of a task of a whole robot: a posture, and what is wrong with it.
    pub robot_miss: Option<Box<RobotMiss>>,
    /// What was reached when the search ended: of the attempt that reached most, where the method is `gait`. Not in events.
    #[serde(skip)]
    pub reached: Option<Box<Outline>>,
    /// Counts of the search.
    pub statistics: Statistics,
}

impl Failure {
    /// Kind, message and advice alone: no causes, no nearest miss, nothing counted.
    pub fn bare(kind: FailureKind, message: String, advice: &str) -> Self {
        Failure {
            kind,
            message,
            advice: advice.into(),
            causes: Vec::new(),
            leg: None,
            nearest_miss: None,
            robot_miss: None,
            reached: None,
            statistics: Statistics::default(),
        }
    }

    /// Refuses a hand of more fingers than planners have room for.
    pub fn refuse_many_fingers(view: &HandView) -> Result<(), Self> {
        let n_fingers = view.hand.fingers.len();
        if n_fingers <= MAX_FINGERS {
            return Ok(());
        }
        let message =
            format!("hand \"{}\" has {n_fingers} fingers; this version plans for {MAX_FINGERS}", view.hand_name);
        Err(Failure::bare(FailureKind::Impossible, message, "name fewer of them in the hand file"))
    }

    /// Refuses hands in which a joint of one finger follows a joint of another one: their fingers cannot let go one by one. Robots may carry
    /// such hands; grasps of lists close them.
    pub fn refuse_tied_fingers(view: &HandView) -> Result<(), Self> {
        let Some(tie) = view.hand.ties.first() else { return Ok(()) };
        let name = |joint: regrasp_robot::JointId| view.hand.robot.joints[joint.0].name.as_str();
        let leader = tie.coupling.terms.first().map_or("another joint", |(leader, _)| name(*leader));
        let follower = name(tie.follower);
        let message = format!(
            "hand \"{}\" has one motor for several fingers: joint \"{follower}\" follows joint \"{leader}\", and holding both still, with \
             the joints before them on their fingers, would leave a finger without a joint, so that fingers cannot let go one by one",
            view.hand_name,
        );
        let advice = "pick the object up and put it down again (task = \"pick_and_place\"), or use a hand whose fingers move alone; to hold \
                      one joint still, fix it in the URDF (type=\"fixed\")";
        Err(Failure::bare(FailureKind::Impossible, message, advice))
    }

    /// Of settings that do not validate; `problem` says what is wrong with them.
    pub fn of_settings(problem: &str) -> Self {
        let message = format!("the settings make no sense: {problem}");
        Failure::bare(FailureKind::SettingsInvalid, message, "correct this value, or leave it out")
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}
