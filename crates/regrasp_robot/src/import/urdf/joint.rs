//! Joints of a URDF: type, axis, limits.

use super::MAX_LINKS;
use super::geometry::read_origin;
use crate::import::xml::{Reader, child, children};
use crate::robot::{Joint, JointId, JointKind, Limits};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::diagnostic::{did_you_mean, number};
use regrasp_base::{Diagnostic, InputError};
use regrasp_geometry::frame::{direction, length};
use regrasp_geometry::{Pose, UnitVector, Vector};
use roxmltree::Node;

/// Joint types of the URDF form.
const TYPES: [&str; 6] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar"];

/// Limits of speed and effort above this limit nothing, in SI units.
const MAX_BOUND: f64 = 1e9;
/// With a lower limit of speed a motion of a radian would take longer than eleven days; in radians or metres per second.
const MIN_VELOCITY: f64 = 1e-6;
/// Largest limit of a joint's position, in radians or metres: plans hold no larger ones.
const MAX_POSITION: f64 = 1e6;

/// A joint before its links are known.
pub(super) struct DraftJoint<'a, 'input> {
    pub node: Node<'a, 'input>,
    pub name: &'a str,
    pub parent: &'a str,
    pub child: &'a str,
    pub kind: JointKind,
    pub parent_from_joint: Pose,
    pub axis: UnitVector,
    pub limits: Option<Limits>,
}

/// All joints that can be read; problems go to the reader. Errors: too many (`U105`).
pub(super) fn read_joints<'a, 'input: 'a>(
    reader: &mut Reader<'a>,
    root: Node<'a, 'input>,
) -> Result<Vec<DraftJoint<'a, 'input>>, InputError> {
    // Every joint carries a link of its own.
    if let Some(node) = children(root, "joint").nth(MAX_LINKS) {
        let place = reader.place(node);
        return Err(Diagnostic::new("U105", place, format!("has more than {MAX_LINKS} joints")).into());
    }
    // Transmissions and sensors hold elements called <joint> too; only those directly below <robot> are joints.
    Ok(children(root, "joint").filter_map(|node| read_joint(reader, node)).collect())
}

fn read_joint<'a, 'input: 'a>(reader: &mut Reader<'a>, node: Node<'a, 'input>) -> Option<DraftJoint<'a, 'input>> {
    let name = reader.required_name(node, "name", "joint")?;
    let element = ("joint", name);
    let known = ["origin", "parent", "child", "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller"];
    reader.note_misspelt_children(node, &known, element);
    let kind = read_kind(reader, node, name);
    let parent = read_link(reader, node, name, "parent");
    let child = read_link(reader, node, name, "child");
    let parent_from_joint = read_origin(reader, node, element);
    let moves = kind.is_some_and(|kind| kind != JointKind::Fixed);
    let axis = if moves { read_axis(reader, node, name) } else { Some(Vector::x_axis()) };
    let limits = match kind {
        Some(JointKind::Revolute | JointKind::Prismatic) => read_limits(reader, node, name, kind).map(Some),
        Some(JointKind::Continuous) => {
            note_useless_limits(reader, node, name);
            Some(None)
        }
        _ => Some(None),
    };
    // What could not be read has its message; a stand-in lets the rest of the file be looked at in the same run.
    Some(DraftJoint {
        node,
        name,
        parent: parent?,
        child: child?,
        kind: kind.unwrap_or(JointKind::Continuous),
        parent_from_joint: parent_from_joint.unwrap_or_else(Pose::identity),
        axis: axis.unwrap_or_else(Vector::x_axis),
        limits: limits.flatten(),
    })
}

