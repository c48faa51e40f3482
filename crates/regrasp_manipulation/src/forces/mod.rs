//! Contact forces of the hand's fingers: what balances the object's weight within all limits.

/// Forces and torques along a plan.
pub mod along;
/// Forces of one grasp.
pub mod held;
/// What contact forces balance, and their limits.
pub mod limits;
