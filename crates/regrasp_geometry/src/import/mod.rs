//! Readers of mesh files: STL, OBJ, PLY, COLLADA and binary glTF.
//!
//! Readers take bytes and the name they came under, never open files, and never panic, whatever the bytes. Codes: M200
//! unknown kind of file, M202 nothing in it, M203 numbers that are not finite, M204 encoding, M220 too large, M230
//! binary STL, M231 ASCII STL, M240 OBJ statements, M241 indices of vertices, M250 PLY, M260 COLLADA, M270 glTF.

mod dae;
mod glb;
mod obj;
mod placed;
mod ply;
mod polygon;
mod stl;

#[cfg(test)]
mod placed_tests;
#[cfg(test)]
mod tests;

use crate::frame::Point;
use crate::mesh::{MeshError, TriangleMesh};
use regrasp_base::diagnostic::{Diagnostics, printable};
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::Path;

pub use dae::read_dae;
pub use glb::read_glb;
pub use obj::read_obj;
pub use ply::read_ply;
pub use stl::read_stl;

/// What is said where another format is given.
const FORMATS: &str = "an .stl, .obj, .ply, .dae or .glb file";

/// Most triangles that are read from a file. A planner and a checker need about half a kilobyte for each.
pub const MAX_TRIANGLES: usize = 1_500_000;

/// Reads a mesh file of the format that the extension of `path` says, in upper or lower case.
///
/// Errors: those of [`read_stl`], [`read_obj`], [`read_ply`], [`read_dae`] and [`read_glb`], and M200 for any other extension.
pub fn read_mesh(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "stl" => read_stl(path, bytes),
        "obj" => read_obj(path, bytes),
        "ply" => read_ply(path, bytes),
        "dae" => read_dae(path, bytes),
        "glb" => read_glb(path, bytes),
        "" => Err(Diagnostic::new("M200", Place::file(path), "has no extension that says its format")
            .expected(FORMATS)
            .into()),
        _ => {
            Err(Diagnostic::new("M200", Place::file(path), format!("\".{extension}\" is not a mesh format read here"))
                .expected(FORMATS)
                .fix("convert it, e.g. with trimesh: trimesh.load(\"FILE\").export(\"FILE.obj\")")
                .into())
        }
    }
}

/// The faults of one file, in the order found.
struct Faults<'a> {
    path: &'a Path,
    found: Diagnostics,
}

impl<'a> Faults<'a> {
    fn new(path: &'a Path) -> Self {
        Faults { path, found: Diagnostics::default() }
    }

    fn push(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic);
    }

    fn at_line(&mut self, code: &'static str, line: u32, problem: String, expected: &str) {
        if self.found.counted_only() {
            return;
        }
        self.push(Diagnostic::new(code, Place::line(self.path, line), problem).expected(expected));
    }

    /// The mesh, when there were no faults.
    fn finish(self, vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<TriangleMesh, InputError> {
        self.found.into_result(())?;
        TriangleMesh::new(vertices, triangles).map_err(|error| {
            let code = match error {
                MeshError::NotFinite { .. } => "M203",
                MeshError::IndexOutOfRange { .. } => "M241",
                MeshError::Empty { .. } => "M202",
            };
            Diagnostic::new(code, Place::file(self.path), error.to_string()).into()
        })
    }
}

/// Errors that concern the bytes as a whole: nothing there, or UTF-16.
fn check_encoding(path: &Path, bytes: &[u8]) -> Result<(), InputError> {
    match bytes {
        [] => Err(Diagnostic::new("M202", Place::file(path), "is empty (0 bytes)").into()),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => {
            Err(Diagnostic::new("M204", Place::file(path), "looks like UTF-16 text").expected("ASCII or UTF-8").into())
        }
        _ => Ok(()),
    }
}

/// A mesh, or all meshes of a file, of too many triangles (`M220`).
pub fn too_many(path: &Path, n_triangles: usize) -> InputError {
    Diagnostic::new("M220", Place::file(path), format!("has {n_triangles} triangles"))
        .expected(format!("at most {MAX_TRIANGLES}, in all meshes of a scene or of a robot together"))
        .fix("simplify the mesh, e.g. with MeshLab or trimesh simplify_quadric_decimation")
        .into()
}

/// Lines with their numbers, from 1; a line feed, a carriage return, or both end them.
struct TextLines<'a> {
    rest: Option<&'a [u8]>,
    line: u32,
}

impl<'a> TextLines<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        TextLines { rest: Some(bytes), line: 0 }
    }
}

impl<'a> Iterator for TextLines<'a> {
    type Item = (u32, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.rest?;
        self.line += 1;
        let Some(end) = rest.iter().position(|&b| b == b'\n' || b == b'\r') else {
            self.rest = None;
            return Some((self.line, rest));
        };
        let after = if rest[end..].starts_with(b"\r\n") { end + 2 } else { end + 1 };
        self.rest = rest.get(after..);
        Some((self.line, &rest[..end]))
    }
}

/// Words of a line, between ASCII white space.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A word as shown in messages, cut at 40 characters.
fn shown(word: &[u8]) -> String {
    printable(&String::from_utf8_lossy(word)).chars().take(40).collect()
}

/// The number that `word` is, finite or not; None when it is none.
fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// What to say about a word that is not a number.
fn not_a_number(word: &[u8]) -> String {
    let text = shown(word);
    let with_point = text.replacen(',', ".", 1);
    if text.contains(',') && with_point.parse::<f64>().is_ok() {
        return format!("cannot read \"{text}\" as a number; did you mean {with_point}?");
    }
    format!("cannot read \"{text}\" as a number")
}

/// Reads three coordinates; faults are pushed and give the origin.
fn coordinates<'w>(
    words: &mut impl Iterator<Item = &'w [u8]>,
    code: &'static str,
    line: u32,
    faults: &mut Faults,
) -> Point {
    let mut point = Point::origin();
    let mut words = words.take(3).collect::<Vec<_>>().into_iter();
    for k in 0..3 {
        let Some(word) = words.next() else {
            faults.at_line(code, line, format!("a vertex has {k} coordinates"), "three numbers");
            return Point::origin();
        };
        match number(word) {
            Some(value) if value.is_finite() => point[k] = value,
            Some(_) => {
                faults.at_line("M203", line, format!("a vertex has the coordinate {}", shown(word)), "finite numbers");
                return Point::origin();
            }
            None => {
                faults.at_line(code, line, not_a_number(word), "three numbers");
                return Point::origin();
            }
        }
    }
    point
}
