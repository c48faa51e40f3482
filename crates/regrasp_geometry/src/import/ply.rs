//! PLY (Stanford polygon format), text and binary. Vertices and faces are read; colours, normals and other elements are passed over.

use super::polygon::Cutter;
use super::{Faults, MAX_TRIANGLES, TextLines, check_encoding, not_a_number, number, shown, too_many, words};
use crate::frame::Point;
use crate::mesh::TriangleMesh;
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::Path;

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }
}

/// How the body is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

/// A property of an element: one number, or a list of them behind their count.
struct Property {
    name: String,
    count: Option<Kind>,
    kind: Kind,
}

/// Entries of one kind.
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
    line: u32,
}

impl Element {
    /// Where the property of one of these names stands; `is_list` says whether it is a list.
    fn index(&self, names: &[&str], is_list: bool) -> Option<usize> {
        let is_named = |p: &Property| names.iter().any(|name| p.name.eq_ignore_ascii_case(name));
        let is_it = |p: &Property| is_named(p) && p.count.is_some() == is_list;
        self.properties.iter().position(is_it)
    }
}

/// Reads a PLY file. Faces of more than three corners, concave ones too, are cut into triangles.
///
/// Errors: M202 no faces, M203 NaN or infinite coordinates, M220 too many triangles, M241 an index that names no vertex, M250 a header that
/// cannot be read, or a body that does not fit it.
pub fn read_ply(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    check_encoding(path, bytes)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let header = read_header(path, bytes)?;
    let mut body = Body { path, format: header.format, bytes, at: header.end, lines: None, words: Vec::new(), line: 0 };
    if header.format == Format::Text {
        body.lines = Some(TextLines { rest: bytes.get(header.end..), line: header.n_lines });
    }
    let mut faults = Faults::new(path);
    let (mut vertices, mut triangles, mut cutter) = (Vec::new(), Vec::new(), Cutter::default());
    if let Some(face) = header.elements.iter().position(|element| element.name == "face")
        && header.elements.iter().position(|element| element.name == "vertex").is_none_or(|vertex| vertex > face)
    {
        let error = fault(Place::line(path, header.elements[face].line), "faces stand before the vertices");
        return Err(error.expected("element vertex before element face").into());
    }
    for element in &header.elements {
        // Every entry takes a byte at least, so that no count can ask for more work than the file is long.
        if element.count > bytes.len() || (element.properties.is_empty() && element.count > 0) {
            let problem =
                format!("says {} entries of \"{}\", more than the file can hold", element.count, element.name);
            return Err(fault(Place::line(path, element.line), problem).expected("a count that fits the file").into());
        }
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut body, &mut vertices)?,
            "face" => read_faces(element, &mut body, &vertices, &mut triangles, &mut cutter, &mut faults)?,
            "tristrips" => {
                let error = fault(Place::line(path, element.line), "has triangle strips, which are not read here");
                return Err(error.expected("element face").fix("export it with faces").into());
            }
            _ => {
                for _ in 0..element.count {
                    element.properties.iter().try_for_each(|property| body.pass_over(property))?;
                }
            }
        }
    }
    refuse_not_finite(&vertices, &triangles, path, &mut faults);
    // Vertices that no face names may be anything: scans on a grid have some that are NaN.
    let used = vertices.into_iter().map(|v: Point| if v.iter().all(|x| x.is_finite()) { v } else { Point::origin() });
    faults.finish(used.collect(), triangles)
}

/// Corners of triangles that are NaN or infinite (`M203`), each once.
fn refuse_not_finite(vertices: &[Point], triangles: &[[u32; 3]], path: &Path, faults: &mut Faults) {
    let mut bad: Vec<u32> = triangles.as_flattened().to_vec();
    bad.retain(|&corner| vertices[corner as usize].iter().any(|x| !x.is_finite()));
    bad.sort_unstable();
    bad.dedup();
    for index in bad {
        let [x, y, z]: [f64; 3] = vertices[index as usize].coords.into();
        let problem = format!("vertex {index} has the coordinates {x}, {y}, {z}");
        faults.push(Diagnostic::new("M203", Place::file(path), problem).expected("finite numbers"));
    }
}

fn fault(place: Place, problem: impl Into<String>) -> Diagnostic {
    Diagnostic::new("M250", place, problem)
}

/// What stands before the body.
struct Header {
    format: Format,
    elements: Vec<Element>,
    /// Where the body begins.
    end: usize,
    n_lines: u32,
}

