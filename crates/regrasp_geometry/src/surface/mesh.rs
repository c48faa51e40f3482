//! The outer surface of a triangle mesh. Faces are triangles, numbered as in the mesh.
//!
//! Sign of the distance: Baerentzen, Aanaes 2005, "Signed distance computation using the angle weighted pseudonormal".
//! Normals are interpolated between vertices, but not across creases. Where parts of the mesh overlap, what lies inside
//! another part does not belong to the surface.

/// How it bends.
mod curvature;
/// Shortest ways on it.
mod geodesic;
/// How long its creases are.
mod grain;

use super::bvh::{Aabb, Bvh};
use super::geodesic::Geodesic;
use super::mesh_topology::{NONE, Topology, angle_at, creases, face_normals, patches};
use super::{Facing, SurfaceError, SurfaceKind, SurfacePoint, unit_or};
use crate::frame::{Point, UnitVector, Vector};
use crate::mesh::TriangleMesh;
use nalgebra::Matrix3;
use regrasp_base::Rng;

/// What was put right when a surface was made of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct MeshRepairs {
    /// Triangles that were wound against their neighbours.
    pub triangles_turned: usize,
    /// Closed parts that were inside out.
    pub parts_turned: usize,
    /// Triangles inside other parts of the mesh, which nothing can touch.
    pub triangles_inside: usize,
}

/// The outer surface of a triangle mesh, with what queries need.
#[derive(Debug, Clone)]
pub struct MeshSurface {
    pub(super) vertices: Vec<Point>,
    pub(super) topology: Topology,
    pub(super) face_normals: Vec<Vector>,
    pub(super) corner_normals: Vec<[Vector; 3]>,
    pub(super) is_crease: Vec<[bool; 3]>,
    vertex_pseudonormals: Vec<Vector>,
    patch_of: Vec<u32>,
    /// Over the outer triangles, whose numbers are `outer[rank]` and corners `corners[rank]`.
    bvh: Bvh,
    outer: Vec<u32>,
    corners: Vec<[Point; 3]>,
    /// Area of the outer triangles up to and including `rank`.
    area_up_to: Vec<f64>,
    /// Triangles that are only partly outside, when parts overlap.
    partly_outer: Vec<bool>,
    inside_test: Option<InsideTest>,
    crease_bvh: Bvh,
    crease_edges: Vec<[Point; 2]>,
    repairs: MeshRepairs,
}

/// Where on a triangle a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feature {
    Inside,
    Edge(usize),
    Corner(usize),
}

impl MeshSurface {
    pub(super) fn new(mesh: &TriangleMesh, crease_angle: f64) -> Result<Self, SurfaceError> {
        let vertices = mesh.vertices().to_vec();
        let mut topology = Topology::new(mesh.triangles())?;
        let mut repairs = MeshRepairs { triangles_turned: topology.n_turned, ..MeshRepairs::default() };
        turn_parts_outward(&vertices, &mut topology, &mut repairs);
        let face_normals = face_normals(&vertices, &topology.triangles);
        let is_crease = creases(&topology, &face_normals, crease_angle);
        let patch_of = patches(&topology, &is_crease);
        let angles = corner_angles(&vertices, &topology.triangles);
        let corner_normals = corner_normals(&topology, &face_normals, &angles, &is_crease);
        let mut vertex_pseudonormals = vec![Vector::zeros(); vertices.len()];
        for (i, corners) in topology.triangles.iter().enumerate() {
            for k in 0..3 {
                vertex_pseudonormals[corners[k] as usize] += face_normals[i] * angles[i][k];
            }
        }
        let inside_test = InsideTest::new(&vertices, &topology, &face_normals);
        let (outer, partly_outer) = outer_triangles(&vertices, &topology, &face_normals, inside_test.as_ref());
        if outer.is_empty() {
            return Err(SurfaceError::NoOuterSurface);
        }
        repairs.triangles_inside = topology.triangles.len() - outer.len();

        let corners_of = |i: u32| topology.triangles[i as usize].map(|v| vertices[v as usize]);
        let boxes: Vec<Aabb> = outer.iter().map(|&i| Aabb::of(&corners_of(i))).collect();
        let mut bvh = Bvh::new(&boxes);
        let outer: Vec<u32> = bvh.order().iter().map(|&rank| outer[rank as usize]).collect();
        let corners: Vec<[Point; 3]> = outer.iter().map(|&i| corners_of(i)).collect();
        bvh.add_sheets(&corners);
        let mut area = 0.0;
        let area_up_to = corners
            .iter()
            .map(|[a, b, c]| {
                area += 0.5 * (b - a).cross(&(c - a)).norm();
                area
            })
            .collect();

        let mut is_outer = vec![false; topology.triangles.len()];
        outer.iter().for_each(|&i| is_outer[i as usize] = true);
        let mut crease_edges = Vec::new();
        for i in (0..topology.triangles.len()).filter(|&i| is_outer[i]) {
            for k in (0..3).filter(|&k| is_crease[i][k]) {
                let j = topology.neighbours[i][k];
                // An edge with the triangle of lower number; with the other one where that is inside.
                if j == NONE || (i as u32) < j || !is_outer[j as usize] {
                    let corners = corners_of(i as u32);
                    crease_edges.push([corners[k], corners[(k + 1) % 3]]);
                }
            }
        }
        let boxes: Vec<Aabb> = crease_edges.iter().map(|edge| Aabb::of(edge)).collect();
        let crease_bvh = Bvh::new(&boxes);
        let crease_edges = crease_bvh.order().iter().map(|&rank| crease_edges[rank as usize]).collect();
        Ok(MeshSurface {
            vertices,
            topology,
            face_normals,
            corner_normals,
            is_crease,
            vertex_pseudonormals,
            patch_of,
            bvh,
            outer,
            corners,
            area_up_to,
            partly_outer,
            inside_test,
            crease_bvh,
            crease_edges,
            repairs,
        })
    }

