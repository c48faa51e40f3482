//! Changing one grasp into another.

/// One transfer and one change of grasp, in either order.
pub mod change;
/// Sequences of relocations from one grasp to another.
pub mod regrasp;
/// Moving fingers that are seldom free to move.
pub mod unlock;
