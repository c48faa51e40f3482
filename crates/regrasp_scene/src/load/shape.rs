//! The shape of an object or obstacle in a scene file: exactly one of the keys `sphere`, `box`, `cylinder`, `capsule`,
//! `ellipsoid`, `mesh`.

use super::files::Files;
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table, one_of};
use regrasp_geometry::{ConvexHull, Shape, TriangleMesh, Vector};
use std::sync::Arc;

/// Keys that name a kind of shape.
const KINDS: [&str; 6] = ["sphere", "box", "cylinder", "capsule", "ellipsoid", "mesh"];
/// Larger shapes are taken for a mistake of units, in metres (reliability R15).
const MAX_EXTENT: f64 = 3.0;
/// Smaller shapes are taken for a mistake of units, in metres (reliability R15).
const MIN_EXTENT: f64 = 2e-3;

/// What stands for the inside of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Solid {
    /// What its triangles enclose.
    Mesh,
    /// Its convex hull.
    Hull,
}

/// Where the object frame lies in the frame of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Origin {
    /// At the origin of the mesh file.
    File,
    /// At the centre of volume.
    Center,
    /// At a point of the scaled mesh file.
    Point(Vector),
}

/// A shape as read, not yet moved to its origin.
pub(super) struct ReadShape {
    /// The shape, in the frame of the file.
    pub shape: Shape,
    /// Its convex hull, where that stands for its inside.
    pub hull: Option<Shape>,
    /// Where its frame is to lie.
    pub origin: Origin,
    /// How the scene file names the mesh, if it is one.
    pub line: Option<MeshLine>,
}

/// The line of a scene file that names a mesh, to be written again with another scale.
#[derive(Debug, Clone)]
pub(super) struct MeshLine {
    file: String,
    scale: Vector,
    rest: String,
}

impl MeshLine {
    /// The line with its scale times `factor`.
    pub fn scaled(&self, factor: f64) -> String {
        // Nine digits: what a person would write.
        let rounded = |x: f64| format!("{x:.8e}").parse().unwrap_or(x);
        let scale = (self.scale * factor).map(rounded);
        let scale = match scale.iter().all(|one| *one == scale.x) {
            true => number(scale.x),
            false => format!("[{}, {}, {}]", number(scale.x), number(scale.y), number(scale.z)),
        };
        format!("mesh = {{ file = \"{}\", scale = {scale}{} }}", self.file, self.rest)
    }
}

/// The unit that a mesh is probably in, whose middle extent would be `middle` metres, and the factor that makes it metres: of
/// the usual ones, that which brings it nearest to `wanted`, by ratio.
pub(super) fn likely_unit(middle: f64, wanted: f64) -> (&'static str, f64) {
    const UNITS: [(&str, f64); 7] = [
        ("millimetres", 0.001),
        ("centimetres", 0.01),
        ("inches", 0.0254),
        ("decimetres", 0.1),
        ("metres, with a scale of 0.1 too many", 10.0),
        ("metres, with a scale of 0.01 too many", 100.0),
        ("kilometres, or a scale of 0.001 was applied twice", 1000.0),
    ];
    let off = |(_, factor): &(&str, f64)| (middle * factor / wanted).ln().abs();
    UNITS.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("there are units")
}

/// Middle extent that meshes are expected to have where no hand is known, in metres.
const USUAL_EXTENT: f64 = 0.05;

