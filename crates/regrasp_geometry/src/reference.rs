//! Distance and penetration by parry: the checker's second way of knowing. Nothing else in the workspace sees parry.
//!
//! parry's GJK proposes, a separating plane decides: a pair is called separated only by the width of the slab between
//! two parallel planes that the support functions of both shapes confirm (Boyd, Vandenberghe 2004, 8.2). GJK stopping
//! early, a wrong witness or a NaN therefore end as `Clearance::Unresolved`, never as a clearance. Balls and capsules are
//! a point and a segment with a margin, so that shallow contact of round fingertips needs no EPA. A mesh is a solid: what
//! touches no triangle may be inside (`inside.rs`).

use crate::frame::{Point, Pose};
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
pub use inside::Inside;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose as ParryPose, Rotation as ParryRotation, Vector as ParryVector};
use parry3d_f64::query::PointQuery;
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::{self, CsoPoint, GJKResult, VoronoiSimplex};
use parry3d_f64::shape::{ConvexPolyhedron, SupportMap, TriMesh, TriMeshFlags};
use polyhedron::Polyhedron;
use std::cell::Cell;

mod inside;
mod polyhedron;
#[cfg(test)]
mod tests;

/// Distances below this, in m, are always computed, even when less is asked for.
const SMALLEST_MAX: f64 = 1e-6;

/// Penetration, in m, that is looked at a second time.
const SHALLOW: f64 = 1e-5;

/// Shapes farther apart than this, in m, are as far apart as their bounding balls: squares of larger lengths overflow in GJK.
const FAR: f64 = 1e6;

/// Lengths, in m, and parts of rotations below this count as zero.
const TINY: f64 = 1e-100;

/// Steps that widen a slab.
const MAX_STEPS: usize = 40;

/// What is known about two shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clearance {
    /// At least this far apart, in m, above zero. Proven by a separating plane.
    SeparatedBy(f64),
    /// They share points, or are too near to tell; the depth in m, at least zero, is parry's estimate, or, where that fails, the
    /// overlap along some axis, which is no smaller (of one triangle for meshes).
    Penetrating(f64),
    /// Not decided: counts as a collision.
    Unresolved,
}

/// Why a shape cannot be prepared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// parry refuses the polyhedron or mesh.
    #[error("parry cannot use the {kind}: {reason}")]
    Refused {
        /// Kind of shape.
        kind: &'static str,
        /// What it says.
        reason: String,
    },
}

/// A shape prepared for queries.
#[derive(Clone)]
pub struct ReferenceShape {
    body: PreparedShape,
    center: Point,
    radius: f64,
}

#[derive(Clone)]
enum PreparedShape {
    Convex(Convex),
    Mesh(Box<MeshBody>),
}

/// All points within `margin` of a core.
#[derive(Clone)]
struct Convex {
    core: Core,
    margin: f64,
    /// Some point of the core.
    middle: ParryVector,
}

impl Convex {
    fn new(core: Core, margin: f64) -> Self {
        let middle = match &core {
            Core::Point(point) => *point,
            Core::Triangle([a, b, c]) => (*a + *b + *c) / 3.0,
            Core::Polyhedron(polyhedron) => {
                let points = polyhedron.points();
                points.iter().fold(ParryVector::ZERO, |sum, point| sum + *point) / points.len() as f64
            }
            Core::Segment { .. } | Core::Box { .. } | Core::Cylinder { .. } | Core::Ellipsoid { .. } => {
                ParryVector::ZERO
            }
        };
        Convex { core, margin, middle }
    }
}

#[derive(Clone)]
struct MeshBody {
    mesh: TriMesh,
    /// What touches no triangle may still be inside.
    inside: Inside,
    /// A vertex of each connected part.
    part_vertices: Vec<ParryVector>,
}

#[derive(Clone)]
enum Core {
    Point(ParryVector),
    Segment { half_length: f64 },
    Box { half_extents: ParryVector },
    Cylinder { half_length: f64, radius: f64 },
    Ellipsoid { radii: ParryVector },
    Polyhedron(Box<Polyhedron>),
    Triangle([ParryVector; 3]),
}

