//! The direction that last separated a pair: near the object it turns with it.

use crate::workspace::Workspace;
use regrasp_geometry::Vector;

impl Workspace<'_> {
    /// The direction that last separated the pair, in the world; in the middle of the step where it turns with the object.
    #[inline]
    pub(super) fn last_direction(&self, index: usize) -> Vector {
        let direction = self.directions[index];
        match self.turns_with(index) {
            Some(body) if direction != Vector::zeros() => {
                let [now, next] = [&self.now, &self.next].map(|end| end.placements[body].vector(&direction));
                (now + next).try_normalize(1e-6).unwrap_or(next)
            }
            _ => direction,
        }
    }

    /// What is stored of a direction in the world that separates the pair at `next`.
    #[inline]
    pub(super) fn to_keep(&self, index: usize, direction: &Vector) -> Vector {
        match self.turns_with(index) {
            Some(body) => self.next.placements[body].vector_to_child(direction),
            None => *direction,
        }
    }

    /// The object, where it is one of the pair.
    #[inline]
    fn turns_with(&self, index: usize) -> Option<usize> {
        let (pair, object) = (self.pairs[index], self.model.object);
        (pair.a == object || pair.b == object).then_some(object)
    }
}
