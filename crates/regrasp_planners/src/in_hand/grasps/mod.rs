//! Contacts that fingers could take, and the grasps that they make.

/// Contacts that a finger could take, and how far it could follow with them.
pub mod candidate;
/// Grasps at a given object pose.
pub mod choose;
/// Closure of every set of fingers over candidates.
pub mod closure_table;
/// Combinations of candidates: closure, release, worth.
pub mod combine;
/// Postures of free fingers.
pub mod free;
/// How freely grasps let the object go where it is wanted.
pub mod freedom;
/// Candidates gathered at one pose.
pub mod pool;
/// Random grasps.
pub mod sample;