/// Reads the shape of `table`. Errors: none or several kinds (`S106`), bad lengths (`S107`), bad meshes (`M2xx`).
pub(super) fn shape(table: &mut Table, files: &mut Files, found: &mut Found) -> Option<ReadShape> {
    let kinds = table.present(&KINDS);
    let [kind] = kinds.as_slice() else {
        let names: Vec<&str> = kinds.iter().map(|kind| kind.name.as_str()).collect();
        let problem = if names.is_empty() {
            "has no shape".to_owned()
        } else {
            format!("has {} shapes: {}", names.len(), names.join(", "))
        };
        let diagnostic = table.error("S106", found, problem).expected(format!("exactly one of {}", one_of(&KINDS)));
        found.diagnostics.push(diagnostic);
        return None;
    };
    if kind.name.ends_with(".mesh") || kind.name == "mesh" {
        return mesh(kind, files, found);
    }
    let mut inside = kind.table(found)?;
    let shape = primitive(kind, &mut inside, found);
    inside.finish(found);
    let shape = shape?;
    has_likely_size(&shape, None, kind, found).then_some(ReadShape {
        shape,
        hull: None,
        origin: Origin::File,
        line: None,
    })
}

fn primitive(kind: &Entry, table: &mut Table, found: &mut Found) -> Option<Shape> {
    let name = kind.name.rsplit('.').next().unwrap_or_default();
    match name {
        "sphere" => Some(Shape::Sphere { radius: length(table, "radius", found)? }),
        "box" => Some(Shape::Cuboid { half_extents: lengths(table, "size", found)? * 0.5 }),
        "ellipsoid" => Some(Shape::Ellipsoid { radii: lengths(table, "radii", found)? }),
        _ => {
            let (radius, length) = (length(table, "radius", found), length(table, "length", found));
            let (radius, half_length) = (radius?, length? * 0.5);
            Some(match name {
                "cylinder" => Shape::Cylinder { half_length, radius },
                _ => Shape::Capsule { half_length, radius },
            })
        }
    }
}

fn length(table: &mut Table, key: &'static str, found: &mut Found) -> Option<f64> {
    table.required(found, key, &format!("add {key} = ..., in metres"))?.length(found)
}

fn lengths(table: &mut Table, key: &'static str, found: &mut Found) -> Option<Vector> {
    let entries = table.required(found, key, &format!("add {key} = [x, y, z], in metres"))?;
    let lengths = Vector::from(entries.numbers::<3>(found)?);
    if lengths.min() > 0.0 {
        return Some(lengths);
    }
    let diagnostic = entries
        .error("S107", found, format!("has the length {}", number(lengths.min())))
        .expected("lengths above 0, in metres");
    found.diagnostics.push(diagnostic);
    None
}

/// Reports a shape whose size can only be a mistake of units (`M201`).
fn has_likely_size(shape: &Shape, line: Option<&MeshLine>, entry: &Entry, found: &mut Found) -> bool {
    let (low, high) = shape.bounds();
    let size = high - low;
    let extent = size.max();
    let (is_large, is_small) = (extent > MAX_EXTENT, extent < MIN_EXTENT);
    if !is_large && !is_small {
        return true;
    }
    let fix = match line {
        Some(line) => {
            let (unit, factor) = likely_unit(middle_of(size), USUAL_EXTENT);
            format!("it is probably in {unit}: {}", line.scaled(factor))
        }
        None => format!("lengths are in metres: multiply them by {}", if is_large { "0.001" } else { "1000" }),
    };
    // Four decimals where they say something.
    let shown = |x: f64| if (0.01..1e6).contains(&extent) { format!("{x:.4}") } else { format!("{x:.1e}") };
    let diagnostic = entry
        .error("M201", found, format!("is {} x {} x {} m", shown(size.x), shown(size.y), shown(size.z)))
        .expected(format!("a largest extent between {MIN_EXTENT} m and {MAX_EXTENT} m"))
        .fix(fix);
    found.diagnostics.push(diagnostic);
    false
}

