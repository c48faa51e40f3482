//! The files that a scene file names: found, read once, hashed.

use super::stock::Stock;
use crate::scene::InputFile;
use regrasp_base::Diagnostic;
use regrasp_base::files;
use regrasp_base::toml_table::{Entry, Found};
use regrasp_geometry::TriangleMesh;
use regrasp_geometry::import::{MAX_TRIANGLES, too_many};
use regrasp_robot::import::LoadOptions;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files found so far, for [`crate::Scene::inputs`].
pub(super) struct Files<'a> {
    scene: &'a Path,
    /// Where packages are.
    pub options: &'a LoadOptions,
    /// Hands, robots and meshes read before.
    pub stock: &'a Stock,
    /// In the order in which they were read, the scene file first.
    pub inputs: Vec<InputFile>,
    /// Triangles of all meshes read so far.
    n_triangles: usize,
}

impl<'a> Files<'a> {
    /// No file yet but the scene file itself, with its bytes.
    pub fn new(scene: &'a Path, bytes: &[u8], options: &'a LoadOptions, stock: &'a Stock) -> Self {
        let name = scene.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let mut files = Files { scene, options, stock, inputs: Vec::new(), n_triangles: 0 };
        files.record("scene", name, scene, bytes);
        files
    }

    /// The file that `entry` names: `package://NAME/PATH`, or a path relative to the scene file's folder and nothing else.
    ///
    /// Errors: empty (`S110`), not found or fetched from elsewhere (`S110`, `U101`).
    pub fn locate(&self, entry: &Entry, found: &mut Found) -> Option<PathBuf> {
        let name = entry.text(found)?;
        match self.find(name, entry, found) {
            Ok((path, notes)) => {
                for note in notes {
                    found.note(&entry.span, note);
                }
                Some(path)
            }
            Err(diagnostic) => {
                found.diagnostics.push(*diagnostic);
                None
            }
        }
    }

    fn find(&self, name: &str, entry: &Entry, found: &Found) -> Result<(PathBuf, Vec<String>), Box<Diagnostic>> {
        if name.contains("://") {
            let place = found.place(&entry.span);
            let resolved = self
                .options
                .resolve(name, self.scene, place)
                .map_err(|diagnostic| Box::new(diagnostic.element("key", &entry.name)))?;
            return Ok((resolved.path, resolved.notes));
        }
        if name.trim().is_empty() {
            return Err(Box::new(
                entry
                    .error("S110", found, "is empty")
                    .expected("a path relative to the scene file, or package://NAME/PATH"),
            ));
        }
        let path = self.scene.parent().unwrap_or(Path::new("")).join(name);
        if self.options.is_file(&path) {
            let remark = format!("{} is an absolute path \"{name}\": the scene works on this machine only", entry.name);
            return Ok((path, if Path::new(name).is_absolute() { vec![remark] } else { Vec::new() }));
        }
        let problem = if path.exists() { "is not a file" } else { "does not exist" };
        Err(Box::new(
            entry
                .error("S110", found, format!("\"{name}\" {problem}; looked at {}", path.display()))
                .expected("a path relative to the scene file, or package://NAME/PATH with --package NAME=DIR"),
        ))
    }

    /// Notes that `path` was read.
    pub fn record(&mut self, role: &str, name: String, path: &Path, bytes: &[u8]) {
        let sha256 = files::sha256(bytes);
        self.inputs.push(InputFile { role: role.to_owned(), name, path: path.to_owned(), sha256 });
    }

    /// False when the deadline has passed, with a diagnostic (`F004`).
    pub fn is_in_time(&self, found: &mut Found) -> bool {
        self.options.check_time(self.scene).map_err(|error| found.diagnostics.extend(error)).is_ok()
    }

    /// The mesh in the file that `entry` names, in the file's frame and unit.
    pub fn mesh(&mut self, entry: &Entry, found: &mut Found) -> Option<Arc<TriangleMesh>> {
        let path = self.locate(entry, found)?;
        let read = self.stock.mesh(&path, || {
            self.options.check_time(&path)?;
            let bytes = self.options.read(&path)?;
            let mesh = regrasp_geometry::import::read_mesh(&path, &bytes)?;
            // The bytes are not needed any more when the mesh is made ready, which takes several times as many.
            Ok((files::sha256(&bytes), Arc::new(mesh)))
        });
        let read = read.and_then(|(sha256, mesh)| {
            self.n_triangles += mesh.triangles().len();
            match self.n_triangles > MAX_TRIANGLES {
                true => Err(too_many(self.scene, self.n_triangles)),
                false => Ok((sha256, mesh)),
            }
        });
        match read {
            Ok((sha256, mesh)) => {
                let name = entry.text(found)?.to_owned();
                self.inputs.push(InputFile { role: "mesh".to_owned(), name, path, sha256 });
                self.is_in_time(found).then_some(mesh)
            }
            Err(error) => {
                found.diagnostics.extend(error);
                None
            }
        }
    }
}
