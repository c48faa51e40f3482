//! Robots with arms: their parts guessed, links that always or never touch, and robot files for them.

/// Arms, hands and common joints.
mod guess;
/// Robot files.
mod text;
/// Links that touch.
mod touch;

use super::drawn::{drawn_links, read_again};
use super::guess::{guess_hand, leave_out_what_blocks};
use super::{InspectSettings, PairTable};
use crate::hand::Hand;
use crate::import::assemble::assemble;
use crate::import::spec::{HandSpec, leave_geometry_out};
use crate::import::srdf::LoadedSrdf;
use crate::import::{LoadOptions, LoadedRobot, srdf::load_srdf};
use crate::robot::{LinkId, Robot};
pub use guess::{ArmGuess, HandGuess, RobotGuess, guess_robot};
use regrasp_base::{Diagnostic, InputError, Place, Rng};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
pub use text::{FileNames, robot_file_text};

/// A hand of a robot, and whether a hand file can be written for it.
#[derive(Debug, Clone)]
pub struct FoundHand {
    /// Where it is.
    pub guess: HandGuess,
    /// The hand, or why it is none.
    pub hand: Result<Hand, InputError>,
}

/// A robot with at least one arm.
#[derive(Debug, Clone)]
pub struct WholeRobot {
    /// The robot.
    pub robot: Arc<Robot>,
    /// Its parts.
    pub guess: RobotGuess,
    /// Its hands, in the order of [`RobotGuess::hands`].
    pub hands: Vec<FoundHand>,
    /// Which links touch, besides neighbours and the pairs of the SRDF.
    pub pairs: PairTable,
    /// The SRDF.
    pub srdf: Option<LoadedSrdf>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// The parts of `robot`, which was read from `file`. None for a robot without an arm.
///
/// Errors: an SRDF that cannot be read, limits of joints that leave no posture (`U143`).
pub fn inspect_whole(
    robot: Arc<Robot>,
    (file, srdf): (&Path, Option<&Path>),
    options: &LoadOptions,
    settings: &InspectSettings,
    rng: &mut Rng,
) -> Result<Option<WholeRobot>, InputError> {
    let srdf = srdf.map(|path| load_srdf(path, &robot, options)).transpose()?;
    let guess = guess_robot(&robot, srdf.as_ref().map(|loaded| &loaded.srdf));
    if guess.arms.is_empty() {
        return Ok(None);
    }
    let bases: Vec<LinkId> = guess.hands.iter().map(|hand| hand.base).collect();
    let drawn = drawn_links(&robot, &bases);
    let (robot, mut notes) = match drawn.is_empty() || bases.is_empty() {
        true => (robot, Vec::new()),
        false => {
            let loaded = LoadedRobot { robot: (*robot).clone(), inputs: Vec::new(), notes: Vec::new() };
            let LoadedRobot { robot, mut notes, .. } = read_again(loaded, &drawn, (file, options))?;
            // The others have been said.
            (Arc::new(robot), notes.pop().into_iter().collect())
        }
    };
    let guessed = |guess: &HandGuess| {
        let base = Some(robot.links[guess.base.0].name.clone());
        guess_hand(&robot, &LoadOptions { base, ..options.clone() }, file)
    };
    let mut specs: Vec<Result<HandSpec, InputError>> = guess.hands.iter().map(guessed).collect();
    let mut cleared = (*robot).clone();
    for spec in specs.iter_mut().flatten() {
        // With what the mount link carries rigidly, which is the arm's otherwise.
        let Ok((hand, _)) = assemble(&robot, spec, file) else { continue };
        notes.extend(leave_out_what_blocks(&robot, &hand, spec));
        leave_geometry_out(&mut cleared, spec.without_geometry.iter().copied());
    }
    let robot = Arc::new(cleared);
    let make = |guess: &HandGuess, spec: Result<HandSpec, InputError>| {
        let spec = spec?;
        // What the arm's mount link carries rigidly is the arm's.
        let spec = HandSpec { mount: Some(mount_of(&robot, guess)), ..spec };
        let (mut hand, _) = assemble(&robot, &spec, file)?;
        super::rest::bend_towards_palm(&mut hand);
        Ok(hand)
    };
    let hands = guess
        .hands
        .iter()
        .zip(specs)
        .map(|(guess, spec)| FoundHand { guess: guess.clone(), hand: make(guess, spec) })
        .collect();
    let allowed: BTreeSet<_> =
        srdf.iter().flat_map(|loaded| loaded.srdf.disabled_pairs.iter().map(|pair| pair.links)).collect();
    let pairs = touch::count(&robot, &allowed, settings.n_postures, rng).map_err(|no_posture| {
        Diagnostic::new("U143", Place::file(file), "the limits of joints that follow others leave no posture")
            .element("joint", &no_posture.joint)
            .expected("limits that overlap")
    })?;
    Ok(Some(WholeRobot { robot, guess, hands, pairs, srdf, notes }))
}

/// The link above the palm, which the hand does not own.
fn mount_of(robot: &Robot, hand: &HandGuess) -> crate::robot::LinkId {
    robot.links[hand.base.0].parent_joint.map_or(robot.root, |joint| robot.joints[joint.0].parent)
}
