//! Scenes for `regrasp place`, from what is asked for: a hand, an object and turns.

use crate::file_names::name_from;
use crate::scene_text::{SceneText, Turn, mesh, object_of_scene, primitive};
use regrasp_base::{Diagnostic, InputError, Place, files};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Mass and friction of an object of which nobody says any.
const USUAL: [(&str, f64); 2] = [("mass", 0.1), ("friction", 0.8)];

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// The scene file that is written.
    pub output: &'a Path,
    /// Hand file or URDF.
    pub hand: &'a Path,
    /// Mesh file, scene file whose object is taken, or a primitive such as `sphere:0.032`.
    pub object: &'a str,
    /// At least one turn.
    pub turns: &'a [Turn],
    /// Mass, in kilograms.
    pub mass: Option<f64>,
    /// Friction coefficient.
    pub friction: Option<f64>,
    /// Scale of a mesh, as scene files have it; factors with commas between them.
    pub scale: Option<&'a str>,
    /// What stands for the inside of a mesh, as scene files have it.
    pub solid: Option<&'a str>,
    /// Soft fingertips of this torsion radius, in metres, where the hand file names no contact model.
    pub torsion_radius: Option<f64>,
    /// Folders of packages, by name.
    pub packages: &'a [(String, PathBuf)],
}

impl Asked<'_> {
    /// What the scene is written from. Errors: an object that cannot be understood (`A505`), or read from its scene file.
    pub fn scene(&self) -> Result<SceneText, InputError> {
        Ok(SceneText {
            hand: name_from(self.output, self.hand, self.packages),
            torsion_radius: self.torsion_radius,
            object: self.object()?,
            turns: self.turns.to_vec(),
            comment: vec!["Written by `regrasp place`; edit freely. Metres and radians.".into()],
        })
    }

    /// The object as a scene file has it.
    fn object(&self) -> Result<Table, InputError> {
        let path = Path::new(self.object);
        let named = |file: &Path| name_from(self.output, file, self.packages);
        let mut object = if let Some(read) = primitive(self.object) {
            read.map_err(|expected| refused("OBJECT", format!("is \"{}\"", self.object), &expected))?
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            let folder = path.parent().unwrap_or(Path::new(""));
            let renamed = |file: &str| if file.contains("://") { file.to_owned() } else { named(&folder.join(file)) };
            object_of_scene(path, &files::read_text(path)?, None, renamed)?
        } else {
            let name = path.file_stem().map_or_else(|| "object".into(), |stem| stem.to_string_lossy());
            mesh(&if self.object.contains("://") { self.object.to_owned() } else { named(path) }, &name)
        };
        let of_mesh = [("scale", self.scale.is_some()), ("solid", self.solid.is_some())];
        let mut no_mesh = Table::new();
        let inside = match object.get_mut("mesh").and_then(Value::as_table_mut) {
            Some(inside) => inside,
            None => match of_mesh.iter().find(|(_, is_given)| *is_given) {
                Some((argument, _)) => {
                    return Err(refused(argument, "is for meshes".into(), "a mesh file as the object"));
                }
                None => &mut no_mesh,
            },
        };
        if let Some(solid) = self.solid {
            inside.insert("solid".into(), Value::String(solid.to_owned()));
        }
        if let Some(scale) = self.scale {
            let numbers: Option<Vec<f64>> = scale.split(',').map(|part| part.trim().parse().ok()).collect();
            let value = match numbers.as_deref() {
                Some([factor]) => Value::Float(*factor),
                Some(factors) => Value::Array(factors.iter().map(|factor| Value::Float(*factor)).collect()),
                None => Value::String(scale.to_owned()),
            };
            inside.insert("scale".into(), value);
        }
        for ((key, usual), given) in USUAL.into_iter().zip([self.mass, self.friction]) {
            let is_said = object.contains_key(key) || (key == "mass" && object.contains_key("density"));
            if given.is_some() && key == "mass" {
                object.remove("density");
            }
            if given.is_some() || !is_said {
                object.insert(key.into(), Value::Float(given.unwrap_or(usual)));
            }
        }
        Ok(object)
    }

    /// The scene of the best pose, of the second best, and so on: `scene.toml`, `scene.2.toml`.
    pub fn path(&self, index: usize) -> PathBuf {
        if index == 0 {
            return self.output.to_owned();
        }
        let stem = self.output.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let extension = self.output.extension().map_or_else(|| "toml".into(), |extension| extension.to_string_lossy());
        self.output.with_file_name(format!("{stem}.{}.{extension}", index + 1))
    }
}

/// What is wrong with the scene that was to be written: `draft`, for `path`, which nobody has yet: its lines are shown.
pub fn of_draft(mut error: InputError, path: &Path, draft: &str) -> InputError {
    for diagnostic in error.diagnostics.iter_mut().filter(|diagnostic| diagnostic.place.file == path) {
        let line = diagnostic.place.line.and_then(|line| draft.lines().nth(line as usize - 1));
        let shown = line.map_or(String::new(), |line| format!(" (line `{line}`)"));
        diagnostic.problem = format!("{}, in the scene that would be written{shown}", diagnostic.problem);
        let scale = diagnostic
            .fix
            .split_once("scale = ")
            .map(|(_, rest)| rest.split([' ', ',', '[']).next().unwrap_or_default().to_owned());
        let option = match scale.filter(|factor| !factor.is_empty()) {
            Some(factor) => Some(format!("--scale {factor}")),
            None => diagnostic.fix.contains("solid = \"hull\"").then(|| "--solid hull".to_owned()),
        };
        if let Some(option) = option {
            diagnostic.fix = format!("{}; for `regrasp place`, {option}", diagnostic.fix);
        }
    }
    error
}