impl SupportMap for Core {
    fn local_support_point(&self, direction: ParryVector) -> ParryVector {
        match self {
            Core::Point(point) => *point,
            Core::Segment { half_length } => ParryVector::new(0.0, 0.0, half_length.copysign(direction.z)),
            Core::Box { half_extents: h } => {
                ParryVector::new(h.x.copysign(direction.x), h.y.copysign(direction.y), h.z.copysign(direction.z))
            }
            Core::Cylinder { half_length, radius } => {
                let across = direction.x.hypot(direction.y);
                let scale = if across > 0.0 { radius / across } else { 0.0 };
                ParryVector::new(direction.x * scale, direction.y * scale, half_length.copysign(direction.z))
            }
            Core::Ellipsoid { radii } => {
                let scaled = *radii * direction;
                let length = scaled.length();
                if length > 0.0 { *radii * scaled / length } else { ParryVector::new(radii.x, 0.0, 0.0) }
            }
            Core::Polyhedron(polyhedron) => polyhedron.local_support_point(direction),
            Core::Triangle([a, b, c]) => {
                let (x, y, z) = (a.dot(direction), b.dot(direction), c.dot(direction));
                if x >= y && x >= z {
                    *a
                } else if y >= z {
                    *b
                } else {
                    *c
                }
            }
        }
    }
}

impl ReferenceShape {
    /// Prepares `shape`. Errors when parry cannot use a polyhedron or mesh.
    pub fn new(shape: &Shape) -> Result<Self, ReferenceError> {
        let (center, radius) = shape.bounding_sphere();
        let convex = |core, margin| PreparedShape::Convex(Convex::new(core, margin));
        let body = match shape {
            Shape::Sphere { radius } => convex(Core::Point(ParryVector::ZERO), *radius),
            Shape::Capsule { half_length, radius } => convex(Core::Segment { half_length: *half_length }, *radius),
            Shape::Cuboid { half_extents: h } => {
                convex(Core::Box { half_extents: ParryVector::new(h.x, h.y, h.z) }, 0.0)
            }
            Shape::Cylinder { half_length, radius } => {
                convex(Core::Cylinder { half_length: *half_length, radius: *radius }, 0.0)
            }
            Shape::Ellipsoid { radii: r } => convex(Core::Ellipsoid { radii: ParryVector::new(r.x, r.y, r.z) }, 0.0),
            Shape::Convex(hull) => {
                let points = hull.vertices().iter().map(vector).collect();
                let polyhedron = ConvexPolyhedron::from_convex_mesh(points, hull.triangles()).ok_or_else(|| {
                    let reason = "it is not a closed convex polyhedron".to_owned();
                    ReferenceError::Refused { kind: shape.kind(), reason }
                })?;
                convex(Core::Polyhedron(Box::new(Polyhedron::new(polyhedron, hull.triangles()))), 0.0)
            }
            Shape::Mesh(mesh) => PreparedShape::Mesh(Box::new(MeshBody::new(mesh)?)),
        };
        Ok(ReferenceShape { body, center, radius })
    }
}

impl MeshBody {
    fn new(mesh: &TriangleMesh) -> Result<Self, ReferenceError> {
        let triangles = mesh.triangles().to_vec();
        let vertices: Vec<ParryVector> = mesh.vertices().iter().map(vector).collect();
        // One vertex per connected part, by union-find over vertices.
        let mut root: Vec<u32> = (0..vertices.len() as u32).collect();
        let find = |root: &mut Vec<u32>, mut i: u32| {
            while root[i as usize] != i {
                root[i as usize] = root[root[i as usize] as usize];
                i = root[i as usize];
            }
            i
        };
        for [a, b, c] in &triangles {
            for other in [b, c] {
                let (p, q) = (find(&mut root, *a), find(&mut root, *other));
                root[p.max(q) as usize] = p.min(q);
            }
        }
        let mut parts: Vec<u32> = triangles.iter().map(|corners| find(&mut root, corners[0])).collect();
        parts.sort_unstable();
        parts.dedup();
        let part_vertices = parts.iter().map(|&i| vertices[i as usize]).collect();
        let inside = Inside::of(mesh);
        let mesh = TriMesh::with_flags(vertices, triangles, TriMeshFlags::empty())
            .map_err(|error| ReferenceError::Refused { kind: "mesh", reason: error.to_string() })?;
        Ok(MeshBody { mesh, inside, part_vertices })
    }

