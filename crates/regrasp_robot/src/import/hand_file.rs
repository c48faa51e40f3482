//! `hand.toml`: which links of a URDF are fingers, what their tips are, which links may touch.
//!
//! A bare URDF is accepted too; its fingers and tips are then guessed as `inspect` does.

use super::assemble::assemble;
use super::couplings;
use super::fixes;
use super::names::{known_joint, known_link};
use super::options::{LoadOptions, LoadedInput};
use super::shared_motors;
use super::spec::{FingerSpec, HandSpec, PadSpec, TipSpec, leave_geometry_out};
use super::srdf::{LoadedSrdf, load_srdf};
use super::ties;
use super::urdf::{LoadedRobot, load_robot, load_robot_with};
use crate::contact_model::{self, ContactModel};
use crate::hand::{Hand, MAX_FINGERS};
use crate::inspect::drawn::{drawn_links, read_again};
use crate::inspect::enclosing::LARGEST_RADIUS;
use crate::inspect::guess::{guess_hand, leave_out_what_blocks};
use crate::robot::{JointId, LinkId, Robot};
use nalgebra::{Quaternion, UnitQuaternion};
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Codes, Entry, Found, Table};
use regrasp_base::{Diagnostic, InputError, Place, files};
use regrasp_geometry::frame::direction;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Shape, Vector};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The value of `format` in a hand file.
pub const FORMAT: &str = "regrasp-hand";
/// The value of `format_version` in a hand file.
pub const VERSION: f64 = 1.0;

pub(super) const CODES: Codes = Codes {
    syntax: "U200",
    unknown_key: "U201",
    missing_key: "U202",
    wrong_type: "U203",
    unknown_word: "U213",
    other_format: "U204",
    out_of_range: "U213",
};