fn mesh(kind: &Entry, files: &mut Files, found: &mut Found) -> Option<ReadShape> {
    let mut table = kind.table(found)?;
    let file = table.required(found, "file", "add file = \"...\", relative to the scene file or package://NAME/PATH");
    let scale_entry = table.optional("scale");
    let scale = match &scale_entry {
        Some(entry) => scale(entry, found),
        None => Some(Scale::Factors(Vector::repeat(1.0))),
    };
    let solid = match table.optional("solid") {
        Some(entry) => entry.choice(found, &["mesh", "hull"]).map(|word| match word {
            "hull" => Solid::Hull,
            _ => Solid::Mesh,
        }),
        None => Some(Solid::Mesh),
    };
    let origin = match table.optional("origin") {
        Some(entry) => origin(&entry, found),
        None => Some(Origin::File),
    };
    table.finish(found);
    let file_name = file.as_ref().and_then(Entry::as_text).unwrap_or_default().to_owned();
    let read = file.and_then(|entry| files.mesh(&entry, found));
    let (mesh, scale, solid, origin) = (read?, scale?, solid?, origin?);
    let (scale, fitted) = (scale.factors(&mesh), matches!(scale, Scale::Fit(_)));
    if let Some(entry) = scale_entry.filter(|_| fitted) {
        found.note(&entry.span, format!("the mesh is fitted by the factor {}", number(scale.x)));
    }
    let scaled = match mesh.scaled(scale) {
        Ok(scaled) => oriented(scaled, kind, found),
        Err(error) => {
            let diagnostic = kind.error("M205", found, format!("cannot be scaled by {scale:?}: {error}"));
            found.diagnostics.push(diagnostic);
            return None;
        }
    };
    note_statistics(&scaled, kind, found);
    let hull = match solid {
        Solid::Mesh => None,
        Solid::Hull => match ConvexHull::new(scaled.vertices()) {
            Ok(hull) => Some(Shape::Convex(Arc::new(hull))),
            Err(error) => {
                let diagnostic = kind.error("M206", found, error.to_string()).fix("give a mesh that has an inside");
                found.diagnostics.push(diagnostic);
                return None;
            }
        },
    };
    let shape = Shape::Mesh(Arc::new(scaled));
    let solid = if solid == Solid::Hull { ", solid = \"hull\"" } else { "" };
    let origin_text = match origin {
        Origin::File => String::new(),
        Origin::Center => ", origin = \"center\"".to_owned(),
        Origin::Point(p) => format!(", origin = [{}, {}, {}]", number(p.x), number(p.y), number(p.z)),
    };
    let line = MeshLine { file: file_name, scale, rest: format!("{solid}{origin_text}") };
    let is_good = has_likely_size(&shape, Some(&line), kind, found) && has_likely_place(&shape, origin, kind, found);
    is_good.then_some(ReadShape { shape, hull, origin, line: Some(line) })
}

/// Reports a mesh that is farther from its own frame than any object is large (`M204`): the object would turn about a
/// point in the next room. An origin that is given answers for it.
fn has_likely_place(shape: &Shape, origin: Origin, entry: &Entry, found: &mut Found) -> bool {
    let (low, high) = shape.bounds();
    // Of the box, the point nearest to the origin.
    let nearest = low.coords.sup(&-high.coords).sup(&Vector::zeros()).norm();
    if origin != Origin::File || nearest <= MAX_EXTENT {
        return true;
    }
    let diagnostic = entry
        .error("M204", found, format!("lies {} m from the origin of its own file", number(nearest.round())))
        .expected(format!("at most {MAX_EXTENT} m: the object frame is the frame of the file"))
        .fix("mesh = { file = ..., origin = \"center\" }");
    found.diagnostics.push(diagnostic);
    false
}

/// How a mesh file is scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// By a factor per axis.
    Factors(Vector),
    /// So that the middle one of the three extents of the file is this long, in metres.
    Fit(f64),
}

impl Scale {
    /// The factors for `mesh`.
    fn factors(self, mesh: &TriangleMesh) -> Vector {
        match self {
            Scale::Factors(factors) => factors,
            Scale::Fit(length) => {
                let (low, high) = mesh.bounds();
                Vector::repeat(length / middle_of(high - low))
            }
        }
    }
}

