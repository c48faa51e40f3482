//! Contacts spread over the object's surface, in trees of where the centre of a fingertip then is (Saut 2010, sec. IV-A.2).

use crate::kd_tree::KdTree;
use regrasp_base::Rng;
use regrasp_geometry::Point;
use regrasp_grasp::Contact;
use regrasp_grasp::list::score::inverse_curvature;
use regrasp_scene::Object;
use std::collections::BTreeMap;

/// Points that are drawn for each one that may be kept.
const DRAWS_PER_POINT: f64 = 12.0;
/// Most points that are drawn.
const MOST_DRAWS: f64 = 200_000.0;

/// A place where a fingertip can touch.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The contact.
    pub contact: Contact,
    /// Inverse curvature there, not normalised.
    pub flatness: f64,
}

/// Places where fingertips of one size can touch.
#[derive(Debug, Clone)]
pub struct SurfacePoints {
    /// The places; their order is random.
    pub places: Vec<Place>,
    /// Where the centre of the fingertip is at each.
    pub centers: KdTree,
    /// Least and largest inverse curvature.
    flatness: [f64; 2],
}

impl SurfacePoints {
    /// Places of `object` at about `step` from each other, for fingertips of this radius. A ball of `settle_radius` touches there
    /// and nowhere else.
    pub fn new(object: &Object, step: f64, tip_radius: f64, settle_radius: f64, seed: u64) -> Self {
        let mut rng = Rng::keyed(seed, "surface points", 0);
        let surface = &object.surface;
        let n_draws = (DRAWS_PER_POINT * surface.area() / (step * step)).clamp(200.0, MOST_DRAWS) as usize;
        let mut kept = Sparse::new(step);
        let mut places = Vec::new();
        for _ in 0..n_draws {
            let drawn = surface.sample(&mut rng);
            if !kept.has_room(&drawn.point_in_object) || surface.crease_distance(&drawn) < object.edge_distance {
                continue;
            }
            let Some(at) = surface.settle(&drawn, settle_radius) else { continue };
            if !kept.has_room(&at.point_in_object) || surface.crease_distance(&at) < object.edge_distance {
                continue;
            }
            kept.add(&at.point_in_object);
            let contact = Contact { point_in_object: at.point_in_object, normal_in_object: at.normal_in_object };
            places.push(Place { contact, flatness: inverse_curvature(surface.curvature(&at), tip_radius) });
        }
        let flatness = places.iter().map(|place: &Place| place.flatness);
        let flatness = flatness.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let center =
            |place: &Place| place.contact.point_in_object + place.contact.normal_in_object.into_inner() * tip_radius;
        let centers: Vec<Point> = places.iter().map(center).collect();
        SurfacePoints { centers: KdTree::new(&centers), places, flatness }
    }

    /// Inverse curvature normalised over the surface: 1 at its flattest place, 0 at its sharpest.
    pub fn normalised(&self, flatness: f64) -> f64 {
        let [low, high] = self.flatness;
        if high - low > 1e-9 { ((flatness - low) / (high - low)).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// Points that keep a distance from each other, in cells of that size.
struct Sparse {
    step: f64,
    cells: BTreeMap<[i64; 3], Vec<Point>>,
}

impl Sparse {
    fn new(step: f64) -> Self {
        Sparse { step, cells: BTreeMap::new() }
    }

    fn cell(&self, point: &Point) -> [i64; 3] {
        std::array::from_fn(|k| (point[k] / self.step).floor() as i64)
    }

    fn has_room(&self, point: &Point) -> bool {
        let [i, j, k] = self.cell(point);
        let near = (0..27).filter_map(|n| self.cells.get(&[i + n / 9 - 1, j + n / 3 % 3 - 1, k + n % 3 - 1]));
        !near.flatten().any(|other| (other - point).norm_squared() < self.step * self.step)
    }

    fn add(&mut self, point: &Point) {
        self.cells.entry(self.cell(point)).or_default().push(*point);
    }
}
