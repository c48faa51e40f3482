//! What a stage of building looks at, and what it finds.

use crate::in_hand::roadmap::graph::{Graph, Leg, Lists};
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::state::GraspState;

/// Where a sequence begins.
#[expect(clippy::large_enum_variant, reason = "a few at a time, short-lived")]
pub enum Origin {
    /// At a node.
    Node(u32),
    /// At a new grasp, at the place that was worked on.
    New(GraspState),
}

/// A sequence of motions that was found.
pub struct Found {
    /// Where it begins.
    pub origin: Origin,
    /// Its motions.
    pub legs: Vec<Leg>,
}

/// What a stage may look at of one place.
pub struct AtPlace<'g> {
    /// As the stage before left it.
    pub graph: &'g Graph,
    /// Index of the place.
    pub place: usize,
    /// Its object pose.
    pub pose: Pose,
    /// Nodes by place.
    pub nodes_at: &'g Lists,
}

impl AtPlace<'_> {
    /// Nodes at the place.
    pub fn nodes(&self) -> &[u32] {
        self.nodes_at.of(self.place)
    }
}
