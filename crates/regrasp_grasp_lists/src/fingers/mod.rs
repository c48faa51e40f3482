//! What is prepared of the fingers of a hand: workspaces as spheres, where these meet, and who touches first.

/// Where the workspaces meet, and who touches first.
mod meeting;
/// Workspaces as spheres.
mod spheres;

pub use meeting::{first_finger, meeting_point};
pub use spheres::{SphereLimits, Workspheres};
