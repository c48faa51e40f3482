//! Objects, supports and obstacles.

use super::files::Files;
use super::numbers::{list, shown};
use super::pose;
use super::shape::{self, MeshLine, Origin, ReadShape};
use super::units;
use crate::object::Object;
use crate::scene::{Obstacle, SceneHand};
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::mass::{Solid, solid_properties};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::surface::{DEFAULT_CREASE_ANGLE, MeshSurface};
use regrasp_geometry::{Point, Shape, Surface};
use std::collections::BTreeSet;

/// Contacts keep this distance from creases when the file says nothing, in metres (by measurement on a prototype).
const DEFAULT_EDGE_DISTANCE: f64 = 0.004;
/// Creases of a mesh that are shorter than this share of its middle extent are the texture of a scan, no edges of the object. By
/// measurement: those of 10 scans have at most a sixth, those of 5 models of boxes and bottles more than all of it.
const TEXTURE: f64 = 0.25;
/// Largest friction coefficient: plans hold no larger one.
const MAX_FRICTION: f64 = 1e3;
/// Largest mass, in kilograms: plans hold no contact forces that carry more.
const MAX_MASS: f64 = 1e6;
/// Friction coefficients above this are noted: no known pair of materials has them.
const UNLIKELY_FRICTION: f64 = 2.0;
/// Masses above this are noted, in kilograms.
const UNLIKELY_MASS: f64 = 20.0;

/// What an object has to fit: the hands of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hands {
    tips: Tips,
    /// Size of the largest, in metres; none where none could be read.
    size: Option<f64>,
}

impl Hands {
    /// What `hands` are.
    pub fn of<'a>(hands: impl IntoIterator<Item = &'a SceneHand> + Clone) -> Self {
        let size = hands.clone().into_iter().map(|hand| units::size_of(&hand.hand)).max_by(f64::total_cmp);
        Hands { tips: Tips::of(hands), size }
    }
}

/// The fingertips of all hands of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tips {
    /// All have a radius: each touches an edge with a normal of its own.
    Round,
    /// Some are points, or not known.
    Sharp,
}

impl Tips {
    /// Those of `hands`.
    fn of<'a>(hands: impl IntoIterator<Item = &'a SceneHand>) -> Self {
        let mut fingers = hands.into_iter().flat_map(|hand| &hand.hand.fingers).peekable();
        match fingers.peek().is_some() && fingers.all(|finger| finger.tip.radius() > 0.0) {
            true => Tips::Round,
            false => Tips::Sharp,
        }
    }
}

