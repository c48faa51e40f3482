//! A fingertip in contact keeps to the surface.

use super::Workspace;
use regrasp_geometry::Vector;
use regrasp_geometry::collision::{HalfSpace, gap_along};

impl Workspace<'_> {
    /// Proves that a tip in contact presses into the object by no more than the allowance, along the contact normal.
    pub(super) fn tip_is_clear(&mut self, index: usize, finger: usize, normal_in_world: Option<Vector>) -> bool {
        let pair = self.pairs[index];
        let (tip, object) = (&self.model.bodies[pair.a], &self.model.bodies[pair.b]);
        self.slack[index] = f64::NEG_INFINITY;
        let allowed = self.model.settings.contact_allowance - self.deviation[pair.a] - self.deviation[pair.b];
        for configuration in &[&self.now, &self.next][usize::from(self.stands)..] {
            let (at_tip, at_object) = (&configuration.placements[pair.a], &configuration.placements[pair.b]);
            let normal = normal_in_world.unwrap_or_else(|| at_object.vector(&self.contacts[finger].normal_in_object));
            // The gap along the inward normal, from tip to object.
            let inward = -normal;
            let gap = gap_along(&inward, &tip.shape, at_tip, &object.shape, at_object, &mut self.hints[index]);
            if gap >= -allowed {
                continue;
            }
            let Some(tree) = &object.tree_for_tips else { return false };
            let object_from_tip = at_object.inverse_then(at_tip);
            let normal_in_object = at_object.vector_to_child(&normal);
            let in_tip = object_from_tip.vector_to_child(&-normal_in_object);
            let lowest = normal_in_object.dot(&object_from_tip.translation)
                - regrasp_geometry::collision::support::support_value(&tip.shape, &in_tip, &mut self.hints[index][0]);
            let below = HalfSpace { normal: normal_in_object, level: lowest + allowed };
            let bounds = (&tip.center, tip.radius);
            let is_apart = tree.meets_only_below(&tip.shape, bounds, &object_from_tip, &below);
            // What it may press into lies below; where it is thicker than that, it must not be inside with all of the rest.
            let middle = object_from_tip.point(&tip.middle);
            let is_thick = normal_in_object.dot(&middle.coords) - lowest > allowed;
            if !is_apart || self.stands && is_thick && tree.holds(&middle) {
                return false;
            }
        }
        true
    }
}
