//! The roadmap file. `docs/reference/roadmap-format.md` says the same in words.
//!
//! Codes: R601 not a roadmap file, R602 another version, R603 not as long as it says, R604 damaged, R605 what it says
//! about itself cannot be understood, R606 contradicts itself.

use crate::in_hand::roadmap::bytes::{Reader, Writer, checksum};
use crate::in_hand::roadmap::graph::{Edge, Footholds, Graph, Node, Passage};
use crate::in_hand::roadmap::identity::{Digest, Identity};
use crate::in_hand::roadmap::index::{Costs, Index};
use crate::in_hand::roadmap::landmarks::{Landmarks, ROW_BYTES, Row};
use crate::in_hand::roadmap::{About, BuildSettings, GraspRoadmap, Region};
use crate::settings::InHandSettings;
use regrasp_base::{Diagnostic, InputError, Place, files};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_robot::ContactModel;
use regrasp_robot::kinematics::finger_ik;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// First bytes of every roadmap file.
const MAGIC: [u8; 8] = *b"regrasp\x1a";
/// Version that this program reads and writes.
const FORMAT_VERSION: u32 = 5;
/// Largest file that is read: more nodes than indices can tell apart need more.
const MAX_FILE_BYTES: u64 = 8 << 30;
/// Where the bytes begin that the checksum is of: after magic, version, number of fingers, length and checksum.
const CHECKED_FROM: usize = 32;
/// Most moving joints of a finger.
const MAX_COORDINATES: usize = finger_ik::MAX_COORDINATES;
/// Finger of an edge that is a transfer.
const NO_FINGER: u8 = 255;
/// Last byte of the record of an edge with forces and times.
const TIMED: u8 = 1;

/// [`About`] on disk.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AboutData {
    tool: String,
    fingers: Vec<String>,
    hand_name: String,
    hand_sha256: String,
    contacts: Vec<ContactData>,
    object_name: String,
    object_sha256: String,
    obstacles_sha256: String,
    friction: f64,
    region: Region,
    settings: InHandSettings,
    build: BuildSettings,
    seed: u64,
    n_grown: u64,
    turn_length: f64,
    relocation_cost: f64,
    dynamics: Vec<f64>,
}

/// [`ContactModel`] on disk, with the words of hand files.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
enum ContactData {
    Frictionless,
    Point,
    SoftFinger { torsion_radius: f64 },
}

/// Sizes of all tables, as the file says them.
struct Sizes {
    about: usize,
    places: usize,
    contacts: usize,
    nodes: usize,
    edges: usize,
    strands: usize,
    ways: usize,
    tracks: usize,
    /// Joints and footholds of every finger.
    fingers: Vec<(usize, usize)>,
}

