//! What a robot and a hand are like: joints, limits, meshes, units, fingers and tips, links that always or never touch.

/// Links of one finger that are always near each other.
pub(crate) mod crowded;
/// Fingertips that are drawn and have no collision geometry.
pub(crate) mod drawn;
/// Collision geometry that encloses the fingers.
pub(crate) mod enclosing;
/// Names of fingers.
mod finger_names;
/// Fingers and tips guessed from a robot alone.
pub(crate) mod guess;
/// A hand as the text of a `hand.toml`.
pub mod hand_text;
/// Where fingertips reach.
pub mod reach;
/// Rest postures.
pub(crate) mod rest;
/// Links that move together.
mod rigid;
/// Joints and meshes as tables, and what looks like a wrong unit.
pub mod robot_table;
/// Tips compared with the geometry of their links.
pub mod tip_report;
/// Tips fitted to the distal end of a link.
mod tip_sphere;
/// Which links touch.
mod touch;
/// Robots with arms, and robot files for them.
pub mod whole;

use crate::hand::Hand;
use crate::import::{LoadOptions, LoadedInput, load_hand, load_robot};
use crate::robot::{LinkId, Robot};
use crate::tip::TipShape;
use regrasp_base::{InputError, Rng};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

pub use hand_text::hand_file_text;
pub use reach::{TipReach, TipRegion};
pub use robot_table::{Follows, JointRow, MeshRow, RobotInspection, inspect_robot};
pub use tip_report::{StandsOut, TipReport, tip_report};

/// How a hand is inspected.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectSettings {
    /// Postures drawn to find links that always or never touch. 10,000 as MoveIt's setup assistant.
    pub n_postures: usize,
}

impl Default for InspectSettings {
    fn default() -> Self {
        InspectSettings { n_postures: 10_000 }
    }
}

/// A finger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FingerRow {
    /// Name.
    pub name: String,
    /// Independent joints, base first.
    pub joints: Vec<String>,
    /// The link that carries the tip.
    pub tip_link: String,
    /// `sphere`, `point` or `mesh`.
    pub tip_shape: &'static str,
    /// Radius of the tip, in metres; 0 for other shapes.
    pub tip_radius: f64,
    /// Centre of the tip in the frame of the last moving body, in metres.
    pub tip_center_in_body: [f64; 3],
    /// How well the tip is what the link's collision geometry is.
    pub tip: TipReport,
    /// Rest posture.
    pub rest: Vec<f64>,
}

/// Two links and how often they touch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairRow {
    /// The links, by name, in document order.
    pub links: [String; 2],
    /// Share of the postures in which they touch, between 0 and 1.
    pub share: f64,
}

/// Pairs of links that no finger joint alone separates, over random postures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairTable {
    /// How many postures were drawn.
    pub n_postures: usize,
    /// Pairs that touched in every posture.
    pub always: Vec<[String; 2]>,
    /// Pairs that touched in some.
    pub sometimes: Vec<PairRow>,
    /// Pairs that touched in none.
    pub never: Vec<[String; 2]>,
    /// Pairs that touch in the rest posture.
    pub at_rest: Vec<[String; 2]>,
    /// Ids of the pairs of `always`, for [`hand_file_text`].
    #[serde(skip)]
    pub always_ids: BTreeSet<(LinkId, LinkId)>,
}

/// What a hand is like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HandInspection {
    /// The link whose frame is the hand frame.
    pub base: String,
    /// Fingers.
    pub fingers: Vec<FingerRow>,
    /// Links of the palm that have collision geometry.
    pub palm: Vec<String>,
    /// Largest distance between two joints or tips at rest, in metres.
    pub span: f64,
    /// Which links touch.
    pub pairs: PairTable,
}

