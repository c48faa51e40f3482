//! Binary glTF 2.0 (Khronos 2017): triangles of the scene, placed by its nodes. Materials, normals and animations have no part in planning
//! and are passed over. What would move the surface in another way is refused.

use super::placed::{Corners, Placed, fan, strip};
use super::{MAX_TRIANGLES, shown, too_many};
use crate::frame::{Point, Vector};
use crate::mesh::TriangleMesh;
use nalgebra::{Matrix4, Quaternion, UnitQuaternion};
use regrasp_base::{Diagnostic, InputError, Place};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Most nodes of the scene, and most inside each other. In a file that keeps to the rules each is there once.
const MAX_PLACED: usize = 100_000;
const MAX_DEPTH: usize = 256;
/// First chunk of a file, and the chunk of numbers.
const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Gltf {
    scene: Option<usize>,
    scenes: Vec<SceneEntry>,
    nodes: Vec<NodeEntry>,
    meshes: Vec<MeshEntry>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<BufferView>,
    buffers: Vec<Buffer>,
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct SceneEntry {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct NodeEntry {
    #[serde(default)]
    children: Vec<usize>,
    mesh: Option<usize>,
    /// Column by column.
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    /// A unit quaternion, x y z w.
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    skin: Option<usize>,
    /// In place of those of its mesh.
    weights: Option<Vec<f64>>,
    #[serde(default)]
    extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
struct MeshEntry {
    primitives: Vec<Primitive>,
    /// Of shapes that the mesh is drawn towards.
    #[serde(default)]
    weights: Vec<f64>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: BTreeMap<String, usize>,
    indices: Option<usize>,
    /// 4 triangles, 5 strips, 6 fans; less are points and lines.
    mode: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
    sparse: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// Reads a binary glTF file: the meshes of its scene, or all meshes where it has no scene. Axes are those of the file: y is up in most.
///
/// Errors: M202 no triangles, M203 NaN or infinite coordinates, M220 too many triangles, M241 an index that names no vertex, M270 not as
/// glTF says, or with what is not read here (skins, weights of other shapes, instances by an extension, compression, sparse accessors, other
/// files).
pub fn read_glb(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    if bytes.is_empty() {
        return Err(Diagnostic::new("M202", Place::file(path), "is empty (0 bytes)").into());
    }
    let fault = |problem: String| Diagnostic::new("M270", Place::file(path), problem);
    let (json, binary) = chunks(bytes).map_err(|problem| {
        fault(problem.into()).expected("a binary glTF file of version 2").fix("export it again, as .glb")
    })?;
    let gltf: Gltf =
        serde_json::from_slice(json).map_err(|error| fault(format!("its JSON cannot be read: {error}")))?;
    if let Some(name) = gltf.extensions_required.iter().find(|name| !is_passed_over(name)) {
        let error = fault(format!("needs the extension {}, which is not read here", shown(name.as_bytes())));
        return Err(error
            .expected("plain numbers")
            .fix("export it without compression and without this extension")
            .into());
    }
    let file = File { path, gltf: &gltf, binary };
    let mut placing =
        Placing { placed: Placed::new(path), n_placed: 0, meshes: BTreeMap::new(), positions: BTreeMap::new() };
    let scene = gltf
        .scene
        .map_or_else(|| Ok(gltf.scenes.first()), |index| file.entry(&gltf.scenes, index, "scene").map(Some))?;
    match scene {
        Some(scene) => {
            for &node in &scene.nodes {
                file.place(node, &Matrix4::identity(), 0, &mut placing)?;
            }
        }
        None => {
            for mesh in 0..gltf.meshes.len() {
                let triangles = file.mesh(mesh, &mut placing.positions)?;
                placing.placed.add(&triangles, &Matrix4::identity())?;
            }
        }
    }
    placing.placed.finish()
}

/// True of extensions that change nothing of the surface.
fn is_passed_over(name: &str) -> bool {
    const PARTS: [&str; 7] =
        ["_materials_", "_texture_", "_lights_", "_animation_", "_xmp", "_audio", "_node_visibility"];
    PARTS.iter().any(|part| name.contains(part))
}

/// An extension that places a mesh many times.
const INSTANCES: &str = "EXT_mesh_gpu_instancing";

/// The chunks of JSON and of numbers.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), &'static str> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    if !bytes.starts_with(b"glTF") {
        return Err("does not begin with \"glTF\"");
    }
    if word(4) != Some(2) {
        return Err("is not of version 2");
    }
    let chunk = |at: usize| -> Option<(u32, &[u8])> {
        let length = word(at)? as usize;
        // Some writers leave out the bytes that fill the last word.
        let (start, missing) = (at + 8, (at + 8 + length).saturating_sub(bytes.len()));
        Some((word(at + 4)?, bytes.get(start..start + length - missing.min(3).min(length))?))
    };
    let Some((JSON, json)) = chunk(12) else { return Err("has no whole chunk of JSON: it is cut short, or no glTF") };
    let after = 20 + json.len();
    let json = json.trim_ascii_end();
    let json = &json[..json.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1)];
    match chunk(after) {
        Some((BINARY, binary)) => Ok((json, binary)),
        None if word(after + 4) == Some(BINARY) => Err("is cut short: its chunk of numbers ends too early"),
        _ => Ok((json, &[])),
    }
}

struct Placing<'a> {
    placed: Placed<'a>,
    n_placed: usize,
    /// Each mesh is read once, however often it is placed.
    meshes: BTreeMap<usize, Arc<Vec<Corners>>>,
    /// So are positions, however many parts of meshes share them.
    positions: BTreeMap<usize, Arc<Vec<Point>>>,
}