fn read_header(path: &Path, bytes: &[u8]) -> Result<Header, InputError> {
    let mut lines = TextLines::of(bytes);
    let refuse = |line: u32, problem: String, expected: &str| -> InputError {
        fault(Place::line(path, line), problem).expected(expected).into()
    };
    if lines.next().is_none_or(|(_, first)| first.trim_ascii_end() != b"ply") {
        return Err(refuse(1, "does not begin with \"ply\"".into(), "a PLY file"));
    }
    let (mut format, mut elements): (Option<Format>, Vec<Element>) = (None, Vec::new());
    while let Some((line, text)) = lines.next() {
        let parts: Vec<&[u8]> = words(text).take(6).collect();
        match parts.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"end_header"] => {
                let Some(format) = format else {
                    return Err(refuse(
                        line,
                        "the header says no format".into(),
                        "\"format ascii 1.0\" or a binary one",
                    ));
                };
                let mut end = bytes.len() - lines.rest.map_or(0, <[u8]>::len);
                // Where carriage returns alone end lines, a line feed after the last one belongs to the body.
                let is_returns = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
                if is_returns && bytes[..end].ends_with(b"\r\n") {
                    end -= 1;
                }
                return Ok(Header { format, elements, end, n_lines: lines.line });
            }
            [b"format", word, ..] => {
                format = Some(match *word {
                    b"ascii" => Format::Text,
                    b"binary_little_endian" => Format::LittleEndian,
                    b"binary_big_endian" => Format::BigEndian,
                    other => {
                        let problem = format!("the format is \"{}\"", shown(other));
                        return Err(refuse(line, problem, "ascii, binary_little_endian or binary_big_endian"));
                    }
                });
            }
            [b"element", name, count] => {
                let Some(count) = std::str::from_utf8(count).ok().and_then(|text| text.parse().ok()) else {
                    let problem = format!("cannot read \"{}\" as the count of \"{}\"", shown(count), shown(name));
                    return Err(refuse(line, problem, "a whole number"));
                };
                elements.push(Element { name: shown(name), count, properties: Vec::new(), line });
            }
            [b"property", rest @ ..] => {
                let property = match rest {
                    [b"list", count, kind, name] => Kind::named(count)
                        .zip(Kind::named(kind))
                        .map(|(count, kind)| Property { name: shown(name), count: Some(count), kind }),
                    [kind, name] => Kind::named(kind).map(|kind| Property { name: shown(name), count: None, kind }),
                    _ => None,
                };
                let (Some(property), Some(element)) = (property, elements.last_mut()) else {
                    let problem = format!("cannot read \"{}\"", shown(text));
                    return Err(refuse(
                        line,
                        problem,
                        "\"property TYPE NAME\" or \"property list TYPE TYPE NAME\" of an element",
                    ));
                };
                element.properties.push(property);
            }
            _ => {
                let known = ["comment", "obj_info", "end_header", "format", "element", "property"];
                let meant = did_you_mean(&shown(parts[0]), known);
                let error = fault(Place::line(path, line), format!("found \"{}\" in the header", shown(text)));
                let fix = meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"));
                return Err(error.expected("a statement of a PLY header").fix(fix).into());
            }
        }
    }
    Err(refuse(lines.line, "the header does not end".into(), "\"end_header\""))
}

/// The numbers after the header.
struct Body<'a> {
    path: &'a Path,
    format: Format,
    bytes: &'a [u8],
    /// Where the next number of a binary body begins.
    at: usize,
    /// Lines of a text body that are left, and words of the present one, last first.
    lines: Option<TextLines<'a>>,
    words: Vec<&'a [u8]>,
    line: u32,
}

impl<'a> Body<'a> {
    fn place(&self) -> Place {
        if self.format == Format::Text { Place::line(self.path, self.line) } else { Place::file(self.path) }
    }

    fn ends(&self) -> InputError {
        fault(self.place(), "the file ends before its last number")
            .expected("as many numbers as the header says")
            .fix("the file is cut short: export or download it again")
            .into()
    }

