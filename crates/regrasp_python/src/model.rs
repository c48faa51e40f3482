//! Hands and scenes, read. They never change, so that any number of threads may share one.

use crate::describe;
use crate::error;
use crate::guard::guarded;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use regrasp::base::files;
use regrasp::base::{Diagnostic, Place, Rng};
use regrasp::geometry::Pose;
use regrasp::plan::check::prepared::Prepared;
use regrasp::robot::import::{KeptFiles, LoadOptions, ResolveOptions, load_hand};
use regrasp::robot::inspect::{InspectSettings, hand_file_text, inspect_hand};
use regrasp::scene::{Gravity, InputFile, LoadedScene, Stock, Task, load_scene_with};
use std::path::PathBuf;
use std::sync::Arc;

/// How files are read, as the package passes it: packages by name and folder, folders to search, lenient.
pub type Options = (Vec<(String, PathBuf)>, Vec<PathBuf>, bool);

/// How files are read.
pub fn load_options((packages, search_paths, lenient): Options) -> LoadOptions {
    LoadOptions { resolve: ResolveOptions { packages, search_paths }, lenient, ..LoadOptions::default() }
}

/// A scene and all it names.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Scene {
    /// What was read.
    pub loaded: LoadedScene,
    /// What the checker has prepared of it.
    pub prepared: Arc<Prepared>,
    source: Source,
}

/// Where a scene comes from.
#[derive(Debug, Clone)]
struct Source {
    /// The scene file; of a scene without one, where it would stand.
    path: PathBuf,
    /// Its content.
    text: Vec<u8>,
    /// True where there is a file at `path` with that content.
    is_on_disk: bool,
    options: LoadOptions,
    gravity: Option<GravityInHand>,
    /// Hands, robots and meshes, shared with the scenes varied from this one.
    stock: Arc<Stock>,
}

/// A file that a scene names: role, how it is named, where it was found, SHA-256, bytes.
type KeptFile<'py> = (String, String, PathBuf, String, Bound<'py, PyBytes>);

/// Gravity instead of the scene file's, as seen from the hand's base link.
#[derive(FromPyObject, Debug, Clone)]
enum GravityInHand {
    /// Along this direction, of any length.
    Direction([f64; 3]),
    /// The word "any".
    Word(String),
}

/// Reads a scene, under the gravity given. What `stock` has is not read again.
fn read(source: &Source, stock: &Stock) -> Result<LoadedScene, regrasp::InputError> {
    let loaded = load_scene_with(&source.path, source.text.clone(), &source.options, stock)?;
    let gravity = match &source.gravity {
        None => return Ok(loaded),
        Some(GravityInHand::Word(word)) => (word == "any").then_some(Gravity::Any),
        Some(GravityInHand::Direction(down)) => {
            Gravity::along(&loaded.manipulation().world_from_hand(), &(*down).into())
        }
    };
    let Some(gravity) = gravity else {
        let diagnostic = Diagnostic::new("A503", Place::file("regrasp.load_scene"), "is no direction");
        let expected = "a direction in the frame of the hand's base link, or \"any\"";
        return Err(diagnostic.element("argument", "gravity").expected(expected).into());
    };
    Ok(LoadedScene { scene: loaded.scene.under_gravity(gravity), ..loaded })
}

impl Scene {
    fn of(py: Python<'_>, source: Source) -> PyResult<Self> {
        let loaded = py.detach(|| read(&source, &source.stock)).map_err(|error| error::input(py, &error))?;
        Ok(Scene { loaded, prepared: Arc::default(), source })
    }

    /// The same scene, read afresh: the checker starts from files. Of a scene without a file the text is read again; hands and
    /// meshes, which never change, are those that it has.
    pub fn read_again(&self) -> Result<LoadedScene, regrasp::InputError> {
        match self.source.is_on_disk {
            true => {
                let text = files::read(&self.source.path)?;
                read(&Source { text, ..self.source.clone() }, &Stock::default())
            }
            false => read(&self.source, &self.source.stock),
        }
    }

