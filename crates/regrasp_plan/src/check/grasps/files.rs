//! `regrasp check grasps.json`: everything is read afresh from files.

use super::{GraspReport, check_grasps};
use crate::check::CheckSettings;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_grasp::list::{GraspList, GraspSource, MeshRecord, format};
use regrasp_robot::ContactModel;
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
use std::path::{Path, PathBuf};

/// Files of hand and object that replace those that the list names, and folders to look for those in.
#[derive(Debug, Clone, Default)]
pub struct GraspPaths {
    /// The hand.
    pub hand: Option<PathBuf>,
    /// The object: a mesh where the list names one, else a scene file.
    pub object: Option<PathBuf>,
    /// Folders in which the files that the list names are looked for, in this order.
    pub folders: Vec<PathBuf>,
}

/// A list, judged.
#[derive(Debug, Clone)]
pub struct CheckedGrasps {
    /// The list.
    pub list: GraspList,
    /// Hand and object.
    pub scene: GraspScene,
    /// What the checker says.
    pub report: GraspReport,
}

/// What a list says about where hand and object come from.
pub fn source_of(hand: &Path, object: &ObjectSource, torsion_radius: Option<f64>) -> GraspSource {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let (path, mesh) = match object {
        ObjectSource::Scene(path) => (path, None),
        ObjectSource::Mesh(mesh) => {
            let MeshObject { path, scale, mass, friction, edge_distance, crease_angle_deg } = mesh;
            let (scale, mass, friction) = (*scale, *mass, *friction);
            let (edge_distance, crease_angle_deg) = (*edge_distance, *crease_angle_deg);
            (path, Some(MeshRecord { scale, mass, friction, edge_distance, crease_angle_deg }))
        }
    };
    GraspSource { hand: text(hand), object: text(path), mesh, torsion_radius }
}

/// Reads hand and object of a list that came from `list_path`.
///
/// Errors: the list names no files, or they are not found (`G720`); files that cannot be read or understood.
pub fn load_grasp_files(
    list_path: &Path,
    list: &GraspList,
    paths: &GraspPaths,
    options: &LoadOptions,
) -> Result<GraspScene, InputError> {
    let fail = |problem: String| {
        Diagnostic::new("G720", Place::file(list_path), problem)
            .element("key", "source")
            .expected("files in the folder of the list or in the current folder")
            .fix("name them: --hand FILE --object FILE")
    };
    let source = list.source.as_ref();
    let find = |given: &Option<PathBuf>, named: Option<&String>, what: &str| -> Result<PathBuf, InputError> {
        if let Some(path) = given {
            return Ok(path.clone());
        }
        let named = named.ok_or_else(|| fail(format!("names no {what} file")))?;
        if named.contains("://") {
            return Ok(PathBuf::from(named));
        }
        let places = paths.folders.iter().map(|folder| folder.join(named));
        places
            .filter(|path| path.is_file())
            .map(|path| path.strip_prefix("./").map_or(path.clone(), Path::to_owned))
            .next()
            .ok_or_else(|| fail(format!("was made with the {what} \"{named}\", which is not found")).into())
    };
    let hand = find(&paths.hand, source.map(|source| &source.hand), "hand")?;
    let object = find(&paths.object, source.map(|source| &source.object), "object")?;
    let object = match source.and_then(|source| source.mesh.as_ref()) {
        None => ObjectSource::Scene(object),
        Some(mesh) => ObjectSource::Mesh(MeshObject {
            path: object,
            scale: mesh.scale,
            mass: mesh.mass,
            friction: mesh.friction,
            edge_distance: mesh.edge_distance,
            crease_angle_deg: mesh.crease_angle_deg,
        }),
    };
    let contact = match source.and_then(|source| source.torsion_radius) {
        Some(torsion_radius) => ContactModel::SoftFinger { torsion_radius },
        None => options.contact,
    };
    load_grasp_scene(&hand, &object, &LoadOptions { contact, ..options.clone() })
}

/// Reads and judges the list at `list_path`.
///
/// Errors: as [`load_grasp_files`]. A file that is not the one of the list is no error but a violation.
pub fn check_grasp_files(
    list_path: &Path,
    paths: &GraspPaths,
    options: &LoadOptions,
    settings: &CheckSettings,
    n_threads: usize,
) -> Result<CheckedGrasps, InputError> {
    let bytes = regrasp_base::files::read_at_most(list_path, format::MAX_BYTES)?;
    let list = format::from_json(list_path, &bytes)?;
    let scene = load_grasp_files(list_path, &list, paths, options)?;
    let report = check_grasps(&scene, &list, settings, n_threads);
    Ok(CheckedGrasps { list, scene, report })
}
