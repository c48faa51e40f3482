//! What stands around the robot: obstacles as balls see them.

/// A tree of boxes over many obstacles.
mod tree;

use crate::lanes::{F8, LANES, V8, minus, squared};
use nalgebra::Matrix3;
use regrasp_geometry::collision::{MeshTree, Placed, Placement, Separation, separation};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use std::sync::Arc;

pub use tree::BoxTree;

/// An obstacle at rest.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// Name.
    pub name: String,
    /// Its shape in the world.
    pub placed: PlacedShape,
}

/// A box that may be turned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnedBox {
    center: [f32; 3],
    /// Directions of its edges.
    axes: [[f32; 3]; 3],
    half: [f32; 3],
}

/// An obstacle in single precision.
#[derive(Debug, Clone)]
pub(crate) enum Item {
    Cuboid(TurnedBox),
    Cylinder {
        center: [f32; 3],
        axis: [f32; 3],
        half_length: f32,
        radius: f32,
    },
    /// A ball where the half length is zero.
    Capsule {
        center: [f32; 3],
        axis: [f32; 3],
        half_length: f32,
        radius: f32,
    },
    /// Any other shape: a box about it, then distances in double precision.
    Other {
        bound: TurnedBox,
        exact: Arc<ExactShape>,
    },
}

/// A shape for distances in double precision.
#[derive(Debug, Clone)]
pub struct ExactShape {
    /// The shape.
    pub shape: Shape,
    /// Where it is.
    pub world_from_shape: Placement,
    /// The triangles of a mesh.
    pub tree: Option<Arc<MeshTree>>,
}

impl ExactShape {
    /// A shape and where it is.
    pub fn new(placed: &PlacedShape) -> Self {
        let tree = match &placed.shape {
            Shape::Mesh(mesh) => Some(Arc::new(MeshTree::new(mesh))),
            _ => None,
        };
        ExactShape { shape: placed.shape.clone(), world_from_shape: (&placed.parent_from_shape).into(), tree }
    }

    /// True where the convex `shape` at `at` is proved to be farther away than `required`, in metres.
    pub fn is_apart(&self, shape: &Shape, at: &Placement, required: f64) -> bool {
        match &self.tree {
            Some(tree) => {
                let here = self.world_from_shape.inverse_then(at);
                tree.is_outside(shape, &shape.middle(), &here, required.max(1e-12), &mut 0.0)
            }
            None => {
                let found = separation(
                    Placed { shape, at },
                    Placed { shape: &self.shape, at: &self.world_from_shape },
                    required.max(1e-12),
                    required.max(1e-12),
                    &mut Vector::zeros(),
                    &mut [0; 2],
                );
                matches!(found, Separation::SeparatedBy(_))
            }
        }
    }
}

#[inline(always)]
fn dot(v: &V8, u: &[f32; 3]) -> F8 {
    v[0] * u[0] + v[1] * u[1] + v[2] * u[2]
}

#[inline(always)]
fn from(p: &V8, center: &[f32; 3]) -> V8 {
    [p[0] - center[0], p[1] - center[1], p[2] - center[2]]
}

impl TurnedBox {
    /// Squares of the distances of eight points.
    #[inline(always)]
    fn squared_distance(&self, p: &V8) -> F8 {
        let d = from(p, &self.center);
        let mut sum = F8::ZERO;
        for k in 0..3 {
            let outside = (dot(&d, &self.axes[k]).abs() - self.half[k]).max(F8::ZERO);
            sum = sum + outside * outside;
        }
        sum
    }
}