    /// The task of this name; the first where none is asked for. Errors: there is none of that name (`A510`).
    pub fn task(&self, py: Python<'_>, name: Option<&str>) -> PyResult<&Task> {
        let Some(name) = name else { return Ok(self.loaded.task()) };
        self.loaded.task_named(name).ok_or_else(|| {
            let names: Vec<&str> = self.loaded.tasks.iter().map(|task| task.name.as_str()).collect();
            error::argument(py, "scene", "task", format!("is \"{name}\""), &format!("one of {}", names.join(", ")))
        })
    }

    /// Where its packages are.
    pub fn packages(&self) -> &ResolveOptions {
        &self.source.options.resolve
    }
}

/// The bytes of a file that a scene was read from. Errors: it cannot be read, or changed since (`F005`).
fn unchanged(input: &InputFile, options: &LoadOptions) -> Result<Vec<u8>, regrasp::InputError> {
    let bytes = options.read(&input.path)?;
    if files::sha256(&bytes) == input.sha256 {
        return Ok(bytes);
    }
    let diagnostic = Diagnostic::new("F005", Place::file(&input.path), "has changed since the scene was read");
    Err(diagnostic.fix("read the scene again").into())
}

#[pymethods]
impl Scene {
    /// Reads the scene file at `path`; `gravity` stands above the file's.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, options: Options, gravity: Option<GravityInHand>) -> PyResult<Self> {
        guarded(py, || {
            let text = py.detach(|| files::read(&path)).map_err(|error| error::input(py, &error))?;
            let (options, stock) = (load_options(options), Arc::default());
            Scene::of(py, Source { path, text, is_on_disk: true, options, gravity, stock })
        })
    }

    /// Reads the scene with the content `text`, as if it stood at `path`.
    #[staticmethod]
    fn parse(
        py: Python<'_>,
        text: Vec<u8>,
        path: PathBuf,
        options: Options,
        gravity: Option<GravityInHand>,
    ) -> PyResult<Self> {
        guarded(py, || {
            let (options, stock) = (load_options(options), Arc::default());
            Scene::of(py, Source { path, text, is_on_disk: false, options, gravity, stock })
        })
    }

    /// Reads the scene `text` as [`Scene::parse`], with `kept` for all files that it names: name, path, bytes.
    #[staticmethod]
    fn restore(
        py: Python<'_>,
        text: Vec<u8>,
        path: PathBuf,
        kept: Vec<(String, PathBuf, Vec<u8>)>,
        lenient: bool,
        gravity: Option<GravityInHand>,
    ) -> PyResult<Self> {
        guarded(py, || {
            let mut files = KeptFiles::default();
            for (name, path, bytes) in kept {
                files.insert(path, name, bytes);
            }
            let options = LoadOptions { lenient, kept: Some(Arc::new(files)), ..LoadOptions::default() };
            Scene::of(py, Source { path, text, is_on_disk: false, options, gravity, stock: Arc::default() })
        })
    }

    /// The scene `text` in place of this one's. Hands and meshes that both name are not read again.
    fn varied(&self, py: Python<'_>, text: Vec<u8>) -> PyResult<Self> {
        guarded(py, || Scene::of(py, Source { text, is_on_disk: false, ..self.source.clone() }))
    }

    /// The content of the scene file.
    fn text<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.source.text)
    }

    /// The files that the scene names, with their bytes. Errors: one has changed since the scene was read (`F005`).
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Vec<KeptFile<'py>>> {
        guarded(py, || {
            let named = self.loaded.scene.inputs.iter().skip(1);
            let kept = named.map(|input| {
                let bytes = py.detach(|| unchanged(input, &self.source.options));
                let bytes = bytes.map_err(|error| error::input(py, &error))?;
                let InputFile { role, name, path, sha256 } = input.clone();
                Ok((role, name, path, sha256, PyBytes::new(py, &bytes)))
            });
            kept.collect()
        })
    }

    /// What the scene is made of, as JSON.
    fn describe(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, || Ok(describe::scene(&self.loaded, &self.source.path).to_string()))
    }

    /// The poses that the query of `seed` asks for, from start to goal, as JSON.
    #[pyo3(signature = (seed, task=None))]
    fn query(&self, py: Python<'_>, seed: u64, task: Option<&str>) -> PyResult<String> {
        guarded(py, || Ok(describe::query(&self.task(py, task)?.query(seed)).to_string()))
    }

    /// Tip centres of a hand in the world, as [`Hand::tips`] gives them in the base frame.
    fn tips<'py>(&self, py: Python<'py>, hand: usize, joints: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || {
            let hands = &self.loaded.scene.hands;
            let placed = hands.get(hand).ok_or_else(|| {
                error::argument(py, "tips", "hand", format!("is {hand}"), &format!("less than {}", hands.len()))
            })?;
            tips(py, &placed.hand, &placed.world_from_hand, joints)
        })
    }
}

