//! COLLADA 1.4 and 1.5 (Khronos 2008): triangles and polygons of the scene, placed by its nodes, in metres.
//!
//! The unit of the file scales lengths. Its up axis turns nothing, as in tools of ROS. Materials, normals and animations have no part in
//! planning and are passed over.

use super::placed::{Corners, Placed};
use super::polygon::{MAX_CONCAVE, triangulate};
use super::{MAX_TRIANGLES, check_encoding, not_a_number, shown, too_many};
use crate::frame::{Point, Vector};
use crate::mesh::TriangleMesh;
use nalgebra::{Matrix3, Matrix4, Rotation3, Unit};
use regrasp_base::diagnostic::Lines;
use regrasp_base::markup::{Hostile, MAX_NODES, refuse_hostile};
use regrasp_base::{Diagnostic, InputError, Place};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Most nodes of the scene, each as often as it is there: nodes may stand for others, and those for others again.
const MAX_PLACED: usize = 100_000;
/// Most nodes that stand for each other in a row.
const MAX_DEPTH: usize = 64;
/// Elements of a mesh that have a surface.
const SURFACES: [&str; 5] = ["triangles", "trifans", "tristrips", "polylist", "polygons"];

/// Reads a COLLADA file: the geometry of its scene, or all geometry where it has no scene. Polygons, concave ones too, are cut into
/// triangles.
///
/// Errors: M202 no triangles, M203 NaN or infinite coordinates, M204 not UTF-8, M220 too many triangles, M241 an index that names no vertex,
/// M260 not well-formed, or not as COLLADA says, or with what is not read here (skins, holes in polygons, skew).
pub fn read_dae(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    check_encoding(path, bytes)?;
    let text = std::str::from_utf8(bytes).map_err(|_| {
        InputError::from(Diagnostic::new("M204", Place::file(path), "is not UTF-8 text").expected("UTF-8"))
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let fault = |place: Place, problem: String| InputError::from(Diagnostic::new("M260", place, problem));
    refuse_hostile(text).map_err(|hostile| match hostile {
        Hostile::Doctype { offset } => {
            fault(Place::at_offset(path, text, offset), "has a document type declaration (DTD)".into())
        }
        Hostile::Excess { offset, problem } => fault(Place::at_offset(path, text, offset), problem),
    })?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let place = Place { file: path.to_owned(), line: Some(error.pos().row), column: Some(error.pos().col) };
        fault(place, format!("is not well-formed XML: {error}"))
    })?;
    let root = document.root_element();
    let file = File { path, lines: Lines::of(text), ids: ids(root) };
    if root.tag_name().name() != "COLLADA" {
        let problem = format!("the outermost element is <{}>", root.tag_name().name());
        return Err(file.fault(root, problem).expected("<COLLADA>").into());
    }
    let mut scene =
        Scene { placed: Placed::new(path), n_placed: 0, geometries: BTreeMap::new(), positions: BTreeMap::new() };
    let unit = Matrix4::new_scaling(file.metres(root)?);
    match file.visual_scene(root)? {
        Some(nodes) => {
            for node in children(nodes, "node") {
                file.read_node(node, &unit, 0, &mut scene)?;
            }
        }
        None => {
            for geometry in root.descendants().filter(|node| node.has_tag_name_of("geometry")) {
                file.read_geometry(geometry, &unit, &mut scene)?;
            }
        }
    }
    scene.placed.finish()
}

/// Elements by their ids.
fn ids<'a, 'i>(root: Node<'a, 'i>) -> BTreeMap<&'a str, Node<'a, 'i>> {
    root.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect()
}

fn children<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i> {
    node.children().filter(move |child| child.has_tag_name_of(name))
}

/// Tags compared by their local name: files declare one of two name spaces, or none.
trait LocalName {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl LocalName for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

/// What is read so far.
struct Scene<'a> {
    placed: Placed<'a>,
    n_placed: usize,
    /// Each geometry and each array of positions is read once, however often it is placed; by the byte at which it begins.
    geometries: BTreeMap<usize, Arc<Vec<Corners>>>,
    positions: BTreeMap<usize, Arc<Vec<Point>>>,
}

/// A file under reading.
struct File<'a, 'i> {
    path: &'a Path,
    lines: Lines,
    ids: BTreeMap<&'a str, Node<'a, 'i>>,
}