impl GraspRoadmap {
    /// Reads a roadmap file.
    ///
    /// Errors: as [`files::read`], and as [`GraspRoadmap::from_bytes`].
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::from_bytes(path, &files::read_at_most(path, MAX_FILE_BYTES)?)
    }

    /// Writes a roadmap file, whole or not at all: through a temporary file beside it that is renamed at the end.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        files::write_atomic(path, &self.to_bytes())
    }

    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let graph = &self.graph;
        let about = serde_json::to_string(&data_of(&self.about)).expect("plain data becomes JSON");
        let mut out = Writer::default();
        out.bytes.extend(MAGIC);
        out.u32(FORMAT_VERSION);
        out.u32(graph.n_fingers() as u32);
        out.u64(0); // Length and checksum are put in at the end.
        out.u64(0);
        let counts = [
            about.len(),
            graph.places.len(),
            graph.contacts.len(),
            graph.nodes.len(),
            graph.edges.len(),
            graph.strands.len(),
            graph.ways.len(),
            graph.tracks.len(),
        ];
        counts.iter().for_each(|&count| out.u64(count as u64));
        for footholds in &graph.footholds {
            out.u64(footholds.n_coordinates as u64);
            out.u64(footholds.contacts.len() as u64);
        }
        out.bytes.extend(about.as_bytes());
        out.pad();
        for place in &graph.places {
            out.f64s(place.translation.vector.iter().chain(place.rotation.coords.iter()).copied());
        }
        for contact in &graph.contacts {
            out.f64s(contact.point_in_object.iter().chain(contact.normal_in_object.iter()).copied());
        }
        for footholds in &graph.footholds {
            out.u32s(footholds.contacts.iter().copied());
            out.pad();
            out.f64s(footholds.joints.iter().copied());
        }
        for node in &graph.nodes {
            out.u32(node.place);
            out.u32s(node.footholds[..graph.n_fingers()].iter().copied());
        }
        out.pad();
        for edge in &graph.edges {
            let (first, n_between, finger, kind) = match edge.passage {
                Passage::Transfer { first, n_between } => (first, n_between, NO_FINGER, 0),
                Passage::Relocation { finger, first, n_between } => (first, n_between, finger, 0),
                Passage::Timed { finger, first, n_between } => (first, n_between, finger.unwrap_or(NO_FINGER), TIMED),
            };
            out.u32s([edge.from, edge.to, first]);
            out.bytes.extend(n_between.to_le_bytes());
            out.bytes.extend([finger, kind]);
        }
        out.u32s(graph.strands.iter().copied());
        out.pad();
        out.f32s(&graph.ways);
        out.pad();
        out.f64s(graph.tracks.iter().copied());
        out.f64s([self.landmarks.step]);
        self.landmarks.rows.iter().for_each(|row| out.bytes.extend(row.0));
        seal(&mut out.bytes);
        out.bytes
    }

    /// The roadmap of the bytes of a file, which came from `path`.
    ///
    /// No size is believed before it fits the number of bytes. Errors: `R601` to `R606`.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, InputError> {
        let fail = |code, problem: String| {
            Diagnostic::new(code, Place::file(path), problem).fix("build it again, or take it from a backup")
        };
        let cut = || fail("R603", format!("has {} bytes and ends too early", bytes.len()));
        let mut reader = Reader::new(bytes);
        if reader.take(MAGIC.len()) != Some(&MAGIC) {
            let start: String = bytes.iter().take(MAGIC.len()).map(|byte| format!("{byte:02x}")).collect();
            let diagnostic = Diagnostic::new("R601", Place::file(path), format!("begins with the bytes \"{start}\""));
            let diagnostic = diagnostic.expected("a file that regrasp roadmap build wrote");
            return Err(diagnostic.fix("regrasp roadmap build SCENE -o FILE.roadmap").into());
        }
        let version = reader.u32().ok_or_else(cut)?;
        if version != FORMAT_VERSION {
            let diagnostic = Diagnostic::new("R602", Place::file(path), format!("has format version {version}"));
            return Err(diagnostic.expected(FORMAT_VERSION.to_string()).fix("build it again with this program").into());
        }
        let n_fingers = reader.u32().ok_or_else(cut)?;
        let length = reader.u64().ok_or_else(cut)?;
        let sum = reader.u64().ok_or_else(cut)?;
        if length != bytes.len() as u64 {
            let problem = format!("has {} bytes and says it has {length}", bytes.len());
            return Err(fail("R603", problem).into());
        }
        let own_sum = checksum(&bytes[CHECKED_FROM..]);
        if own_sum != sum {
            let problem = format!("is damaged: its bytes have the checksum {own_sum:016x}");
            return Err(fail("R604", problem).expected(format!("{sum:016x}, as it says at byte 24")).into());
        }
        let sizes = sizes(&mut reader, n_fingers, bytes.len()).map_err(|problem| fail("R606", problem))?;
        let about = about(&mut reader, &sizes).map_err(|problem| fail("R605", problem))?;
        let (graph, landmarks) = tables(&mut reader, &sizes).ok_or_else(cut)?;
        if !reader.is_at_end() {
            return Err(fail("R606", "has bytes that belong to nothing".into()).into());
        }
        let contradiction = |problem| InputError::from(fail("R606", problem));
        graph.validate().map_err(contradiction)?;
        let identity = &about.identity;
        if [identity.fingers.len(), identity.contacts.len()] != [graph.n_fingers(); 2] {
            return Err(contradiction("names other fingers than it has".into()));
        }
        if !(landmarks.step > 0.0 && landmarks.step.is_finite()) {
            return Err(contradiction(format!("has landmarks that measure in steps of {}", landmarks.step)));
        }
        let index = Index::new(&graph, about.costs);
        Ok(GraspRoadmap { about, graph, landmarks, index })
    }
}

