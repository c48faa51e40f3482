//! SRDF: groups, end effectors, pairs of links that are never tested. Form: <http://wiki.ros.org/srdf>.

use super::options::{LoadOptions, LoadedInput};
use super::xml::{Named, Reader, children, parse};
use crate::robot::{JointId, LinkId, Robot};
use regrasp_base::diagnostic::{Lines, did_you_mean};
use regrasp_base::markup::without_undeclared_prefixes;
use regrasp_base::{Diagnostic, InputError, files};
use roxmltree::Node;
use std::path::Path;

/// A named set of joints and links.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Name, unique in the file.
    pub name: String,
    /// Joints named one by one.
    pub joints: Vec<JointId>,
    /// Links named one by one.
    pub links: Vec<LinkId>,
    /// Chains, from base link to tip link.
    pub chains: Vec<(LinkId, LinkId)>,
    /// Names of groups that belong to it.
    pub groups: Vec<String>,
}

/// A hand or tool at the end of an arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EndEffector {
    /// Name.
    pub name: String,
    /// The group of its own links and joints.
    pub group: String,
    /// The link that it is attached to.
    pub parent_link: LinkId,
}

/// Two links that are never tested against each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisabledPair {
    /// The links, smaller id first.
    pub links: (LinkId, LinkId),
    /// Why, as the file says: `Adjacent`, `Always`, `Never`, ...
    pub reason: String,
}

/// What is read from an SRDF.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Srdf {
    /// Groups, in document order.
    pub groups: Vec<Group>,
    /// End effectors, in document order.
    pub end_effectors: Vec<EndEffector>,
    /// Pairs that are never tested, in document order.
    pub disabled_pairs: Vec<DisabledPair>,
}

/// An SRDF with what it was read from.
#[derive(Debug, Clone)]
pub struct LoadedSrdf {
    /// The content.
    pub srdf: Srdf,
    /// The file.
    pub input: LoadedInput,
    /// Remarks; what was skipped, when lenient.
    pub notes: Vec<String>,
}

/// Reads the SRDF file at `path`, which belongs to `robot`.
///
/// Errors: as XML in general; unknown links (`U161`), joints (`U162`) and groups (`U163`), skipped with a note when
/// lenient.
pub fn load_srdf(path: &Path, robot: &Robot, options: &LoadOptions) -> Result<LoadedSrdf, InputError> {
    let bytes = options.read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let input = LoadedInput { role: "srdf".into(), name, path: path.to_owned(), sha256: files::sha256(&bytes) };
    let text = files::text_of(path, bytes)?;
    let (srdf, notes) = parse_srdf(path, &text, robot, options.lenient)?;
    Ok(LoadedSrdf { srdf, input, notes })
}

/// Reads `text`, the content of the SRDF file `path`.
pub(crate) fn parse_srdf(
    path: &Path,
    text: &str,
    robot: &Robot,
    lenient: bool,
) -> Result<(Srdf, Vec<String>), InputError> {
    let text = &without_undeclared_prefixes(text);
    let document = parse(path, text)?;
    let root = document.root_element();
    // The joint between the robot and the world, of which the URDF knows nothing.
    let virtual_joints: Vec<&str> = children(root, "virtual_joint").filter_map(|node| node.attribute("name")).collect();
    let lines = Lines::of(text);
    let mut reader = Reader::new(path, &lines, lenient);
    reader.refuse_other_root(root)?;
    let mut srdf = Srdf::default();
    for node in children(root, "group") {
        // Groups without a name are references inside other groups in old files.
        let Some(name) = reader.required_name(node, "name", "group") else { continue };
        srdf.groups.push(read_group(&mut reader, node, name, (robot, &virtual_joints)));
    }
    let group_names: Vec<String> = srdf.groups.iter().map(|group| group.name.clone()).collect();
    for node in children(root, "end_effector") {
        srdf.end_effectors.extend(read_end_effector(&mut reader, node, robot, &group_names));
    }
    for node in children(root, "disable_collisions") {
        let element = ("disable_collisions", "");
        let a = known_link(&mut reader, node, "link1", element, robot);
        let b = known_link(&mut reader, node, "link2", element, robot);
        if let (Some(a), Some(b)) = (a, b) {
            let reason = node.attribute("reason").unwrap_or_default().to_owned();
            srdf.disabled_pairs.push(DisabledPair { links: (a.min(b), a.max(b)), reason });
        }
    }
    reader.finish(srdf)
}

