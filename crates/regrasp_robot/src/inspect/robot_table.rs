//! Joints and meshes of a robot as tables, and what looks like a wrong unit.

use crate::coupling::Coupling;
use crate::robot::{JointId, JointKind, Robot};
use regrasp_base::{Diagnostic, Place};
use regrasp_geometry::Shape;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// A joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointRow {
    /// Name.
    pub name: String,
    /// `fixed`, `revolute`, `continuous` or `prismatic`.
    pub kind: &'static str,
    /// The link that carries it.
    pub parent: String,
    /// The link that it carries.
    pub child: String,
    /// Lowest position, in radians or metres.
    pub lower: Option<f64>,
    /// Highest position, in radians or metres.
    pub upper: Option<f64>,
    /// Highest speed, in rad/s or m/s.
    pub velocity: Option<f64>,
    /// Highest torque or force, in N m or N.
    pub effort: Option<f64>,
    /// The joint that it follows.
    pub follows: Option<Follows>,
}

/// A coupling: `position = multiplier * position(joint) + offset`, plus the same product for each of `others`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Follows {
    /// The joint followed; the first of several.
    pub joint: String,
    /// Its multiplier.
    pub multiplier: f64,
    /// Offset, in radians or metres.
    pub offset: f64,
    /// More joints followed, with their multipliers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<Leader>,
}

/// A joint that another follows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leader {
    /// The joint followed.
    pub joint: String,
    /// Its multiplier.
    pub multiplier: f64,
}

impl Follows {
    pub(super) fn new(robot: &Robot, coupling: &Coupling) -> Self {
        let leader = |&(id, multiplier): &(JointId, f64)| Leader { joint: robot.joints[id.0].name.clone(), multiplier };
        let Leader { joint, multiplier } = leader(&coupling.terms[0]);
        let others = coupling.terms[1..].iter().map(leader).collect();
        Follows { joint, multiplier, offset: coupling.offset, others }
    }
}

/// A collision mesh of a link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshRow {
    /// Links that use it, in document order.
    pub links: Vec<String>,
    /// Number of triangles.
    pub n_triangles: usize,
    /// Number of vertices.
    pub n_vertices: usize,
    /// True when every edge has exactly two triangles, wound alike.
    pub watertight: bool,
    /// Holes, duplicates and flips.
    pub statistics: regrasp_geometry::mesh::MeshStatistics,
    /// Edge lengths of its bounding box, in metres.
    pub size: [f64; 3],
}

/// What a robot is like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotInspection {
    /// Name of the robot.
    pub name: String,
    /// The root link.
    pub root: String,
    /// Number of links.
    pub n_links: usize,
    /// Joints in document order.
    pub joints: Vec<JointRow>,
    /// Collision meshes, each once.
    pub meshes: Vec<MeshRow>,
    /// What looks like a wrong unit (`M201`).
    pub suspicions: Vec<Diagnostic>,
}

/// Joints and meshes of `robot`, which was read from `file`.
pub fn inspect_robot(robot: &Robot, file: &Path) -> RobotInspection {
    let (meshes, mut suspicions) = mesh_rows(robot, file);
    for joint in &robot.joints {
        if let (JointKind::Revolute, Some(limits)) = (joint.kind, joint.limits)
            && limits.lower.abs().max(limits.upper.abs()) > 20.0
        {
            let problem = format!("limits {}..{} look like degrees", limits.lower, limits.upper);
            suspicions.push(
                Diagnostic::new("M201", Place::file(file), problem).element("joint", &joint.name).expected("radians"),
            );
        }
    }
    let joints = robot
        .joints
        .iter()
        .map(|joint| JointRow {
            name: joint.name.clone(),
            kind: match joint.kind {
                JointKind::Fixed => "fixed",
                JointKind::Revolute => "revolute",
                JointKind::Continuous => "continuous",
                JointKind::Prismatic => "prismatic",
            },
            parent: robot.links[joint.parent.0].name.clone(),
            child: robot.links[joint.child.0].name.clone(),
            lower: joint.limits.map(|limits| limits.lower),
            upper: joint.limits.map(|limits| limits.upper),
            velocity: joint.limits.and_then(|limits| limits.velocity),
            effort: joint.limits.and_then(|limits| limits.effort),
            follows: joint.coupling.as_ref().map(|coupling| Follows::new(robot, coupling)),
        })
        .collect();
    let root = robot.links[robot.root.0].name.clone();
    RobotInspection { name: robot.name.clone(), root, n_links: robot.links.len(), joints, meshes, suspicions }
}

fn mesh_rows(robot: &Robot, file: &Path) -> (Vec<MeshRow>, Vec<Diagnostic>) {
    let (mut seen, mut rows, mut suspicions) = (Vec::new(), Vec::<MeshRow>::new(), Vec::new());
    for link in &robot.links {
        for placed in &link.collision {
            let Shape::Mesh(mesh) = &placed.shape else { continue };
            if let Some(known) = seen.iter().position(|other| Arc::ptr_eq(other, mesh)) {
                rows[known].links.push(link.name.clone());
                continue;
            }
            let (low, high) = mesh.bounds();
            let size: [f64; 3] = (high - low).into();
            seen.push(mesh.clone());
            rows.push(MeshRow {
                links: vec![link.name.clone()],
                n_triangles: mesh.triangles().len(),
                n_vertices: mesh.vertices().len(),
                watertight: mesh.statistics().is_watertight(),
                statistics: mesh.statistics().clone(),
                size,
            });
            suspicions.extend(suspect_size(size, file, &link.name));
        }
    }
    (rows, suspicions)
}

/// A mesh larger than 3 m or smaller than 2 mm is hardly in metres.
fn suspect_size([x, y, z]: [f64; 3], file: &Path, link: &str) -> Option<Diagnostic> {
    let largest = x.max(y).max(z);
    let (guess, scale) = match largest {
        l if l > 3.0 => ("it is probably in millimetres", "0.001"),
        l if l < 0.002 => ("it is probably scaled down by 1000 once too often", "1000"),
        _ => return None,
    };
    Some(
        Diagnostic::new("M201", Place::file(file), format!("a collision mesh is {x:.4} x {y:.4} x {z:.4} m"))
            .element("link", link)
            .expected(format!("metres; {guess}"))
            .fix(format!("<mesh filename=\"...\" scale=\"{scale} {scale} {scale}\"/>")),
    )
}