impl Item {
    fn new(placed: &PlacedShape, exact: &Arc<ExactShape>) -> Self {
        let rotation = *placed.parent_from_shape.rotation.to_rotation_matrix().matrix();
        let single = |v: Vector| [v.x as f32, v.y as f32, v.z as f32];
        let column = |k: usize| single(rotation.column(k).into_owned());
        let (center, axis) = (single(placed.parent_from_shape.translation.vector), column(2));
        let turned = |middle: Vector, half: Vector| TurnedBox {
            center: single(placed.parent_from_shape.translation.vector + rotation * middle),
            axes: [column(0), column(1), column(2)],
            half: single(half),
        };
        match &placed.shape {
            Shape::Sphere { radius } => Item::Capsule { center, axis, half_length: 0.0, radius: *radius as f32 },
            Shape::Capsule { half_length, radius } => {
                Item::Capsule { center, axis, half_length: *half_length as f32, radius: *radius as f32 }
            }
            Shape::Cuboid { half_extents } => Item::Cuboid(turned(Vector::zeros(), *half_extents)),
            Shape::Cylinder { half_length, radius } => {
                Item::Cylinder { center, axis, half_length: *half_length as f32, radius: *radius as f32 }
            }
            other => {
                let (low, high) = other.bounds();
                let bound = turned(nalgebra::center(&low, &high).coords, (high - low) * 0.5);
                Item::Other { bound, exact: exact.clone() }
            }
        }
    }

    /// For eight balls: positive where the ball of radius `reach` about `p` meets the obstacle (squares of radius less distance).
    /// Of [`Item::Other`] it is the box about it.
    #[inline(always)]
    pub(crate) fn overlap(&self, p: &V8, reach: F8) -> F8 {
        match self {
            Item::Cuboid(turned) => reach * reach - turned.squared_distance(p),
            Item::Cylinder { center, axis, half_length, radius } => {
                let d = from(p, center);
                let along = dot(&d, axis);
                let across = (squared(&d) - along * along).max(F8::ZERO).sqrt();
                let (end, side) = ((along.abs() - *half_length).max(F8::ZERO), (across - *radius).max(F8::ZERO));
                reach * reach - (end * end + side * side)
            }
            Item::Capsule { center, axis, half_length, radius } => {
                let d = from(p, center);
                let along = dot(&d, axis).max(F8::splat(-*half_length)).min(F8::splat(*half_length));
                let off = [d[0] - along * axis[0], d[1] - along * axis[1], d[2] - along * axis[2]];
                let reach = reach + *radius;
                reach * reach - squared(&off)
            }
            Item::Other { bound, .. } => reach * reach - bound.squared_distance(p),
        }
    }

    /// For eight balls of which the box about [`Item::Other`] is met (`overlap`): the same for the shape itself, in double
    /// precision. What is not decided counts as met.
    #[inline(never)]
    pub(crate) fn refined(exact: &ExactShape, p: &V8, reach: F8, overlap: F8) -> F8 {
        let mut out = overlap;
        for l in 0..LANES {
            if overlap.0[l] > 0.0 {
                let center = Vector::new(f64::from(p[0].0[l]), f64::from(p[1].0[l]), f64::from(p[2].0[l]));
                let at = Placement { rotation: Matrix3::identity(), translation: center };
                let ball = Shape::Sphere { radius: f64::from(reach.0[l]).max(1e-9) };
                if exact.is_apart(&ball, &at, 0.0) {
                    out.0[l] = -1.0;
                }
            }
        }
        out
    }
}

/// Obstacles at rest, made ready for collision tests.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// The obstacles.
    pub obstacles: Vec<Obstacle>,
    pub(crate) items: Vec<Item>,
    /// Shapes for the last test, by obstacle.
    pub(crate) exact: Vec<Arc<ExactShape>>,
    /// Boxes about eight obstacles: lowest and highest corners.
    boxes: Vec<[F8; 6]>,
    tree: Option<BoxTree>,
}

/// Fewer obstacles than this are looked at in a row.
const FEW: usize = 64;

impl World {
    /// True where the convex `shape` at `at` is proved to be farther than `required` from an obstacle, by its index.
    pub fn is_apart(&self, obstacle: usize, shape: &Shape, at: &Placement, required: f64) -> bool {
        self.exact[obstacle].is_apart(shape, at, required)
    }

    /// True where the ball about `center` is proved to meet no obstacle.
    pub fn is_ball_free(&self, center: &Point, radius: f64) -> bool {
        let at = Placement { rotation: Matrix3::identity(), translation: center.coords };
        let ball = Shape::Sphere { radius };
        (0..self.exact.len()).all(|obstacle| self.is_apart(obstacle, &ball, &at, 0.0))
    }