/// A file under reading.
struct File<'a> {
    path: &'a Path,
    gltf: &'a Gltf,
    binary: &'a [u8],
}

impl<'a> File<'a> {
    fn fault(&self, problem: impl Into<String>) -> Diagnostic {
        Diagnostic::new("M270", Place::file(self.path), problem)
    }

    fn entry<T>(&self, entries: &'a [T], index: usize, name: &str) -> Result<&'a T, InputError> {
        entries.get(index).ok_or_else(|| {
            let problem = format!("names {name} {index}, but there are {}, counted from 0", entries.len());
            self.fault(problem).expected("an index of an entry of this file").into()
        })
    }

    fn place(&self, node: usize, above: &Matrix4<f64>, depth: usize, placing: &mut Placing) -> Result<(), InputError> {
        placing.n_placed += 1;
        if placing.n_placed > MAX_PLACED || depth > MAX_DEPTH {
            let problem = format!("places more than {MAX_PLACED} nodes, or more than {MAX_DEPTH} inside each other");
            return Err(self.fault(problem).expected("nodes that are a tree").into());
        }
        let entry = self.entry(&self.gltf.nodes, node, "node")?;
        let file_from_node = above * self.transform(entry, node)?;
        if let Some(mesh) = entry.mesh {
            let weights = entry.weights.as_ref().unwrap_or(&self.entry(&self.gltf.meshes, mesh, "mesh")?.weights);
            let others = [
                (entry.skin.is_some(), "a skin"),
                (entry.extensions.contains_key(INSTANCES), INSTANCES),
                (weights.iter().any(|weight| *weight != 0.0), "weights of other shapes"),
            ];
            if let Some((_, other)) = others.into_iter().find(|(is_there, _)| *is_there) {
                let error = self.fault(format!("node {node} changes its mesh by {other}, which is not read here"));
                return Err(error.expected("a mesh placed by its node").fix("export the mesh as it looks").into());
            }
            let triangles = match placing.meshes.get(&mesh) {
                Some(known) => known.clone(),
                None => {
                    let triangles = Arc::new(self.mesh(mesh, &mut placing.positions)?);
                    placing.meshes.insert(mesh, triangles.clone());
                    triangles
                }
            };
            placing.placed.add(&triangles, &file_from_node)?;
        }
        entry.children.iter().try_for_each(|&child| self.place(child, &file_from_node, depth + 1, placing))
    }

    fn transform(&self, entry: &NodeEntry, node: usize) -> Result<Matrix4<f64>, InputError> {
        if let Some(matrix) = entry.matrix {
            return Ok(Matrix4::from_column_slice(&matrix));
        }
        let turn = match entry.rotation {
            Some([x, y, z, w]) => UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).ok_or_else(|| {
                self.fault(format!("the rotation of node {node} is zero")).expected("a unit quaternion")
            })?,
            None => UnitQuaternion::identity(),
        };
        let translation = Matrix4::new_translation(&Vector::from(entry.translation.unwrap_or_default()));
        let scale = Matrix4::new_nonuniform_scaling(&Vector::from(entry.scale.unwrap_or([1.0; 3])));
        Ok(translation * turn.to_homogeneous() * scale)
    }