    fn holds(&self, point: ParryVector) -> bool {
        self.mesh.local_aabb().contains_local_point(point) && self.inside.holds(&Point::new(point.x, point.y, point.z))
    }

    /// How deep `point` lies inside the solid; None outside.
    fn depth_of(&self, point: ParryVector) -> Option<f64> {
        self.holds(point).then(|| (self.mesh.project_local_point(point, false).point - point).length())
    }
}

/// How far apart the shapes are, where that is less than `max`; beyond it the answer is some lower bound of at least
/// `max`. Anything that is not finite gives [`Clearance::Unresolved`].
pub fn distance(
    a: &ReferenceShape,
    world_from_a: &Pose,
    b: &ReferenceShape,
    world_from_b: &Pose,
    max: f64,
) -> Clearance {
    let apart = (world_from_a * a.center - world_from_b * b.center).norm() - a.radius - b.radius;
    if !apart.is_finite() || max.is_nan() {
        return Clearance::Unresolved;
    }
    // The search for the nearest triangle starts at `max`: it must not be empty.
    let max = max.max(SMALLEST_MAX);
    // A rounding error of the bounding balls must not look like a clearance.
    let apart = apart - 1e-12 * (a.radius + b.radius + world_from_a.translation.vector.norm());
    if apart > max.min(FAR) {
        return Clearance::SeparatedBy(apart);
    }
    let mut relative = world_from_a.inv_mul(world_from_b);
    // Squares of such lengths are zero, and GJK divides by them.
    relative.translation.vector.apply(|x| *x = if x.abs() < TINY { 0.0 } else { *x });
    let turn = relative.rotation.coords.map(|x| if x.abs() < TINY { 0.0 } else { x });
    relative.rotation = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::from(turn));
    let a_from_b = parry_pose(&relative);
    if !a_from_b.is_finite() {
        return Clearance::Unresolved;
    }
    match (&a.body, &b.body) {
        (PreparedShape::Convex(a), PreparedShape::Convex(b)) => between_convex(a, b, &a_from_b, max),
        (PreparedShape::Mesh(a), PreparedShape::Convex(b)) => mesh_to_convex(a, b, &a_from_b, max),
        (PreparedShape::Convex(a), PreparedShape::Mesh(b)) => mesh_to_convex(b, a, &a_from_b.inverse(), max),
        (PreparedShape::Mesh(a), PreparedShape::Mesh(b)) => mesh_to_mesh(a, b, &a_from_b, max),
    }
}

/// Distance of `point_in_world` from the shape's surface in m, negative inside. NaN when it
/// cannot be told, which no comparison takes for a clearance.
pub fn point_distance(shape: &ReferenceShape, world_from_shape: &Pose, point_in_world: &Point) -> f64 {
    let point = vector(&world_from_shape.inverse_transform_point(point_in_world));
    if !point.is_finite() {
        return f64::NAN;
    }
    match &shape.body {
        PreparedShape::Mesh(body) => {
            let projection = body.mesh.project_local_point(point, false);
            let distance = (projection.point - point).length();
            if body.holds(point) { -distance } else { distance }
        }
        PreparedShape::Convex(convex) => {
            let to_core = match &convex.core {
                Core::Point(center) => (point - *center).length(),
                Core::Segment { half_length } => {
                    let along = point.z.clamp(-half_length, *half_length);
                    (point - ParryVector::new(0.0, 0.0, along)).length()
                }
                Core::Box { half_extents } => {
                    parry3d_f64::shape::Cuboid::new(*half_extents).distance_to_local_point(point, false)
                }
                // parry's cylinder stands along y.
                Core::Cylinder { half_length, radius } => parry3d_f64::shape::Cylinder::new(*half_length, *radius)
                    .distance_to_local_point(ParryVector::new(point.x, point.z, point.y), false),
                core => {
                    let ball = Convex::new(Core::Point(point), 0.0);
                    let shape = Convex::new(core.clone(), 0.0);
                    match between_convex(&shape, &ball, &ParryPose::IDENTITY, f64::MAX) {
                        Clearance::SeparatedBy(distance) => distance,
                        Clearance::Penetrating(depth) => -depth,
                        Clearance::Unresolved => f64::NAN,
                    }
                }
            };
            to_core - convex.margin
        }
    }
}