    /// The same world with the obstacles of another one, whose shapes are given the pose `world_from_shape`.
    #[must_use]
    pub fn with(&self, other: &World, world_from_shape: &Pose) -> Self {
        let mut obstacles = self.obstacles.clone();
        let mut exact = self.exact.clone();
        for (obstacle, shape) in other.obstacles.iter().zip(&other.exact) {
            let placed = PlacedShape { parent_from_shape: *world_from_shape, shape: obstacle.placed.shape.clone() };
            obstacles.push(Obstacle { name: obstacle.name.clone(), placed });
            exact.push(Arc::new(ExactShape { world_from_shape: world_from_shape.into(), ..ExactShape::clone(shape) }));
        }
        World::of(obstacles, exact)
    }

    /// The same world without the obstacles with these indices.
    #[must_use]
    pub fn without(&self, left_out: &[usize]) -> Self {
        let kept = || (0..self.obstacles.len()).filter(|index| !left_out.contains(index));
        let obstacles = kept().map(|index| self.obstacles[index].clone()).collect();
        World::of(obstacles, kept().map(|index| self.exact[index].clone()).collect())
    }

    /// The world of these obstacles.
    pub fn new(obstacles: Vec<Obstacle>) -> Self {
        let exact = obstacles.iter().map(|obstacle| Arc::new(ExactShape::new(&obstacle.placed))).collect();
        World::of(obstacles, exact)
    }

    fn of(obstacles: Vec<Obstacle>, exact: Vec<Arc<ExactShape>>) -> Self {
        let items: Vec<Item> =
            obstacles.iter().zip(&exact).map(|(obstacle, exact)| Item::new(&obstacle.placed, exact)).collect();
        let corners: Vec<[[f32; 3]; 2]> = obstacles.iter().map(|obstacle| box_about(&obstacle.placed)).collect();
        let tree = (obstacles.len() >= FEW).then(|| BoxTree::new(&corners));
        let block = |of_block: &[[[f32; 3]; 2]]| {
            // A box that nothing meets.
            let mut block = [F8::splat(f32::INFINITY); 6];
            for (l, [low, high]) in of_block.iter().enumerate() {
                for k in 0..3 {
                    block[k].0[l] = low[k];
                    block[3 + k].0[l] = high[k];
                }
            }
            block
        };
        let boxes = corners.chunks(LANES).map(block).collect();
        World { obstacles, items, exact, boxes, tree }
    }

    /// Indices of at least all obstacles that meet the box from `low` to `high`, in rising order, in place of `found`.
    #[inline(always)]
    pub(crate) fn near(&self, low: [f32; 3], high: [f32; 3], found: &mut Vec<u32>) {
        found.clear();
        if let Some(tree) = &self.tree {
            tree.meets(low, high, found);
            return;
        }
        for (index, block) in self.boxes.iter().enumerate() {
            let mut gap = F8::splat(f32::NEG_INFINITY);
            for k in 0..3 {
                let (below, above) = (F8::splat(low[k]) - block[3 + k], block[k] - high[k]);
                gap = gap.max(below).max(above);
            }
            let mut bits = !gap.positive();
            while bits != 0 {
                let item = (index * LANES) as u32 + bits.trailing_zeros();
                bits &= bits - 1;
                found.push(item);
            }
        }
    }
}

/// The box along the world's axes about a placed shape, rounded outwards.
fn box_about(placed: &PlacedShape) -> [[f32; 3]; 2] {
    let (low, high) = placed.shape.bounds();
    let center: Point = placed.parent_from_shape * nalgebra::center(&low, &high);
    let rotation = placed.parent_from_shape.rotation.to_rotation_matrix();
    let half = rotation.matrix().abs() * ((high - low) * 0.5);
    let corner = |sign: f64| {
        let corner = center.coords + half * sign + Vector::repeat(sign * 1e-6);
        [corner.x as f32, corner.y as f32, corner.z as f32]
    };
    [corner(-1.0), corner(1.0)]
}

/// Positive where two balls meet, in each of eight configurations.
#[inline(always)]
pub(crate) fn ball_overlap(a: &V8, b: &V8, reach: F8) -> F8 {
    reach * reach - squared(&minus(a, b))
}