    /// What was put right.
    pub fn repairs(&self) -> MeshRepairs {
        self.repairs
    }

    /// Number of triangles, with those that are inside.
    pub fn n_triangles(&self) -> usize {
        self.topology.triangles.len()
    }

    /// How far its creases run on before they turn, branch or end, in metres: the mean over them, weighed by length. None without
    /// creases.
    pub fn crease_grain(&self) -> Option<f64> {
        grain::grain(&self.crease_edges)
    }

    /// Corners of triangle `facet`, counter-clockwise seen from outside.
    pub fn corners(&self, facet: u32) -> [Point; 3] {
        self.topology.triangles[facet as usize].map(|v| self.vertices[v as usize])
    }

    /// Outward normal of triangle `facet`, not interpolated.
    pub fn face_normal(&self, facet: u32) -> UnitVector {
        unit_or(self.face_normals[facet as usize], Vector::z_axis())
    }

    /// Interpolated normal, not of length one, at a point of triangle `facet`.
    pub(super) fn normal_at(&self, facet: u32, point: &Point) -> Vector {
        let weights = barycentric(&self.corners(facet), point);
        let [a, b, c] = self.corner_normals[facet as usize];
        a * weights[0] + b * weights[1] + c * weights[2]
    }

    /// False for a point of a triangle that is inside the mesh there.
    fn is_outer(&self, facet: u32, point: &Point) -> bool {
        match &self.inside_test {
            Some(test) if self.partly_outer[facet as usize] => {
                !test.is_inside(point, &self.face_normals[facet as usize])
            }
            _ => true,
        }
    }

    fn surface_point(&self, facet: u32, point: Point) -> SurfacePoint {
        let normal = unit_or(self.normal_at(facet, &point), self.face_normal(facet));
        SurfacePoint::new(point, normal, facet)
    }

    /// The nearest point of the surface, its triangle and what of that it lies on; quick when `reach` is hardly larger than its
    /// distance, right whatever it is.
    fn nearest(&self, point: &Point, reach: f64) -> (u32, Point, Feature) {
        let visit = |rank: usize| (nearest_on_triangle(&self.corners[rank], point).0 - point).norm_squared();
        let near = self.bvh.nearest(point, reach * reach * (1.0 + 1e-9), visit);
        let near = near.or_else(|| self.bvh.nearest(point, f64::INFINITY, visit));
        let rank = near.map_or(0, |(rank, _)| rank);
        let (on_triangle, feature) = nearest_on_triangle(&self.corners[rank], point);
        (self.outer[rank], on_triangle, feature)
    }

    /// Length of `away`, which leads from the nearest point of the surface; negative inside.
    fn signed(&self, away: Vector, facet: u32, feature: Feature) -> f64 {
        away.norm().copysign(away.dot(&self.pseudonormal(facet, feature)))
    }

    /// Direction that tells outside from inside next to a feature of triangle `facet`.
    fn pseudonormal(&self, facet: u32, feature: Feature) -> Vector {
        let i = facet as usize;
        match feature {
            Feature::Inside => self.face_normals[i],
            Feature::Edge(k) => match self.topology.neighbours[i][k] {
                NONE => self.face_normals[i],
                j => self.face_normals[i] + self.face_normals[j as usize],
            },
            Feature::Corner(k) => self.vertex_pseudonormals[self.topology.triangles[i][k] as usize],
        }
    }
}

