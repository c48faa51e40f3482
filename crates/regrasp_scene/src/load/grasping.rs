//! A hand and an object by themselves, without a task: what grasp lists are made of.

use super::files::Files;
use super::{CODES, Stock, hand, load_scene, object, units};
use crate::gravity::Gravity;
use crate::hand_view::HandView;
use crate::limits::Limits;
use crate::manipulation::Manipulation;
use crate::object::Object;
use crate::scene::{InputFile, Scene, SceneHand};
use crate::state::State;
use regrasp_base::InputError;
use regrasp_base::diagnostic::printable_line;
use regrasp_base::toml_table::{Found, Table};
use regrasp_geometry::Pose;
use regrasp_robot::import::LoadOptions;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A mesh file with what makes it an object.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshObject {
    /// The file; `package://NAME/PATH` works too.
    pub path: PathBuf,
    /// Factor of all lengths of the file.
    pub scale: f64,
    /// Mass, in kilograms.
    pub mass: f64,
    /// Friction coefficient.
    pub friction: f64,
    /// Contacts keep this distance from creases, in metres. None: the default of scene files.
    pub edge_distance: Option<f64>,
    /// Edges that fold by more than this are creases, in degrees. None: the default of scene files.
    pub crease_angle_deg: Option<f64>,
}

/// Where an object comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum ObjectSource {
    /// The object of the first task of a scene file.
    Scene(PathBuf),
    /// A mesh.
    Mesh(MeshObject),
}

/// One hand and one object, under gravity of any direction. The hand stands at the world's origin.
#[derive(Debug, Clone)]
pub struct GraspScene {
    /// The scene. It has no obstacles.
    pub scene: Scene,
    /// The hand in its rest posture, the object at the world's origin.
    pub state: State,
    /// Things worth knowing that are no errors, each with its place.
    pub notes: Vec<String>,
}

impl GraspScene {
    /// A scene of `hand` and `object`.
    pub fn of(hand: SceneHand, object: Object, inputs: Vec<InputFile>, notes: Vec<String>) -> Self {
        let scene = Scene {
            grasp_files: Vec::new(),
            name: object.name.clone(),
            robots: Vec::new(),
            hands: vec![SceneHand { world_from_hand: Pose::identity(), carrier: None, reach: None, ..hand }],
            objects: vec![object],
            supports: Vec::new(),
            obstacles: Vec::new(),
            gravity: Some(Gravity::Any),
            limits: Limits::default(),
            inputs,
        };
        let state = State::at_rest(&scene, vec![Pose::identity()]);
        GraspScene { scene, state, notes }
    }

    /// The hand and the object.
    pub fn manipulation(&self) -> Manipulation<'_> {
        Manipulation::first(&self.scene, &self.state)
    }

    /// The scene as the hand sees it.
    pub fn view(&self) -> HandView<'_> {
        HandView::of(&self.manipulation())
    }
}

/// Name of the place of messages about arguments.
const ARGUMENTS: &str = "command line";