/// A hand file, or a URDF whose fingers were guessed.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Hand {
    hand: regrasp::robot::Hand,
    description: String,
}

#[pymethods]
impl Hand {
    /// Reads the hand at `path`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, options: Options) -> PyResult<Self> {
        guarded(py, || {
            let options = load_options(options);
            let loaded = py.detach(|| load_hand(&path, &options)).map_err(|error| error::input(py, &error))?;
            let mut description = describe::hand(&loaded.hand);
            description["notes"] = loaded.notes.into();
            Ok(Hand { hand: loaded.hand, description: description.to_string() })
        })
    }

    /// What the hand is like, as JSON.
    fn describe(&self) -> &str {
        &self.description
    }

    /// Tip centres for rows of joint positions: doubles in, doubles out, three per finger and row.
    fn tips<'py>(&self, py: Python<'py>, joints: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || tips(py, &self.hand, &Pose::identity(), joints))
    }
}

/// The text of a hand file about the URDF at `path`, as `regrasp inspect` writes it, and the remarks of the reader.
///
/// `urdf` is how the file names it. `allow` are names of links that may touch; names of links that there are not are passed over.
#[pyfunction]
pub fn hand_file(
    py: Python<'_>,
    path: PathBuf,
    options: Options,
    urdf: &str,
    allow: Vec<(String, String)>,
) -> PyResult<(String, Vec<String>)> {
    guarded(py, || {
        let options = load_options(options);
        let written = py.detach(|| {
            let loaded = load_hand(&path, &options)?;
            let table = inspect_hand(&loaded.hand, &InspectSettings::default(), &mut Rng::keyed(0, "inspect", 0));
            let mut pairs = table.pairs.always_ids;
            let link = |name: &String| loaded.hand.robot.link_named(name);
            pairs.extend(allow.iter().filter_map(|(a, b)| link(a).zip(link(b))).map(|(a, b)| (a.min(b), a.max(b))));
            Ok((hand_file_text(&loaded.hand, urdf, &pairs), loaded.notes))
        });
        written.map_err(|error: regrasp::InputError| error::input(py, &error))
    })
}

fn tips<'py>(
    py: Python<'py>,
    hand: &regrasp::robot::Hand,
    world_from_hand: &Pose,
    joints: &[u8],
) -> PyResult<Bound<'py, PyBytes>> {
    let (values, rest) = joints.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    if !rest.is_empty() || !values.len().is_multiple_of(hand.n_joints().max(1)) {
        let problem = format!("has {} values", values.len());
        return Err(error::argument(py, "tips", "joints", problem, &format!("rows of {}", hand.n_joints())));
    }
    let mut out = Vec::new();
    for row in values.chunks(hand.n_joints().max(1)) {
        let mut left = row;
        for finger in &hand.fingers {
            let own = left.split_off(..finger.chain.n_coordinates()).unwrap_or_default();
            let tip = world_from_hand * finger.chain.tip(own, &finger.tip.center_in_body);
            out.extend(tip.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    Ok(PyBytes::new(py, &out))
}