impl SurfaceKind for MeshSurface {
    fn area(&self) -> f64 {
        self.area_up_to.last().copied().unwrap_or(0.0)
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        loop {
            let at = rng.unit() * self.area();
            let rank = self.area_up_to.partition_point(|&area| area <= at).min(self.outer.len() - 1);
            let [a, b, c] = self.corners[rank];
            let (root, share) = (rng.unit().sqrt(), rng.unit());
            let point = a + (b - a) * (root * (1.0 - share)) + (c - a) * (root * share);
            let facet = self.outer[rank];
            if self.is_outer(facet, &point) {
                return self.surface_point(facet, point);
            }
        }
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        let mut hit = None;
        self.bvh.along_ray(origin, direction, |rank, limit| match meet(&self.corners[rank], origin, direction) {
            Some(t) if t < limit => {
                hit = Some((rank, t));
                t
            }
            _ => limit,
        });
        let (rank, t) = hit?;
        Some(self.surface_point(self.outer[rank], origin + direction.as_ref() * t))
    }

    fn exits(&self, origin: &Point, direction: &UnitVector) -> Vec<SurfacePoint> {
        let mut hits: Vec<(f64, u32)> = Vec::new();
        self.bvh.along_ray(origin, direction, |rank, limit| {
            let facet = self.outer[rank];
            if self.face_normals[facet as usize].dot(direction) > 0.0
                && let Some(t) = meet(&self.corners[rank], origin, direction)
            {
                hits.push((t, facet));
            }
            limit
        });
        hits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let at = |(t, facet): (f64, u32)| (facet, origin + direction.as_ref() * t);
        let is_outer = |(facet, point): &(u32, Point)| self.is_outer(*facet, point);
        hits.into_iter().map(at).filter(is_outer).map(|(facet, point)| self.surface_point(facet, point)).collect()
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        let (facet, on_surface, _) = self.nearest(point, f64::INFINITY);
        self.surface_point(facet, on_surface)
    }

    fn flat_normal(&self, at: &SurfacePoint) -> UnitVector {
        self.face_normal(at.facet)
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        let (facet, on_surface, feature) = self.nearest(point, f64::INFINITY);
        self.signed(point - on_surface, facet, feature)
    }

    fn project_signed(&self, point: &Point, reach: f64) -> (SurfacePoint, f64) {
        let (facet, on_surface, feature) = self.nearest(point, reach);
        (self.surface_point(facet, on_surface), self.signed(point - on_surface, facet, feature))
    }

    fn facing(&self, at: &SurfacePoint, from: &Point) -> Option<(Facing, Point)> {
        let corners = self.corners(at.facet);
        let facing = match nearest_on_triangle(&corners, from).1 {
            Feature::Inside => Facing::Face(self.face_normal(at.facet)),
            Feature::Edge(k) => Facing::Edge(UnitVector::try_new(corners[(k + 1) % 3] - corners[k], 0.0)?),
            Feature::Corner(_) => Facing::Corner,
        };
        Some((facing, at.point_in_object))
    }

    fn crease_distance(&self, at: &SurfacePoint) -> f64 {
        let point = at.point_in_object;
        let visit = |rank: usize| (nearest_on_segment(&self.crease_edges[rank], &point) - point).norm_squared();
        self.crease_bvh.nearest(&point, f64::INFINITY, visit).map_or(f64::INFINITY, |(_, d)| d.sqrt())
    }

    fn same_face(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        self.patch_of[a.facet as usize] == self.patch_of[b.facet as usize]
    }

    fn curvature(&self, at: &SurfacePoint) -> [f64; 2] {
        curvature::curvature(self, at)
    }

    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        curvature::shape_operator(self, at)
    }

    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        geodesic::geodesic(self, a, b)
    }
}

/// Turns closed parts of negative volume inside out.
fn turn_parts_outward(vertices: &[Point], topology: &mut Topology, repairs: &mut MeshRepairs) {
    let n_parts = topology.open_edges.len();
    let mut volumes = vec![0.0; n_parts];
    let mut origins: Vec<Option<Point>> = vec![None; n_parts];
    for (corners, &part) in topology.triangles.iter().zip(&topology.part_of) {
        let origin = *origins[part as usize].get_or_insert(vertices[corners[0] as usize]);
        let [a, b, c] = corners.map(|i| vertices[i as usize] - origin);
        volumes[part as usize] += a.dot(&b.cross(&c));
    }
    let is_inverted: Vec<bool> = (0..n_parts).map(|p| volumes[p] < 0.0 && topology.encloses(p as u32)).collect();
    repairs.parts_turned = is_inverted.iter().filter(|&&inverted| inverted).count();
    for i in 0..topology.triangles.len() {
        if is_inverted[topology.part_of[i] as usize] {
            topology.turn(i);
        }
    }
}