/// Where the inputs of a primitive stand among its indices.
struct Inputs {
    positions: Arc<Vec<Point>>,
    /// Index of the position among those of one corner, and how many those are.
    offset: usize,
    stride: usize,
}

impl<'a, 'i> File<'a, 'i> {
    fn fault(&self, node: Node, problem: impl Into<String>) -> Diagnostic {
        Diagnostic::new("M260", self.lines.place(self.path, node.range().start), problem)
    }

    /// The element that attribute `name` of `node` points to.
    fn target(&self, node: Node, name: &str) -> Result<Node<'a, 'i>, InputError> {
        let url = node.attribute(name).unwrap_or_default();
        url.strip_prefix('#').and_then(|id| self.ids.get(id)).copied().ok_or_else(|| {
            let problem =
                format!("<{}> points to \"{}\", which is not there", node.tag_name().name(), shown(url.as_bytes()));
            self.fault(node, problem).expected("\"#ID\" of an element of this file").into()
        })
    }

    /// Metres per unit of length.
    fn metres(&self, root: Node) -> Result<f64, InputError> {
        let unit = children(root, "asset").next().and_then(|asset| children(asset, "unit").next());
        let Some((unit, text)) = unit.and_then(|unit| Some((unit, unit.attribute("meter")?))) else { return Ok(1.0) };
        match text.trim().parse::<f64>() {
            Ok(metres) if metres > 0.0 && metres.is_finite() => Ok(metres),
            _ => {
                let problem = format!("the unit is \"{}\" metres", shown(text.as_bytes()));
                Err(self.fault(unit, problem).expected("a number above 0").into())
            }
        }
    }

    /// The scene that is shown, or the only one; none where there is none.
    fn visual_scene(&self, root: Node<'a, 'i>) -> Result<Option<Node<'a, 'i>>, InputError> {
        let shown = children(root, "scene").flat_map(|scene| children(scene, "instance_visual_scene")).next();
        match shown {
            Some(instance) => self.target(instance, "url").map(Some),
            None => Ok(root.descendants().find(|node| node.has_tag_name_of("visual_scene"))),
        }
    }

