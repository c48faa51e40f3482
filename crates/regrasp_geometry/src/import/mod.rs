//! Readers of mesh files: STL and OBJ.
//!
//! Readers take bytes and the name they came under, never open files, and never panic, whatever the bytes. Codes: M200
//! unknown kind of file, M202 nothing in it, M203 numbers that are not finite, M204 encoding, M220 too large, M230
//! binary STL, M231 ASCII STL, M240 OBJ statements, M241 OBJ indices.

mod obj;
mod polygon;
mod stl;

#[cfg(test)]
mod tests;

use crate::frame::Point;
use crate::mesh::{MeshError, TriangleMesh};
use regrasp_base::diagnostic::{Diagnostics, printable};
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::Path;

pub use obj::read_obj;
pub use stl::read_stl;

/// Most triangles that are read from a file.
pub const MAX_TRIANGLES: usize = 5_000_000;

/// Faults of one file that are listed one by one; the rest is counted.
const MAX_FAULTS: usize = 20;

/// Reads an STL or OBJ file, told apart by the extension of `path` in upper or lower case.
///
/// Errors: those of [`read_stl`] and [`read_obj`], and M200 for any other extension.
pub fn read_mesh(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "stl" => read_stl(path, bytes),
        "obj" => read_obj(path, bytes),
        "" => Err(Diagnostic::new("M200", Place::file(path), "has no extension that says its format")
            .expected("an .stl or .obj file")
            .into()),
        _ => {
            Err(Diagnostic::new("M200", Place::file(path), format!("\".{extension}\" is not a mesh format read here"))
                .expected("an .stl or .obj file")
                .fix("convert it, e.g. with trimesh: trimesh.load(\"FILE\").export(\"FILE.obj\")")
                .into())
        }
    }
}

/// The faults of one file, in the order found; the first [`MAX_FAULTS`] in full.
struct Faults<'a> {
    path: &'a Path,
    found: Diagnostics,
    n_found: usize,
}

impl<'a> Faults<'a> {
    fn new(path: &'a Path) -> Self {
        Faults { path, found: Diagnostics::default(), n_found: 0 }
    }

    fn push(&mut self, diagnostic: Diagnostic) {
        self.n_found += 1;
        if self.n_found <= MAX_FAULTS {
            self.found.push(diagnostic);
        }
    }

    fn at_line(&mut self, code: &'static str, line: u32, problem: String, expected: &str) {
        self.push(Diagnostic::new(code, Place::line(self.path, line), problem).expected(expected));
    }

    /// The mesh, when there were no faults.
    fn finish(mut self, vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<TriangleMesh, InputError> {
        if self.n_found > MAX_FAULTS {
            let more = format!("has {} more faults of these kinds", self.n_found - MAX_FAULTS);
            self.found.push(Diagnostic::new("M202", Place::file(self.path), more));
        }
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

fn too_many(path: &Path, n_triangles: usize) -> InputError {
    Diagnostic::new("M220", Place::file(path), format!("has {n_triangles} triangles"))
        .expected(format!("at most {MAX_TRIANGLES}"))
        .fix("simplify the mesh, e.g. with MeshLab or trimesh simplify_quadric_decimation")
        .into()
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
            Some(value) => {
                faults.at_line("M203", line, format!("a vertex has the coordinate {value}"), "finite numbers");
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