/// GJK on the cores, its axis confirmed by both supports; EPA when the cores meet.
fn between_convex(a: &Convex, b: &Convex, a_from_b: &ParryPose, max: f64) -> Clearance {
    answer_and_axis(a, b, a_from_b, max).0
}

/// As [`between_convex`], with the axis of the separating slab, which means nothing for other answers.
fn answer_and_axis(a: &Convex, b: &Convex, a_from_b: &ParryPose, max: f64) -> (Clearance, ParryVector) {
    let margins = a.margin + b.margin;
    let first_axis = a_from_b.translation.try_normalize().unwrap_or(ParryVector::X);
    let mut simplex = VoronoiSimplex::new();
    let mut shallow = Clearance::Unresolved;
    // GJK may stall on curved shapes; a start from another side mostly helps.
    for axis in [first_axis, ParryVector::new(0.36, 0.48, 0.8), ParryVector::new(-0.8, 0.36, 0.48)] {
        simplex.reset(CsoPoint::from_shapes(a_from_b, &a.core, &b.core, axis));
        let result = gjk::closest_points(a_from_b, &a.core, &b.core, max + margins, true, &mut simplex);
        let (axes, reached) = match result {
            GJKResult::ClosestPoints(p, q, axis) => ([(q - p).normalize_or_zero(), axis], (q - p).length()),
            GJKResult::NoIntersection(axis) | GJKResult::Proximity(axis) => ([axis, axis], f64::INFINITY),
            GJKResult::Intersection => {
                // Curved shapes nearly in touch can look so from one side.
                match penetration(a, b, a_from_b, &simplex) {
                    Clearance::Penetrating(depth) if depth < SHALLOW => shallow = Clearance::Penetrating(depth),
                    Clearance::Unresolved => {}
                    answer => return (answer, ParryVector::ZERO),
                }
                continue;
            }
        };
        // The width of the widest slab confirmed is a lower bound of the distance, `reached` an upper bound.
        let (gap, axis) = widest_slab(a, b, a_from_b, &axes, reached - margins);
        if gap > 0.0 {
            return (Clearance::SeparatedBy(gap), axis);
        }
        if reached <= margins {
            return (Clearance::Penetrating(margins - reached), ParryVector::ZERO);
        }
    }
    let has_faces = |shape: &Convex| matches!(shape.core, Core::Box { .. }) && shape.margin == 0.0;
    if shallow != Clearance::Unresolved || !has_faces(a) || !has_faces(b) {
        return (shallow, ParryVector::ZERO);
    }
    // Along any axis the overlap bounds the depth from above; along that of a face it mostly is the depth.
    let axes = [ParryVector::X, ParryVector::Y, ParryVector::Z];
    let of_b = axes.map(|axis| a_from_b.transform_vector(axis));
    let mut all = vec![first_axis, -first_axis];
    all.extend(axes.iter().chain(&of_b).flat_map(|&axis| [axis, -axis]));
    let (gap, axis) = widest_slab(a, b, a_from_b, &all, 0.0);
    match gap {
        gap if !gap.is_finite() => (Clearance::Unresolved, ParryVector::ZERO),
        gap if gap > 0.0 => (Clearance::SeparatedBy(gap), axis),
        gap => (Clearance::Penetrating(-gap), ParryVector::ZERO),
    }
}

