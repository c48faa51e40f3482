//! `hand.toml`: which links of a URDF are fingers, what their tips are, which links may touch.
//!
//! A bare URDF is accepted too; its fingers and tips are then guessed as `inspect` does.

use super::assemble::{FingerSpec, HandSpec, TipSpec, assemble};
use super::resolve::{ResolveOptions, resolve_own};
use super::srdf::load_srdf;
use super::toml_table::{Need, Table, TomlReader};
use super::urdf::{LoadedRobot, load_robot};
use crate::hand::Hand;
use crate::robot::{LinkId, Robot};
use regrasp_base::diagnostic::{Diagnostics, did_you_mean};
use regrasp_base::{Diagnostic, InputError, Place, files};
use regrasp_geometry::Point;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The value of `format` in a hand file.
pub const FORMAT: &str = "regrasp-hand";
/// The value of `format_version` in a hand file.
pub const VERSION: i64 = 1;

/// How hands and robots are read.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Where packages are.
    pub resolve: ResolveOptions,
    /// Drop, with a note, what is not supported or not found: joints of unsupported types are held fixed, collision
    /// geometry that cannot be read is left out, unknown links in an SRDF are skipped.
    pub lenient: bool,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadedInput {
    /// What it is for: `hand`, `urdf`, `srdf`, `mesh`.
    pub role: String,
    /// How the file that names it spells it; the file name for the outermost.
    pub name: String,
    /// Where it was found.
    pub path: PathBuf,
    /// SHA-256 of its bytes, lower-case hexadecimal.
    pub sha256: String,
}

