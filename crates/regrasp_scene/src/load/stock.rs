//! What scenes of one family share, read once: hands, robots, meshes, and the surfaces of objects.

use regrasp_base::InputError;
use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::{Shape, Surface, TriangleMesh};
use regrasp_robot::LoadedManipulator;
use regrasp_robot::contact_model::ContactModel;
use regrasp_robot::import::LoadedHand;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Meshes made ready that are remembered, at most: scenes that vary the scale of a mesh have a new one each time.
const MAX_BODIES: usize = 8;

/// Hands, robots and meshes that scenes were read with. Nothing in it changes once it is there.
#[derive(Debug, Default)]
pub struct Stock {
    hands: Mutex<BTreeMap<(PathBuf, String), LoadedHand>>,
    robots: Mutex<BTreeMap<PathBuf, LoadedManipulator>>,
    meshes: Mutex<BTreeMap<PathBuf, (String, Arc<TriangleMesh>)>>,
    bodies: Mutex<Vec<ReadyMesh>>,
}

/// The mesh of an object, made ready.
#[derive(Debug, Clone)]
pub(super) struct ReadyMesh {
    mesh: Arc<TriangleMesh>,
    crease_angle: f64,
    surface: Surface,
    body: Option<MeshBody>,
}

impl Stock {
    /// The hand at `path`, whose fingertips have `contact` where its file says nothing.
    pub(super) fn hand(
        &self,
        path: &Path,
        contact: ContactModel,
        read: impl FnOnce() -> Result<LoadedHand, InputError>,
    ) -> Result<LoadedHand, InputError> {
        known(&self.hands, (path.to_owned(), format!("{contact:?}")), read)
    }

    /// The robot at `path`.
    pub(super) fn robot(
        &self,
        path: &Path,
        read: impl FnOnce() -> Result<LoadedManipulator, InputError>,
    ) -> Result<LoadedManipulator, InputError> {
        known(&self.robots, path.to_owned(), read)
    }

    /// The mesh at `path` with the SHA-256 of its file.
    pub(super) fn mesh(
        &self,
        path: &Path,
        read: impl FnOnce() -> Result<(String, Arc<TriangleMesh>), InputError>,
    ) -> Result<(String, Arc<TriangleMesh>), InputError> {
        known(&self.meshes, path.to_owned(), read)
    }

    /// `shape` with its surface and collision body, made by `make`. A mesh that was made ready before takes the place of an
    /// equal one.
    pub(super) fn ready<E>(
        &self,
        shape: Shape,
        crease_angle: f64,
        make: impl FnOnce(&Shape) -> Result<(Surface, Option<MeshBody>), E>,
    ) -> Result<(Shape, Surface, Option<MeshBody>), E> {
        let Shape::Mesh(mesh) = &shape else {
            let (surface, body) = make(&shape)?;
            return Ok((shape, surface, body));
        };
        let is_same = |ready: &&ReadyMesh| {
            ready.crease_angle == crease_angle
                && ready.mesh.vertices() == mesh.vertices()
                && ready.mesh.triangles() == mesh.triangles()
        };
        let ready = self.bodies.lock().unwrap_or_else(PoisonError::into_inner).iter().find(is_same).cloned();
        if let Some(ready) = ready {
            return Ok((Shape::Mesh(ready.mesh), ready.surface, ready.body));
        }
        let (surface, body) = make(&shape)?;
        let mut bodies = self.bodies.lock().unwrap_or_else(PoisonError::into_inner);
        if bodies.len() == MAX_BODIES {
            bodies.remove(0);
        }
        bodies.push(ReadyMesh { mesh: mesh.clone(), crease_angle, surface: surface.clone(), body: body.clone() });
        drop(bodies);
        Ok((shape, surface, body))
    }
}

/// The value of `key`, read if it is not there yet. What cannot be read is not remembered.
fn known<K: Ord, V: Clone>(
    map: &Mutex<BTreeMap<K, V>>,
    key: K,
    read: impl FnOnce() -> Result<V, InputError>,
) -> Result<V, InputError> {
    let there = map.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
    if let Some(value) = there {
        return Ok(value);
    }
    let value = read()?;
    map.lock().unwrap_or_else(PoisonError::into_inner).insert(key, value.clone());
    Ok(value)
}
