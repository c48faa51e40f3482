//! What a space must answer, the only generic seam of the search.

use regrasp_base::Rng;

/// A space in which roadmaps are built.
///
/// `&mut self` lets a space keep scratch memory and statistics; answers must depend on the arguments only.
pub trait Space {
    /// A valid point.
    type Point: Clone;
    /// A valid motion between two points.
    type Motion: Clone;

    /// A valid point at random; none when the draw was invalid.
    fn sample(&mut self, rng: &mut Rng) -> Option<Self::Point>;

    /// Distance of two points: which neighbours are tried first.
    fn distance(&self, a: &Self::Point, b: &Self::Point) -> f64;

    /// A valid motion from `a` to `b`, which can be gone both ways; none when there is no simple one.
    fn connect(&mut self, a: &Self::Point, b: &Self::Point) -> Option<Self::Motion>;
}