/// Width of the widest slab found between `a` and `b`, starting across `axes`; not above zero when none separates them.
///
/// The width is concave in the axis near its best, so where GJK stalled on curved shapes, steps uphill close what is
/// left up to `reached`, the distance of two points of the shapes.
fn widest_slab(a: &Convex, b: &Convex, a_from_b: &ParryPose, axes: &[ParryVector], reached: f64) -> (f64, ParryVector) {
    let mut best = (f64::NEG_INFINITY, ParryVector::X, ParryVector::ZERO);
    for &axis in axes {
        let (width, uphill) = slab(a, b, a_from_b, axis);
        if width > best.0 {
            best = (width, axis, uphill);
        }
    }
    if !reached.is_finite() || reached < 0.0 || !best.0.is_finite() {
        return (best.0, best.1);
    }
    let mut step = 1.0 / (reached + a.margin + b.margin).max(1e-12);
    for _ in 0..MAX_STEPS {
        if reached - best.0 <= 1e-7 * reached + 1e-12 {
            break;
        }
        let axis = (best.1 + best.2 * step).normalize_or_zero();
        let (width, uphill) = slab(a, b, a_from_b, axis);
        if width > best.0 {
            best = (width, axis, uphill);
            step *= 1.5;
        } else {
            step *= 0.4;
        }
    }
    (best.0, best.1)
}

/// Width of the slab across `axis`, from `a` to `b`, that has `a` on one side and `b` on the other, and the direction in
/// which turning the axis widens it.
fn slab(a: &Convex, b: &Convex, a_from_b: &ParryPose, axis: ParryVector) -> (f64, ParryVector) {
    let length = axis.length();
    if length.is_nan() || length < 0.5 {
        return (f64::NEG_INFINITY, ParryVector::ZERO);
    }
    let axis = axis / length;
    let (p, q) = (a.core.local_support_point(axis), b.core.support_point(a_from_b, -axis));
    let along = (q - p).dot(axis);
    // What the products above may be off by.
    let rounding = 8.0 * f64::EPSILON * (p.length() + q.length() + a.margin + b.margin);
    (along - a.margin - b.margin - rounding, q - p - axis * along)
}

fn penetration(a: &Convex, b: &Convex, a_from_b: &ParryPose, simplex: &VoronoiSimplex) -> Clearance {
    match EPA::new().closest_points(a_from_b, &a.core, &b.core, simplex) {
        Some((p, q, normal)) => {
            // GJK takes the narrowest gaps for contact; the axis found may still separate.
            let depth = -(q - p).dot(normal);
            let reached = if depth < SHALLOW { SHALLOW } else { f64::INFINITY };
            let (gap, _) = widest_slab(a, b, a_from_b, &[normal, -normal], reached);
            if gap > 0.0 {
                return Clearance::SeparatedBy(gap);
            }
            // Along the axis of least penetration the shapes overlap by just the depth; EPA sometimes finds another
            // (parry#378).
            let overlap = -slab(a, b, a_from_b, normal).0 - a.margin - b.margin;
            if (overlap - depth).abs() <= 1e-6 + 1e-3 * depth {
                Clearance::Penetrating(depth.max(0.0) + a.margin + b.margin)
            } else {
                Clearance::Unresolved
            }
        }
        // Flat cores, such as two segments, may be too thin for EPA, but with a margin they overlap at least by it.
        None if a.margin + b.margin > 0.0 => Clearance::Penetrating(a.margin + b.margin),
        None => Clearance::Unresolved,
    }
}

/// The nearest triangle by parry's hierarchy of boxes; a solid also holds what is inside it.
fn mesh_to_convex(body: &MeshBody, convex: &Convex, mesh_from_convex: &ParryPose, max: f64) -> Clearance {
    let answer = triangles_to_convex(body, convex, mesh_from_convex, max);
    if let Clearance::SeparatedBy(_) = answer {
        let inner = mesh_from_convex.transform_point(convex.middle);
        if let Some(depth) = body.depth_of(inner) {
            return Clearance::Penetrating(depth);
        }
    }
    answer
}

