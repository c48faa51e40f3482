//! The scene file. `docs/reference/scene-format.md` says what it may contain.
//!
//! Codes: S100 not TOML, S101 unknown key, S102 missing key, S103 wrong type, S104 unknown word, S105 another format,
//! S106 exactly one of several, S107 number out of range, S110 file not found, S112 name used twice, S113 obstacle in a support, S120 unknown joint
//! or finger, S121 joint or finger missing; M201 units, M204 mesh far from its own origin, M205 to M207 unusable mesh,
//! M210 no volume; P302 out of reach, P303 joint limit, P304 contact off the surface, P305 wrist of a
//! short arm, P306 object that does not stand, P307 object in something else; V001 not finite, V002 quaternion
//! not of length one, V003 zero quaternion.

mod bodies;
mod contact;
mod files;
mod grasping;
mod gravity;
mod hand;
mod limits;
mod motion;
mod named;
mod numbers;
mod object;
mod overlap;
mod pick_and_place;
mod pose;
mod robot;
mod shape;
mod standing;
mod stock;
mod task;
mod units;

pub use grasping::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
pub use stock::Stock;
pub use task::{OpenStart, StartOrientation, Task};

use crate::hand_view::HandView;
use crate::manipulation::Manipulation;
use crate::scene::Scene;
use crate::state::State;
use bodies::Parts;
use files::Files;
use regrasp_base::InputError;
use regrasp_base::diagnostic::printable_line;
use regrasp_base::toml_table::{Codes, Found, Table};
use regrasp_robot::import::LoadOptions;
use std::path::Path;

/// Value of `format` in a scene file.
pub const FORMAT: &str = "regrasp-scene";
/// Values of `format_version` that this version reads. Version 1 has one hand, one object and one task.
pub const FORMAT_VERSIONS: [f64; 2] = [1.0, 2.0];

const CODES: Codes = Codes {
    syntax: "S100",
    unknown_key: "S101",
    missing_key: "S102",
    wrong_type: "S103",
    unknown_word: "S104",
    other_format: "S105",
    out_of_range: "S107",
};

/// A scene file, read.
#[derive(Debug, Clone)]
pub struct LoadedScene {
    /// What planners plan in.
    pub scene: Scene,
    /// Where everything is at the beginning: hands in their rest postures, objects where they rest.
    pub state: State,
    /// What is asked, in the order of the file. At least one task.
    pub tasks: Vec<Task>,
    /// Things worth knowing that are no errors, each with its place.
    pub notes: Vec<String>,
}

impl LoadedScene {
    /// The first task: of most scenes the only one.
    pub fn task(&self) -> &Task {
        &self.tasks[0]
    }

    /// The task called `name`.
    pub fn task_named(&self, name: &str) -> Option<&Task> {
        self.tasks.iter().find(|task| task.name == name)
    }

    /// The task of a plan for the query called `name`: the one of that name, else the first.
    pub fn task_for(&self, name: &str) -> &Task {
        self.task_named(name).unwrap_or(self.task())
    }

    /// The same scene with the task of a plan for the query called `name` as its first.
    #[must_use]
    pub fn for_query(self, name: &str) -> Self {
        match self.task_named(name) {
            Some(_) => self.choosing(name).expect("the scene has a task of this name"),
            None => self,
        }
    }

    /// The same scene with the task called `name` as its first; none where it has none of that name.
    pub fn choosing(mut self, name: &str) -> Option<Self> {
        let index = self.tasks.iter().position(|task| task.name == name)?;
        self.tasks[..=index].rotate_right(1);
        Some(self)
    }

    /// The hand and the object of `task`, among everything else.
    pub fn manipulation_of(&self, task: &Task) -> Manipulation<'_> {
        let (hand_index, object_index) = (task.hand, task.object);
        Manipulation { scene: &self.scene, state: &self.state, hand_index, object_index }
    }

    /// The hand and the object of the first task.
    pub fn manipulation(&self) -> Manipulation<'_> {
        self.manipulation_of(self.task())
    }

    /// The scene as the hand of the first task sees it.
    pub fn view(&self) -> HandView<'_> {
        HandView::of(&self.manipulation())
    }
}

/// Reads the scene file at `path` and every file it names.
///
/// Errors: every cause found, in this file and in those it names.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<LoadedScene, InputError> {
    load_scene_text(path, options.read(path)?, options)
}

/// As [`load_scene`], of a scene file that is or could be at `path` and has these bytes.
///
/// Errors: as [`load_scene`].
pub fn load_scene_text(path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedScene, InputError> {
    load_scene_with(path, bytes, options, &Stock::default())
}

/// As [`load_scene_text`]; what `stock` has of hands, robots and meshes is not read again. It must have been filled with the same
/// options.
///
/// Errors: as [`load_scene`].
pub fn load_scene_with(
    path: &Path,
    bytes: Vec<u8>,
    options: &LoadOptions,
    stock: &Stock,
) -> Result<LoadedScene, InputError> {
    let mut files = Files::new(path, &bytes, options, stock);
    let text = regrasp_base::files::text_of(path, bytes)?;
    let mut found = Found::new(path, &text, CODES);
    let document = found.parse();
    let parts = document.as_ref().and_then(|document| read(Table::root(document), &mut files, &mut found));
    let (notes, diagnostics) = (found.notes, found.diagnostics);
    let parts = diagnostics.into_result(parts)?;
    let Parts { robots, hands, objects, world_from_objects, grasp_files, supports, obstacles, gravity, limits, tasks } =
        parts.expect("what could not be read has left a diagnostic");
    let name = path.file_stem().map_or_else(String::new, |stem| printable_line(&stem.to_string_lossy()));
    let scene =
        Scene { name, robots, hands, objects, grasp_files, supports, obstacles, gravity, limits, inputs: files.inputs };
    let state = State::at_rest(&scene, world_from_objects);
    Ok(LoadedScene { scene, state, tasks, notes })
}

/// Reads the whole file; none if anything is missing, with the reason in `found`.
fn read(mut root: Table, files: &mut Files, found: &mut Found) -> Option<Parts> {
    let version = root.version_of_format(found, FORMAT, &FORMAT_VERSIONS)?;
    let parts = if version == 1.0 {
        bodies::one_hand(&mut root, files, found)
    } else {
        bodies::several(&mut root, files, found)
    };
    root.finish(found);
    parts
}
