//! What moves when a motor turns: joints that follow others, over all fingers.

use crate::settings::GraspSettings;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::list::GraspKind;
use regrasp_manipulation::grasp::state::HandJoints;
use regrasp_manipulation::model::Model;
use regrasp_robot::Hand;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// A coordinate of a finger that a motor drives: `factor * position + offset`.
#[derive(Debug, Clone, Copy)]
pub struct Driven {
    /// The finger.
    pub finger: usize,
    coordinate: usize,
    factor: f64,
    offset: f64,
}

/// One motor.
#[derive(Debug, Clone)]
pub struct Motor {
    /// What it drives.
    pub driven: Vec<Driven>,
    /// Its position while the hand is open.
    pub open: f64,
    /// Its position at the other end.
    pub closed: f64,
}

impl Motor {
    /// Brings all that the motor drives to where it belongs.
    pub fn put(&self, joints: &mut HandJoints, position: f64) {
        for driven in &self.driven {
            joints[driven.finger][driven.coordinate] = driven.factor * position + driven.offset;
        }
    }

    /// Position of the motor with these joints.
    fn position(&self, joints: &HandJoints) -> f64 {
        let driven = &self.driven[0];
        (joints[driven.finger][driven.coordinate] - driven.offset) / driven.factor
    }

    /// How the coordinates of `finger` change when the motor turns by one.
    pub fn change_of(&self, finger: usize, n_coordinates: usize) -> Coordinates {
        let mut change: Coordinates = (0..n_coordinates).map(|_| 0.0).collect();
        self.driven.iter().filter(|driven| driven.finger == finger).for_each(|driven| {
            change[driven.coordinate] = driven.factor;
        });
        change
    }
}

/// The motors of a hand.
#[derive(Debug, Clone)]
pub struct Motors {
    /// Those that close it: they drive the last joint of some finger.
    pub closing: Vec<Motor>,
    /// The others: they shape the hand before it closes.
    shaping: Vec<Motor>,
    /// The hand at rest.
    rest: HandJoints,
}

impl Motors {
    /// The motors of the hand of `model`. Errors: what they cannot do, in words.
    pub fn new(model: &Model, settings: &GraspSettings) -> Result<Self, String> {
        let hand = model.view.hand;
        let rest: HandJoints = hand.fingers.iter().map(|finger| finger.rest.iter().copied().collect()).collect();
        let mut motors = motors_of(hand, settings.limit_margin)?;
        if settings.kind == GraspKind::Gripper {
            if hand.fingers.len() != 2 {
                return Err(format!("kind gripper needs a hand of two fingers; this one has {}", hand.fingers.len()));
            }
            // Jaws that are not coupled move alike.
            while motors.len() > 1 && hand.fingers.iter().all(|finger| finger.chain.n_coordinates() == 1) {
                let other = motors.remove(1);
                motors[0] = joined(&motors[0], &other, hand);
            }
        }
        let (closing, shaping): (Vec<Motor>, Vec<Motor>) = motors.into_iter().partition(|motor| {
            let is_last = |driven: &Driven| driven.coordinate + 1 == hand.fingers[driven.finger].chain.n_coordinates();
            motor.driven.iter().any(is_last)
        });
        let mut motors = Motors { closing, shaping, rest };
        if settings.kind == GraspKind::Gripper && motors.closing.len() != 1 {
            return Err("kind gripper needs two jaws of one joint each, or two that one motor drives".into());
        }
        motors.find_ends(hand);
        Ok(motors)
    }

    /// Turns the motors round that close towards their lower end: at the closed end fingertips are nearer to the middle of them all.
    fn find_ends(&mut self, hand: &Hand) {
        let tip = |joints: &HandJoints, f: usize| hand.fingers[f].ik.tip(&joints[f]);
        let mut middle = self.rest.clone();
        self.closing.iter().for_each(|motor| motor.put(&mut middle, 0.5 * (motor.open + motor.closed)));
        let n = hand.fingers.len();
        let sum: Vector = (0..n).map(|f| tip(&middle, f).coords).sum();
        let center = Point::from(sum / n as f64);
        for motor in &mut self.closing {
            let apart = |position: f64| -> f64 {
                let mut joints = middle.clone();
                motor.put(&mut joints, position);
                motor.driven.iter().map(|driven| (tip(&joints, driven.finger) - center).norm()).sum()
            };
            if apart(motor.open) < apart(motor.closed) {
                std::mem::swap(&mut motor.open, &mut motor.closed);
            }
        }
    }