/// Reads an object from its table; `hands` are those that may hold it.
pub(super) fn object(mut table: Table, hands: Hands, files: &mut Files, found: &mut Found) -> Option<Object> {
    let span = table.span.clone();
    let element = table.name.clone();
    let name = table.optional("name").and_then(|entry| entry.name(found)).unwrap_or("object").to_owned();
    let read = shape::shape(&mut table, files, found);
    let friction = table.required(found, "friction", "add friction = 0.8").and_then(|entry| friction(&entry, found));
    let edge_entry = table.optional("edge_distance");
    let edge_distance = match &edge_entry {
        Some(entry) => entry.number_that(found, "a length of 0 or more, in metres", |x| x >= 0.0),
        None => Some(DEFAULT_EDGE_DISTANCE),
    };
    let crease_angle = match table.optional("crease_angle_deg") {
        Some(entry) => {
            entry.number_that(found, "degrees between 1 and 180", |x| (1.0..=180.0).contains(&x)).map(f64::to_radians)
        }
        None => Some(DEFAULT_CREASE_ANGLE),
    };
    let given_mass = mass(&mut table, found);
    let center = table.optional("center_of_mass");
    let given_center = center.as_ref().map(|entry| entry.numbers::<3>(found).map(Point::from));
    let read = read.filter(|read| match (&read.line, hands.size) {
        (Some(line), Some(size)) => fits(&read.shape, line, size, &table, found),
        _ => true,
    });
    let placed = read.and_then(|read| placed(read, given_mass.as_ref(), &given_center, &table, found));
    let no_room = placed.as_ref().zip(edge_distance).and_then(|(placed, distance)| no_room(&placed.shape, distance));
    if let Some(room) = no_room {
        let (distance, expected) = (number(edge_distance?), format!("an edge_distance below {room} m"));
        let problem = format!("edge_distance {distance} m leaves no place for a contact");
        let diagnostic = match &edge_entry {
            Some(entry) => entry.error("S107", found, problem),
            None => table.error("S107", found, problem),
        };
        found.diagnostics.push(diagnostic.expected(expected));
    }
    table.finish(found);

    let Placed { shape, hull, mass, center_of_mass } = placed?;
    let (edge_distance, crease_angle) = (edge_distance?, crease_angle?);
    if let Some(center) = &center {
        center_is_inside(&shape, &center_of_mass, center, found)?;
    }
    // Both take long for meshes of a million triangles.
    if !files.is_in_time(found) {
        return None;
    }
    let ready = files.stock.ready(shape, crease_angle, |shape| {
        std::thread::scope(|scope| {
            let mesh_body = scope.spawn(|| MeshBody::of(shape));
            let surface = Surface::with_crease_angle(shape, crease_angle);
            let mesh_body = mesh_body.join().expect("preparing a mesh does not panic");
            surface.map(|surface| (surface, mesh_body))
        })
    });
    let (shape, surface, mesh_body) = match ready {
        Ok(ready) => ready,
        Err(error) => {
            let diagnostic =
                regrasp_base::Diagnostic::new("M207", found.place(&span), error.to_string()).element("table", &element);
            found.diagnostics.push(diagnostic);
            return None;
        }
    };
    let radius = shape.reach_from(&center_of_mass);
    let grain = surface.mesh().and_then(MeshSurface::crease_grain);
    let (low, high) = shape.bounds();
    let edge_distance = match (edge_entry, hands.tips, grain) {
        (None, Tips::Round, Some(grain)) if grain < TEXTURE * shape::middle_of(high - low) => {
            let millimetres = 1e3 * grain;
            let problem = format!(
                "contacts may lie on edges (edge_distance = 0): its creases are {millimetres:.1} mm long, as those of \
                 scans are; edge_distance = {edge_distance} keeps contacts off edges"
            );
            found.note(&span, problem);
            0.0
        }
        _ => edge_distance,
    };
    Some(Object {
        name,
        shape,
        hull,
        radius,
        mesh_body,
        surface,
        mass,
        center_of_mass,
        friction: friction?,
        edge_distance,
        crease_angle,
    })
}

/// A mesh whose least extent is more than this times the size of the hand cannot be held.
const TOO_LARGE: f64 = 1.5;
/// A mesh whose largest extent is less than this times the size of the hand cannot be held either.
const TOO_SMALL: f64 = 0.05;
/// A mesh whose least extent is more than this times the size of the hand is noted.
const LARGE: f64 = 0.5;
/// A mesh whose largest extent is less than this times the size of the hand is noted.
const SMALL: f64 = 0.1;
/// A hand larger than this, in metres, has a mesh in another unit.
const LARGEST_HAND: f64 = 3.0;
/// Share of the hand's size that the middle extent of an object usually has.
const USUAL: f64 = 0.25;

/// Reports a mesh that is too large for a hand of this size (`M201`), and notes one that is hardly of its size: with the unit that it
/// is probably in.
fn fits(shape: &Shape, line: &MeshLine, hand: f64, table: &Table, found: &mut Found) -> bool {
    let (low, high) = shape.bounds();
    let size = high - low;
    let (is_large, is_small) = (size.min() > LARGE * hand, size.max() < SMALL * hand);
    if !is_large && !is_small {
        return true;
    }
    let (unit, factor) = shape::likely_unit(shape::middle_of(size), USUAL * hand);
    let problem = format!(
        "the mesh is {:.4} x {:.4} x {:.4} m, and the hand {hand:.3} m from end to end",
        size.x, size.y, size.z
    );
    let fix = match hand > LARGEST_HAND {
        true => "no hand is so large: a mesh of its URDF is probably in millimetres (scale=\"0.001 0.001 0.001\"); `regrasp inspect` on the URDF \
                 names the link"
            .to_owned(),
        false => format!("it is probably in {unit}: {}", line.scaled(factor)),
    };
    if size.min() > TOO_LARGE * hand || size.max() < TOO_SMALL * hand {
        let expected = format!(
            "a smallest extent of at most {:.3} m and a largest of at least {:.3} m, which fingers can reach around",
            TOO_LARGE * hand,
            TOO_SMALL * hand
        );
        found.diagnostics.push(table.error("M201", found, problem).expected(expected).fix(fix));
        return false;
    }
    found.note(&table.span, format!("{problem}; if it is not meant to be, {fix}"));
    true
}