fn read_kind(reader: &mut Reader, node: Node, name: &str) -> Option<JointKind> {
    let place = reader.attribute_place(node, "type");
    match node.attribute("type") {
        Some("revolute") => Some(JointKind::Revolute),
        Some("continuous") => Some(JointKind::Continuous),
        Some("prismatic") => Some(JointKind::Prismatic),
        Some("fixed") => Some(JointKind::Fixed),
        Some(other @ ("floating" | "planar")) => {
            if reader.lenient {
                reader.note(node, ("joint", name), format!("type \"{other}\" is not supported; held fixed"));
                return Some(JointKind::Fixed);
            }
            reader.found.push(
                Diagnostic::new("U125", place, format!("unsupported joint type \"{other}\""))
                    .element("joint", name)
                    .expected("revolute, continuous, prismatic or fixed")
                    .fix("type=\"fixed\", or --lenient to hold it fixed"),
            );
            None
        }
        Some(other) => {
            let meant = did_you_mean(other, TYPES).map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"));
            reader.found.push(
                Diagnostic::new("U126", place, format!("unknown joint type \"{other}\""))
                    .element("joint", name)
                    .expected("revolute, continuous, prismatic or fixed")
                    .fix(meant),
            );
            None
        }
        None => reader.required(node, "type", ("joint", name)).and(None),
    }
}

/// The link named by the `<parent>` or `<child>` of a joint.
fn read_link<'a, 'input: 'a>(
    reader: &mut Reader<'a>,
    node: Node<'a, 'input>,
    name: &str,
    tag: &'static str,
) -> Option<&'a str> {
    let Some(link) = child(node, tag) else {
        let place = reader.place(node);
        reader.found.push(
            Diagnostic::new("U112", place, format!("has no <{tag}>"))
                .element("joint", name)
                .expected(format!("<{tag} link=\"...\"/>")),
        );
        return None;
    };
    reader.required(link, "link", ("joint", name))
}

fn read_axis(reader: &mut Reader, node: Node, name: &str) -> Option<UnitVector> {
    let Some(axis) = child(node, "axis") else {
        reader.note(node, ("joint", name), "has no <axis>; URDF's default 1 0 0 is taken");
        return Some(Vector::x_axis());
    };
    let given = Vector::from(reader.numbers(axis, "xyz", None, ("joint", name))?);
    let Some(direction) = direction(&given) else {
        let place = reader.attribute_place(axis, "xyz");
        let seen = axis.attribute("xyz").unwrap_or_default();
        reader.found.push(
            Diagnostic::new("U122", place, format!("axis \"{seen}\" has length 0"))
                .element("joint", name)
                .expected("a direction, such as \"0 0 1\""),
        );
        return None;
    };
    let length = length(&given);
    // Axes written with a few digits are never exactly of length one; only a wrong length is worth a word.
    if (length - 1.0).abs() > 1e-3 {
        reader.note(axis, ("joint", name), format!("axis has length {}; taken as a direction", number(length)));
    }
    Some(direction)
}

fn read_limits(reader: &mut Reader, node: Node, name: &str, kind: Option<JointKind>) -> Option<Limits> {
    let element = ("joint", name);
    let (word, alternative) = match kind {
        Some(JointKind::Prismatic) => ("prismatic", ""),
        _ => ("revolute", ", or type=\"continuous\" if it turns without end"),
    };
    let limit = child(node, "limit");
    let has = |attribute: &str| limit.is_some_and(|l| l.has_attribute(attribute));
    let Some(limit) = limit.filter(|_| has("lower") || has("upper")) else {
        let place = reader.place(limit.unwrap_or(node));
        let seen = if limit.is_some() { "a <limit> without lower and upper" } else { "no <limit>" };
        reader.found.push(
            Diagnostic::new("U120", place, format!("is {word} but has {seen}"))
                .element("joint", name)
                .expected("<limit lower=\"...\" upper=\"...\" effort=\"...\" velocity=\"...\"/>")
                .fix(format!("add the limit{alternative}")),
        );
        return None;
    };
    for attribute in ["lower", "upper"] {
        if !has(attribute) {
            reader.note(limit, element, format!("<limit> has no {attribute}; URDF's default 0 is taken"));
        }
    }
    let [lower] = reader.numbers(limit, "lower", Some([0.0]), element)?;
    let [upper] = reader.numbers(limit, "upper", Some([0.0]), element)?;
    let velocity = read_bound(reader, limit, "velocity", name);
    let velocity = velocity.and_then(|velocity| likely_velocity(reader, limit, velocity, name));
    let effort = read_bound(reader, limit, "effort", name);
    if lower > upper {
        let place = reader.attribute_place(limit, "lower");
        reader.found.push(
            Diagnostic::new(
                "U121",
                place,
                format!("lower limit {} is above upper limit {}", number(lower), number(upper)),
            )
            .element("joint", name)
            .expected("lower <= upper")
            .fix(format!("swap them: lower=\"{}\" upper=\"{}\"", number(upper), number(lower))),
        );
        return None;
    }
    if let Some((attribute, far)) =
        [("lower", lower), ("upper", upper)].into_iter().find(|(_, q)| q.abs() > MAX_POSITION)
    {
        let place = reader.attribute_place(limit, attribute);
        reader.found.push(
            Diagnostic::new("U124", place, format!("{attribute} limit is {}", number(far)))
                .element("joint", name)
                .expected(format!("at most {} in size, in radians or metres", number(MAX_POSITION)))
                .fix(if word == "revolute" { "type=\"continuous\" if it turns without end" } else { "" }),
        );
        return None;
    }
    if word == "revolute" && (lower.abs() > 20.0 || upper.abs() > 20.0) {
        reader.note(
            limit,
            element,
            format!("limits {}..{} look like degrees; they are read as radians", number(lower), number(upper)),
        );
    }
    Some(Limits { lower, upper, velocity, effort })
}

