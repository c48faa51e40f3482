//! Readers: URDF, SRDF, `package://` paths, hand files, robot files.
//!
//! Own readers over an XML and a TOML parser, because every message must name file, line, element, value and fix.
//! They read files that the caller names and files that those name, below allowed folders; no environment, no
//! subprocess, no network.
//!
//! Codes: U10x files and XML, U11x numbers and attributes, U12x joints, U13x the tree, U14x couplings, U15x geometry,
//! U16x SRDF, U2xx hand files and robot files, V001 numbers that are not finite.

/// A hand from a robot and the choice of its fingers.
pub(crate) mod assemble;
mod chain;
mod couplings;
/// What to write where a hand cannot be made.
mod fixes;
/// `hand.toml`, and hands guessed from a bare URDF.
pub mod hand_file;
pub(crate) mod hull_tip;
mod hulls;
/// Files held in memory.
pub mod kept;
mod names;
/// How files are read, and which were.
pub mod options;
/// Files of other forms where a URDF is expected.
mod other_form;
/// `package://` and relative paths, below allowed folders.
pub mod resolve;
/// `robot.toml`: models, arms and hands that make one manipulator.
pub mod robot_file;
/// Motors that several fingers share, held still.
pub(crate) mod shared_motors;
/// What a hand is to be made of.
pub(crate) mod spec;
/// SRDF: groups, end effectors, pairs of links that are not tested.
pub mod srdf;
/// Fingers that share a motor.
mod ties;
mod tip_split;
/// URDF.
pub mod urdf;
/// XML elements and attributes with their places.
pub(crate) mod xml;

pub use hand_file::{LoadedHand, load_hand};
pub use kept::KeptFiles;
pub use options::{LoadOptions, LoadedInput, OUT_OF_TIME};
pub use resolve::ResolveOptions;
pub use robot_file::{LoadedManipulator, load_manipulator};
pub use urdf::{LoadedRobot, load_robot};