    /// The triangles of a mesh, in its frame.
    fn mesh(&self, mesh: usize, known: &mut BTreeMap<usize, Arc<Vec<Point>>>) -> Result<Vec<Corners>, InputError> {
        let mut triangles: Vec<Corners> = Vec::new();
        for primitive in &self.entry(&self.gltf.meshes, mesh, "mesh")?.primitives {
            let mode = primitive.mode.unwrap_or(4);
            // Points and lines have no surface.
            if mode < 4 {
                continue;
            }
            // What has no positions is not drawn (glTF 2.0, section 3.7.2.1).
            let Some(&positions) = primitive.attributes.get("POSITION") else { continue };
            let points = match known.get(&positions) {
                Some(points) => points.clone(),
                None => {
                    let numbers = self.numbers(positions, "VEC3", 3)?;
                    let points = numbers.chunks_exact(3).map(|c| Point::new(c[0], c[1], c[2]));
                    let points = Arc::new(points.collect::<Vec<Point>>());
                    known.insert(positions, points.clone());
                    points
                }
            };
            let corners: Vec<Point> = match primitive.indices {
                None => points.to_vec(),
                Some(indices) => {
                    let at = |index: f64| {
                        points.get(index as usize).copied().ok_or_else(|| {
                            let problem = format!("mesh {mesh} names vertex {index}, but there are {}", points.len());
                            let error = Diagnostic::new("M241", Place::file(self.path), problem);
                            InputError::from(error.expected("an index of a vertex in this file"))
                        })
                    };
                    self.numbers(indices, "SCALAR", 1)?.into_iter().map(at).collect::<Result<_, _>>()?
                }
            };
            let n_triangles = if mode == 4 { corners.len() / 3 } else { corners.len().saturating_sub(2) };
            if triangles.len() + n_triangles > MAX_TRIANGLES {
                return Err(too_many(self.path, triangles.len() + n_triangles));
            }
            match mode {
                4 => triangles.extend(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]])),
                5 => triangles.extend(strip(&corners)),
                6 => triangles.extend(fan(&corners)),
                _ => {
                    return Err(self.fault(format!("a part of mesh {mesh} has mode {mode}")).expected("0 to 6").into());
                }
            }
        }
        Ok(triangles)
    }

    /// The numbers of an accessor of `kind`, `width` for each entry.
    fn numbers(&self, accessor: usize, kind: &str, width: usize) -> Result<Vec<f64>, InputError> {
        let entry = self.entry(&self.gltf.accessors, accessor, "accessor")?;
        let fault = |problem: String, expected: &str| -> InputError {
            self.fault(format!("accessor {accessor} {problem}")).expected(expected).into()
        };
        if entry.kind != kind {
            return Err(fault(format!("is of type \"{}\"", shown(entry.kind.as_bytes())), kind));
        }
        if entry.sparse.is_some() {
            return Err(fault("is sparse, which is not read here".into(), "all numbers in a buffer"));
        }
        // Positions are floats, unless an extension says otherwise.
        let size = match (entry.component_type, kind) {
            (5126, "VEC3") | (5125, "SCALAR") => 4,
            (5123, "SCALAR") => 2,
            (5121, "SCALAR") => 1,
            (other, _) => {
                return Err(fault(
                    format!("has components of type {other}"),
                    "floats for positions, unsigned integers for indices",
                ));
            }
        };
        let Some(view) = entry.buffer_view else { return Err(fault("has no buffer view".into(), "one")) };
        let view = self.entry(&self.gltf.buffer_views, view, "buffer view")?;
        let buffer = self.entry(&self.gltf.buffers, view.buffer, "buffer")?;
        if view.buffer != 0 || buffer.uri.is_some() {
            return Err(fault("is in another file".into(), "numbers in the file itself, as .glb has them"));
        }
        let stride = view.byte_stride.filter(|stride| *stride > 0).unwrap_or(width * size);
        if entry.count > 3 * MAX_TRIANGLES {
            return Err(too_many(self.path, entry.count / 3));
        }
        let bytes =
            view.byte_offset.checked_add(view.byte_length).and_then(|end| self.binary.get(view.byte_offset..end));
        let bytes = bytes.and_then(|bytes| bytes.get(entry.byte_offset..));
        // Every entry has bytes of its own, or no count could be too large.
        let needed = entry.count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(width * size));
        let (Some(bytes), Some(needed)) = (bytes, needed) else {
            return Err(fault("is outside of its buffer".into(), "numbers within the file"));
        };
        if needed > bytes.len() || stride < width * size {
            return Err(fault(
                format!("needs {needed} bytes, {stride} for each entry, of {}", bytes.len()),
                "numbers within the file",
            ));
        }
        let mut numbers = Vec::with_capacity(entry.count * width);
        for index in 0..entry.count {
            let at = &bytes[index * stride..][..width * size];
            numbers.extend(at.chunks_exact(size).map(|c| match *c {
                [a, b, c, d] if kind == "VEC3" => f64::from(f32::from_le_bytes([a, b, c, d])),
                [a, b, c, d] => f64::from(u32::from_le_bytes([a, b, c, d])),
                [a, b] => f64::from(u16::from_le_bytes([a, b])),
                ref other => f64::from(other.first().copied().unwrap_or_default()),
            }));
        }
        Ok(numbers)
    }
}