/// Puts length and checksum where they belong. For whoever makes or mends a file.
pub fn seal(bytes: &mut [u8]) {
    if bytes.len() >= CHECKED_FROM {
        let length = bytes.len() as u64;
        let sum = checksum(&bytes[CHECKED_FROM..]);
        bytes[16..24].copy_from_slice(&length.to_le_bytes());
        bytes[24..32].copy_from_slice(&sum.to_le_bytes());
    }
}

/// Reads the sizes and holds them against the number of bytes.
fn sizes(reader: &mut Reader, n_fingers: u32, n_bytes: usize) -> Result<Sizes, String> {
    if n_fingers == 0 || n_fingers as usize > MAX_FINGERS {
        return Err(format!("has {n_fingers} fingers; 1 to {MAX_FINGERS} are possible"));
    }
    let mut at = CHECKED_FROM;
    let mut count = |what: &str| -> Result<usize, String> {
        let value = reader.u64().ok_or("ends within its table of sizes")?;
        // Each thing counted takes at least one byte of the file.
        if value > n_bytes as u64 {
            return Err(format!("says at byte {at} that it has {value} {what}, in {n_bytes} bytes"));
        }
        at += 8;
        Ok(value as usize)
    };
    let mut sizes = Sizes {
        about: count("bytes about itself")?,
        places: count("places")?,
        contacts: count("contacts")?,
        nodes: count("nodes")?,
        edges: count("edges")?,
        strands: count("ways of fingers")?,
        ways: count("joint values of motions")?,
        tracks: count("numbers of motions with times")?,
        fingers: Vec::new(),
    };
    for index in 0..n_fingers {
        let finger = (count("joints of a finger")?, count("footholds of a finger")?);
        if finger.0 > MAX_COORDINATES || finger.0 == 0 {
            return Err(format!(
                "says that finger {index} has {} joints; 1 to {MAX_COORDINATES} are possible",
                finger.0
            ));
        }
        sizes.fingers.push(finger);
    }
    match sizes.total() {
        Some(total) if total == n_bytes => Ok(sizes),
        Some(total) => Err(format!("has tables of {total} bytes by its own sizes, in {n_bytes} bytes")),
        None => Err("says sizes beyond all files".into()),
    }
}

impl Sizes {
    /// Number of bytes of the whole file.
    fn total(&self) -> Option<usize> {
        let padded = |n: usize, size: usize| n.checked_mul(size)?.checked_next_multiple_of(8);
        let mut total = CHECKED_FROM + 8 * 8 + 16 * self.fingers.len();
        let mut sections = vec![
            padded(self.about, 1)?,
            padded(self.places, 7 * 8)?,
            padded(self.contacts, 6 * 8)?,
            padded(self.nodes, 4 * (1 + self.fingers.len()))?,
            padded(self.edges, 16)?,
            padded(self.strands, 4)?,
            padded(self.ways, 4)?,
            padded(self.tracks, 8)?,
            8,
            padded(self.nodes, ROW_BYTES)?,
        ];
        for &(n_coordinates, n_footholds) in &self.fingers {
            sections.push(padded(n_footholds, 4)?);
            sections.push(padded(n_footholds, 8 * n_coordinates)?);
        }
        for section in sections {
            total = total.checked_add(section)?;
        }
        Some(total)
    }
}

