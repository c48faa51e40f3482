//! The methods: how a leg of a query is planned.

/// Attempts, one after the other or several at once.
pub mod attempts;
/// The baseline of Saut 2011.
pub mod classic;
/// How long configurations take.
pub mod duration;
/// A first try with more room.
pub mod first_try;
/// Two gait trees that grow until they meet.
pub mod gait;
/// Legs of a query, from way pose to way pose.
pub mod legs;
/// Random shortcuts.
pub mod shorten;
/// The method of Saut 2011.
pub mod visibility;