fn triangles_to_convex(body: &MeshBody, convex: &Convex, mesh_from_convex: &ParryPose, max: f64) -> Clearance {
    let box_of = |axis: ParryVector| convex.core.support_point(mesh_from_convex, axis).dot(axis) + convex.margin;
    let (x, y, z) = (ParryVector::X, ParryVector::Y, ParryVector::Z);
    let bounds = Aabb::new(
        ParryVector::new(-box_of(-x), -box_of(-y), -box_of(-z)),
        ParryVector::new(box_of(x), box_of(y), box_of(z)),
    );
    let unresolved = Cell::new(false);
    // Two planes, each an axis and how far the convex shape reaches against it: one of the nearest triangle so far, one of the last that
    // was farther away. Most other triangles, and most boxes about many of them, lie behind one of them and need no GJK.
    let planes = [(); 2].map(|()| Cell::new((ParryVector::ZERO, f64::NEG_INFINITY)));
    let measure = |i: u32, best: f64| {
        let triangle = body.mesh.triangle(i);
        let corners = [triangle.a, triangle.b, triangle.c];
        let is_behind = |(axis, from): (ParryVector, f64)| corners.iter().all(|corner| from - corner.dot(axis) >= best);
        if planes.iter().any(|plane| is_behind(plane.get())) {
            return None;
        }
        let triangle = Convex::new(Core::Triangle(corners), 0.0);
        match answer_and_axis(&triangle, convex, mesh_from_convex, best.min(max)) {
            (Clearance::SeparatedBy(gap), axis) => {
                let axis = axis.normalize_or_zero();
                if axis != ParryVector::ZERO {
                    let against = convex.core.support_point(mesh_from_convex, -axis).dot(axis) - convex.margin;
                    planes[usize::from(gap >= best)].set((axis, against));
                }
                Some(gap)
            }
            (Clearance::Penetrating(depth), _) => Some(-depth - f64::MIN_POSITIVE),
            (Clearance::Unresolved, _) => {
                unresolved.set(true);
                None
            }
        }
    };
    let nearest = body.mesh.bvh().find_best(
        max,
        |node, _| {
            let gap = (node.mins() - bounds.maxs).max(bounds.mins - node.maxs()).max(ParryVector::ZERO);
            // The corner of the box that lies farthest along the axis.
            let behind = |plane: &Cell<(ParryVector, f64)>| {
                let (axis, from) = plane.get();
                from - (node.mins() * axis).max(node.maxs() * axis).element_sum()
            };
            gap.length().max(behind(&planes[0])).max(behind(&planes[1]))
        },
        measure,
    );
    match nearest {
        Some((_, gap)) if gap <= 0.0 => Clearance::Penetrating(-gap),
        _ if unresolved.get() => Clearance::Unresolved,
        Some((_, gap)) => Clearance::SeparatedBy(gap),
        None => Clearance::SeparatedBy(max),
    }
}

/// Each triangle of `b` as a convex shape against `a`.
fn mesh_to_mesh(a: &MeshBody, b: &MeshBody, a_from_b: &ParryPose, max: f64) -> Clearance {
    let mut nearest = max;
    let mut unresolved = false;
    for triangle in b.mesh.triangles() {
        let triangle = Convex::new(Core::Triangle([triangle.a, triangle.b, triangle.c]), 0.0);
        match triangles_to_convex(a, &triangle, a_from_b, nearest) {
            Clearance::SeparatedBy(gap) => nearest = nearest.min(gap),
            Clearance::Penetrating(depth) => return Clearance::Penetrating(depth),
            Clearance::Unresolved => unresolved = true,
        }
    }
    for vertex in &b.part_vertices {
        if let Some(depth) = a.depth_of(a_from_b.transform_point(*vertex)) {
            return Clearance::Penetrating(depth);
        }
    }
    for vertex in &a.part_vertices {
        if let Some(depth) = b.depth_of(a_from_b.inverse_transform_point(*vertex)) {
            return Clearance::Penetrating(depth);
        }
    }
    if unresolved { Clearance::Unresolved } else { Clearance::SeparatedBy(nearest) }
}

fn vector(point: &Point) -> ParryVector {
    ParryVector::new(point.x, point.y, point.z)
}

fn parry_pose(pose: &Pose) -> ParryPose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    ParryPose::from_parts(ParryVector::new(t.x, t.y, t.z), ParryRotation::from_xyzw(q.x, q.y, q.z, q.w))
}
