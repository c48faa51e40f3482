//! What one attempt at a query has: scratch memory, random numbers, its share of the work, and why things failed.

/// Where the hand reaches.
pub mod accessible;
/// Narrow passages at the ends of a leg.
pub mod passage;
/// How long a finger's way is looked for.
pub mod patience;
/// Random poses of the object.
pub mod poses;
/// What letting a finger go was seen to come to.
pub mod release;
/// What all methods share.
pub mod search;
/// Why attempts failed.
pub mod tally;
