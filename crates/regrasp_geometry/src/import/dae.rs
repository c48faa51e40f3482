//! COLLADA 1.4 and 1.5 (Khronos 2008): triangles and polygons of the scene, placed by its nodes, in metres.
//!
//! The unit of the file scales lengths. Its up axis turns nothing, as in tools of ROS. Materials, normals and animations have no part in
//! planning and are passed over.

use super::placed::{Corners, Placed, fan, strip};
use super::polygon::Cutter;
use super::{MAX_TRIANGLES, check_encoding, not_a_number, shown, too_many};
use crate::frame::{Point, Vector};
use crate::mesh::TriangleMesh;
use nalgebra::{Matrix3, Matrix4, Rotation3, Unit};
use regrasp_base::diagnostic::Lines;
use regrasp_base::markup::{Hostile, MAX_NODES, refuse_hostile, without_undeclared_prefixes};
use regrasp_base::{Diagnostic, InputError, Place};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Most nodes of the scene and what they hold, each as often as it is there: nodes may stand for others, and those for others again.
const MAX_PLACED: usize = 100_000;
/// Most nodes that stand for each other in a row.
const MAX_DEPTH: usize = 64;
/// Elements of a mesh that have a surface.
const SURFACES: [&str; 5] = ["triangles", "trifans", "tristrips", "polylist", "polygons"];
/// Elements of a node that are placed by it.
const HELD: [&str; 4] = ["node", "instance_node", "instance_geometry", "instance_controller"];
/// Geometry that is not read here.
const OTHER_GEOMETRY: [&str; 3] = ["convex_mesh", "spline", "brep"];

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
    let text = &without_undeclared_prefixes(text.strip_prefix('\u{feff}').unwrap_or(text));
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
    let mut scene = Scene {
        placed: Placed::new(path),
        cutter: Cutter::default(),
        n_placed: 0,
        nodes: BTreeMap::new(),
        geometries: BTreeMap::new(),
        positions: BTreeMap::new(),
    };
    let unit = Matrix4::new_scaling(file.metres(root)?);
    match file.visual_scene(root)? {
        Some(nodes) => {
            for node in children(nodes, "node") {
                file.read_node(node, &Ok(unit), 0, &mut scene)?;
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

fn ids<'a, 'i>(root: Node<'a, 'i>) -> Ids<'a, 'i> {
    let mut ids = BTreeMap::new();
    for node in root.descendants() {
        let Some(id) = node.attribute("id") else { continue };
        let mesh = node.parent().filter(|parent| parent.has_tag_name_of("mesh")).map(|mesh| mesh.range().start);
        for scope in [mesh, None] {
            ids.entry((scope, node.tag_name().name(), id)).or_insert(node);
        }
    }
    ids
}

/// Elements by their tags and ids: files of some exporters have one id for elements of several kinds. Those of a mesh stand under its
/// place, too: in files that were put together, meshes have the same ids.
type Ids<'a, 'i> = BTreeMap<(Option<usize>, &'a str, &'a str), Node<'a, 'i>>;

fn children<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i> {
    node.children().filter(move |child| child.has_tag_name_of(name))
}

/// How many faces `primitive` says it has; 0 where it says nothing.
fn count_of(primitive: Node) -> usize {
    primitive.attribute("count").and_then(|text| text.trim().parse().ok()).unwrap_or(0)
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

/// A node by itself.
struct OwnNode<'a, 'i> {
    above_from_node: Result<Matrix4<f64>, InputError>,
    /// Nodes and instances in it.
    holds: Vec<Node<'a, 'i>>,
}

/// What is read so far.
struct Scene<'a, 'i> {
    placed: Placed<'a>,
    cutter: Cutter,
    n_placed: usize,
    /// Each node is read once, however often it is there; by the byte at which it begins.
    nodes: BTreeMap<usize, Arc<OwnNode<'a, 'i>>>,
    /// So are geometries and the vertices of meshes.
    geometries: BTreeMap<usize, Arc<Vec<Corners>>>,
    positions: BTreeMap<usize, Arc<Vec<Point>>>,
}

/// A file under reading.
struct File<'a, 'i> {
    path: &'a Path,
    lines: Lines,
    ids: Ids<'a, 'i>,
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

    /// The element called `tag` that attribute `name` of `node` points to: one of the same mesh, where there is one.
    fn target(&self, node: Node<'a, '_>, name: &str, tag: &'a str) -> Result<Node<'a, 'i>, InputError> {
        let url: &'a str = node.attribute(name).unwrap_or_default();
        let mesh = node.ancestors().find(|above| above.has_tag_name_of("mesh")).map(|mesh| mesh.range().start);
        let found = |id| [mesh, None].into_iter().find_map(|scope| self.ids.get(&(scope, tag, id)));
        url.strip_prefix('#').and_then(found).copied().ok_or_else(|| {
            let seen = shown(url.as_bytes());
            let problem = format!("<{}> points to <{tag}> \"{seen}\", which is not there", node.tag_name().name());
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
            Some(instance) => self.target(instance, "url", "visual_scene").map(Some),
            None => Ok(root.descendants().find(|node| node.has_tag_name_of("visual_scene"))),
        }
    }

    fn read_node(
        &self,
        node: Node<'a, 'i>,
        above: &Result<Matrix4<f64>, InputError>,
        depth: usize,
        scene: &mut Scene<'a, 'i>,
    ) -> Result<(), InputError> {
        let start = node.range().start;
        let own = match scene.nodes.get(&start) {
            Some(known) => known.clone(),
            None => {
                let own = Arc::new(self.own(node));
                scene.nodes.insert(start, own.clone());
                own
            }
        };
        scene.n_placed += 1 + own.holds.len();
        if scene.n_placed > MAX_PLACED || depth > MAX_DEPTH {
            let problem = format!("places more than {MAX_PLACED} nodes, or more than {MAX_DEPTH} inside each other");
            return Err(self.fault(node, problem).expected("nodes that do not stand for themselves").into());
        }
        // What is wrong with a matrix matters where something is placed by it: not above a camera.
        let file_from_node = match (above, &own.above_from_node) {
            (Ok(above), Ok(own)) => Ok(above * own),
            (Err(error), _) | (_, Err(error)) => Err(error.clone()),
        };
        for &child in &own.holds {
            match child.tag_name().name() {
                "node" => self.read_node(child, &file_from_node, depth + 1, scene)?,
                "instance_node" => {
                    self.read_node(self.target(child, "url", "node")?, &file_from_node, depth + 1, scene)?;
                }
                "instance_geometry" => {
                    let geometry = self.target(child, "url", "geometry")?;
                    self.read_geometry(geometry, file_from_node.as_ref().map_err(Clone::clone)?, scene)?;
                }
                _ => {
                    let error = self.fault(child, "has a skin (<instance_controller>), which is not read here");
                    return Err(error.expected("<instance_geometry>").fix("export the mesh without a skeleton").into());
                }
            }
        }
        Ok(())
    }

    /// What `node` says itself.
    fn own(&self, node: Node<'a, 'i>) -> OwnNode<'a, 'i> {
        let elements = || node.children().filter(Node::is_element);
        let above_from_node = elements().try_fold(Matrix4::identity(), |product, element| {
            Ok(self.transform(element)?.map_or(product, |matrix| product * matrix))
        });
        let is_held = |child: &Node| HELD.iter().any(|name| child.has_tag_name_of(name));
        OwnNode { above_from_node, holds: elements().filter(is_held).collect() }
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
        scene: &mut Scene<'a, 'i>,
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
    fn triangles_of(&self, geometry: Node<'a, 'i>, scene: &mut Scene<'a, 'i>) -> Result<Vec<Corners>, InputError> {
        let mut triangles = Vec::new();
        if let Some(other) =
            geometry.children().find(|node| OTHER_GEOMETRY.iter().any(|name| node.has_tag_name_of(name)))
        {
            let error = self.fault(other, format!("has a <{}>, which is not read here", other.tag_name().name()));
            return Err(error.expected("<mesh>").fix("export the mesh in triangles").into());
        }
        let primitives = children(geometry, "mesh").flat_map(|mesh| mesh.children());
        // Lines and points have no surface.
        let is_surface = |node: &Node| SURFACES.iter().any(|name| node.has_tag_name_of(name));
        for primitive in primitives.filter(is_surface) {
            // A material without faces.
            if children(primitive, "p").chain(children(primitive, "ph")).next().is_none() && count_of(primitive) == 0 {
                continue;
            }
            let inputs = self.inputs(primitive, scene)?;
            let mut indices = Vec::new();
            for face in self.corners(primitive, &inputs)? {
                if let Err(expected) = scene.cutter.triangulate(&face, &inputs.positions, &mut indices) {
                    let problem = format!("a concave polygon has {} corners", face.len());
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
    fn inputs(&self, primitive: Node<'a, 'i>, scene: &mut Scene<'a, 'i>) -> Result<Inputs, InputError> {
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
                vertices = Some((offset, self.target(input, "source", "vertices")?));
            }
        }
        let Some((offset, vertices)) = vertices else {
            let name = primitive.tag_name().name();
            return Err(self.fault(primitive, format!("<{name}> has no input VERTEX")).expected("one").into());
        };
        let start = vertices.range().start;
        let positions = match scene.positions.get(&start) {
            Some(known) => known.clone(),
            None => {
                let mut inputs = children(vertices, "input");
                let Some(position) = inputs.find(|input| input.attribute("semantic") == Some("POSITION")) else {
                    return Err(self.fault(vertices, "has no input POSITION").expected("one").into());
                };
                let positions = Arc::new(self.positions(self.target(position, "source", "source")?)?);
                scene.positions.insert(start, positions.clone());
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
            if numbers.len() % inputs.stride != 0 {
                let problem = format!("<p> has {} numbers", numbers.len());
                return Err(self.fault(list, problem).expected(format!("{} for each corner", inputs.stride)).into());
            }
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
            "trifans" => faces.extend(lists.iter().flat_map(|list| fan(list)).map(|face| face.to_vec())),
            "tristrips" => faces.extend(lists.iter().flat_map(|list| strip(list)).map(|face| face.to_vec())),
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
        let stated = if matches!(name, "triangles" | "polylist" | "polygons") { count_of(primitive) } else { 0 };
        if faces.len() < stated {
            let problem = format!("<{name}> has {} faces", faces.len());
            let error = self.fault(primitive, problem).expected(format!("{stated}, as its count says"));
            return Err(error.fix("the file is cut short: export it again").into());
        }
        match faces.iter().find(|face| face.len() < 3) {
            Some(face) => Err(few(face.len())),
            None => Ok(faces),
        }
    }
}
