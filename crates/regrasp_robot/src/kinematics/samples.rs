//! Chains for tests: hands written by their dimensions, random geometries, and real hands read in place.

use super::chain::{Chain, ChainJoint, JointMotion};
use crate::coupling::Coupling;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};

/// A chain of turning joints: origin in the parent, rotation vector, axis, limits.
pub fn turning(joints: &[(Vector, Vector, Vector, f64, f64)]) -> Chain {
    let chain_joints = joints
        .iter()
        .enumerate()
        .map(|(i, (origin, rotation, axis, _, _))| ChainJoint {
            parent_from_joint: Pose::new(*origin, *rotation),
            axis: UnitVector::new_normalize(*axis),
            motion: JointMotion::Turn,
            drive: Coupling::independent(i),
        })
        .collect();
    Chain::new(
        chain_joints,
        (0..joints.len()).map(|i| format!("joint_{i}")).collect(),
        joints.iter().map(|joint| joint.3).collect(),
        joints.iter().map(|joint| joint.4).collect(),
    )
}

/// First finger of the wide hand: abduction about the radial axis, then two flexions.
pub fn wide_finger() -> (Chain, Point) {
    let zero = Vector::zeros();
    let deg = f64::to_radians;
    let chain = turning(&[
        (Vector::new(0.045, 0.0, 0.0), zero, Vector::x(), deg(-35.0), deg(35.0)),
        (zero, zero, -Vector::y(), deg(-75.0), deg(60.0)),
        (Vector::new(0.0, 0.0, 0.058), zero, -Vector::y(), deg(5.0), deg(115.0)),
    ]);
    (chain, Point::new(0.0, 0.0, 0.050))
}

/// A random chain of `n` turning joints with lengths of finger size.
pub fn random_turning(n: usize, reach: f64, rng: &mut Rng) -> (Chain, Point) {
    let vector = |size: f64, rng: &mut Rng| Vector::from(rng.direction()) * size;
    let joints: Vec<_> = (0..n)
        .map(|_| {
            let middle = rng.uniform(-1.0, 1.0);
            let half = rng.uniform(0.3, 1.0) * reach;
            let (length, turn) = (rng.uniform(0.0, 0.06), rng.uniform(0.0, 3.0));
            (vector(length, rng), vector(turn, rng), vector(1.0, rng), middle - half, middle + half)
        })
        .collect();
    let center = Point::from(vector(0.05, rng));
    (turning(&joints), center)
}

/// A random configuration within the limits.
pub fn random_coordinates(chain: &Chain, rng: &mut Rng) -> Vec<f64> {
    (0..chain.n_coordinates()).map(|k| rng.uniform(chain.lower[k], chain.upper[k])).collect()
}

/// The chain from the root of a URDF to `tip_link`, which must be carried by fixed joints from the last moving one;
/// and the tip link's origin, moved by `center_in_tip`, in the last moving body.
pub fn urdf_chain(path: &std::path::Path, tip_link: &str, center_in_tip: Point) -> (Chain, Point) {
    let text = std::fs::read_to_string(path).expect("the URDF is readable");
    let document = roxmltree::Document::parse(&text).expect("the URDF is XML");
    let numbers = |text: Option<&str>, default: Vector| -> Vector {
        text.map_or(default, |text| {
            let values: Vec<f64> = text.split_whitespace().map(|v| v.parse().expect("a number")).collect();
            Vector::new(values[0], values[1], values[2])
        })
    };
    let (mut link, mut child_from_tip) = (tip_link.to_string(), Pose::identity());
    let mut joints: Vec<(ChainJoint, f64, f64)> = Vec::new();
    let mut center = None;
    while let Some(joint) = document.descendants().find(|node| {
        let child = node.children().find(|inner| inner.has_tag_name("child"));
        node.has_tag_name("joint") && child.and_then(|inner| inner.attribute("link")) == Some(link.as_str())
    }) {
        let inner = |name: &str| joint.children().find(|node| node.has_tag_name(name));
        let origin = inner("origin");
        let xyz = numbers(origin.and_then(|o| o.attribute("xyz")), Vector::zeros());
        let rpy = numbers(origin.and_then(|o| o.attribute("rpy")), Vector::zeros());
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
        let parent_from_joint = Pose::from_parts(xyz.into(), rotation);
        if joint.attribute("type") == Some("fixed") {
            child_from_tip = parent_from_joint * child_from_tip;
        } else {
            center.get_or_insert(child_from_tip * center_in_tip);
            if let Some((next, _, _)) = joints.last_mut() {
                next.parent_from_joint = child_from_tip * next.parent_from_joint;
            }
            child_from_tip = Pose::identity();
            let axis = numbers(inner("axis").and_then(|a| a.attribute("xyz")), Vector::x());
            let limit = |name: &str| -> f64 {
                inner("limit").and_then(|l| l.attribute(name)).map_or(0.0, |v| v.parse().expect("a limit"))
            };
            joints.push((
                ChainJoint {
                    parent_from_joint,
                    axis: UnitVector::new_normalize(axis),
                    motion: JointMotion::Turn,
                    drive: Coupling::independent(0),
                },
                limit("lower"),
                limit("upper"),
            ));
        }
        let parent = inner("parent").and_then(|node| node.attribute("link")).expect("a parent link");
        link = parent.to_string();
    }
    if let Some((first, _, _)) = joints.last_mut() {
        first.parent_from_joint = child_from_tip * first.parent_from_joint;
    }
    joints.reverse();
    let (lower, upper) = (joints.iter().map(|j| j.1).collect(), joints.iter().map(|j| j.2).collect());
    let names = (0..joints.len()).map(|i| format!("joint_{i}")).collect();
    let joints = joints
        .into_iter()
        .enumerate()
        .map(|(i, (joint, _, _))| ChainJoint { drive: Coupling::independent(i), ..joint });
    (Chain::new(joints.collect(), names, lower, upper), center.expect("a moving joint"))
}
