//! Hands and scenes, read. They never change, so that any number of threads may share one.

use crate::describe;
use crate::error;
use crate::guard::guarded;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use regrasp::base::{Diagnostic, Place};
use regrasp::geometry::Pose;
use regrasp::robot::import::{LoadOptions, ResolveOptions, load_hand};
use regrasp::scene::{Gravity, LoadedScene, Task, load_scene};
use std::path::{Path, PathBuf};

/// How files are read, as the package passes it: packages by name and folder, folders to search, lenient.
pub type Options = (Vec<(String, PathBuf)>, Vec<PathBuf>, bool);

pub fn load_options((packages, search_paths, lenient): Options) -> LoadOptions {
    LoadOptions { resolve: ResolveOptions { packages, search_paths }, lenient, ..LoadOptions::default() }
}

/// A scene file and all it names.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Scene {
    /// What was read.
    pub loaded: LoadedScene,
    path: PathBuf,
    options: LoadOptions,
    gravity: Option<GravityInHand>,
}

/// Gravity instead of the scene file's, as seen from the hand's base link.
#[derive(FromPyObject, Debug, Clone)]
enum GravityInHand {
    /// Along this direction, of any length.
    Direction([f64; 3]),
    /// The word "any".
    Word(String),
}

/// Reads a scene, under the gravity given.
fn read(
    path: &Path,
    options: &LoadOptions,
    gravity: Option<&GravityInHand>,
) -> Result<LoadedScene, regrasp::InputError> {
    let loaded = load_scene(path, options)?;
    let gravity = match gravity {
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
    /// The same scene, read afresh: the checker starts from files.
    pub fn read_again(&self) -> Result<LoadedScene, regrasp::InputError> {
        read(&self.path, &self.options, self.gravity.as_ref())
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
        &self.options.resolve
    }

    /// The scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[pymethods]
impl Scene {
    /// Reads the scene file at `path`; `gravity` stands above the file's.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, options: Options, gravity: Option<GravityInHand>) -> PyResult<Self> {
        guarded(py, || {
            let options = load_options(options);
            let loaded =
                py.detach(|| read(&path, &options, gravity.as_ref())).map_err(|error| error::input(py, &error))?;
            Ok(Scene { loaded, path, options, gravity })
        })
    }

    /// What the scene is made of, as JSON.
    fn describe(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, || Ok(describe::scene(&self.loaded, &self.path).to_string()))
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