/// A hand with what it was read from.
#[derive(Debug, Clone)]
pub struct LoadedHand {
    /// The hand.
    pub hand: Hand,
    /// Every file that was read, outermost first.
    pub inputs: Vec<LoadedInput>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Reads a hand from a `hand.toml`, or from a URDF whose fingers are then guessed.
///
/// Meshes of links become convex hulls (see [`crate::hand::convex_of`]). Errors: `F00x`, `U1xx`, `U2xx`, `V001`, `M2xx`.
pub fn load_hand(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    match extension.as_str() {
        "toml" => load_hand_file(path, options),
        // Xacro files and models of MuJoCo are refused by what is in them.
        "urdf" | "xml" | "xacro" | "mjcf" => load_bare_urdf(path, options),
        _ => Err(Diagnostic::new("U215", Place::file(path), "is neither a hand file nor a URDF")
            .expected("a file that ends in .toml or .urdf")
            .into()),
    }
}

fn load_bare_urdf(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let mut parts = guessed_parts(path, options)?;
    let (mut hand, mut more) = made(&parts, path, options)?;
    let blocks = leave_out_what_blocks(&parts.robot, &hand, &mut parts.spec);
    if !blocks.is_empty() {
        parts.notes.extend(blocks);
        leave_geometry_out(Arc::make_mut(&mut parts.robot), parts.spec.without_geometry.iter().copied());
        (hand, more) = made(&parts, path, options)?;
    }
    crate::inspect::rest::bend_towards_palm(&mut hand);
    ties::settle_rest(&mut hand);
    refuse_wrong_unit(&hand, path)?;
    Ok(LoadedHand { hand, inputs: parts.inputs, notes: [parts.notes, more].concat() })
}

fn guessed_parts(path: &Path, options: &LoadOptions) -> Result<HandParts, InputError> {
    let mut loaded = load_robot(path, options)?;
    options.check_time(path)?;
    let mut spec = guess_hand(&loaded.robot, options, path)?;
    // One finger alone is an arm.
    if spec.fingers.len() > 1 {
        let drawn = drawn_links(&loaded.robot, &[spec.base]);
        if !drawn.is_empty() {
            loaded = read_again(loaded, &drawn, (path, options))?;
            spec = guess_hand(&loaded.robot, options, path)?;
        }
    }
    let LoadedRobot { robot, inputs, mut notes } = loaded;
    let robot = Arc::new(robot);
    notes.push(format!(
        "{}: fingers and tips were guessed; `regrasp inspect -o hand.toml` writes them down",
        path.display()
    ));
    Ok(HandParts { robot, spec, inputs, notes })
}

fn load_hand_file(path: &Path, options: &LoadOptions) -> Result<LoadedHand, InputError> {
    let parts = hand_file_parts(path, options)?;
    let (hand, more) = made(&parts, path, options)?;
    refuse_wrong_unit(&hand, path)?;
    Ok(LoadedHand { hand, inputs: parts.inputs, notes: [parts.notes, more].concat() })
}

/// The hand of some parts, and remarks.
fn made(parts: &HandParts, path: &Path, options: &LoadOptions) -> Result<(Hand, Vec<String>), InputError> {
    let (mut spec, mut notes) = (parts.spec.clone(), Vec::new());
    if !options.untie {
        shared_motors::hold(&parts.robot, &mut spec, &mut notes);
    }
    // Joints of fingers move: a position given to them says nothing.
    let moving = shared_motors::moving_joints(&parts.robot, &spec);
    spec.held.retain(|joint, _| !moving.contains(joint));
    let robot = shared_motors::with_held_at_zero(&parts.robot, &spec);
    let (robot, ties) = ties::untie(&robot, &spec, &mut notes);
    let (hand, more) = assemble(&Arc::new(robot), &spec, path)?;
    let mut hand = Hand { ties, ..hand };
    ties::settle_rest(&mut hand);
    notes.extend(more);
    Ok((hand, notes))
}

/// What a hand file says, before a hand is made of it.
pub(super) fn hand_file_parts(path: &Path, options: &LoadOptions) -> Result<HandParts, InputError> {
    let bytes = options.read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let own = LoadedInput { role: "hand".into(), name, path: path.to_owned(), sha256: files::sha256(&bytes) };
    let text = files::text_of(path, bytes)?;
    let mut found = Found::new(path, &text, CODES);
    let document = found.parse();
    let parts = document.as_ref().and_then(|document| read(Table::root(document), path, options, &mut found));
    let (notes, diagnostics) = (found.notes, found.diagnostics);
    let parts = diagnostics.into_result(parts)?;
    let Parts { robot, spec, inputs: read } = parts.expect("what could not be read has left a diagnostic");
    options.check_time(path)?;
    let inputs = [vec![own], read].concat();
    Ok(HandParts { robot, spec, inputs, notes })
}

/// What a hand is to be made of.
pub(super) struct HandParts {
    /// The robot of the hand's URDF, with the couplings of the hand file.
    pub robot: Arc<Robot>,
    /// The hand, by the ids of that robot.
    pub spec: HandSpec,
    /// Files read, the hand file first.
    pub inputs: Vec<LoadedInput>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Refuses hands whose joints and tips are spread over less than a centimetre or more than five metres.
///
/// Arms with hands are a metre or two; a hand written in millimetres is a hundred metres or more.
///
/// Errors: such a span (`U216`), a fingertip larger than the hand (`U217`).
pub(super) fn refuse_wrong_unit(hand: &Hand, path: &Path) -> Result<(), InputError> {
    let span = crate::inspect::span(hand);
    if (0.01..=5.0).contains(&span) {
        let Some(finger) = hand.fingers.iter().find(|finger| finger.tip.radius() > span) else { return Ok(()) };
        let problem =
            format!("its tip has a radius of {} m, more than the {span:.4} m of the hand", number(finger.tip.radius()));
        return Err(Diagnostic::new("U217", Place::file(path), problem)
            .element("finger", &finger.name)
            .expected("a radius in metres")
            .into());
    }
    let (guess, factor) = if span > 5.0 {
        ("is probably in millimetres", "0.001")
    } else {
        ("is probably scaled down too often", "1000")
    };
    Err(Diagnostic::new(
        "U216",
        Place::file(path),
        format!("the joints and tips of the hand are spread over {} m", shown_span(span)),
    )
    .expected(format!("a hand in metres; this one {guess}"))
    .fix(match large_tip_mesh(hand).filter(|_| span > 5.0) {
        Some(link) => {
            format!("scale the collision mesh of link \"{link}\": <mesh filename=\"...\" scale=\"0.001 0.001 0.001\"/>")
        }
        None => format!("multiply every length of the URDF by {factor}"),
    })
    .into())
}

/// The first tip link with a mesh that cannot be in metres.
fn large_tip_mesh(hand: &Hand) -> Option<&str> {
    let links = hand.fingers.iter().map(|finger| &hand.robot.links[finger.tip.link.0]);
    let is_large = |placed: &PlacedShape| {
        matches!(placed.shape, Shape::Mesh(_)) && placed.shape.bounding_sphere().1 > LARGEST_RADIUS
    };
    links.into_iter().find(|link| link.collision.iter().any(is_large)).map(|link| link.name.as_str())
}

/// Metres with four decimals, where they say something.
fn shown_span(span: f64) -> String {
    if (1e-3..1e6).contains(&span) { format!("{span:.4}") } else { format!("{span:.1e}") }
}

/// What a hand file says.
struct Parts {
    robot: Arc<Robot>,
    spec: HandSpec,
    inputs: Vec<LoadedInput>,
}

/// Reads the whole file; none if anything is missing, with the reason in `found`.
fn read(mut root: Table, path: &Path, options: &LoadOptions, found: &mut Found) -> Option<Parts> {
    if !root.is_of_format(found, FORMAT, VERSION) {
        return None;
    }
    let urdf = root.required_or(found, "urdf", || fixes::add_urdf(path));
    let srdf = root.optional("srdf");
    let base = root.optional("base_link");
    let allow = root.optional("allow");
    let couplings = root.optional("couplings");
    let held = root.optional("held");
    let without_geometry = root.optional("without_geometry");
    let from_visuals = root.optional("collision_from_visuals");
    let inspect = fixes::inspect_command(urdf.as_ref().and_then(Entry::as_text), path);
    let fingers = root.required(found, "fingers", &inspect);
    root.finish(found);
    // Without a robot no name in the rest of the file can be looked up.
    let from_visuals = from_visuals.and_then(|entry| entry.entries(found, "a list of links")).unwrap_or_default();
    let names = from_visuals.iter().filter_map(Entry::as_text).map(Into::into).collect();
    let (mut robot, mut inputs) = urdf.and_then(|entry| locate_and_load(&entry, path, options, &names, found))?;
    from_visuals.iter().for_each(|link| refuse_unless_from_visuals(link, &robot, found));
    if let Some(entry) = couplings {
        couplings::read(&entry, &mut robot, found);
    }
    let without_geometry: BTreeSet<LinkId> = without_geometry
        .and_then(|entry| entry.entries(found, "a list of links"))
        .map_or_else(BTreeSet::new, |links| links.iter().filter_map(|link| known_link(link, &robot, found)).collect());
    leave_geometry_out(&mut robot, without_geometry.iter().copied());
    let robot = Arc::new(robot);
    let base = base.and_then(|entry| known_link(&entry, &robot, found)).unwrap_or(robot.root);
    let mut allow = allow.map_or_else(BTreeSet::new, |entry| read_pairs(&entry, &robot, found));
    let fingers = fingers.map_or_else(Vec::new, |entry| read_fingers(&entry, &robot, options.contact, &inspect, found));
    if let Some(entry) = srdf
        && let Some(loaded) = read_srdf(&entry, path, &robot, options, found)
    {
        allow.extend(loaded.srdf.disabled_pairs.iter().map(|pair| pair.links));
        inputs.push(loaded.input);
    }
    let held = held.map_or_else(BTreeMap::new, |entry| read_held(&entry, &robot, found));
    let spec = HandSpec { base, fingers, mount: None, allow, held, without_geometry };
    Some(Parts { robot, spec, inputs })
}

/// Refuses an entry of `collision_from_visuals` whose link has other geometry (`U213`), or no such link (`U205`).
fn refuse_unless_from_visuals(entry: &Entry, robot: &Robot, found: &mut Found) {
    let Some(link) = known_link(entry, robot, found).map(|link| &robot.links[link.0]) else { return };
    if !link.collision_from_visuals {
        let problem = match link.visual.is_empty() && link.collision.is_empty() {
            true => format!("link \"{}\" has no visual geometry", link.name),
            false => format!("link \"{}\" has collision geometry of its own", link.name),
        };
        let diagnostic = entry.error("U213", found, problem);
        found.diagnostics.push(
            diagnostic.expected("a link with <visual> elements and no <collision>").fix("take the link off the list"),
        );
    }
}

/// Positions of joints that belong to no finger.
fn read_held(entry: &Entry, robot: &Robot, found: &mut Found) -> BTreeMap<JointId, f64> {
    let mut held = BTreeMap::new();
    let table = entry.table(found);
    for (name, entry) in table.iter().flat_map(Table::all) {
        let Some(position) = entry.number(found) else { continue };
        let Some(id) = robot.joint_named(name) else {
            let names = robot.joints.iter().map(|joint| joint.name.as_str());
            let meant = did_you_mean(name, names);
            let diagnostic = entry.error("U205", found, format!("the robot has no joint \"{name}\""));
            let fix = meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"));
            found.diagnostics.push(diagnostic.expected("the name of a joint of the URDF").fix(fix));
            continue;
        };
        let joint = &robot.joints[id.0];
        if joint.coupling.is_some() || !joint.moves() {
            let problem = format!("joint \"{name}\" does not move by itself");
            found
                .diagnostics
                .push(entry.error("U213", found, problem).expected("a joint that moves and follows no other"));
            continue;
        }
        if let Some(limits) = joint.limits.filter(|limits| position < limits.lower || position > limits.upper) {
            let problem = format!("position {} is outside the limits of joint \"{name}\"", number(position));
            let expected = format!("{}..{}", number(limits.lower), number(limits.upper));
            found.diagnostics.push(entry.error("U212", found, problem).expected(expected));
            continue;
        }
        held.insert(id, position);
    }
    held
}

/// The file that `entry` names.
pub(super) fn locate(entry: &Entry, path: &Path, options: &LoadOptions, found: &mut Found) -> Option<PathBuf> {
    let name = entry.text(found)?;
    match options.resolve_own(name, path, found.place(&entry.span)) {
        Ok(resolved) => {
            found.notes.extend(resolved.notes);
            Some(resolved.path)
        }
        Err(diagnostic) => {
            found.diagnostics.push(diagnostic.element("key", &entry.name));
            None
        }
    }
}

/// The robot of the URDF that `entry` names; `from_visuals` is that of [`load_robot_with`].
pub(super) fn locate_and_load(
    entry: &Entry,
    path: &Path,
    options: &LoadOptions,
    from_visuals: &BTreeSet<String>,
    found: &mut Found,
) -> Option<(Robot, Vec<LoadedInput>)> {
    let urdf = locate(entry, path, options, found)?;
    match load_robot_with(&urdf, options, from_visuals) {
        Ok(mut loaded) => {
            if let (Some(first), Some(name)) = (loaded.inputs.first_mut(), entry.as_text()) {
                name.clone_into(&mut first.name);
            }
            found.notes.extend(loaded.notes);
            Some((loaded.robot, loaded.inputs))
        }
        Err(error) => {
            found.diagnostics.extend(error);
            None
        }
    }
}

pub(super) fn read_srdf(
    entry: &Entry,
    path: &Path,
    robot: &Robot,
    options: &LoadOptions,
    found: &mut Found,
) -> Option<LoadedSrdf> {
    let srdf = locate(entry, path, options, found)?;
    match load_srdf(&srdf, robot, options) {
        Ok(mut loaded) => {
            entry.as_text()?.clone_into(&mut loaded.input.name);
            found.notes.append(&mut loaded.notes);
            Some(loaded)
        }
        Err(error) => {
            found.diagnostics.extend(error);
            None
        }
    }
}

fn read_fingers(
    entry: &Entry,
    robot: &Robot,
    contact: ContactModel,
    inspect: &str,
    found: &mut Found,
) -> Vec<FingerSpec> {
    let items = entry.entries(found, "at least one [[fingers]] table").unwrap_or_default();
    if entry.is_empty_list() {
        let diagnostic = entry.error("U202", found, "is empty").expected("at least one [[fingers]] table");
        found.diagnostics.push(diagnostic.fix(inspect));
    }
    if items.len() > MAX_FINGERS {
        let problem = format!("has {} fingers", items.len());
        let diagnostic = entry.error("U221", found, problem).expected(format!("at most {MAX_FINGERS}"));
        found
            .diagnostics
            .push(diagnostic.fix("leave out [[fingers]] that are not needed; their links are held and become palm"));
        return Vec::new();
    }
    items.iter().filter_map(|item| read_finger(item.table(found)?, robot, contact, found)).collect()
}

fn read_finger(
    mut table: Table,
    robot: &Robot,
    default_contact: ContactModel,
    found: &mut Found,
) -> Option<FingerSpec> {
    let name = table.required(found, "name", "add name = \"thumb\"").and_then(|entry| entry.name(found));
    let tip_link = table
        .required_or(found, "tip_link", || fixes::add_tip_link(robot))
        .and_then(|entry| known_link(&entry, robot, found));
    let first_joint = table.optional("first_joint").map(|entry| known_joint(&entry, robot, found));
    let tip = table
        .required(found, "tip", "add tip = { shape = \"sphere\", radius = 0.012, center = [0, 0, 0] }")
        .and_then(|entry| read_tip(entry.table(found)?, found));
    let pad = table.optional("pad").map(|entry| read_pad(entry.table(found)?, found));
    let contact = contact_model::read(&mut table, "contact", default_contact, "U218", found);
    let rest = table.optional("rest").and_then(|entry| entry.table(found));
    let mut positions = Vec::new();
    for (joint, entry) in rest.iter().flat_map(Table::all) {
        let number = entry.number(found);
        positions.extend(number.map(|number| (joint.to_owned(), number, found.place(&entry.span))));
    }
    let place = found.place(&table.span);
    table.finish(found);
    let first_joint = match first_joint {
        Some(joint) => Some(joint?),
        None => None,
    };
    Some(FingerSpec {
        name: name?.to_owned(),
        tip_link: tip_link?,
        first_joint,
        tip: tip?,
        pad: match pad {
            Some(pad) => Some(pad?),
            None => None,
        },
        contact: contact?,
        rest: positions,
        place,
    })
}

fn read_tip(mut table: Table, found: &mut Found) -> Option<TipSpec> {
    let shape = table
        .required(found, "shape", "add shape = \"sphere\", \"ellipsoid\", \"point\" or \"mesh\"")?
        .choice(found, &["sphere", "ellipsoid", "point", "mesh"])?;
    let tip = match shape {
        "sphere" => {
            let center = point(&mut table, "center", found);
            let radius = table
                .required(found, "radius", "add radius = 0.012, in metres; shape = \"point\" for a sharp tip")
                .and_then(|entry| {
                    entry.number_that(found, "a length above 0, in metres, or shape = \"point\" for a sharp tip", |x| {
                        x > 0.0
                    })
                });
            radius.zip(center).map(|(radius, center)| TipSpec::Sphere { radius, center })
        }
        "ellipsoid" => {
            let center = point(&mut table, "center", found);
            let radii = table
                .required(found, "radii", "add radii = [0.009, 0.007, 0.007], the half axes in metres")
                .and_then(|entry| lengths(&entry, found));
            let turn = match table.optional("quat_xyzw") {
                Some(entry) => unit_quaternion(&entry, found),
                None => Some(UnitQuaternion::identity()),
            };
            radii.zip(center).zip(turn).map(|((radii, center), turn)| TipSpec::Ellipsoid {
                radii,
                center,
                link_from_ellipsoid: turn,
            })
        }
        "point" => point(&mut table, "position", found).map(|position| TipSpec::Point { position }),
        _ => {
            let elements = match table.optional("collision") {
                Some(entry) => indices(&entry, found),
                None => Some(Vec::new()),
            };
            point(&mut table, "center", found)
                .zip(elements)
                .map(|(center, elements)| TipSpec::Hull { center, elements })
        }
    };
    table.finish(found);
    tip
}

/// Indices of `<collision>` elements, at least one.
fn indices(entry: &Entry, found: &mut Found) -> Option<Vec<usize>> {
    const EXPECTED: &str = "indices of <collision> elements of the tip link, counted from 0";
    let entries = entry.entries(found, EXPECTED)?;
    if entries.is_empty() {
        let fix = "leave the key out: the tip is then made of all of them";
        found.diagnostics.push(entry.error("U213", found, "is empty").expected(EXPECTED).fix(fix));
        return None;
    }
    let is_index = |x: f64| x >= 0.0 && x.fract() == 0.0 && x < 1e4;
    entries.iter().map(|entry| Some(entry.number_that(found, EXPECTED, is_index)? as usize)).collect()
}

/// Half axes of an ellipsoid, none less than a fifth of another: flatter ones are plates, not fingertips.
fn lengths(entry: &Entry, found: &mut Found) -> Option<Vector> {
    let radii = Vector::from(entry.numbers::<3>(found)?);
    if radii.min() > 0.0 && radii.min() >= 0.2 * radii.max() {
        return Some(radii);
    }
    let expected = "three lengths above 0, in metres, none less than a fifth of another";
    let problem = format!("is [{}, {}, {}]", number(radii.x), number(radii.y), number(radii.z));
    found.diagnostics.push(entry.error("U213", found, problem).expected(expected));
    None
}

pub(super) fn unit_quaternion(entry: &Entry, found: &mut Found) -> Option<UnitQuaternion<f64>> {
    let [x, y, z, w] = entry.numbers::<4>(found)?;
    let quaternion = Quaternion::new(w, x, y, z);
    let length = x.hypot(y).hypot(z.hypot(w));
    if (length - 1.0).abs() <= 1e-6 {
        return Some(UnitQuaternion::from_quaternion(quaternion));
    }
    let problem = format!("has length {}", number(length));
    found.diagnostics.push(entry.error("U213", found, problem).expected("a unit quaternion, x y z w"));
    None
}

fn read_pad(mut table: Table, found: &mut Found) -> Option<PadSpec> {
    let axis = table
        .required(found, "axis", "add axis = [0.0, 0.0, 1.0], out of the pad, in the frame of the tip link")
        .and_then(|entry| {
            let axis = direction(&Vector::from(entry.numbers::<3>(found)?));
            if axis.is_none() {
                let problem = "is the zero vector, which is no direction";
                found.diagnostics.push(
                    entry
                        .error("U213", found, problem)
                        .expected("a direction out of the pad, in the frame of the tip link"),
                );
            }
            axis
        });
    let angle = table.required(found, "angle_deg", "add angle_deg = 60").and_then(|entry| {
        entry.number_that(found, "an angle above 0 and at most 180, in degrees", |x| x > 0.0 && x <= 180.0)
    });
    table.finish(found);
    axis.zip(angle).map(|(axis, angle)| PadSpec { axis, angle: angle.to_radians() })
}

/// The point in `key`, the origin of the tip link where it is missing; none where it is bad.
fn point(table: &mut Table, key: &'static str, found: &mut Found) -> Option<Point> {
    match table.optional(key) {
        Some(entry) => entry.numbers::<3>(found).map(Point::from),
        None => Some(Point::origin()),
    }
}

pub(super) fn read_pairs(entry: &Entry, robot: &Robot, found: &mut Found) -> BTreeSet<(LinkId, LinkId)> {
    let expected = "pairs of link names: [[\"link_a\", \"link_b\"], ...]";
    let mut pairs = BTreeSet::new();
    for pair in entry.entries(found, expected).unwrap_or_default() {
        let Some(names) = pair.entries(found, expected) else { continue };
        let [a, b] = names.as_slice() else {
            let diagnostic = pair.error("U203", found, format!("has {} values", names.len())).expected(expected);
            found.diagnostics.push(diagnostic);
            continue;
        };
        if let (Some(a), Some(b)) = (known_link(a, robot, found), known_link(b, robot, found)) {
            pairs.insert((a.min(b), a.max(b)));
        }
    }
    pairs
}
