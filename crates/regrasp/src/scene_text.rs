//! Scene files as text: a hand, an object, turns about axes of the world.

use regrasp_base::toml_table::too_deep;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::Pose;
use std::fmt::Write;
use std::path::Path;
use toml::{Table, Value};

/// Shapes that can be said in a few numbers, and what the numbers are.
const PRIMITIVES: [(&str, &str); 5] = [
    ("sphere", "sphere:RADIUS"),
    ("box", "box:X,Y,Z"),
    ("cylinder", "cylinder:RADIUS,LENGTH"),
    ("capsule", "capsule:RADIUS,LENGTH"),
    ("ellipsoid", "ellipsoid:RX,RY,RZ"),
];
/// Keys of an object that say where it is.
const POSE_KEYS: [&str; 4] = ["position", "quat_xyzw", "quat_wxyz", "rotation_vector"];

/// A turn about an axis of the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// The axis: `x`, `y`, `z` or three numbers.
    axis: Value,
    /// What it is called: `z90`.
    name: String,
    /// Angle, in degrees.
    angle_deg: f64,
}

impl Turn {
    /// Reads `z:90`, or `1,1,0:45`. Errors: what was expected.
    pub fn read(text: &str) -> Result<Self, String> {
        let expected = || "expected AXIS:DEGREES, such as z:90 or 1,1,0:45".to_owned();
        let (axis, angle) = text.rsplit_once(':').ok_or_else(expected)?;
        let angle_deg: f64 = angle.trim().parse().map_err(|_| expected())?;
        if !(angle_deg.abs() <= 3600.0) {
            return Err("expected degrees between -3600 and 3600".into());
        }
        if angle_deg == 0.0 {
            return Err("expected an angle other than 0; whether the object can be held is asked with --hold".into());
        }
        let (axis, angle) = (axis.trim(), angle.trim());
        let (value, name) = match axis {
            "x" | "y" | "z" => (Value::String(axis.into()), format!("{axis}{angle}")),
            _ => match numbers(axis).as_deref() {
                Some([x, y, z]) if [x, y, z].iter().any(|part| **part != 0.0) => {
                    (floats(&[*x, *y, *z]), format!("{axis}_{angle}"))
                }
                _ => return Err(expected()),
            },
        };
        Ok(Turn { axis: value, name, angle_deg })
    }

