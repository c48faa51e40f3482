//! The triangles of a polyhedron, sorted into pieces with boxes around them, so that those near a point are found without
//! looking at all of them. The answers are those of looking at all; the planner's trees have no part in this.

use regrasp_geometry::{Point, Shape, Vector};

/// Triangles per piece of surface, on the mean.
const PER_PIECE: f64 = 64.0;
/// Most cells along an axis.
const MOST_CELLS: f64 = 256.0;

/// A surface made of triangles, in pieces.
#[derive(Debug)]
pub struct Pieces<'a> {
    vertices: &'a [Point],
    triangles: &'a [[u32; 3]],
    /// Numbers of triangles, piece after piece.
    order: Vec<u32>,
    pieces: Vec<Piece>,
    /// 1 where triangles are wound counter-clockwise seen from outside, else -1.
    outward: f64,
}

/// Triangles of one cell of a grid, by their middles, and the box that holds them whole.
#[derive(Debug)]
struct Piece {
    low: Point,
    high: Point,
    range: std::ops::Range<usize>,
}

impl<'a> Pieces<'a> {
    /// The triangles of a hull or mesh; None for primitives.
    pub fn of(shape: &'a Shape) -> Option<Self> {
        match shape {
            Shape::Convex(hull) => Some(Pieces::new(hull.vertices(), hull.triangles())),
            Shape::Mesh(mesh) => Some(Pieces::new(mesh.vertices(), mesh.triangles())),
            _ => None,
        }
    }

    fn new(vertices: &'a [Point], triangles: &'a [[u32; 3]]) -> Self {
        let middle = |corners: &[u32; 3]| corners.iter().map(|&i| vertices[i as usize].coords).sum::<Vector>() / 3.0;
        let infinity = Vector::repeat(f64::INFINITY);
        let (low, high) = triangles.iter().map(middle).fold((infinity, -infinity), |(l, h), p| (l.inf(&p), h.sup(&p)));
        // A surface meets about as many cells of a grid as a face of it has.
        let n_cells = (triangles.len() as f64 / PER_PIECE).sqrt().ceil().clamp(1.0, MOST_CELLS);
        let size = (high - low).map(|extent| (extent / n_cells).max(f64::MIN_POSITIVE));
        let cell = |corners: &[u32; 3]| {
            let at = (middle(corners) - low).component_div(&size).map(|x| x.clamp(0.0, n_cells - 1.0) as u32);
            (at.x * n_cells as u32 + at.y) * n_cells as u32 + at.z
        };
        let cells: Vec<u32> = triangles.iter().map(cell).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (cells[i as usize], i));
        let mut pieces = Vec::new();
        let mut start = 0;
        for members in order.chunk_by(|&a, &b| cells[a as usize] == cells[b as usize]) {
            let corners = members.iter().flat_map(|&i| triangles[i as usize]).map(|i| vertices[i as usize]);
            let (low, high) = corners.fold((infinity, -infinity), |(l, h), p| (l.inf(&p.coords), h.sup(&p.coords)));
            pieces.push(Piece { low: low.into(), high: high.into(), range: start..start + members.len() });
            start += members.len();
        }
        let origin = vertices[0];
        let volume: f64 = triangles
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|i| vertices[i as usize] - origin);
                a.dot(&b.cross(&c))
            })
            .sum();
        Pieces { vertices, triangles, order, pieces, outward: if volume < 0.0 { -1.0 } else { 1.0 } }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Point; 3] {
        self.triangles[triangle].map(|i| self.vertices[i as usize])
    }

    /// Outward unit normal of a triangle.
    pub fn normal(&self, triangle: usize) -> Vector {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a)).normalize() * self.outward
    }

    /// Numbers of the triangles whose `distance` is within `slack` of the least, in order, and that least one. No triangle may be
    /// nearer to `point` than its distance says.
    pub fn nearest(&self, point: &Point, slack: f64, distance: impl Fn(&[Point; 3]) -> f64) -> (f64, Vec<usize>) {
        let bounds: Vec<f64> = self.pieces.iter().map(|piece| piece.bound(point)).collect();
        let mut best = f64::INFINITY;
        let mut near: Vec<(f64, usize)> = Vec::new();
        let mut look = |piece: &Piece, best: &mut f64| {
            for &triangle in &self.order[piece.range.clone()] {
                let seen = distance(&self.corners(triangle as usize));
                if seen <= *best + slack {
                    *best = best.min(seen);
                    near.push((seen, triangle as usize));
                }
            }
        };
        // The piece that comes nearest tells how near the others have to come.
        let Some(first) = (0..bounds.len()).min_by(|&a, &b| bounds[a].total_cmp(&bounds[b])) else {
            return (best, Vec::new());
        };
        look(&self.pieces[first], &mut best);
        for (index, piece) in self.pieces.iter().enumerate() {
            if index != first && bounds[index] <= best + slack {
                look(piece, &mut best);
            }
        }
        let mut found: Vec<usize> =
            near.into_iter().filter(|(seen, _)| *seen <= best + slack).map(|(_, triangle)| triangle).collect();
        found.sort_unstable();
        (best, found)
    }
}

impl Piece {
    /// No point of the piece is nearer than this.
    fn bound(&self, point: &Point) -> f64 {
        (self.low - point).sup(&(point - self.high)).sup(&Vector::zeros()).norm()
    }
}