    /// The open hand in a shape that is drawn.
    pub fn drawn_shape(&self, rng: &mut Rng) -> HandJoints {
        let mut joints = self.rest.clone();
        for motor in &self.shaping {
            motor.put(&mut joints, rng.uniform(motor.open, motor.closed));
        }
        self.opened(&joints, 1.0)
    }

    /// `joints` with every closing motor moved to its open end by `share` of the way.
    pub fn opened(&self, joints: &HandJoints, share: f64) -> HandJoints {
        let mut open = joints.clone();
        for motor in &self.closing {
            let position = motor.position(joints);
            motor.put(&mut open, position + (motor.open - position) * share);
        }
        open
    }

    /// Position of closing motor `index` with these joints.
    pub fn position(&self, index: usize, joints: &HandJoints) -> f64 {
        self.closing[index].position(joints)
    }

    /// The hand at rest.
    pub fn rest(&self) -> &HandJoints {
        &self.rest
    }
}

/// One motor for each joint that follows no other one; its ends are those within the limits of all that it drives.
fn motors_of(hand: &Hand, limit_margin: f64) -> Result<Vec<Motor>, String> {
    let coordinate_of = |joint: regrasp_robot::JointId| {
        let name = &hand.robot.joints[joint.0].name;
        let of_finger = |(f, finger): (usize, &regrasp_robot::Finger)| {
            finger.chain.names.iter().position(|known| known == name).map(|k| (f, k))
        };
        hand.fingers.iter().enumerate().find_map(of_finger)
    };
    let mut motors = Vec::new();
    for (f, finger) in hand.fingers.iter().enumerate() {
        for k in 0..finger.chain.n_coordinates() {
            if hand.ties.iter().any(|tie| coordinate_of(tie.follower) == Some((f, k))) {
                continue;
            }
            let mut driven = vec![Driven { finger: f, coordinate: k, factor: 1.0, offset: 0.0 }];
            for tie in &hand.ties {
                let [(leader, factor)] = tie.coupling.terms.as_slice() else {
                    let name = &hand.robot.joints[tie.follower.0].name;
                    return Err(format!(
                        "joint \"{name}\" follows several joints of other fingers: no motor drives it alone"
                    ));
                };
                if coordinate_of(*leader) == Some((f, k))
                    && let Some((finger, coordinate)) = coordinate_of(tie.follower)
                {
                    driven.push(Driven { finger, coordinate, factor: *factor, offset: tie.coupling.offset });
                }
            }
            let [low, high] = ends(hand, &driven, limit_margin);
            if low > high {
                return Err(format!("what follows joint \"{}\" leaves it no position", finger.chain.names[k]));
            }
            motors.push(Motor { driven, open: low, closed: high });
        }
    }
    Ok(motors)
}

/// Lowest and highest position of a motor.
fn ends(hand: &Hand, driven: &[Driven], limit_margin: f64) -> [f64; 2] {
    let pi = std::f64::consts::PI;
    driven.iter().fold([-pi, pi], |[low, high], one| {
        let chain = &hand.fingers[one.finger].chain;
        let (lower, upper) = (chain.lower[one.coordinate], chain.upper[one.coordinate]);
        let margin = limit_margin.min(0.02 * (upper - lower));
        let at = |position: f64| (position - one.offset) / one.factor;
        let (a, b) = (at(lower + margin), at(upper - margin));
        [low.max(a.min(b)), high.min(a.max(b))]
    })
}

/// Two motors as one whose position runs from 0 to 1. Which end of each is the closed one follows from where the tips come together.
fn joined(first: &Motor, second: &Motor, hand: &Hand) -> Motor {
    let along = |motor: &Motor, from: f64, to: f64| -> Vec<Driven> {
        let drive =
            |one: &Driven| Driven { factor: one.factor * (to - from), offset: one.factor * from + one.offset, ..*one };
        motor.driven.iter().map(drive).collect()
    };
    let tip = |motor: &Motor, position: f64| {
        let one = motor.driven[0];
        hand.fingers[one.finger].ik.tip(&[one.factor * position + one.offset])
    };
    let ends = |motor: &Motor| [(motor.open, motor.closed), (motor.closed, motor.open)];
    let pairs = ends(first).into_iter().flat_map(|a| ends(second).map(|b| (a, b)));
    let apart = |(a, b): &((f64, f64), (f64, f64))| (tip(first, a.1) - tip(second, b.1)).norm();
    let nearest = pairs.min_by(|x, y| apart(x).total_cmp(&apart(y)));
    let (a, b) = nearest.unwrap_or(((first.open, first.closed), (second.open, second.closed)));
    Motor { driven: [along(first, a.0, a.1), along(second, b.0, b.1)].concat(), open: 0.0, closed: 1.0 }
}