    /// What it is called: `z90`.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// The object of a primitive said in a few numbers, such as `sphere:0.032`; None where `text` is none. Errors: what was expected.
pub fn primitive(text: &str) -> Option<Result<Table, String>> {
    let (kind, rest) = text.split_once(':')?;
    let (_, form) = PRIMITIVES.iter().find(|(name, _)| *name == kind)?;
    let wrong = || format!("{form}, in metres");
    let mut inside = Table::new();
    match (kind, numbers(rest).as_deref()) {
        ("sphere", Some([radius])) => {
            inside.insert("radius".into(), Value::Float(*radius));
        }
        ("box", Some(size @ [_, _, _])) => {
            inside.insert("size".into(), floats(size));
        }
        ("ellipsoid", Some(radii @ [_, _, _])) => {
            inside.insert("radii".into(), floats(radii));
        }
        ("cylinder" | "capsule", Some([radius, length])) => {
            inside.insert("radius".into(), Value::Float(*radius));
            inside.insert("length".into(), Value::Float(*length));
        }
        _ => return Some(Err(wrong())),
    }
    let mut object = Table::new();
    object.insert("name".into(), Value::String(kind.into()));
    object.insert(kind.into(), Value::Table(inside));
    Some(Ok(object))
}

/// The object of a mesh file, by the name that the scene calls the file.
pub fn mesh(file: &str, name: &str) -> Table {
    let mut inside = Table::new();
    inside.insert("file".into(), Value::String(file.into()));
    let mut object = Table::new();
    object.insert("name".into(), Value::String(name.into()));
    object.insert("mesh".into(), Value::Table(inside));
    object
}

/// The object called `name` of a scene file with this text, else its first, without its pose. `renamed` says what the new scene calls
/// a file that the old one names.
///
/// Errors: the file is no TOML (`S100`), or has no such object (`S102`).
pub fn object_of_scene(
    path: &Path,
    text: &str,
    name: Option<&str>,
    renamed: impl Fn(&str) -> String,
) -> Result<Table, InputError> {
    let fail = |code, problem: String| InputError::from(Diagnostic::new(code, Place::file(path), problem));
    if too_deep(text).is_some() {
        return Err(fail("S100", "opens more brackets than any scene does".into()));
    }
    let document: Table = toml::from_str(text).map_err(|error| fail("S100", error.message().to_owned()))?;
    let is_called = |table: &&Table| name.is_none_or(|name| table.get("name").and_then(Value::as_str) == Some(name));
    let several = document.get("objects").and_then(Value::as_array);
    let mut found = document.get("object").into_iter().chain(several.into_iter().flatten()).filter_map(Value::as_table);
    let object = found.find(is_called).ok_or_else(|| {
        let fix = "the hand comes first, then a mesh, a shape or a scene file: regrasp place HAND OBJECT";
        InputError::from(Diagnostic::new("S102", Place::file(path), "has no object to be placed").fix(fix))
    })?;
    let mut object = object.clone();
    POSE_KEYS.iter().for_each(|key| {
        object.remove(*key);
    });
    if let Some(file) = object.get_mut("mesh").and_then(|mesh| mesh.get_mut("file"))
        && let Some(old) = file.as_str()
    {
        *file = Value::String(renamed(old));
    }
    Ok(object)
}

/// What a scene file is written from.
#[derive(Debug, Clone)]
pub struct SceneText {
    /// What the scene calls the hand file or URDF.
    pub hand: String,
    /// Soft fingertips of this torsion radius, in metres, for fingers whose hand file says nothing.
    pub torsion_radius: Option<f64>,
    /// The object, as `[object]` has it.
    pub object: Table,
    /// At least one turn.
    pub turns: Vec<Turn>,
    /// Lines of comment that come first.
    pub comment: Vec<String>,
}

impl SceneText {
    /// The text of the scene in which the object starts at `start`; where that is None the planner chooses.
    pub fn text(&self, start: Option<&Pose>) -> String {
        let mut out = String::new();
        for line in &self.comment {
            let line: String = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            let _ = writeln!(out, "# {line}");
        }
        let put = |table: &mut Table, key: &str, value: Value| {
            table.insert(key.into(), value);
        };
        let mut hand = Table::new();
        put(&mut hand, "file", Value::String(self.hand.clone()));
        if let Some(radius) = self.torsion_radius {
            put(&mut hand, "contact", Value::String("soft_finger".into()));
            put(&mut hand, "torsion_radius", Value::Float(radius));
        }
        let goal = |turn: &Turn| {
            let mut inside = Table::new();
            put(&mut inside, "axis", turn.axis.clone());
            put(&mut inside, "angle_deg", Value::Float(turn.angle_deg));
            Table::from_iter([("turn".to_owned(), Value::Table(inside))])
        };
        out += "format = \"regrasp-scene\"\n";
        if let [turn] = self.turns.as_slice() {
            out += "format_version = 1\ntask = \"in_hand\"\n";
            section("[hand]", &hand, &mut out);
            section("[object]", &self.object, &mut out);
            section("[start]", &start_table(start), &mut out);
            section("[goal]", &goal(turn), &mut out);
            return out;
        }
        out += "format_version = 2\n";
        put(&mut hand, "name", Value::String("hand".into()));
        section("[[robot.hands]]", &hand, &mut out);
        // Where the object rests is where the tasks start.
        let mut object = self.object.clone();
        object.extend(start_table(start.or(Some(&Pose::identity()))));
        section("[[objects]]", &object, &mut out);
        for turn in &self.turns {
            let mut task = Table::new();
            put(&mut task, "name", Value::String(turn.name.clone()));
            put(&mut task, "task", Value::String("in_hand".into()));
            if start.is_none() {
                put(&mut task, "start", Value::Table(start_table(None)));
            }
            put(&mut task, "goal", Value::Table(goal(turn)));
            section("[[tasks]]", &task, &mut out);
        }
        out
    }
}

/// A table under its heading: the name first, tables in it on one line.
fn section(heading: &str, table: &Table, out: &mut String) {
    let _ = writeln!(out, "\n{heading}");
    let mut entries: Vec<(&String, &Value)> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.as_str() != "name");
    for (key, value) in entries {
        let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        let key = if is_bare { key.clone() } else { Value::String(key.clone()).to_string() };
        let _ = writeln!(out, "{key} = {value}");
    }
}

/// `position` and `quat_xyzw`, or that the planner chooses them.
fn start_table(start: Option<&Pose>) -> Table {
    let mut table = Table::new();
    match start {
        None => {
            table.insert("position".into(), Value::String("auto".into()));
        }
        Some(start) => {
            let [x, y, z, w]: [f64; 4] = start.rotation.coords.into();
            let sign = if w < 0.0 { -1.0 } else { 1.0 };
            table.insert("position".into(), floats(start.translation.vector.as_slice()));
            table.insert("quat_xyzw".into(), floats(&[x, y, z, w].map(|part| sign * part)));
        }
    }
    table
}

/// Zero has no sign in files.
fn floats(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|value| Value::Float(value + 0.0)).collect())
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let values: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    values.filter(|values| values.iter().all(|value: &f64| value.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_and_primitives_are_read_or_refused_with_what_was_expected() {
        assert_eq!(Turn::read("z:90").unwrap().name(), "z90");
        let turn = Turn::read("1,0,1:-45").unwrap();
        assert_eq!((turn.angle_deg, turn.name()), (-45.0, "1,0,1_-45"));
        for wrong in ["z:0", "z", "z:", "w:90", "0,0,0:90", "z:NaN", "1,2:3", "z:1e9"] {
            assert!(Turn::read(wrong).is_err(), "{wrong}");
        }
        assert!(primitive("sphere:0.03").unwrap().is_ok());
        assert!(primitive("box:0.05,0.05").unwrap().unwrap_err().contains("box:X,Y,Z"));
        assert!(primitive("meshes/cube.obj").is_none() && primitive("c:/cube.obj").is_none());
    }
}