/// A hand with what it was read from.
#[derive(Debug, Clone)]
pub struct LoadedHand {
    /// The hand.
    pub hand: Hand,
    /// Every file that was read, outermost first.
    pub inputs: Vec<LoadedInput>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Reads a hand from a `hand.toml`, or from a URDF whose fingers are then guessed.
///
/// Meshes of links become convex hulls (see [`crate::hand::convex_of`]). Errors: `F00x`, `U1xx`, `U2xx`, `V001`, `M2xx`.
pub fn load_hand(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    match extension.as_str() {
        "toml" => load_hand_file(path, options),
        "urdf" | "xml" => load_bare_urdf(path, options),
        _ => Err(Diagnostic::new("U215", Place::file(path), "is neither a hand file nor a URDF")
            .expected("a file that ends in .toml or .urdf")
            .into()),
    }
}

fn load_bare_urdf(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let LoadedRobot { robot, inputs, mut notes } = load_robot(path, options)?;
    let robot = Arc::new(robot);
    let spec = crate::inspect::guess::guess_hand(&robot, path)?;
    notes.push(format!(
        "{}: fingers and tips were guessed; `regrasp inspect -o hand.toml` writes them down",
        path.display()
    ));
    let (mut hand, more) = assemble(&robot, &spec, path)?;
    notes.extend(more);
    crate::inspect::rest::bend_towards_palm(&mut hand);
    refuse_wrong_unit(&hand, path)?;
    Ok(LoadedHand { hand, inputs, notes })
}

fn load_hand_file(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let bytes = files::read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let own = LoadedInput { role: "hand".into(), name, path: path.to_owned(), sha256: files::sha256(&bytes) };
    let text = files::text_of(path, bytes)?;
    let document = DeTable::parse(&text).map_err(|error| {
        let place = match error.span() {
            Some(span) => Place::at_offset(path, &text, span.start),
            None => Place::file(path),
        };
        let message = error.message().lines().collect::<Vec<_>>().join(" ");
        InputError::from(Diagnostic::new("U200", place, format!("is not valid TOML: {message}")))
    })?;
    let table = Table { entries: document.get_ref(), offset: 0 };
    let mut reader = TomlReader { file: path, text: &text, found: Diagnostics::default() };
    reader.refuse_unknown(table, &["format", "format_version", "urdf", "srdf", "base_link", "allow", "fingers"]);
    refuse_other_format(&mut reader, table);

    let mut inputs = vec![own];
    let mut notes = Vec::new();
    let urdf = reader.text(table, "urdf", Need::Required);
    let robot = urdf.and_then(|(urdf, offset)| {
        let loaded = resolve_own(urdf, path, reader.place(offset), &options.resolve)
            .map_err(|error| InputError::from(error.element("key", "urdf")))
            .and_then(|resolved| {
                notes.extend(resolved.notes);
                load_robot(&resolved.path, options)
            });
        match loaded {
            Ok(mut loaded) => {
                if let Some(first) = loaded.inputs.first_mut() {
                    urdf.clone_into(&mut first.name);
                }
                inputs.extend(loaded.inputs);
                notes.extend(loaded.notes);
                Some(Arc::new(loaded.robot))
            }
            Err(error) => {
                reader.found.extend(error);
                None
            }
        }
    });
    // Without a robot no name in the rest of the file can be looked up.
    let Some(robot) = robot else { return Err(only_error(reader.found, path)) };
    let mut spec = read_spec(&mut reader, table, &robot);
    if let Some((srdf, offset)) = reader.text(table, "srdf", Need::Optional) {
        let loaded = resolve_own(srdf, path, reader.place(offset), &options.resolve)
            .map_err(|error| InputError::from(error.element("key", "srdf")))
            .and_then(|resolved| load_srdf(&resolved.path, &robot, options.lenient));
        match loaded {
            Ok(mut loaded) => {
                srdf.clone_into(&mut loaded.input.name);
                inputs.push(loaded.input);
                notes.extend(loaded.notes);
                spec.allow.extend(loaded.srdf.disabled_pairs.iter().map(|pair| pair.links));
            }
            Err(error) => reader.found.extend(error),
        }
    }
    reader.found.into_result(())?;
    let (hand, more) = assemble(&robot, &spec, path)?;
    notes.extend(more);
    refuse_wrong_unit(&hand, path)?;
    Ok(LoadedHand { hand, inputs, notes })
}

/// Refuses hands whose joints and tips are spread over less than a centimetre or more than five metres.
///
/// Arms with hands are a metre or two; a hand written in millimetres is a hundred metres or more.
fn refuse_wrong_unit(hand: &Hand, path: &Path) -> Result<(), InputError> {
    let span = crate::inspect::span(hand);
    if (0.01..=5.0).contains(&span) {
        return Ok(());
    }
    let (guess, factor) = if span > 5.0 {
        ("is probably in millimetres", "0.001")
    } else {
        ("is probably scaled down too often", "1000")
    };
    Err(Diagnostic::new(
        "U216",
        Place::file(path),
        format!("the joints and tips of the hand are spread over {span:.4} m"),
    )
    .expected(format!("a hand in metres; this one {guess}"))
    .fix(format!("multiply every length of the URDF by {factor}"))
    .into())
}

/// The gathered problems as an error; there is at least one.
fn only_error(found: Diagnostics, path: &Path) -> InputError {
    match found.into_result(()) {
        Err(error) => error,
        Ok(()) => Diagnostic::new("U200", Place::file(path), "cannot be used").into(),
    }
}

fn refuse_other_format(reader: &mut TomlReader, table: Table) {
    if let Some((format, offset)) = reader.text(table, "format", Need::Optional)
        && format != FORMAT
    {
        let place = reader.place(offset);
        reader.found.push(
            Diagnostic::new("U204", place, format!("is \"{format}\""))
                .element("key", "format")
                .expected(format!("\"{FORMAT}\"")),
        );
    }
    if table.get("format").is_none() {
        reader.missing(table, "format", &format!("format = \"{FORMAT}\""));
    }
    let Some(version) = table.get("format_version") else {
        reader.missing(table, "format_version", &format!("format_version = {VERSION}"));
        return;
    };
    if let Some(seen) = reader.finite(version, "format_version")
        && seen != VERSION as f64
    {
        let place = reader.place(version.span().start);
        reader.found.push(
            Diagnostic::new("U204", place, format!("is {seen}, which this program does not know"))
                .element("key", "format_version")
                .expected(format!("{VERSION}")),
        );
    }
}

fn read_spec(reader: &mut TomlReader, table: Table, robot: &Robot) -> HandSpec {
    let base = match reader.text(table, "base_link", Need::Optional) {
        Some((name, offset)) => known_link(reader, robot, "base_link", name, offset).unwrap_or(robot.root),
        None => robot.root,
    };
    let allow = table.get("allow").map_or_else(BTreeSet::new, |value| read_pairs(reader, robot, value));
    let mut fingers = Vec::new();
    match table.get("fingers") {
        None => reader.missing(table, "fingers", "at least one [[fingers]] table"),
        Some(value) => match value.get_ref().as_array() {
            Some(items) if !items.is_empty() => {
                for item in items {
                    match item.get_ref().as_table() {
                        Some(entries) => {
                            let finger = Table { entries, offset: item.span().start };
                            fingers.extend(read_finger(reader, finger, robot));
                        }
                        None => reader.wrong_type(item, "fingers", "a [[fingers]] table"),
                    }
                }
            }
            _ => reader.wrong_type(value, "fingers", "at least one [[fingers]] table"),
        },
    }
    HandSpec { base, fingers, allow }
}

fn read_finger(reader: &mut TomlReader, table: Table, robot: &Robot) -> Option<FingerSpec> {
    reader.refuse_unknown(table, &["name", "tip_link", "first_joint", "tip", "rest"]);
    let name = reader.text(table, "name", Need::Required);
    let tip_link = reader
        .text(table, "tip_link", Need::Required)
        .and_then(|(link, offset)| known_link(reader, robot, "tip_link", link, offset));
    let first_joint = match reader.text(table, "first_joint", Need::Optional) {
        Some((joint, offset)) => Some(known_joint(reader, robot, "first_joint", joint, offset)?),
        None => None,
    };
    let tip = read_tip(reader, table);
    let mut rest = Vec::new();
    if let Some(value) = table.get("rest") {
        match value.get_ref().as_table() {
            None => reader.wrong_type(value, "rest", "a table: { joint_name = value, ... }"),
            Some(entries) => {
                for (key, value) in entries {
                    let number = reader.finite(value, key.get_ref());
                    let place = reader.place(key.span().start);
                    rest.extend(number.map(|number| (key.get_ref().to_string(), number, place)));
                }
            }
        }
    }
    Some(FingerSpec {
        name: name?.0.to_owned(),
        tip_link: tip_link?,
        first_joint,
        tip: tip?,
        rest,
        place: reader.place(table.offset),
    })
}

fn read_tip(reader: &mut TomlReader, finger: Table) -> Option<TipSpec> {
    let expected = "tip = { shape = \"sphere\", radius = 0.012, center = [0, 0, 0] }";
    let Some(value) = finger.get("tip") else {
        reader.missing(finger, "tip", expected);
        return None;
    };
    let Some(entries) = value.get_ref().as_table() else {
        reader.wrong_type(value, "tip", expected);
        return None;
    };
    let tip = Table { entries, offset: value.span().start };
    let (shape, offset) = reader.text(tip, "shape", Need::Required)?;
    match shape {
        "sphere" => {
            reader.refuse_unknown(tip, &["shape", "radius", "center"]);
            let center = read_center(reader, tip, "center");
            let Some(value) = tip.get("radius") else {
                reader.missing(tip, "radius", "radius = 0.012");
                return None;
            };
            let radius = reader.finite(value, "radius")?;
            if radius <= 0.0 {
                let place = reader.place(value.span().start);
                reader.found.push(
                    Diagnostic::new("U213", place, format!("is {radius}"))
                        .element("key", "radius")
                        .expected("a length above 0, in metres")
                        .fix("shape = \"point\" for a sharp tip"),
                );
                return None;
            }
            Some(TipSpec::Sphere { radius, center: center? })
        }
        "point" => {
            reader.refuse_unknown(tip, &["shape", "position"]);
            Some(TipSpec::Point { position: read_center(reader, tip, "position")? })
        }
        "mesh" => {
            reader.refuse_unknown(tip, &["shape", "center"]);
            Some(TipSpec::Hull { center: read_center(reader, tip, "center")? })
        }
        other => {
            let meant = did_you_mean(other, ["sphere", "point", "mesh"]);
            let place = reader.place(offset);
            reader.found.push(
                Diagnostic::new("U213", place, format!("is \"{other}\""))
                    .element("key", "shape")
                    .expected("\"sphere\", \"point\" or \"mesh\"")
                    .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"))),
            );
            None
        }
    }
}

/// The point in `key`, the origin of the tip link where it is missing; none where it is bad.
fn read_center(reader: &mut TomlReader, tip: Table, key: &str) -> Option<Point> {
    if tip.get(key).is_none() {
        return Some(Point::origin());
    }
    reader.vector(tip, key).map(Point::from)
}

fn read_pairs(reader: &mut TomlReader, robot: &Robot, value: &Spanned<DeValue>) -> BTreeSet<(LinkId, LinkId)> {
    let expected = "pairs of link names: [[\"link_a\", \"link_b\"], ...]";
    let mut pairs = BTreeSet::new();
    let Some(items) = value.get_ref().as_array() else {
        reader.wrong_type(value, "allow", expected);
        return pairs;
    };
    for item in items {
        let names: Vec<(&str, usize)> = item.get_ref().as_array().map_or_else(Vec::new, |pair| {
            pair.iter().filter_map(|name| name.get_ref().as_str().map(|text| (text, name.span().start))).collect()
        });
        let &[(a, a_offset), (b, b_offset)] = names.as_slice() else {
            reader.wrong_type(item, "allow", expected);
            continue;
        };
        let a = known_link(reader, robot, "allow", a, a_offset);
        let b = known_link(reader, robot, "allow", b, b_offset);
        if let (Some(a), Some(b)) = (a, b) {
            pairs.insert((a.min(b), a.max(b)));
        }
    }
    pairs
}

fn known_link(reader: &mut TomlReader, robot: &Robot, key: &str, name: &str, offset: usize) -> Option<LinkId> {
    let link = robot.link_named(name);
    if link.is_none() {
        let names = robot.links.iter().map(|link| link.name.as_str());
        refuse_name(reader, key, "link", name, names, offset);
    }
    link
}

fn known_joint(
    reader: &mut TomlReader,
    robot: &Robot,
    key: &str,
    name: &str,
    offset: usize,
) -> Option<crate::robot::JointId> {
    let joint = robot.joint_named(name);
    if joint.is_none() {
        let names = robot.joints.iter().map(|joint| joint.name.as_str());
        refuse_name(reader, key, "joint", name, names, offset);
    }
    joint
}

fn refuse_name<'n>(
    reader: &mut TomlReader,
    key: &str,
    kind: &str,
    name: &str,
    names: impl Iterator<Item = &'n str>,
    offset: usize,
) {
    let meant = did_you_mean(name, names);
    let place = reader.place(offset);
    reader.found.push(
        Diagnostic::new("U205", place, format!("the robot has no {kind} \"{name}\""))
            .element("key", key)
            .expected(format!("the name of a {kind} of the URDF"))
            .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"))),
    );
}
