//! URDF. Form: <http://wiki.ros.org/urdf/XML>, with the `<capsule>` of URDF 1.2 (`length` is that of the cylinder).
//!
//! Read: links with collision geometry, joints, limits, couplings; of visuals which they are, and no file that they name
//! unless they stand for the collision geometry of a link that has none.
//! Not read: inertia, transmissions, sensors.
//! Every problem of a file is reported in one run.

mod geometry;
mod joint;
mod mimic;
mod tree;
mod visual;

pub(crate) use geometry::DROPPED;
pub(crate) use mimic::{GOOD_COUPLING, check_coupling, refuse_empty_range};

use super::options::{LoadOptions, LoadedInput};
use super::resolve::Hints;
use super::xml::{Reader, children, parse};
use crate::robot::{Link, Robot};
use regrasp_base::diagnostic::{Lines, bad_name};
use regrasp_base::markup::without_undeclared_prefixes;
use regrasp_base::{Diagnostic, InputError, files};
use regrasp_geometry::TriangleMesh;
use regrasp_geometry::import::{MAX_TRIANGLES, too_many};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most links in a robot, and most joints.
const MAX_LINKS: usize = 1_000;
/// Most collision shapes in a robot: each is tested against many others.
const MAX_COLLISIONS: usize = 10_000;
/// Names of missing mesh files for which files of the same name are looked for elsewhere.
const MAX_HINTS: usize = 20;

/// A robot with what it was read from.
#[derive(Debug, Clone)]
pub struct LoadedRobot {
    /// The robot.
    pub robot: Robot,
    /// The URDF and its collision meshes, each once.
    pub inputs: Vec<LoadedInput>,
    /// Remarks: what was normalised, defaulted or (when lenient) dropped.
    pub notes: Vec<String>,
}

/// Reads the URDF file at `path` and the collision meshes that it names.
///
/// Errors: every problem of the file and its meshes (`U1xx`, `V001`, `M2xx`), or `F00x` when it cannot be read.
pub fn load_robot(path: &Path, options: &LoadOptions) -> Result<LoadedRobot, InputError> {
    load_robot_with(path, options, &BTreeSet::new())
}

/// As [`load_robot`]; the visuals of links called as `from_visuals` says stand for their collision geometry where they have none.
pub(crate) fn load_robot_with(
    path: &Path,
    options: &LoadOptions,
    from_visuals: &BTreeSet<String>,
) -> Result<LoadedRobot, InputError> {
    let bytes = options.read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let input = LoadedInput { role: "urdf".into(), name, path: path.to_owned(), sha256: files::sha256(&bytes) };
    let text = files::text_of(path, bytes)?;
    let mut meshes =
        Meshes { options: options.clone(), read: BTreeMap::new(), n_triangles: 0, n_missed: 0, inputs: vec![input] };
    let (robot, notes) = parse_robot(path, &text, (options.lenient, from_visuals), &mut meshes)?;
    Ok(LoadedRobot { robot, inputs: meshes.inputs, notes })
}