/// Reads the tables; none where the bytes end.
fn tables(reader: &mut Reader, sizes: &Sizes) -> Option<(Graph, Landmarks)> {
    let mut graph = Graph::new(sizes.fingers.iter().map(|&(n_coordinates, _)| n_coordinates));
    let places = reader.take(sizes.places.checked_mul(56)?)?;
    graph.places = places.as_chunks::<56>().0.iter().map(|chunk| pose_of(&numbers(chunk))).collect();
    let contacts = reader.take(sizes.contacts.checked_mul(48)?)?;
    graph.contacts = contacts.as_chunks::<48>().0.iter().map(|chunk| contact_of(&numbers(chunk))).collect();
    for (footholds, &(n_coordinates, n_footholds)) in graph.footholds.iter_mut().zip(&sizes.fingers) {
        let contacts = reader.u32s(n_footholds)?;
        let joints = reader.f64s(n_footholds.checked_mul(n_coordinates)?)?;
        *footholds = Footholds { n_coordinates, contacts, joints };
    }
    let stride = 1 + sizes.fingers.len();
    let nodes = reader.u32s(sizes.nodes.checked_mul(stride)?)?;
    graph.nodes = nodes
        .chunks_exact(stride)
        .map(|record| {
            let mut footholds = [0; MAX_FINGERS];
            footholds[..stride - 1].copy_from_slice(&record[1..]);
            Node { place: record[0], footholds }
        })
        .collect();
    let edges = reader.take(sizes.edges.checked_mul(16)?)?;
    graph.edges = edges.as_chunks::<16>().0.iter().map(edge_of).collect();
    graph.strands = reader.u32s(sizes.strands)?;
    graph.ways = reader.f32s(sizes.ways)?;
    graph.tracks = reader.f64s(sizes.tracks)?;
    let step = *reader.f64s(1)?.first()?;
    let rows = reader.take(sizes.nodes.checked_mul(ROW_BYTES)?)?;
    let rows = rows.as_chunks::<ROW_BYTES>().0.iter().map(|row| Row(*row)).collect();
    Some((graph, Landmarks { step, rows }))
}

fn numbers<const N: usize>(bytes: &[u8]) -> [f64; N] {
    let chunks = bytes.as_chunks::<8>().0;
    std::array::from_fn(|k| chunks.get(k).map_or(f64::NAN, |chunk| f64::from_le_bytes(*chunk)))
}

fn pose_of(numbers: &[f64; 7]) -> Pose {
    let [x, y, z, qx, qy, qz, qw] = *numbers;
    regrasp_geometry::pose_from([x, y, z], [qx, qy, qz, qw])
}

fn contact_of(numbers: &[f64; 6]) -> Contact {
    let [x, y, z, nx, ny, nz] = *numbers;
    let normal_in_object = UnitVector::new_unchecked(Vector::new(nx, ny, nz));
    Contact { point_in_object: Point::new(x, y, z), normal_in_object }
}

fn edge_of(record: &[u8; 16]) -> Edge {
    let words = record.as_chunks::<4>().0;
    let word = |k: usize| u32::from_le_bytes(words[k]);
    let [low, high, finger, kind] = words[3];
    let (first, n_between) = (word(2), u16::from_le_bytes([low, high]));
    let passage = match finger {
        finger if kind == TIMED => {
            Passage::Timed { finger: Some(finger).filter(|&finger| finger != NO_FINGER), first, n_between }
        }
        NO_FINGER => Passage::Transfer { first, n_between },
        finger => Passage::Relocation { finger, first, n_between },
    };
    Edge { from: word(0), to: word(1), passage }
}

