//! Forward kinematics from the text of a URDF, by 4 x 4 matrices: shares nothing with the crate.

use nalgebra::{Matrix3, Matrix4, Vector3};
use std::collections::BTreeMap;

struct Joint {
    name: String,
    parent: String,
    parent_from_joint: Matrix4<f64>,
    axis: Vector3<f64>,
    kind: String,
    mimic: Option<(String, f64, f64)>,
}

/// The joints of a URDF by the link that they carry.
pub struct Tree(BTreeMap<String, Joint>);

fn numbers(text: Option<&str>, default: [f64; 3]) -> Vector3<f64> {
    let Some(text) = text else { return default.into() };
    let values: Vec<f64> = text.split_whitespace().map(|value| value.parse().unwrap()).collect();
    Vector3::new(values[0], values[1], values[2])
}

fn turn(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let axis = axis / axis.norm();
    let cross = Matrix3::new(0.0, -axis.z, axis.y, axis.z, 0.0, -axis.x, -axis.y, axis.x, 0.0);
    Matrix3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

fn matrix(rotation: Matrix3<f64>, translation: Vector3<f64>) -> Matrix4<f64> {
    let mut matrix = Matrix4::identity();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&translation);
    matrix
}

impl Tree {
    pub fn of(text: &str) -> Self {
        let document = roxmltree::Document::parse(text).unwrap();
        let joints = document.root_element().children().filter(|node| node.has_tag_name("joint"));
        let one = |node: roxmltree::Node| {
            let inner = |name: &str| node.children().find(|child| child.has_tag_name(name));
            let attribute = |child: &str, name: &str| inner(child).and_then(|n| n.attribute(name)).map(str::to_owned);
            let rpy = numbers(attribute("origin", "rpy").as_deref(), [0.0; 3]);
            let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
            let rotation = turn(&z, rpy.z) * turn(&y, rpy.y) * turn(&x, rpy.x);
            let mimic = attribute("mimic", "joint").map(|leader| {
                let number = |name, default| attribute("mimic", name).map_or(default, |text| text.parse().unwrap());
                (leader, number("multiplier", 1.0), number("offset", 0.0))
            });
            let joint = Joint {
                name: node.attribute("name").unwrap().to_owned(),
                parent: attribute("parent", "link").unwrap(),
                parent_from_joint: matrix(rotation, numbers(attribute("origin", "xyz").as_deref(), [0.0; 3])),
                axis: numbers(attribute("axis", "xyz").as_deref(), [1.0, 0.0, 0.0]),
                kind: node.attribute("type").unwrap().to_owned(),
                mimic,
            };
            (attribute("child", "link").unwrap(), joint)
        };
        Tree(joints.map(one).collect())
    }

    /// Names of all links that a joint carries.
    pub fn links(&self) -> impl Iterator<Item = &String> {
        self.0.keys()
    }

    /// Pose of `link` in the root's frame; `position` gives the positions of independent joints.
    pub fn root_from(&self, link: &str, position: &dyn Fn(&str) -> f64) -> Matrix4<f64> {
        let Some(joint) = self.0.get(link) else { return Matrix4::identity() };
        let at = match &joint.mimic {
            Some((leader, multiplier, offset)) => multiplier * position(leader) + offset,
            None if joint.kind == "fixed" => 0.0,
            None => position(&joint.name),
        };
        let motion = match joint.kind.as_str() {
            "fixed" => Matrix4::identity(),
            "prismatic" => matrix(Matrix3::identity(), joint.axis * (at / joint.axis.norm())),
            _ => matrix(turn(&joint.axis, at), Vector3::zeros()),
        };
        self.root_from(&joint.parent, position) * joint.parent_from_joint * motion
    }
}