fn friction(entry: &Entry, found: &mut Found) -> Option<f64> {
    let friction =
        entry.number_that(found, "a friction coefficient from 0 to 1000", |x| (0.0..=MAX_FRICTION).contains(&x))?;
    if friction == 0.0 {
        found.note(&entry.span, "friction 0: fingertips can only push along the normal");
    } else if friction > UNLIKELY_FRICTION {
        found.note(&entry.span, format!("friction {} is more than any known pair of materials has", number(friction)));
    }
    Some(friction)
}

/// The distance below which contacts of a primitive with edges have a place, when `edge_distance` is not below it.
fn no_room(shape: &Shape, edge_distance: f64) -> Option<f64> {
    let room = match shape {
        // Of all points the middle of the largest face is farthest from the edges, by half its shorter side.
        Shape::Cuboid { half_extents } => half_extents.sum() - half_extents.max() - half_extents.min(),
        Shape::Cylinder { half_length, radius } => half_length.max(*radius),
        _ => return None,
    };
    (edge_distance >= room).then_some(room)
}

/// What the file says about the mass.
enum GivenMass {
    /// Kilograms.
    Mass(f64),
    /// Kilograms per cubic metre.
    Density(f64),
}

fn mass(table: &mut Table, found: &mut Found) -> Option<GivenMass> {
    let entries = table.present(&["mass", "density"]);
    match entries.as_slice() {
        [entry] if entry.name.ends_with("density") => entry
            .number_that(found, "a density above 0, in kg/m^3 (water has 1000)", |x| x > 0.0)
            .map(GivenMass::Density),
        [entry] => {
            let mass = entry
                .number_that(found, "a mass from 0 to 1000000, in kilograms", |x| (0.0..=MAX_MASS).contains(&x))?;
            if mass == 0.0 {
                found.note(&entry.span, "mass 0: the object has no weight");
            } else if mass > UNLIKELY_MASS {
                found
                    .note(&entry.span, format!("mass {} kg is much for a hand; masses are in kilograms", number(mass)));
            }
            Some(GivenMass::Mass(mass))
        }
        [] => {
            let diagnostic = table
                .error("S102", found, "has neither mass nor density")
                .fix("add mass = 0.1, in kilograms, or density = 1000, in kg/m^3");
            found.diagnostics.push(diagnostic);
            None
        }
        [_, second, ..] => {
            let diagnostic = second.error("S106", found, "cannot stand beside object.mass").fix("keep one of them");
            found.diagnostics.push(diagnostic);
            None
        }
    }
}

/// The object in its own frame.
struct Placed {
    shape: Shape,
    hull: Option<Shape>,
    mass: f64,
    center_of_mass: Point,
}

/// Shape in the object frame, mass and centre of mass, where the volume is asked for only if something needs it: that of the
/// hull where it stands for the inside.
///
/// Errors: the shape has no volume and something needs it (`M210`).
fn placed(
    read: ReadShape,
    mass: Option<&GivenMass>,
    given_center: &Option<Option<Point>>,
    table: &Table,
    found: &mut Found,
) -> Option<Placed> {
    let needs_solid =
        read.origin == Origin::Center || given_center.is_none() || matches!(mass, Some(GivenMass::Density(_)));
    let solid: Option<Solid> = if needs_solid {
        match solid_properties(read.hull.as_ref().unwrap_or(&read.shape)) {
            Ok(solid) => {
                if solid.closed_share > 0.0 {
                    let percent = 100.0 * solid.closed_share;
                    found.note(
                        &table.span,
                        format!(
                            "the mesh has holes of {percent:.2} % of its area, which count as closed for its volume"
                        ),
                    );
                }
                Some(solid)
            }
            Err(error) => {
                let diagnostic = table
                    .error("M210", found, format!("has no volume: {error}"))
                    .expected("a closed mesh, where center_of_mass, density or origin = \"center\" ask for its volume")
                    .fix("mesh = { ..., solid = \"hull\" }, or give mass and center_of_mass");
                found.diagnostics.push(diagnostic);
                return None;
            }
        }
    } else {
        None
    };
    let shift = match read.origin {
        Origin::File => nalgebra::zero(),
        Origin::Center => -solid.as_ref()?.center_of_mass.coords,
        Origin::Point(point) => -point,
    };
    let shifted = |shape| shape::shifted(shape, shift);
    let (shape, hull) = match (shifted(&read.shape), read.hull.as_ref().map(shifted).transpose()) {
        (Ok(shape), Ok(hull)) => (shape, hull),
        (Err(reason), _) | (_, Err(reason)) => {
            let diagnostic = table.error("M205", found, format!("cannot be moved to its origin: {reason}"));
            found.diagnostics.push(diagnostic);
            return None;
        }
    };
    let center = match given_center {
        Some(center) => (*center)?,
        None => solid.as_ref()?.center_of_mass + shift,
    };
    let mass = match mass? {
        GivenMass::Mass(mass) => *mass,
        GivenMass::Density(density) => {
            let mass = density * solid.as_ref()?.volume;
            if mass > MAX_MASS {
                let problem = format!("with density {} it weighs {} kg", number(*density), number(mass));
                let diagnostic = table.error("S107", found, problem);
                found
                    .diagnostics
                    .push(diagnostic.expected("at most 1000000 kg; densities are in kg/m^3 (water has 1000)"));
                return None;
            }
            mass
        }
    };
    Some(Placed { shape, hull, mass, center_of_mass: center })
}