/// What a hand, or a robot that may be one, is like.
#[derive(Debug, Clone)]
pub struct Inspection {
    /// Links and joints, as read.
    pub tree: Arc<Robot>,
    /// The robot.
    pub robot: RobotInspection,
    /// The hand with what is said about it, or why the robot is no hand.
    pub hand: Result<(Hand, HandInspection), InputError>,
    /// Files read.
    pub inputs: Vec<LoadedInput>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Inspects the hand file or URDF at `path`. Errors: a file that cannot be read as a robot.
pub fn inspect(
    path: &Path,
    options: &LoadOptions,
    settings: &InspectSettings,
    rng: &mut Rng,
) -> Result<Inspection, InputError> {
    match load_hand(path, options) {
        Ok(loaded) => {
            let mut robot = inspect_robot(&loaded.hand.robot, path);
            // Joints that follow other fingers are coordinates of the hand, but they follow all the same.
            for tie in &loaded.hand.ties {
                robot.joints[tie.follower.0].follows = Some(Follows::new(&loaded.hand.robot, &tie.coupling));
            }
            let table = inspect_hand(&loaded.hand, settings, rng);
            let tree = loaded.hand.robot.clone();
            Ok(Inspection { tree, robot, hand: Ok((loaded.hand, table)), inputs: loaded.inputs, notes: loaded.notes })
        }
        Err(no_hand) => {
            // A hand file without a hand has nothing else to show; a URDF may still be a robot.
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
                return Err(no_hand);
            }
            let loaded = load_robot(path, options)?;
            let robot = inspect_robot(&loaded.robot, path);
            let tree = Arc::new(loaded.robot);
            Ok(Inspection { tree, robot, hand: Err(no_hand), inputs: loaded.inputs, notes: loaded.notes })
        }
    }
}

/// Fingers, span and touching links of `hand`.
pub fn inspect_hand(hand: &Hand, settings: &InspectSettings, rng: &mut Rng) -> HandInspection {
    let name = |link: LinkId| hand.robot.links[link.0].name.clone();
    let fingers = hand
        .fingers
        .iter()
        .map(|finger| FingerRow {
            name: finger.name.clone(),
            joints: finger.chain.names.clone(),
            tip_link: name(finger.tip.link),
            tip_shape: match finger.tip.shape {
                TipShape::Sphere { .. } => "sphere",
                TipShape::Point => "point",
                TipShape::Ellipsoid(_) => "ellipsoid",
                TipShape::Hull { .. } => "mesh",
            },
            tip_radius: finger.tip.radius(),
            tip_center_in_body: finger.tip.center_in_body.coords.into(),
            tip: tip_report(hand, finger),
            rest: finger.rest.clone(),
        })
        .collect();
    let mut palm: Vec<String> = hand.palm.iter().map(|shape| name(shape.link)).collect();
    palm.dedup();
    HandInspection {
        base: name(hand.base),
        fingers,
        palm,
        span: span(hand),
        pairs: count_touching(hand, settings.n_postures, rng),
    }
}

/// Largest distance between two joint origins or tip centres of `hand` at rest, in metres.
pub fn span(hand: &Hand) -> f64 {
    let mut points = Vec::new();
    let mut poses = Vec::new();
    for finger in &hand.fingers {
        finger.chain.forward(&finger.rest, &mut poses);
        points.extend(poses.iter().map(|pose| pose.translation.vector));
        points.push(finger.chain.tip(&finger.rest, &finger.tip.center_in_body).coords);
    }
    let farthest = |from: &regrasp_geometry::Vector| points.iter().map(|p| (p - from).norm()).fold(0.0, f64::max);
    points.iter().map(farthest).fold(0.0, f64::max)
}

fn count_touching(hand: &Hand, n_postures: usize, rng: &mut Rng) -> PairTable {
    let touch = touch::Touch::new(hand);
    let counts = touch.count(n_postures, rng);
    let names = |(a, b): (LinkId, LinkId)| [a, b].map(|link| hand.robot.links[link.0].name.clone());
    let rest: Vec<Vec<f64>> = hand.fingers.iter().map(|finger| finger.rest.clone()).collect();
    let at_rest = touch.touching(&rest);
    let mut table = PairTable {
        n_postures,
        always: Vec::new(),
        sometimes: Vec::new(),
        never: Vec::new(),
        at_rest: touch.pairs.iter().zip(at_rest).filter(|(_, touches)| *touches).map(|(&p, _)| names(p)).collect(),
        always_ids: BTreeSet::new(),
    };
    for (&pair, &count) in touch.pairs.iter().zip(&counts) {
        match count {
            0 => table.never.push(names(pair)),
            n if n == n_postures => {
                table.always.push(names(pair));
                table.always_ids.insert(pair);
            }
            n => table.sometimes.push(PairRow { links: names(pair), share: n as f64 / n_postures as f64 }),
        }
    }
    table
}