/// Reads `text`, the content of the URDF file `path`. `from_visuals` is that of [`load_robot_with`].
fn parse_robot(
    path: &Path,
    text: &str,
    (lenient, from_visuals): (bool, &BTreeSet<String>),
    meshes: &mut Meshes,
) -> Result<(Robot, Vec<String>), InputError> {
    let text = &without_undeclared_prefixes(text);
    let document = parse(path, text)?;
    let root = document.root_element();
    let lines = Lines::of(text);
    let mut reader = Reader::new(path, &lines, lenient);
    reader.refuse_other_root(root)?;
    reader.note_misspelt_children(root, &["link", "joint", "material", "transmission", "gazebo"], ("robot", ""));
    let name = root.attribute("name").unwrap_or_default().to_owned();
    if let Some(diagnostic) = bad_name(|| reader.attribute_place(root, "name"), "robot", &name) {
        reader.found.push(diagnostic);
    }

    let mut collisions = children(root, "link").flat_map(|link| geometry::elements(link, from_visuals));
    if let Some(node) = collisions.nth(MAX_COLLISIONS) {
        let problem = format!("has more than {MAX_COLLISIONS} <{}> elements", node.tag_name().name());
        return Err(Diagnostic::new("U105", reader.place(node), problem).into());
    }
    let mut links = Vec::new();
    let mut link_nodes = Vec::new();
    for node in children(root, "link") {
        let Some(link_name) = reader.required_name(node, "name", "link") else { continue };
        if links.len() == MAX_LINKS {
            let place = reader.place(node);
            return Err(Diagnostic::new("U105", place, format!("has more than {MAX_LINKS} links")).into());
        }
        reader.note_misspelt_children(node, &["inertial", "visual", "collision"], ("link", link_name));
        let elements = geometry::elements(node, from_visuals);
        let collision_from_visuals = elements.first().is_some_and(|element| element.has_tag_name("visual"));
        let collision = geometry::read_collisions(&mut reader, &elements, link_name, meshes);
        let visual = visual::read_visuals(path, &lines, node, link_name);
        let name = link_name.to_owned();
        links.push(Link { name, collision, visual, collision_from_visuals, parent_joint: None });
        link_nodes.push(node);
    }
    if links.is_empty() {
        let place = reader.place(root);
        reader.found.push(Diagnostic::new("U130", place, "has no <link>").expected("at least one link with a name"));
    }
    let draft_joints = joint::read_joints(&mut reader, root)?;
    tree::refuse_duplicates(&mut reader, "link", links.iter().map(|l| l.name.as_str()).zip(link_nodes.iter().copied()));
    tree::refuse_duplicates(&mut reader, "joint", draft_joints.iter().map(|j| (j.name, j.node)));
    let (joints, root_link) = tree::assemble(&mut reader, root, &mut links, &link_nodes, &draft_joints);
    let joints = mimic::resolve(&mut reader, joints, &draft_joints);
    let joints = joint::freeze_unmoving(&mut reader, joints, &draft_joints);
    let (root_link, notes) = reader.finish(root_link)?;
    // Without a problem there is a root: `assemble` reports its absence.
    let root = root_link.ok_or_else(|| Diagnostic::new("U134", regrasp_base::Place::file(path), "has no root link"))?;
    Ok((Robot { name, links, joints, root }, notes))
}

/// Collision meshes, read once each.
pub(crate) struct Meshes {
    options: LoadOptions,
    read: BTreeMap<PathBuf, Result<Arc<TriangleMesh>, InputError>>,
    /// Triangles of all of them.
    n_triangles: usize,
    /// Names that led to no file so far.
    n_missed: usize,
    /// The URDF and every mesh read so far.
    inputs: Vec<LoadedInput>,
}

impl Meshes {
    /// The mesh file called `name` in the reader's file; remarks go to `notes`.
    fn get(
        &mut self,
        name: &str,
        model: &Path,
        place: regrasp_base::Place,
        reader: &mut Reader,
    ) -> Result<Arc<TriangleMesh>, InputError> {
        let hints = if self.n_missed < MAX_HINTS { Hints::SameNameNear } else { Hints::None };
        let resolved = self.options.resolve_with(name, model, place, hints);
        self.n_missed += usize::from(resolved.is_err());
        let resolved = resolved?;
        resolved.notes.into_iter().for_each(|note| reader.note_once(note));
        if let Some(known) = self.read.get(&resolved.path) {
            return known.clone();
        }
        self.options.check_time(&resolved.path)?;
        let bytes = self.options.read(&resolved.path);
        let mesh = bytes.and_then(|bytes| {
            let sha256 = files::sha256(&bytes);
            let input = LoadedInput { role: "mesh".into(), name: name.to_owned(), path: resolved.path.clone(), sha256 };
            self.inputs.push(input);
            let mesh = regrasp_geometry::import::read_mesh(&resolved.path, &bytes)?;
            self.n_triangles += mesh.triangles().len();
            match self.n_triangles > MAX_TRIANGLES {
                true => Err(too_many(model, self.n_triangles)),
                false => Ok(Arc::new(mesh)),
            }
        });
        self.read.insert(resolved.path, mesh.clone());
        mesh
    }
}
