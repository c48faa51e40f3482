//! STL, binary and ASCII. Normals in the file are not used: the winding says which side is outside.

use super::{Faults, MAX_TRIANGLES, TextLines, check_encoding, coordinates, shown, too_many, words};
use crate::frame::Point;
use crate::mesh::TriangleMesh;
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::Path;

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads an STL file, binary or ASCII, whatever its header claims.
///
/// A file whose length fits its triangle count is binary, even when it starts with "solid". Fewer than 50 bytes after
/// the last triangle are ignored. Errors: M202 empty, M203 NaN or infinite coordinates, M220 too many triangles, M230
/// the count in a binary file does not fit its length, M231 not the grammar of ASCII STL, with the line.
pub fn read_stl(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    check_encoding(path, bytes)?;
    let claimed = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(|b| u32::from_le_bytes(b) as usize);
    let fits = claimed.is_some_and(|n| Some(bytes.len()) == n.checked_mul(RECORD).and_then(|m| m.checked_add(HEADER)));
    if !fits && looks_like_text(bytes) {
        return read_ascii(path, bytes);
    }
    read_binary(path, bytes, claimed)
}

/// True when the first word is "solid" and no byte in the first kilobyte is one that text has not.
fn looks_like_text(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(1024)];
    let is_text = |b: &u8| b.is_ascii_whitespace() || (b' '..=b'~').contains(b) || *b >= 0x80;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    words(bytes).next().is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && start.iter().all(is_text)
}

fn read_binary(path: &Path, bytes: &[u8], claimed: Option<usize>) -> Result<TriangleMesh, InputError> {
    let fail = |problem: String| Diagnostic::new("M230", Place::file(path), problem);
    let Some(n_triangles) = claimed else {
        return Err(fail(format!("has {} bytes, too few for an STL file", bytes.len()))
            .expected("a binary STL of at least 84 bytes, or text that starts with \"solid\"")
            .into());
    };
    let records = &bytes[HEADER..];
    let room = records.len() / RECORD;
    if n_triangles == 0 && room == 0 {
        return Err(Diagnostic::new("M202", Place::file(path), "has no triangles").into());
    }
    if n_triangles > room {
        return Err(fail(format!("header says {n_triangles} triangles, file has room for {room}"))
            .expected(format!("a binary STL of 84 + 50 x {n_triangles} bytes, not {}", bytes.len()))
            .fix("the file is cut short or not an STL: export or download it again")
            .into());
    }
    if n_triangles < room {
        return Err(fail(format!(
            "header says {n_triangles} triangles, but {} bytes follow them, room for {} more",
            records.len() - n_triangles * RECORD,
            room - n_triangles
        ))
        .fix("export the file again; its header and its content disagree")
        .into());
    }
    if n_triangles > MAX_TRIANGLES {
        return Err(too_many(path, n_triangles));
    }
    let mut faults = Faults::new(path);
    let mut vertices = Vec::with_capacity(3 * n_triangles);
    for (i, record) in records.chunks_exact(RECORD).take(n_triangles).enumerate() {
        // Twelve bytes of normal, then three corners of three little-endian f32.
        let mut values =
            record[12..48].chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        let corners: [Point; 3] =
            std::array::from_fn(|_| Point::from(std::array::from_fn(|_| values.next().unwrap_or(f64::NAN))));
        if corners.iter().any(|p| p.iter().any(|x| !x.is_finite())) {
            let problem = format!("triangle {} (byte {}) has NaN or infinite coordinates", i + 1, HEADER + i * RECORD);
            faults.push(Diagnostic::new("M203", Place::file(path), problem).expected("finite numbers"));
        }
        vertices.extend(corners);
    }
    finish(faults, vertices)
}

/// What may come next in an ASCII STL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Start,
    Solid,
    Facet,
    Loop { n_vertices: usize },
    LoopDone,
}

impl State {
    fn expected(self) -> &'static str {
        match self {
            State::Start => "\"solid\"",
            State::Solid => "\"facet normal\" or \"endsolid\"",
            State::Facet => "\"outer loop\"",
            State::Loop { n_vertices: 3 } => "\"endloop\" (a facet has three vertices)",
            State::Loop { .. } => "\"vertex\" (a facet has three vertices)",
            State::LoopDone => "\"endfacet\"",
        }
    }
}

fn read_ascii(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut faults = Faults::new(path);
    let mut vertices: Vec<Point> = Vec::new();
    let mut state = State::Start;
    let mut last_line = 1;
    for (line, text) in TextLines::of(bytes) {
        let mut words = words(text);
        while let Some(word) = words.next() {
            last_line = line;
            let word = word.to_ascii_lowercase();
            state = match (state, word.as_slice()) {
                // The rest of these lines is a name.
                (State::Start, b"solid") => {
                    words.by_ref().for_each(drop);
                    State::Solid
                }
                (State::Solid, b"endsolid") => {
                    words.by_ref().for_each(drop);
                    State::Start
                }
                (State::Solid, b"facet") => {
                    // "normal" and three numbers, which may be NaN and are not used.
                    let is_normal = words.next().is_some_and(|w| w.eq_ignore_ascii_case(b"normal"));
                    if !is_normal || words.by_ref().take(3).count() < 3 {
                        faults.at_line("M231", line, "a facet has no normal".into(), "\"facet normal X Y Z\"");
                    }
                    State::Facet
                }
                (State::Facet, b"outer") => {
                    if !words.next().is_some_and(|w| w.eq_ignore_ascii_case(b"loop")) {
                        faults.at_line("M231", line, "\"outer\" without \"loop\"".into(), state.expected());
                    }
                    State::Loop { n_vertices: 0 }
                }
                (State::Loop { n_vertices }, b"vertex") if n_vertices < 3 => {
                    vertices.push(coordinates(&mut words, "M231", line, &mut faults));
                    if vertices.len() > 3 * MAX_TRIANGLES {
                        return Err(too_many(path, vertices.len().div_ceil(3)));
                    }
                    State::Loop { n_vertices: n_vertices + 1 }
                }
                (State::Loop { n_vertices: 3 }, b"endloop") => State::LoopDone,
                (State::LoopDone, b"endfacet") => State::Solid,
                _ => {
                    // What follows cannot be trusted, so this is the last fault.
                    faults.at_line("M231", line, format!("found \"{}\"", shown(&word)), state.expected());
                    return faults.finish(Vec::new(), Vec::new());
                }
            };
        }
    }
    if state != State::Start {
        faults.at_line("M231", last_line, "the file ends here, cut short".into(), state.expected());
    }
    finish(faults, vertices)
}

/// Every three vertices are a triangle.
fn finish(faults: Faults, vertices: Vec<Point>) -> Result<TriangleMesh, InputError> {
    let triangles = (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    faults.finish(vertices, triangles)
}