fn refused(argument: &str, problem: String, expected: &str) -> InputError {
    Diagnostic::new("A505", Place::file("arguments"), problem).element("argument", argument).expected(expected).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_robot::import::LoadOptions;
    use regrasp_scene::{LoadedScene, load_scene_text};

    fn asked<'a>(object: &'a str, turns: &'a [Turn], output: &'a Path, hand: &'a Path) -> Asked<'a> {
        let (mass, friction, scale, solid, torsion_radius) = (None, None, None, None, None);
        Asked { output, hand, object, turns, mass, friction, scale, solid, torsion_radius, packages: &[] }
    }

    /// The scene that would be written, or what is wrong with it.
    fn load(asked: &Asked) -> Result<LoadedScene, String> {
        let draft = asked.scene().unwrap().text(None);
        let loaded = load_scene_text(asked.output, draft.clone().into_bytes(), &LoadOptions::default());
        loaded.map_err(|error| of_draft(error, asked.output, &draft).to_string())
    }

    /// What is written is read back as what was asked, with the start given and left open.
    #[test]
    fn texts_are_scenes_that_say_what_was_asked() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let hand = root.join("assets/hands/wide_four_finger/hand.toml");
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("scene.toml");
        let turns: Vec<Turn> = ["z:90", "1,0,0:-45"].map(|text| Turn::read(text).unwrap()).into();
        let cube = root.join("scenes/cubic.toml");
        for object in ["sphere:0.03", "box:0.05,0.05,0.06", "cylinder:0.02,0.08", cube.to_str().unwrap()] {
            for n_turns in [1, 2] {
                let asked = asked(object, &turns[..n_turns], &output, &hand);
                let text = asked.scene().unwrap();
                let start = regrasp_geometry::pose_from([0.01, -0.002, 0.07], [0.6, 0.0, 0.0, 0.8]);
                let read = |start| load_scene_text(&output, text.text(start).into_bytes(), &LoadOptions::default());
                let given = read(Some(&start)).unwrap_or_else(|error| panic!("{object}: {error}"));
                let open = read(None).unwrap_or_else(|error| panic!("{object}: {error}"));
                assert_eq!(given.tasks.len(), n_turns);
                for (given, open) in given.tasks.iter().zip(&open.tasks) {
                    let (given, open) = (given.query(5), open.query(5));
                    assert!(open.has_open_start() && !given.has_open_start());
                    let started = open.started_at(&start);
                    for (a, b) in [(started.start(), given.start()), (started.goal(), given.goal())] {
                        let apart = regrasp_geometry::frame::pose_distance(a, b, 1.0);
                        assert!(apart < 1e-12, "{object}: {apart}");
                    }
                }
                if object.ends_with(".toml") {
                    let original = regrasp_scene::load_scene(&cube, &LoadOptions::default()).unwrap();
                    let (a, b) = (&original.scene.objects[0], &given.scene.objects[0]);
                    assert_eq!((a.mass, a.friction, &a.name), (b.mass, b.friction, &b.name));
                }
            }
        }
        assert_eq!(asked("sphere:0.03", &turns, &output, &hand).path(1), folder.path().join("scene.2.toml"));
    }

    /// A mesh in millimetres is told so, with the option.
    #[test]
    fn a_mesh_in_millimetres_is_told_the_option_that_scales_it() {
        let folder = tempfile::tempdir().unwrap();
        let hand = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
        let (output, mesh) = (folder.path().join("scene.toml"), folder.path().join("mm.obj"));
        let text = "v 0 0 0\nv 50 0 0\nv 0 50 0\nv 0 0 50\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        std::fs::write(&mesh, text).unwrap();
        let turns = [Turn::read("z:90").unwrap()];
        let large = asked(mesh.to_str().unwrap(), &turns, &output, &hand);
        for solid in [None, Some("hull")] {
            let said = load(&Asked { solid, ..large }).err().unwrap();
            assert!(
                said.contains("M201") && said.trim_end().ends_with("; for `regrasp place`, --scale 0.001"),
                "{said}"
            );
        }
        assert!(load(&Asked { scale: Some("0.001"), ..large }).is_ok());
    }

    /// A mesh with a hole has no volume; with its hull for its inside it has one. The line of the scene that nobody has yet is shown.
    #[test]
    fn a_refused_draft_shows_its_lines_and_the_option_that_helps() {
        let folder = tempfile::tempdir().unwrap();
        let hand = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
        let (output, mesh) = (folder.path().join("scene.toml"), folder.path().join("open.obj"));
        // A tetrahedron without its last face.
        let text = "v 0 0 0\nv 0.05 0 0\nv 0 0.05 0\nv 0 0 0.05\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
        std::fs::write(&mesh, text).unwrap();
        let turns = [Turn::read("z:90").unwrap()];
        let object = mesh.to_str().unwrap();
        let open = asked(object, &turns, &output, &hand);
        let said = load(&open).err().unwrap();
        assert!(said.contains("M210") && said.contains("(line `[object]`)"), "{said}");
        assert!(said.contains("for `regrasp place`, --solid hull"), "{said}");
        let loaded = load(&Asked { solid: Some("hull"), ..open }).unwrap();
        // A quarter of the way from the right angle to each other corner.
        let center = loaded.scene.objects[0].center_of_mass;
        assert!((center - regrasp_geometry::Point::new(0.0125, 0.0125, 0.0125)).norm() < 1e-9, "{center}");
        let refused = Asked { object: "sphere:0.03", solid: Some("hull"), ..open }.scene().unwrap_err().to_string();
        assert!(refused.contains("argument \"solid\": is for meshes"), "{refused}");
    }
}
