//! Wavefront OBJ: vertices and faces. Everything else, materials included, has no part in planning and is skipped.

use super::polygon::Cutter;
use super::{Faults, MAX_TRIANGLES, TextLines, check_encoding, coordinates, shown, too_many, words};
use crate::frame::Point;
use crate::mesh::TriangleMesh;
use regrasp_base::InputError;
use std::borrow::Cow;
use std::path::Path;

/// Reads an OBJ file. Faces of more than three corners, concave ones too, are cut into triangles.
///
/// Errors: M202 no faces, M203 NaN or infinite coordinates, M220 too many triangles, M240 a `v` or `f` statement that
/// cannot be read, M241 an index that is 0 or names no vertex; each with its line.
pub fn read_obj(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    check_encoding(path, bytes)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut faults = Faults::new(path);
    let mut vertices: Vec<Point> = Vec::new();
    // Corners of all faces one after the other, counted from 0; per face its line and where its corners end.
    let mut corners: Vec<i64> = Vec::new();
    let mut faces: Vec<(u32, usize)> = Vec::new();
    let mut n_triangles = 0;
    for (line, statement) in Statements(TextLines::of(bytes)) {
        let mut words = words(&statement);
        match words.next() {
            Some(b"v") => {
                if vertices.len() >= 3 * MAX_TRIANGLES {
                    return Err(too_many(path, vertices.len()));
                }
                vertices.push(coordinates(&mut words, "M240", line, &mut faults));
            }
            Some(b"f") => {
                let start = corners.len();
                for word in words {
                    match corner(word, vertices.len()) {
                        Ok(index) => corners.push(index),
                        Err((code, problem)) => faults.at_line(code, line, problem, "indices that count from 1"),
                    }
                }
                let n_corners = corners.len() - start;
                if n_corners < 3 {
                    if faults.found.is_empty() {
                        let problem = format!("a face has {n_corners} corners");
                        faults.at_line("M240", line, problem, "at least three");
                    }
                    corners.truncate(start);
                    continue;
                }
                n_triangles += n_corners - 2;
                if n_triangles > MAX_TRIANGLES {
                    return Err(too_many(path, n_triangles));
                }
                faces.push((line, corners.len()));
            }
            _ => {}
        }
    }
    let mut triangles = Vec::with_capacity(n_triangles);
    let mut cutter = Cutter::default();
    let mut start = 0;
    for (line, end) in faces {
        let mut face = Vec::with_capacity(end - start);
        for &index in corners.get(start..end).unwrap_or_default() {
            match u32::try_from(index) {
                Ok(i) if (i as usize) < vertices.len() => face.push(i),
                _ => {
                    let problem = format!("a face names vertex {}, but there are {}", index + 1, vertices.len());
                    faults.at_line("M241", line, problem, "an index of a vertex in this file");
                }
            }
        }
        if face.len() == end - start
            && let Err(expected) = cutter.triangulate(&face, &vertices, &mut triangles)
        {
            let problem = format!("a concave face has {} corners", face.len());
            faults.at_line("M240", line, problem, &expected);
        }
        start = end;
    }
    faults.finish(vertices, triangles)
}

/// The vertex, counted from 0, that `word` such as `3`, `3/1`, `3//2`, `-1/4/2` names; not yet checked to exist.
fn corner(word: &[u8], n_vertices: usize) -> Result<i64, (&'static str, String)> {
    let digits = word.split(|&b| b == b'/').next().unwrap_or_default();
    let index = std::str::from_utf8(digits).ok().and_then(|text| text.parse::<i64>().ok());
    match index {
        None => Err(("M240", format!("cannot read \"{}\" as a corner of a face", shown(word)))),
        Some(0) => Err(("M241", "a face names vertex 0".into())),
        Some(index) if index > 0 => Ok(index - 1),
        Some(index) => {
            let from_start = index.saturating_add(n_vertices as i64);
            if from_start < 0 {
                return Err(("M241", format!("a face names vertex {index}, but only {n_vertices} stand before it")));
            }
            Ok(from_start)
        }
    }
}

/// Lines with their numbers; a backslash at the end of a line joins it to the next.
struct Statements<'a>(TextLines<'a>);

/// The part before a comment, without white space at its end.
fn content(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii_end()
}

impl<'a> Iterator for Statements<'a> {
    type Item = (u32, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let (line, first) = self.0.next()?;
        let first = content(first);
        let Some(part) = first.strip_suffix(b"\\") else { return Some((line, Cow::Borrowed(first))) };
        let mut joined = part.to_vec();
        for (_, next) in self.0.by_ref() {
            joined.push(b' ');
            let next = content(next);
            let Some(part) = next.strip_suffix(b"\\") else {
                joined.extend_from_slice(next);
                break;
            };
            joined.extend_from_slice(part);
        }
        Some((line, Cow::Owned(joined)))
    }
}