/// Interior angle of each triangle at each corner.
fn corner_angles(vertices: &[Point], triangles: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let of = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| vertices[i as usize]);
        [angle_at(&a, &b, &c), angle_at(&b, &c, &a), angle_at(&c, &a, &b)]
    };
    triangles.iter().map(of).collect()
}

/// Per triangle and corner: normals of the fan up to the next creases, weighted by their angles (Thuermer, Wuethrich
/// 1998), which unlike areas do not depend on how faces are cut into triangles.
fn corner_normals(
    topology: &Topology,
    face_normals: &[Vector],
    angles: &[[f64; 3]],
    is_crease: &[[bool; 3]],
) -> Vec<[Vector; 3]> {
    let mut normals = vec![[Vector::zeros(); 3]; face_normals.len()];
    let mut done = vec![[false; 3]; face_normals.len()];
    let mut fan = Vec::new();
    for i in 0..face_normals.len() {
        for k in 0..3 {
            if done[i][k] {
                continue;
            }
            let vertex = topology.triangles[i][k];
            topology.fan(i, k, |j, edge| is_crease[j][edge], &mut fan);
            let mut sum = Vector::zeros();
            let at_vertex = |&j: &u32| topology.corner_at(j as usize, vertex).map(|m| (j as usize, m));
            for (j, m) in fan.iter().filter_map(at_vertex) {
                sum += face_normals[j] * angles[j][m];
            }
            let normal = sum.try_normalize(1e-12).unwrap_or(face_normals[i]);
            for (j, m) in fan.iter().filter_map(at_vertex) {
                normals[j][m] = normal;
                done[j][m] = true;
            }
        }
    }
    normals
}

/// Numbers of triangles that are at least partly outside, and which of all triangles are so only partly.
fn outer_triangles(
    vertices: &[Point],
    topology: &Topology,
    face_normals: &[Vector],
    inside_test: Option<&InsideTest>,
) -> (Vec<u32>, Vec<bool>) {
    let n = topology.triangles.len();
    let Some(test) = inside_test else { return ((0..n as u32).collect(), Vec::new()) };
    let (mut outer, mut partly) = (Vec::new(), vec![false; n]);
    for i in 0..n {
        if !test.is_overlapped[topology.part_of[i] as usize] {
            outer.push(i as u32);
            continue;
        }
        let [a, b, c] = topology.triangles[i].map(|v| vertices[v as usize]);
        let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
        // Corners a little inwards, because parts often meet there.
        let probes = [middle, a + (middle - a) * 1e-3, b + (middle - b) * 1e-3, c + (middle - c) * 1e-3];
        let is_inside = |p: &Point| test.is_inside(p, &face_normals[i]);
        // Where another part may come through the triangle, some points that were not looked at may be outside.
        if !probes.iter().all(is_inside) || test.may_cross(topology.part_of[i], &[a, b, c]) {
            outer.push(i as u32);
            partly[i] = true;
        }
    }
    (outer, partly)
}

/// Tells whether a point of one part lies within another, by signed crossings along rays.
#[derive(Debug, Clone)]
struct InsideTest {
    bvh: Bvh,
    corners: Vec<[Point; 3]>,
    normals: Vec<Vector>,
    parts: Vec<u32>,
    /// Per part: whether its box meets that of another part that encloses something.
    is_overlapped: Vec<bool>,
    step: f64,
}