/// Reads the hand file or URDF `hand_path` and the object of `source`, and every file that they name.
///
/// Errors: every cause found, in these files and in those they name.
pub fn load_grasp_scene(
    hand_path: &Path,
    source: &ObjectSource,
    options: &LoadOptions,
) -> Result<GraspScene, InputError> {
    let from_scene = match source {
        ObjectSource::Scene(path) => Some(load_scene(path, options)?),
        ObjectSource::Mesh(_) => None,
    };
    let text = document(hand_path, source);
    let place = Path::new(ARGUMENTS);
    let stock = Stock::default();
    // Hands whose fingers share a motor grasp as well as others.
    let options = &LoadOptions { untie: true, ..options.clone() };
    let mut files = Files::new(place, text.as_bytes(), options, &stock);
    // The arguments are no file.
    files.inputs.clear();
    let mut found = Found::new(place, &text, CODES);
    let parsed = found.parse();
    let read = parsed.as_ref().and_then(|document| {
        let mut root = Table::root(document);
        let hand_table = root.optional("hand")?.table(&mut found);
        let hand = hand_table.and_then(|table| hand::hand(table, "hand".into(), &mut files, &mut found));
        let entry = root.optional("object");
        let mut notes = Vec::new();
        let object = match (&from_scene, &entry) {
            (Some(loaded), _) => {
                // Not the lists of grasps that the scene names: the one to be made may be among them.
                files.inputs.extend(loaded.scene.inputs.iter().filter(|input| input.role != "grasps").cloned());
                notes.clone_from(&loaded.notes);
                Some(loaded.manipulation().object().clone())
            }
            (None, Some(entry)) => entry
                .table(&mut found)
                .and_then(|table| object::object(table, object::Hands::of(&hand), &mut files, &mut found)),
            (None, None) => None,
        };
        let (hand, object) = (hand?, object?);
        if let Some(entry) = &entry {
            units::check_sizes(&hand.hand, &object, entry, &mut found);
        }
        Some((hand, object, notes))
    });
    // Outermost files go by their names alone: the same files are the same wherever they are found.
    let mesh = match source {
        ObjectSource::Mesh(mesh) => Some(mesh.path.as_path()),
        ObjectSource::Scene(_) => None,
    };
    for input in &mut files.inputs {
        let is_outermost = input.path == hand_path || mesh == Some(input.path.as_path());
        if let Some(name) = input.path.file_name().filter(|_| is_outermost) {
            input.name = name.to_string_lossy().into_owned();
        }
    }
    let (mut all_notes, diagnostics) = (found.notes, found.diagnostics);
    let (hand, object, notes) = diagnostics.into_result(read)?.expect("what could not be read has left a diagnostic");
    all_notes.extend(notes);
    Ok(GraspScene::of(hand, object, files.inputs, all_notes))
}

/// Hand and object as the tables of a scene file.
fn document(hand_path: &Path, source: &ObjectSource) -> String {
    let mut text = format!("[hand]\nfile = {}\n", quoted(&hand_path.to_string_lossy()));
    if let ObjectSource::Mesh(mesh) = source {
        let MeshObject { path, scale, mass, friction, edge_distance, crease_angle_deg } = mesh;
        let name = path.file_stem().map_or_else(String::new, |stem| printable_line(&stem.to_string_lossy()));
        let _ = write!(
            text,
            "\n[object]\nname = {}\nmesh = {{ file = {}, scale = {} }}\nmass = {}\nfriction = {}\n",
            quoted(&name),
            quoted(&path.to_string_lossy()),
            decimal(*scale),
            decimal(*mass),
            decimal(*friction),
        );
        for (key, value) in [("edge_distance", edge_distance), ("crease_angle_deg", crease_angle_deg)] {
            if let Some(value) = value {
                let _ = writeln!(text, "{key} = {}", decimal(*value));
            }
        }
    }
    text
}

/// A TOML number.
fn decimal(value: f64) -> String {
    format!("{value:?}").replace("NaN", "nan")
}

/// A TOML string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_numbers_are_toml_whatever_they_hold() {
        let mesh = MeshObject {
            path: "a \"b\"\\c\n.obj".into(),
            scale: f64::NAN,
            mass: 1e-7,
            friction: f64::INFINITY,
            edge_distance: Some(0.0),
            crease_angle_deg: None,
        };
        let text = document(Path::new("hand.toml"), &ObjectSource::Mesh(mesh));
        let mut found = Found::new(Path::new(ARGUMENTS), &text, CODES);
        let document = found.parse().expect("the text is TOML");
        let mut object = Table::root(&document).optional("object").unwrap().table(&mut found).unwrap();
        let mut mesh = object.optional("mesh").unwrap().table(&mut found).unwrap();
        assert_eq!(mesh.optional("file").unwrap().text(&mut found), Some("a \"b\"\\c\n.obj"));
        assert_eq!(object.optional("mass").unwrap().number(&mut found), Some(1e-7));
        assert_eq!(object.optional("friction").unwrap().number(&mut found), None, "not finite");
    }
}
