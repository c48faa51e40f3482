//! What can be wrong with a plan: kind, moment, who, how much.

use crate::check::level::Level;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;

/// A moment of a plan: `fraction` of the way from waypoint `waypoint` to the next one of segment `segment`.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, JsonSchema)]
pub struct Moment {
    /// Index of the segment, from 0.
    pub segment: usize,
    /// Index of the waypoint in the segment, from 0.
    pub waypoint: usize,
    /// In `[0, 1)`.
    pub fraction: f64,
}

impl Moment {
    /// Exactly at a waypoint.
    pub fn at(segment: usize, waypoint: usize) -> Self {
        Moment { segment, waypoint, fraction: 0.0 }
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "segment {}, waypoint {}", self.segment, self.waypoint)?;
        if self.fraction > 0.0 { write!(f, " + {:.4}", self.fraction) } else { Ok(()) }
    }
}

/// Kind of a violation. A kind never changes its meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViolationKind {
    /// A file that the plan was made from is missing, or is another one now.
    InputHashMismatch,
    /// The plan is of another hand or scene: joint names, finger names, task.
    WrongScene,
    /// The plan says that others hold the object than those that do, or nobody holds it.
    WrongHolder,
    /// A number is NaN or infinite, or a rotation or normal is not of length one.
    NotANumber,
    /// The plan does not begin where it was asked to.
    StartMismatch,
    /// The plan does not end where it was asked to.
    GoalMismatch,
    /// A pose that was to be passed on the way is not, or not in the order asked for.
    WayPoseMissed,
    /// A segment does not begin where the one before ends.
    SegmentsDoNotMeet,
    /// No segment, or a segment with fewer than two waypoints.
    EmptySegment,
    /// A joint is beyond a limit.
    JointLimit,
    /// A joint moves so far between two waypoints that it is a jump.
    JointJump,
    /// The object moves in a regrasp.
    ObjectMovesInRegrasp,
    /// A contact that should stay changes.
    GraspChanges,
    /// A finger changes between holding, rolling and being free in a segment that it should spend in one of these; the
    /// moving finger of a regrasp holds between its ends; or a finger rolls that cannot: its tip is sharp, or the object
    /// rests. In tracking, a finger does not touch, or changes between two modes other than being fixed; elsewhere, it has
    /// a mode of tracking.
    WrongContactMode,
    /// In tracking, a contact is not in the mode that the plan says: by the poses it turns, twists or rolls though it
    /// should not, or does not slide though it should.
    ContactModeWrong,
    /// In tracking, a contact lacks its point on the tip, or its relative velocity or turn; elsewhere, it has one of these.
    RelativeMotionMissing,
    /// The relative velocity or turn of a contact is not the one that the poses have.
    RelativeVelocityWrong,
    /// In a regrasp or in tracking, a finger moves that should not, or the moving finger has no name.
    WrongMovingFinger,
    /// In tracking, the rolling finger has no name, is the moving one, or is said to slide; or a segment of another kind
    /// names one.
    WrongRollingFinger,
    /// A holding fingertip is not on its contact.
    ContactOffTip,
    /// A fingertip that should roll, twist or stay slides over the object, or a soft one turns about the normal.
    Slip,
    /// A fingertip's centre leaves the ball that the scene allows it.
    OutOfReach,
    /// A fingertip touches outside the pad that the hand file gives it.
    ContactOffPad,
    /// A contact is not on the object's surface.
    ContactOffSurface,
    /// A contact's normal is not the surface's.
    ContactNormalWrong,
    /// A contact is nearer to an edge of the object than the scene allows.
    ContactTooNearEdge,
    /// The holding fingers are not closed with the margin that the plan promises.
    ClosureLost,
    /// The plan counts on more friction than the scene has.
    FrictionAboveScene,
    /// Two things touch that must not.
    Collision,
    /// A moving finger does not leave or reach its contact along the normal side, or never leaves the object.
    LandingOrLiftingNotFree,
    /// A promise is not one that a plan may make, or is not kept.
    PromiseBroken,
    /// The plan has no contact forces where they are asked for.
    ForcesAbsent,
    /// The plan allows itself more than scene, hand file or checker do: speed, velocity, acceleration, normal force.
    LimitExceeded,
    /// Closure and forces count on more friction than the scene's over the friction margin that is asked for.
    FrictionMarginTooSmall,
    /// A force or torque is missing in a plan that promises forces, or there is one in a plan that promises none.
    ForceMissing,
    /// The contact forces do not balance the object's weight.
    ForceUnbalanced,
    /// A contact force that the fingertip cannot transmit: outside its cone.
    ForceOutsideCone,
    /// The friction force of a fingertip that slides has not its full size, or does not point where the fingertip slides.
    SlidingForceWrong,
    /// A holding finger presses less or more than promised.
    NormalForceOutOfRange,
    /// A finger still presses when it lifts off, or already when it lands.
    MovingFingerPresses,
    /// The joint torques are not those that make the contact forces.
    TorqueWrong,
    /// A joint needs more torque than promised.
    TorqueLimit,
    /// Time stands still, runs backward, or leaves none for forces to change.
    TimeOrder,
    /// A joint goes faster than promised.
    JointTooFast,
    /// A fingertip or the object goes faster than promised.
    TooFast,
    /// A joint's velocity changes faster than promised.
    JointAcceleration,
    /// Joint velocities that do not belong to the motion.
    VelocityInconsistent,
    /// The plan asks for more work than the checker does: the rest of it was not judged.
    NotJudged,
    /// In a task of pick and place the object moves where it has to rest.
    ObjectMovesAtRest,
    /// In a task of pick and place a joint moves where it has to rest.
    JointMovesAtRest,
    /// In a task of pick and place the object does not stand on the support that holds it.
    Unsupported,
    /// Of a grasp list: the object does not stand in a pose that the list calls stable, or a hand is not above the support there.
    StablePoseWrong,
    /// Of a grasp list: the line on which the open hand comes is too short to be a way in.
    NoWayIn,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Violation {
    /// What kind of thing.
    pub kind: ViolationKind,
    /// When, where it has a moment.
    pub at: Option<Moment>,
    /// Who: a joint, a finger, a file, or the two things of a pair.
    pub subjects: Vec<String>,
    /// In words, with the numbers.
    pub message: String,
    /// How much, in metres, radians or as the kind says; NaN is never written.
    pub amount: Option<f64>,
    /// What would have been allowed, in the same unit.
    pub limit: Option<f64>,
    /// The lowest level of verdict at which this counts.
    pub level: Level,
}