/// Reports a given centre of mass outside the object's bounds (`S107`): a mistake of frame or unit.
fn center_is_inside(shape: &Shape, center: &Point, entry: &Entry, found: &mut Found) -> Option<()> {
    let (low, high) = shape.bounds();
    if (0..3).all(|k| center[k] >= low[k] && center[k] <= high[k]) {
        return Some(());
    }
    let corner = |point: Point| point.coords.iter().map(|x| shown(*x, 4)).collect::<Vec<_>>().join(", ");
    let diagnostic = entry
        .error("S107", found, format!("is {}, outside the object", list(center.coords)))
        .expected(format!("a point of the object frame between [{}] and [{}]", corner(low), corner(high)));
    found.diagnostics.push(diagnostic);
    None
}

/// Reads the bodies that stand fixed in the world: `[[obstacles]]` or `[[supports]]`.
///
/// Errors: a name that another body of the scene has (`S112`).
pub(super) fn fixed_bodies(
    root: &mut Table,
    key: &'static str,
    names: &mut Names,
    files: &mut Files,
    found: &mut Found,
) -> Vec<Obstacle> {
    let entries = root.optional(key).and_then(|entry| entry.entries(found, &format!("tables [[{key}]]")));
    let mut bodies: Vec<Obstacle> = Vec::new();
    for entry in entries.unwrap_or_default() {
        let Some(body) = fixed_body(&entry, files, found) else { continue };
        names.add(&body.name, &entry, found);
        bodies.push(body);
    }
    bodies
}

/// Names that all differ: those of the bodies of a scene, or those of its tasks.
pub(super) struct Names {
    what: &'static str,
    known: BTreeSet<String>,
}

impl Names {
    /// No names so far; `what` has them.
    pub fn of(what: &'static str) -> Self {
        Names { what, known: BTreeSet::new() }
    }

    /// Adds the name of `entry`. Errors: another one has it (`S112`).
    pub fn add(&mut self, name: &str, entry: &Entry, found: &mut Found) {
        if !self.known.insert(name.to_owned()) {
            let diagnostic = entry
                .error("S112", found, format!("has the name \"{name}\", as another {}", self.what))
                .expected("names that differ");
            found.diagnostics.push(diagnostic);
        }
    }
}

fn fixed_body(entry: &Entry, files: &mut Files, found: &mut Found) -> Option<Obstacle> {
    let mut table = entry.table(found)?;
    let name = table.required(found, "name", "add name = \"table\"").and_then(|entry| entry.name(found));
    let read = shape::shape(&mut table, files, found);
    let pose = pose::pose(&mut table, found);
    table.finish(found);
    let (name, read, pose) = (name?, read?, pose?);
    if read.origin != Origin::File {
        let diagnostic =
            entry.error("S107", found, "has a mesh with an origin").fix("place the obstacle by its position instead");
        found.diagnostics.push(diagnostic);
        return None;
    }
    if !files.is_in_time(found) {
        return None;
    }
    // Nothing touches an obstacle on purpose: its hull is all there is of it.
    let shape = read.hull.unwrap_or(read.shape);
    let mesh_body = MeshBody::of(&shape);
    let placed = PlacedShape { parent_from_shape: pose, shape };
    Some(Obstacle { name: name.to_owned(), placed, mesh_body })
}