impl InsideTest {
    /// None when no two parts can overlap.
    fn new(vertices: &[Point], topology: &Topology, face_normals: &[Vector]) -> Option<Self> {
        let n_parts = topology.open_edges.len();
        let mut boxes = vec![Aabb::empty(); n_parts];
        for (corners, &part) in topology.triangles.iter().zip(&topology.part_of) {
            let corners = corners.map(|i| vertices[i as usize]);
            boxes[part as usize] = boxes[part as usize].union(&Aabb::of(&corners));
        }
        let closed: Vec<usize> = (0..n_parts).filter(|&p| topology.encloses(p as u32)).collect();
        let is_overlapped: Vec<bool> =
            (0..n_parts).map(|p| closed.iter().any(|&q| q != p && boxes[p].overlaps(&boxes[q]))).collect();
        if !is_overlapped.contains(&true) {
            return None;
        }
        let whole = boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        let enclosing: Vec<usize> =
            (0..topology.triangles.len()).filter(|&i| topology.encloses(topology.part_of[i])).collect();
        let corners_of = |i: usize| topology.triangles[i].map(|v| vertices[v as usize]);
        let bvh = Bvh::new(&enclosing.iter().map(|&i| Aabb::of(&corners_of(i))).collect::<Vec<_>>());
        let order: Vec<usize> = bvh.order().iter().map(|&rank| enclosing[rank as usize]).collect();
        Some(InsideTest {
            corners: order.iter().map(|&i| corners_of(i)).collect(),
            normals: order.iter().map(|&i| face_normals[i]).collect(),
            parts: order.iter().map(|&i| topology.part_of[i]).collect(),
            bvh,
            is_overlapped,
            step: 1e-7 * (whole.high - whole.low).norm(),
        })
    }

    /// False when no triangle of another part meets this triangle of `part`, as their boxes are apart.
    fn may_cross(&self, part: u32, corners: &[Point; 3]) -> bool {
        let own = Aabb::of(corners);
        let middle = Point::from((own.low + own.high) / 2.0);
        let reach = (own.high - own.low).norm() / 2.0 + self.step;
        let mut may = false;
        self.bvh.within(&middle, reach * reach, |rank| {
            may |= self.parts[rank] != part && Aabb::of(&self.corners[rank]).overlaps(&own);
        });
        may
    }

    /// Whether the point just off the surface along `normal` is enclosed: the vote of three rays.
    fn is_inside(&self, point: &Point, normal: &Vector) -> bool {
        // No two of them, and no axis, lie in a plane of a usual box.
        const DIRECTIONS: [[f64; 3]; 3] =
            [[0.5412, 0.3127, 0.7806], [-0.6718, 0.5531, -0.4924], [0.1937, -0.8842, 0.4249]];
        let origin = point + normal * self.step;
        let votes = DIRECTIONS.iter().filter(|direction| {
            let direction = Vector::from(**direction);
            let mut winding = 0;
            self.bvh.along_ray(&origin, &direction, |rank, limit| {
                if meet(&self.corners[rank], &origin, &direction).is_some() {
                    winding += if direction.dot(&self.normals[rank]) > 0.0 { 1 } else { -1 };
                }
                limit
            });
            winding > 0
        });
        votes.count() >= 2
    }
}

/// Distance along the ray to the triangle, if it is above zero (Moeller, Trumbore 1997).
fn meet([a, b, c]: &[Point; 3], origin: &Point, direction: &Vector) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let p = direction.cross(&v);
    let determinant = u.dot(&p);
    if determinant == 0.0 {
        return None;
    }
    let from_a = origin - a;
    let q = from_a.cross(&u);
    let (x, y) = (from_a.dot(&p) / determinant, direction.dot(&q) / determinant);
    // A ray through an edge meets at least one of its triangles.
    const SLACK: f64 = 1e-12;
    let t = v.dot(&q) / determinant;
    (x >= -SLACK && y >= -SLACK && x + y <= 1.0 + SLACK && t > 0.0).then_some(t)
}

/// Nearest point of a triangle (Ericson 2005, 5.1.5).
pub(crate) fn nearest_on_triangle([a, b, c]: &[Point; 3], p: &Point) -> (Point, Feature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Corner(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
    }
    let total = 1.0 / (va + vb + vc);
    (a + ab * (vb * total) + ac * (vc * total), Feature::Inside)
}

fn nearest_on_segment([a, b]: &[Point; 2], p: &Point) -> Point {
    let along = b - a;
    let length_squared = along.norm_squared();
    if length_squared == 0.0 { *a } else { a + along * ((p - a).dot(&along) / length_squared).clamp(0.0, 1.0) }
}

/// Weights of the corners, each at least zero.
pub(super) fn barycentric([a, b, c]: &[Point; 3], p: &Point) -> [f64; 3] {
    let normal = (b - a).cross(&(c - a));
    let area = normal.norm_squared();
    let weight = |u: &Point, v: &Point| ((v - u).cross(&(p - u)).dot(&normal) / area).clamp(0.0, 1.0);
    let weights = [weight(b, c), weight(c, a), weight(a, b)];
    let sum: f64 = weights.iter().sum();
    if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0, 0.0, 0.0] }
}
