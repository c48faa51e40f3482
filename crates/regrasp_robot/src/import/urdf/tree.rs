//! Links and joints of a URDF as one tree with one root.

use super::joint::DraftJoint;
use crate::import::xml::Reader;
use crate::robot::{Joint, JointId, Link, LinkId};
use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::did_you_mean;
use roxmltree::Node;
use std::collections::BTreeMap;

/// Names in messages at most; a list of a thousand helps nobody.
const MAX_NAMES: usize = 8;

/// Reports every name that is used twice (`U131`).
pub(super) fn refuse_duplicates<'a, 'd: 'a, 'i: 'd>(
    reader: &mut Reader,
    kind: &str,
    named: impl Iterator<Item = (&'a str, Node<'d, 'i>)>,
) {
    let mut first: BTreeMap<&str, Node> = BTreeMap::new();
    for (name, node) in named {
        match first.get(name) {
            None => {
                first.insert(name, node);
            }
            Some(earlier) => {
                let line = reader.place(*earlier).line.unwrap_or(0);
                let place = reader.place(node);
                reader.found.push(
                    Diagnostic::new("U131", place, format!("the name is used already on line {line}"))
                        .element(kind, name)
                        .expected(format!("a name of its own for every {kind}")),
                );
            }
        }
    }
}

/// The joints with their links, and the root. Links learn the joint that carries them.
///
/// Reports: unknown links (`U132`), more than one root (`U133`), cycles (`U134`), links carried twice (`U135`).
pub(super) fn assemble(
    reader: &mut Reader,
    robot: Node,
    links: &mut [Link],
    link_nodes: &[Node],
    drafts: &[DraftJoint],
) -> (Vec<Joint>, Option<LinkId>) {
    let mut index: BTreeMap<String, LinkId> = BTreeMap::new();
    for (i, link) in links.iter().enumerate() {
        index.entry(link.name.clone()).or_insert(LinkId(i));
    }
    let mut joints = Vec::new();
    let mut all_known = true;
    for draft in drafts {
        let parent = known_link(reader, &index, draft, "parent", draft.parent);
        let child = known_link(reader, &index, draft, "child", draft.child);
        let (Some(parent), Some(child)) = (parent, child) else {
            all_known = false;
            continue;
        };
        if let Some(carrier) = links[child.0].parent_joint {
            let carrier: &Joint = &joints[carrier.0];
            let place = reader.place(draft.node);
            let problem = format!("carries link \"{}\", which joint \"{}\" carries already", draft.child, carrier.name);
            reader.found.push(
                Diagnostic::new("U135", place, problem)
                    .element("joint", draft.name)
                    .expected("a tree: every link carried by one joint"),
            );
            all_known = false;
            continue;
        }
        links[child.0].parent_joint = Some(JointId(joints.len()));
        joints.push(Joint {
            name: draft.name.to_owned(),
            kind: draft.kind,
            parent,
            child,
            parent_from_joint: draft.parent_from_joint,
            axis: draft.axis,
            limits: draft.limits,
            coupling: None,
        });
    }
    refuse_cycles(reader, links, link_nodes, &joints);
    let roots: Vec<usize> = (0..links.len()).filter(|&i| links[i].parent_joint.is_none()).collect();
    // Joints that could not be read leave links without a carrier; those are not more roots.
    if roots.len() > 1 && all_known && reader.found.is_empty() {
        let names: Vec<String> = roots.iter().take(MAX_NAMES).map(|&i| format!("\"{}\"", links[i].name)).collect();
        let more = if roots.len() > MAX_NAMES { ", ..." } else { "" };
        let place = reader.place(robot);
        reader.found.push(
            Diagnostic::new("U133", place, format!("has {} roots: {}{more}", roots.len(), names.join(", ")))
                .expected("one link that no joint carries")
                .fix("join them by fixed joints, or remove links that are not used"),
        );
    }
    (joints, roots.first().map(|&i| LinkId(i)))
}

fn known_link(
    reader: &mut Reader,
    index: &BTreeMap<String, LinkId>,
    draft: &DraftJoint,
    role: &str,
    name: &str,
) -> Option<LinkId> {
    if let Some(&link) = index.get(name) {
        return Some(link);
    }
    let node = draft.node.children().find(|child| child.has_tag_name(role)).unwrap_or(draft.node);
    let place = reader.place(node);
    let meant = did_you_mean(name, index.keys().map(String::as_str));
    reader.found.push(
        Diagnostic::new("U132", place, format!("{role} link \"{name}\" does not exist"))
            .element("joint", draft.name)
            .expected("the name of a <link>")
            .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"))),
    );
    None
}

/// Reports each cycle of links once, at its first link, with all its names.
fn refuse_cycles(reader: &mut Reader, links: &[Link], link_nodes: &[Node], joints: &[Joint]) {
    // 0: not visited, otherwise the walk that reached it first.
    let mut reached_by = vec![0usize; links.len()];
    for start in 0..links.len() {
        let mut current = start;
        while reached_by[current] == 0 {
            reached_by[current] = start + 1;
            match links[current].parent_joint {
                Some(joint) => current = joints[joint.0].parent.0,
                None => break,
            }
        }
        let closed = reached_by[current] == start + 1 && links[current].parent_joint.is_some();
        if !closed {
            continue;
        }
        let mut names = vec![format!("\"{}\"", links[current].name)];
        let mut walker = current;
        while let Some(joint) = links[walker].parent_joint {
            walker = joints[joint.0].parent.0;
            names.push(format!("\"{}\"", links[walker].name));
            if walker == current || names.len() > links.len() {
                break;
            }
        }
        names.reverse();
        if names.len() > MAX_NAMES + 1 {
            names.truncate(MAX_NAMES);
            names.push("...".into());
        }
        let place = link_nodes.get(current).map(|node| reader.place(*node));
        let place = place.unwrap_or_else(|| regrasp_base::Place::file(reader.file));
        reader.found.push(
            Diagnostic::new("U134", place, format!("links carry each other in a cycle: {}", names.join(" -> ")))
                .element("link", &links[current].name)
                .expected("a tree with one root"),
        );
    }
}