    fn read_node(
        &self,
        node: Node<'a, 'i>,
        above: &Matrix4<f64>,
        depth: usize,
        scene: &mut Scene,
    ) -> Result<(), InputError> {
        scene.n_placed += 1;
        if scene.n_placed > MAX_PLACED || depth > MAX_DEPTH {
            let problem = format!("places more than {MAX_PLACED} nodes, or more than {MAX_DEPTH} inside each other");
            return Err(self.fault(node, problem).expected("nodes that do not stand for themselves").into());
        }
        let mut world_from_node = *above;
        for child in node.children().filter(Node::is_element) {
            if let Some(matrix) = self.transform(child)? {
                world_from_node *= matrix;
            }
        }
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "node" => self.read_node(child, &world_from_node, depth + 1, scene)?,
                "instance_node" => {
                    self.read_node(self.target(child, "url")?, &world_from_node, depth + 1, scene)?;
                }
                "instance_geometry" => {
                    self.read_geometry(self.target(child, "url")?, &world_from_node, scene)?;
                }
                "instance_controller" => {
                    let error = self.fault(child, "has a skin (<instance_controller>), which is not read here");
                    return Err(error.expected("<instance_geometry>").fix("export the mesh without a skeleton").into());
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The transformation that `element` is, if it is one.
    fn transform(&self, element: Node) -> Result<Option<Matrix4<f64>>, InputError> {
        let name = element.tag_name().name();
        let n_numbers = match name {
            "matrix" => 16,
            "translate" | "scale" => 3,
            "rotate" => 4,
            "lookat" | "skew" => {
                let error = self.fault(element, format!("has a <{name}>, which is not read here"));
                return Err(error.expected("<matrix>, <translate>, <rotate> or <scale>").into());
            }
            _ => return Ok(None),
        };
        let numbers = self.numbers(element)?;
        if numbers.len() != n_numbers {
            let problem = format!("<{name}> has {} numbers", numbers.len());
            return Err(self.fault(element, problem).expected(n_numbers.to_string()).into());
        }
        Ok(Some(match name {
            "matrix" => Matrix4::from_row_slice(&numbers),
            "translate" => Matrix4::new_translation(&Vector::new(numbers[0], numbers[1], numbers[2])),
            "scale" => Matrix4::new_nonuniform_scaling(&Vector::new(numbers[0], numbers[1], numbers[2])),
            _ => {
                let axis = Unit::try_new(Vector::new(numbers[0], numbers[1], numbers[2]), 0.0);
                let turn = axis.map(|axis| Rotation3::from_axis_angle(&axis, numbers[3].to_radians()));
                turn.map_or_else(Matrix4::identity, |turn| Matrix3::from(turn).to_homogeneous())
            }
        }))
    }

    /// The finite numbers in `element`.
    fn numbers(&self, element: Node) -> Result<Vec<f64>, InputError> {
        let text: String = element.children().filter(Node::is_text).filter_map(|child| child.text()).collect();
        text.split_ascii_whitespace()
            .map(|word| match word.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                Ok(_) => {
                    let place = self.lines.place(self.path, element.range().start);
                    let problem = format!("<{}> has the number {}", element.tag_name().name(), shown(word.as_bytes()));
                    Err(Diagnostic::new("M203", place, problem).expected("finite numbers").into())
                }
                Err(_) => Err(self.fault(element, not_a_number(word.as_bytes())).expected("numbers").into()),
            })
            .collect()
    }

    fn read_geometry(
        &self,
        geometry: Node<'a, 'i>,
        file_from_geometry: &Matrix4<f64>,
        scene: &mut Scene,
    ) -> Result<(), InputError> {
        let triangles = match scene.geometries.get(&geometry.range().start) {
            Some(known) => known.clone(),
            None => {
                let triangles = Arc::new(self.triangles_of(geometry, scene)?);
                scene.geometries.insert(geometry.range().start, triangles.clone());
                triangles
            }
        };
        scene.placed.add(&triangles, file_from_geometry)
    }

    /// The triangles of `geometry`, in its frame.
    fn triangles_of(&self, geometry: Node<'a, 'i>, scene: &mut Scene) -> Result<Vec<Corners>, InputError> {
        let mut triangles = Vec::new();
        let primitives = children(geometry, "mesh").flat_map(|mesh| mesh.children());
        // Lines and points have no surface.
        let is_surface = |node: &Node| SURFACES.iter().any(|name| node.has_tag_name_of(name));
        for primitive in primitives.filter(is_surface) {
            let inputs = self.inputs(primitive, scene)?;
            let mut indices = Vec::new();
            for face in self.corners(primitive, &inputs)? {
                if !triangulate(&face, &inputs.positions, &mut indices) {
                    let problem = format!("a concave polygon has {} corners", face.len());
                    let expected = format!("at most {MAX_CONCAVE} where it is not convex");
                    return Err(self.fault(primitive, problem).expected(expected).into());
                }
                if triangles.len() + indices.len() > MAX_TRIANGLES {
                    return Err(too_many(self.path, triangles.len() + indices.len()));
                }
            }
            triangles.extend(indices.iter().map(|corners| corners.map(|index| inputs.positions[index as usize])));
        }
        Ok(triangles)
    }

    /// The inputs of `primitive`. Errors: no positions.
    fn inputs(&self, primitive: Node<'a, 'i>, scene: &mut Scene) -> Result<Inputs, InputError> {
        let (mut vertices, mut stride) = (None, 1);
        for input in children(primitive, "input") {
            let offset = input.attribute("offset").map_or(Some(0), |text| text.trim().parse::<usize>().ok());
            let Some(offset) = offset.filter(|offset| *offset < 64) else {
                return Err(self
                    .fault(input, "has an offset that is no small whole number")
                    .expected("0, 1, 2, ...")
                    .into());
            };
            stride = stride.max(offset + 1);
            if input.attribute("semantic") == Some("VERTEX") {
                vertices = Some((offset, self.target(input, "source")?));
            }
        }
        let Some((offset, vertices)) = vertices else {
            let name = primitive.tag_name().name();
            return Err(self.fault(primitive, format!("<{name}> has no input VERTEX")).expected("one").into());
        };
        let position = children(vertices, "input").find(|input| input.attribute("semantic") == Some("POSITION"));
        let Some(position) = position else {
            return Err(self.fault(vertices, "has no input POSITION").expected("one").into());
        };
        let source = self.target(position, "source")?;
        let positions = match scene.positions.get(&source.range().start) {
            Some(known) => known.clone(),
            None => {
                let positions = Arc::new(self.positions(source)?);
                scene.positions.insert(source.range().start, positions.clone());
                positions
            }
        };
        Ok(Inputs { positions, offset, stride })
    }

    /// The points of `source`.
    fn positions(&self, source: Node<'a, 'i>) -> Result<Vec<Point>, InputError> {
        let Some(array) = children(source, "float_array").next() else {
            return Err(self.fault(source, "has no <float_array>").expected("positions").into());
        };
        let accessor = children(source, "technique_common").flat_map(|common| children(common, "accessor")).next();
        let read = |name: &str, default: usize| -> Result<usize, InputError> {
            let Some((accessor, text)) = accessor.and_then(|node| Some((node, node.attribute(name)?))) else {
                return Ok(default);
            };
            text.trim().parse().map_err(|_| {
                let problem = format!("{name} is \"{}\"", shown(text.as_bytes()));
                self.fault(accessor, problem).expected("a whole number").into()
            })
        };
        let (stride, first) = (read("stride", 3)?, read("offset", 0)?);
        let numbers = self.numbers(array)?;
        if !(3..=64).contains(&stride) || first > numbers.len() {
            let problem =
                format!("positions have a stride of {stride} and begin at number {first} of {}", numbers.len());
            return Err(self.fault(source, problem).expected("three numbers for each, within the array").into());
        }
        Ok(numbers[first..].chunks(stride).filter_map(|c| Some(Point::new(c[0], *c.get(1)?, *c.get(2)?))).collect())
    }

    /// The corners of each face of `primitive`.
    fn corners(&self, primitive: Node<'a, 'i>, inputs: &Inputs) -> Result<Vec<Vec<u32>>, InputError> {
        let name = primitive.tag_name().name();
        if let Some(hole) = children(primitive, "ph").next() {
            let error = self.fault(hole, "a polygon has holes, which are not read here");
            return Err(error.expected("polygons without holes").fix("export the mesh in triangles").into());
        }
        let mut lists = Vec::new();
        for list in children(primitive, "p") {
            let numbers = self.numbers(list)?;
            let mut corners = Vec::with_capacity(numbers.len() / inputs.stride);
            for corner in numbers.chunks_exact(inputs.stride) {
                let index = corner[inputs.offset];
                if !(index >= 0.0 && index.fract() == 0.0 && index < inputs.positions.len() as f64) {
                    let problem = format!(
                        "<{name}> names vertex {index}, but there are {}, counted from 0",
                        inputs.positions.len()
                    );
                    let place = self.lines.place(self.path, list.range().start);
                    return Err(Diagnostic::new("M241", place, problem).expected("an index of a vertex").into());
                }
                corners.push(index as u32);
            }
            lists.push(corners);
        }
        let few = |n: usize| -> InputError {
            self.fault(primitive, format!("a polygon has {n} corners")).expected("at least three").into()
        };
        let mut faces: Vec<Vec<u32>> = Vec::new();
        match name {
            "triangles" => faces.extend(lists.iter().flat_map(|list| list.chunks_exact(3)).map(<[u32]>::to_vec)),
            "trifans" => {
                let fans =
                    lists.iter().flat_map(|list| list.windows(2).skip(1).map(|pair| vec![list[0], pair[0], pair[1]]));
                faces.extend(fans);
            }
            "tristrips" => {
                for list in &lists {
                    let strips = list.windows(3).enumerate();
                    faces.extend(strips.map(|(k, c)| if k % 2 == 0 { c.to_vec() } else { vec![c[1], c[0], c[2]] }));
                }
            }
            "polygons" => faces = lists,
            _ => {
                let Some(counts) = children(primitive, "vcount").next() else {
                    return Err(self.fault(primitive, "<polylist> has no <vcount>").expected("one").into());
                };
                let mut rest = lists.first().map(Vec::as_slice).unwrap_or_default();
                for count in self.numbers(counts)? {
                    let is_there = count >= 3.0 && count.fract() == 0.0 && count <= rest.len() as f64;
                    if !is_there {
                        let problem = format!("a polygon has {count} corners, and {} are left", rest.len());
                        return Err(self.fault(counts, problem).expected("at least three, as many as <p> has").into());
                    }
                    let (face, after) = rest.split_at(count as usize);
                    faces.push(face.to_vec());
                    rest = after;
                }
            }
        }
        match faces.iter().find(|face| face.len() < 3) {
            Some(face) => Err(few(face.len())),
            None => Ok(faces),
        }
    }
}