/// The middle one of three lengths.
pub(super) fn middle_of(lengths: Vector) -> f64 {
    lengths.sum() - lengths.max() - lengths.min()
}

/// One factor, one per axis, or "fit:LENGTH"; negative mirrors. Errors: zero (`S107`), a length that is none (`S104`).
fn scale(entry: &Entry, found: &mut Found) -> Option<Scale> {
    if let Some(text) = entry.as_text() {
        let length = text.strip_prefix("fit:").and_then(|length| length.trim().parse::<f64>().ok());
        if let Some(length) = length.filter(|length| (MIN_EXTENT..=MAX_EXTENT).contains(length)) {
            return Some(Scale::Fit(length));
        }
        let expected =
            format!("\"fit:0.06\", with the middle extent in metres, {MIN_EXTENT} to {MAX_EXTENT}, or factors");
        found.diagnostics.push(entry.error("S104", found, format!("is \"{text}\"")).expected(expected));
        return None;
    }
    let scale: Vector =
        if entry.is_number() { Vector::repeat(entry.number(found)?) } else { entry.numbers::<3>(found)?.into() };
    if scale.iter().all(|factor| *factor != 0.0) {
        return Some(Scale::Factors(scale));
    }
    let diagnostic =
        entry.error("S107", found, "has a factor of 0, which leaves nothing").expected("factors other than 0");
    found.diagnostics.push(diagnostic);
    None
}

fn origin(entry: &Entry, found: &mut Found) -> Option<Origin> {
    if entry.as_text().is_some() {
        return Some(match entry.choice(found, &["file", "center"])? {
            "center" => Origin::Center,
            _ => Origin::File,
        });
    }
    entry.numbers::<3>(found).map(|point| Origin::Point(point.into()))
}

/// A closed mesh wound inside out is turned, with a note.
fn oriented(mesh: TriangleMesh, kind: &Entry, found: &mut Found) -> TriangleMesh {
    if mesh.statistics().is_closed() && mesh.signed_volume() < 0.0 {
        found.note(&kind.span, "the triangles are wound inside out; they were turned");
        return mesh.flipped();
    }
    mesh
}

fn note_statistics(mesh: &TriangleMesh, kind: &Entry, found: &mut Found) {
    let statistics = mesh.statistics();
    let counts = [
        (statistics.zero_area_dropped, "triangles of zero area were dropped"),
        (statistics.vertices_welded, "corners of open edges were merged with others nearby"),
        (statistics.duplicates_dropped, "triangles that are there twice were dropped"),
        (statistics.non_manifold_edges, "edges have more than two triangles"),
        (statistics.flipped_edges, "edges have triangles wound against each other"),
        (statistics.open_edges, "edges are open"),
    ];
    let remarks: Vec<String> =
        counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    if !remarks.is_empty() {
        found.note(&kind.span, format!("mesh: {}", remarks.join(", ")));
    }
}

/// `shape` with every point moved by `shift`. Panics for shapes that are not polyhedra: they have their own origin.
pub(super) fn shifted(shape: &Shape, shift: Vector) -> Result<Shape, String> {
    match shape {
        Shape::Mesh(mesh) => {
            let vertices = mesh.vertices().iter().map(|vertex| vertex + shift).collect();
            let mesh = TriangleMesh::new(vertices, mesh.triangles().to_vec()).map_err(|error| error.to_string())?;
            Ok(Shape::Mesh(Arc::new(mesh)))
        }
        Shape::Convex(hull) => {
            let vertices: Vec<_> = hull.vertices().iter().map(|vertex| vertex + shift).collect();
            ConvexHull::new(&vertices).map(|hull| Shape::Convex(Arc::new(hull))).map_err(|error| error.to_string())
        }
        primitive => {
            assert!(shift == Vector::zeros(), "a primitive has its origin at its centre");
            Ok(primitive.clone())
        }
    }
}
