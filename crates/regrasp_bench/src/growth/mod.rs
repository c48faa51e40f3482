//! Growth curves: how loading and planning grow with fingers, triangles, obstacles and threads. The scenes of a curve differ
//! in one size only; code writes them as scene files that any command reads.

mod ellipsoid;
mod hand;
mod measure;
mod obstacles;
mod rows;
mod scenes;
mod section;

pub use measure::{Cost, batch, timed_load};
pub use rows::{GrowthRow, header, is_growth, line, read};
pub use scenes::write_scene;
pub use section::{pictures, section, table};

/// What grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Curve {
    /// Fingers of the hand, all of them soft; a sphere and a box.
    Fingers,
    /// Triangles of one ellipsoid.
    Triangles,
    /// Obstacles around hand and object.
    Obstacles,
    /// Queries planned at the same time.
    Threads,
}

/// A scene of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Point {
    /// Curve.
    pub curve: Curve,
    /// Object, by its name.
    pub object: &'static str,
    /// Place on the curve: fingers, triangles, obstacles or threads.
    pub size: u64,
}

impl Curve {
    /// All of them, in the order of the page.
    pub const ALL: [Curve; 4] = [Curve::Fingers, Curve::Triangles, Curve::Obstacles, Curve::Threads];

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Curve::Fingers => "fingers",
            Curve::Triangles => "triangles",
            Curve::Obstacles => "obstacles",
            Curve::Threads => "threads",
        }
    }

    /// The curve called `name`.
    pub fn named(name: &str) -> Option<Curve> {
        Curve::ALL.into_iter().find(|curve| curve.name() == name)
    }

    /// Its sizes, smallest first.
    pub const fn sizes(self) -> &'static [u64] {
        match self {
            Curve::Fingers => &[3, 4, 5, 6],
            Curve::Triangles => &[100, 1_000, 10_000, 100_000, 1_000_000],
            Curve::Obstacles => &[1, 10, 100, 1_000],
            Curve::Threads => &[1, 2, 4, 8],
        }
    }

    /// Its objects.
    pub const fn objects(self) -> &'static [&'static str] {
        match self {
            Curve::Fingers => &["sphere", "box"],
            Curve::Triangles => &["ellipsoid"],
            Curve::Obstacles | Curve::Threads => &["box"],
        }
    }

    /// The size that times are compared with.
    const fn reference(self) -> u64 {
        match self {
            Curve::Fingers => 4,
            Curve::Triangles => 10_000,
            Curve::Obstacles | Curve::Threads => 1,
        }
    }

    /// Its scenes of at most `up_to`, object by object.
    pub fn points(self, up_to: u64) -> Vec<Point> {
        let of = |&object: &'static &'static str| {
            let sizes = self.sizes().iter().copied().filter(move |&size| size <= up_to);
            sizes.map(move |size| Point { curve: self, object, size })
        };
        self.objects().iter().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back_and_points_end_where_asked() {
        for curve in Curve::ALL {
            assert_eq!(Curve::named(curve.name()), Some(curve));
            assert!(curve.sizes().is_sorted() && curve.sizes().contains(&curve.reference()));
        }
        assert_eq!(Curve::named("legs"), None);
        let points: Vec<_> = Curve::Fingers.points(4).iter().map(|point| (point.object, point.size)).collect();
        assert_eq!(points, [("sphere", 3), ("sphere", 4), ("box", 3), ("box", 4)]);
        assert!(Curve::Triangles.points(99).is_empty());
    }
}