/// What a roadmap says about itself, as the file has it.
pub(super) fn about_json(about: &About) -> serde_json::Value {
    serde_json::to_value(data_of(about)).unwrap_or_default()
}

fn data_of(about: &About) -> AboutData {
    AboutData {
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        fingers: about.identity.fingers.clone(),
        hand_name: about.identity.hand_name.clone(),
        hand_sha256: files::hex(&about.identity.hand),
        contacts: about.identity.contacts.iter().map(ContactData::from).collect(),
        object_name: about.identity.object_name.clone(),
        object_sha256: files::hex(&about.identity.object),
        obstacles_sha256: files::hex(&about.identity.obstacles),
        friction: about.identity.friction,
        region: about.region,
        settings: about.settings.clone(),
        build: about.build.clone(),
        seed: about.seed,
        n_grown: about.n_grown,
        turn_length: about.costs.turn_length,
        relocation_cost: about.costs.relocation,
        dynamics: about.dynamics.clone(),
    }
}

fn about(reader: &mut Reader, sizes: &Sizes) -> Result<About, String> {
    let bytes = reader.take_padded(sizes.about).ok_or("ends within what it says about itself")?;
    let wrong = |error: serde_json::Error| format!("says about itself: {error}");
    let mut data: serde_json::Value = serde_json::from_slice(bytes).map_err(wrong)?;
    // Settings of earlier versions could state gravity; those that did not are today's.
    if let Some(settings) = data.get_mut("settings").and_then(|settings| settings.as_object_mut())
        && settings.get("gravity").is_some_and(serde_json::Value::is_null)
    {
        settings.remove("gravity");
    }
    let data: AboutData = serde_json::from_value(data).map_err(wrong)?;
    data.settings.validate()?;
    data.build.validate()?;
    data.region.validate()?;
    for (name, value) in [("turn_length", data.turn_length), ("relocation_cost", data.relocation_cost)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(format!("{name} is {value}; it must be positive and finite"));
        }
    }
    Ok(About {
        identity: Identity {
            fingers: data.fingers,
            hand_name: data.hand_name,
            hand: digest_of(&data.hand_sha256)?,
            contacts: data.contacts.iter().map(ContactModel::from).collect(),
            object_name: data.object_name,
            object: digest_of(&data.object_sha256)?,
            obstacles: digest_of(&data.obstacles_sha256)?,
            friction: data.friction,
        },
        region: data.region,
        settings: data.settings,
        build: data.build,
        seed: data.seed,
        n_grown: data.n_grown,
        costs: Costs { turn_length: data.turn_length, relocation: data.relocation_cost },
        dynamics: data.dynamics,
    })
}

impl From<&ContactModel> for ContactData {
    fn from(model: &ContactModel) -> Self {
        match *model {
            ContactModel::Frictionless => ContactData::Frictionless,
            ContactModel::Point => ContactData::Point,
            ContactModel::SoftFinger { torsion_radius } => ContactData::SoftFinger { torsion_radius },
        }
    }
}

impl From<&ContactData> for ContactModel {
    fn from(data: &ContactData) -> Self {
        match *data {
            ContactData::Frictionless => ContactModel::Frictionless,
            ContactData::Point => ContactModel::Point,
            ContactData::SoftFinger { torsion_radius } => ContactModel::SoftFinger { torsion_radius },
        }
    }
}

fn digest_of(text: &str) -> Result<Digest, String> {
    let wrong = || format!("\"{text}\" is not a SHA-256 in hexadecimal");
    let digits: Vec<u8> =
        text.chars().map(|c| c.to_digit(16).map(|digit| digit as u8)).collect::<Option<_>>().ok_or_else(wrong)?;
    let bytes: Vec<u8> = digits.as_chunks::<2>().0.iter().map(|[high, low]| 16 * high + low).collect();
    if digits.len() % 2 == 1 {
        return Err(wrong());
    }
    bytes.try_into().map_err(|_| wrong())
}