impl Violation {
    /// A violation without a moment and without an amount.
    pub fn new(kind: ViolationKind, message: impl Into<String>) -> Self {
        Violation {
            kind,
            at: None,
            subjects: Vec::new(),
            message: message.into(),
            amount: None,
            limit: None,
            level: Level::Geometry,
        }
    }

    /// The same, at a moment.
    #[must_use]
    pub fn when(mut self, at: Moment) -> Self {
        self.at = Some(at);
        self
    }

    /// The same, naming who takes part.
    #[must_use]
    pub fn subjects<'a>(mut self, subjects: impl IntoIterator<Item = &'a str>) -> Self {
        self.subjects = subjects.into_iter().map(str::to_owned).collect();
        self
    }

    /// The same, counted only where a plan is judged for this level or a higher one.
    #[must_use]
    pub fn from_level(mut self, level: Level) -> Self {
        self.level = level;
        self
    }

    /// The same, with how much and what would be allowed.
    #[must_use]
    pub fn amount(mut self, amount: f64, limit: f64) -> Self {
        self.amount = amount.is_finite().then_some(amount);
        self.limit = limit.is_finite().then_some(limit);
        self
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.kind)?;
        if let Some(at) = &self.at {
            write!(f, " at {at}")?;
        }
        write!(f, ": {}", regrasp_base::diagnostic::printable(&self.message))
    }
}