    /// The next word of a text body.
    fn word(&mut self) -> Result<&'a [u8], InputError> {
        while self.words.is_empty() {
            let Some((line, text)) = self.lines.as_mut().and_then(Iterator::next) else { return Err(self.ends()) };
            self.line = line;
            self.words.extend(words(text));
            self.words.reverse();
        }
        Ok(self.words.pop().unwrap_or_default())
    }

    /// The next number, stored as `kind`.
    fn next(&mut self, kind: Kind) -> Result<f64, InputError> {
        if self.format == Format::Text {
            let word = self.word()?;
            return number(word).ok_or_else(|| fault(self.place(), not_a_number(word)).expected("a number").into());
        }
        let is_big = self.format == Format::BigEndian;
        macro_rules! take {
            ($number:ty) => {{
                const SIZE: usize = size_of::<$number>();
                let taken = self.bytes.get(self.at..self.at + SIZE).and_then(|bytes| bytes.try_into().ok());
                let Some(taken) = taken else { return Err(self.ends()) };
                self.at += SIZE;
                f64::from(if is_big { <$number>::from_be_bytes(taken) } else { <$number>::from_le_bytes(taken) })
            }};
        }
        Ok(match kind {
            Kind::I8 => take!(i8),
            Kind::U8 => take!(u8),
            Kind::I16 => take!(i16),
            Kind::U16 => take!(u16),
            Kind::I32 => take!(i32),
            Kind::U32 => take!(u32),
            Kind::F32 => take!(f32),
            Kind::F64 => take!(f64),
        })
    }

    /// How many numbers `property` has in the next entry.
    fn length(&mut self, property: &Property) -> Result<usize, InputError> {
        let Some(count) = property.count else { return Ok(1) };
        let count = self.next(count)?;
        if !(count >= 0.0 && count.fract() == 0.0 && count <= self.bytes.len() as f64) {
            let problem = format!("a list \"{}\" has {count:e} entries", property.name);
            return Err(fault(self.place(), problem).expected("a count that fits the file").into());
        }
        Ok(count as usize)
    }

    /// The numbers of `property` of one entry.
    fn values(&mut self, property: &Property, values: &mut Vec<f64>) -> Result<(), InputError> {
        values.clear();
        for _ in 0..self.length(property)? {
            values.push(self.next(property.kind)?);
        }
        Ok(())
    }

    /// Steps over `property` of one entry; in a text body its words may be anything.
    fn pass_over(&mut self, property: &Property) -> Result<(), InputError> {
        for _ in 0..self.length(property)? {
            if self.format == Format::Text {
                self.word()?;
            } else {
                self.next(property.kind)?;
            }
        }
        Ok(())
    }
}

fn read_vertices(element: &Element, body: &mut Body, vertices: &mut Vec<Point>) -> Result<(), InputError> {
    if element.count > 3 * MAX_TRIANGLES {
        return Err(too_many(body.path, element.count));
    }
    let found = ["x", "y", "z"].map(|axis| element.index(&[axis], false));
    let [Some(x), Some(y), Some(z)] = found else {
        let error = fault(Place::line(body.path, element.line), "vertices have no x, y and z");
        return Err(error.expected("properties x, y and z of element vertex").into());
    };
    for _ in 0..element.count {
        let mut point = Point::origin();
        for (k, property) in element.properties.iter().enumerate() {
            match [x, y, z].iter().position(|at| *at == k) {
                Some(axis) => point[axis] = body.next(property.kind)?,
                None => body.pass_over(property)?,
            }
        }
        vertices.push(point);
    }
    Ok(())
}

fn read_faces(
    element: &Element,
    body: &mut Body,
    vertices: &[Point],
    triangles: &mut Vec<[u32; 3]>,
    cutter: &mut Cutter,
    faults: &mut Faults,
) -> Result<(), InputError> {
    let Some(corners) = element.index(&["vertex_indices", "vertex_index"], true) else {
        let error = fault(Place::line(body.path, element.line), "faces have no list of corners");
        return Err(error.expected("\"property list uchar int vertex_indices\" of element face").into());
    };
    let (mut values, mut face) = (Vec::new(), Vec::new());
    for index in 0..element.count {
        face.clear();
        for (k, property) in element.properties.iter().enumerate() {
            if k != corners {
                body.pass_over(property)?;
                continue;
            }
            body.values(property, &mut values)?;
            if values.len() < 3 {
                let problem = format!("face {index} has {} corners", values.len());
                faults.push(fault(body.place(), problem).expected("at least three"));
            }
            for &value in &values {
                if value >= 0.0 && value.fract() == 0.0 && value < vertices.len() as f64 {
                    face.push(value as u32);
                } else {
                    let problem =
                        format!("face {index} names vertex {value}, but there are {}, counted from 0", vertices.len());
                    let expected = "an index of a vertex in this file";
                    faults.push(Diagnostic::new("M241", body.place(), problem).expected(expected));
                }
            }
        }
        if face.len() < 3 {
            continue;
        }
        if triangles.len() + face.len() - 2 > MAX_TRIANGLES {
            return Err(too_many(body.path, triangles.len() + face.len() - 2));
        }
        if faults.found.is_empty()
            && let Err(expected) = cutter.triangulate(&face, vertices, triangles)
        {
            let problem = format!("face {index} is concave and has {} corners", face.len());
            faults.push(fault(body.place(), problem).expected(expected));
        }
    }
    Ok(())
}