/// The highest speed or effort; 0 means "not given" in many files and is taken so, with a note, as are numbers so large that they
/// limit nothing.
fn read_bound(reader: &mut Reader, limit: Node, attribute: &str, name: &str) -> Option<f64> {
    let value = reader.number(limit, attribute, ("joint", name))?;
    if value > 0.0 && value <= MAX_BOUND {
        return Some(value);
    }
    reader.note(limit, ("joint", name), format!("{attribute} limit {} is taken as not given", number(value)));
    None
}

/// The highest speed, unless no plan would ever end with it. Error: `U123`.
fn likely_velocity(reader: &mut Reader, limit: Node, velocity: f64, name: &str) -> Option<f64> {
    if velocity >= MIN_VELOCITY {
        return Some(velocity);
    }
    let place = reader.attribute_place(limit, "velocity");
    reader.found.push(
        Diagnostic::new("U123", place, format!("velocity limit is {}", number(velocity)))
            .element("joint", name)
            .expected(format!("at least {}, in radians or metres per second", number(MIN_VELOCITY)))
            .fix("velocity=\"0\" where the limit is not known"),
    );
    None
}

fn note_useless_limits(reader: &mut Reader, node: Node, name: &str) {
    if let Some(limit) = child(node, "limit")
        && (limit.has_attribute("lower") || limit.has_attribute("upper"))
    {
        reader.note(limit, ("joint", name), "is continuous; its lower and upper limits are not used");
    }
}

/// Turns joints with lower = upper into fixed joints at that position, with a note.
pub(super) fn freeze_unmoving(reader: &mut Reader, mut joints: Vec<Joint>, drafts: &[DraftJoint]) -> Vec<Joint> {
    for i in 0..joints.len() {
        let joint = &joints[i];
        let Some(limits) = joint.limits.filter(|limits| limits.lower == limits.upper) else { continue };
        if joint.coupling.is_some()
            || joints.iter().flat_map(|other| &other.coupling).any(|c| c.multiplier(JointId(i)) != 0.0)
        {
            continue;
        }
        let position = limits.lower;
        let motion = match joint.kind {
            JointKind::Prismatic => {
                Pose::from_parts(Translation3::from(joint.axis.into_inner() * position), UnitQuaternion::identity())
            }
            _ => Pose::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&joint.axis, position)),
        };
        let name = joint.name.clone();
        if let Some(draft) = drafts.iter().find(|draft| draft.name == name) {
            reader.note(draft.node, ("joint", &name), format!("lower and upper limit are both {position}; held fixed"));
        }
        let joint = &mut joints[i];
        joint.parent_from_joint *= motion;
        joint.kind = JointKind::Fixed;
        joint.limits = None;
    }
    joints
}
