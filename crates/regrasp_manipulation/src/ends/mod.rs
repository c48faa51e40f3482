//! The poses of a query and the grasps that it gives: what is wrong with them is said before any search.

/// Object poses that no grasp can have.
pub mod blocked;
/// Which pose of the query.
pub mod end;
/// Given joints and contacts that nearly touch.
pub mod given;
/// The grasps that a query gives.
pub mod given_grasp;
/// Hands that are inside something.
pub mod inside;
/// The nearest valid start to an observed state.
pub mod project;