fn read_group<'a, 'i: 'a>(
    reader: &mut Reader<'a>,
    node: Node<'a, 'i>,
    name: &str,
    (robot, virtual_joints): (&Robot, &[&str]),
) -> Group {
    let element = ("group", name);
    let joints = children(node, "joint")
        .filter(|joint| !joint.attribute("name").is_some_and(|name| virtual_joints.contains(&name)))
        .filter_map(|joint| known_joint(reader, joint, "name", element, robot))
        .collect();
    let links = children(node, "link").filter_map(|link| known_link(reader, link, "name", element, robot)).collect();
    let mut chains = Vec::new();
    for chain in children(node, "chain") {
        let base = known_link(reader, chain, "base_link", element, robot);
        let tip = known_link(reader, chain, "tip_link", element, robot);
        chains.extend(base.zip(tip));
    }
    let groups = children(node, "group").filter_map(|g| g.attribute("name").map(str::to_owned)).collect();
    Group { name: name.to_owned(), joints, links, chains, groups }
}

fn read_end_effector<'a, 'i: 'a>(
    reader: &mut Reader<'a>,
    node: Node<'a, 'i>,
    robot: &Robot,
    groups: &[String],
) -> Option<EndEffector> {
    let name = reader.required_name(node, "name", "end_effector")?;
    let element = ("end_effector", name);
    let parent_link = known_link(reader, node, "parent_link", element, robot);
    let group = reader.required(node, "group", element)?;
    if !groups.iter().any(|known| known == group) {
        unknown(reader, node, "group", group, element, "U163", groups.iter().map(String::as_str));
        return None;
    }
    Some(EndEffector { name: name.to_owned(), group: group.to_owned(), parent_link: parent_link? })
}

fn known_link<'a, 'i: 'a>(
    reader: &mut Reader<'a>,
    node: Node<'a, 'i>,
    attribute: &str,
    element: Named,
    robot: &Robot,
) -> Option<LinkId> {
    let name = reader.required(node, attribute, element)?;
    let link = robot.link_named(name);
    if link.is_none() {
        unknown(reader, node, attribute, name, element, "U161", robot.links.iter().map(|link| link.name.as_str()));
    }
    link
}

fn known_joint<'a, 'i: 'a>(
    reader: &mut Reader<'a>,
    node: Node<'a, 'i>,
    attribute: &str,
    element: Named,
    robot: &Robot,
) -> Option<JointId> {
    let name = reader.required(node, attribute, element)?;
    let joint = robot.joint_named(name);
    if joint.is_none() {
        unknown(reader, node, attribute, name, element, "U162", robot.joints.iter().map(|j| j.name.as_str()));
    }
    joint
}

/// Reports a name that does not exist, or notes it when the reader is lenient.
fn unknown<'n>(
    reader: &mut Reader,
    node: Node,
    attribute: &str,
    name: &str,
    element: Named,
    code: &'static str,
    candidates: impl Iterator<Item = &'n str>,
) {
    let kind = match code {
        "U161" => "link",
        "U162" => "joint",
        _ => "group",
    };
    if reader.lenient {
        reader.note(node, element, format!("skipped: there is no {kind} \"{name}\""));
        return;
    }
    if reader.found.counted_only() {
        return;
    }
    let meant = did_you_mean(name, candidates);
    let place = reader.attribute_place(node, attribute);
    let diagnostic = Diagnostic::new(code, place, format!("{attribute} \"{name}\" is not a {kind} of the robot"))
        .expected(format!("the name of a {kind}"))
        .fix(meant.map_or("--lenient to skip it".to_owned(), |meant| format!("did you mean \"{meant}\"?")));
    let diagnostic = if element.1.is_empty() { diagnostic } else { diagnostic.element(element.0, element.1) };
    reader.found.push(diagnostic);
}

/// The joints of group `name`: named, along its chains, and of the groups in it; moving ones once each, in the order
/// found.
pub fn joints_of_group(srdf: &Srdf, robot: &Robot, name: &str) -> Vec<JointId> {
    let mut joints = Vec::new();
    let mut waiting = vec![name];
    let mut seen: Vec<&str> = Vec::new();
    while let Some(name) = waiting.pop() {
        let Some(group) = srdf.groups.iter().find(|group| group.name == name) else { continue };
        if seen.contains(&name) {
            continue;
        }
        seen.push(name);
        let along_chains = group.chains.iter().flat_map(|(base, tip)| {
            let to_base = robot.joints_to(*base).len();
            robot.joints_to(*tip).into_iter().skip(to_base)
        });
        for joint in group.joints.iter().copied().chain(along_chains) {
            if robot.joints[joint.0].kind != crate::robot::JointKind::Fixed && !joints.contains(&joint) {
                joints.push(joint);
            }
        }
        waiting.extend(group.groups.iter().rev().map(String::as_str));
    }
    joints
}
