//! Which geoms of the model may touch, and with what friction.

use super::GeomNames;
use crate::mjcf::xml::{Xml, numbers};
use regrasp_robot::{ContactModel, Finger};
use regrasp_scene::{FingerShapeId, HandView, collision_pairs};

/// Torsional friction of a fingertip that counts as a point, in metres (physics notes, section 1): none touches at a point.
const POINT_TORSION: f64 = 0.002;
/// MuJoCo's own coefficients of rolling friction; without effect where `condim` is below 6.
const ROLLING: f64 = 0.0001;

/// Writes the pairs: fingertips with the object as the plan means them, then what should never touch.
pub(super) fn write(xml: &mut Xml, view: &HandView, names: &GeomNames) {
    let pairs = collision_pairs(view);
    let friction = view.object.friction;
    xml.open("contact", &[]);
    for (index, finger) in view.hand.fingers.iter().enumerate() {
        let (condim, coefficients) = friction_of(finger, friction);
        for (tip, part) in names.touching[index].iter().flat_map(|tip| names.object.iter().map(move |part| (tip, part)))
        {
            xml.leaf(
                "pair",
                &[
                    ("geom1", tip.clone()),
                    ("geom2", part.clone()),
                    ("condim", condim.to_string()),
                    ("friction", numbers(coefficients)),
                ],
            );
        }
    }
    let unplanned = |xml: &mut Xml, a: &str, b: &str| {
        let coefficients = [friction, friction, POINT_TORSION, ROLLING, ROLLING];
        let attributes = [("class", "unplanned".to_owned()), ("geom1", a.to_owned()), ("geom2", b.to_owned())];
        let friction = [("friction", numbers(coefficients))];
        xml.leaf("pair", &[&attributes[..], &friction[..]].concat());
    };
    let of_finger = |id: FingerShapeId| names.fingers[id.finger.0][id.shape].as_str();
    for &id in &pairs.link_object {
        names.object.iter().for_each(|part| unplanned(xml, of_finger(id), part));
    }
    for &(a, b) in pairs.finger_finger.iter().chain(&pairs.within_finger) {
        unplanned(xml, of_finger(a), of_finger(b));
    }
    for &(id, palm) in &pairs.finger_palm {
        unplanned(xml, of_finger(id), &names.palm[palm]);
    }
    for &(id, obstacle) in &pairs.finger_obstacle {
        unplanned(xml, of_finger(id), &names.obstacles[obstacle]);
    }
    for &palm in &pairs.palm_object {
        names.object.iter().for_each(|part| unplanned(xml, &names.palm[palm], part));
    }
    for &obstacle in &pairs.object_obstacle {
        names.object.iter().for_each(|part| unplanned(xml, &names.obstacles[obstacle], part));
    }
    xml.close();
}

/// `condim` and MuJoCo's five friction coefficients of a fingertip on the object.
fn friction_of(finger: &Finger, friction: f64) -> (u8, [f64; 5]) {
    let with_torsion = |torsion: f64| [friction, friction, torsion, ROLLING, ROLLING];
    match finger.tip.contact {
        ContactModel::Frictionless => (1, with_torsion(POINT_TORSION)),
        _ if friction <= 0.0 => (1, [1.0, 1.0, POINT_TORSION, ROLLING, ROLLING]),
        ContactModel::Point => (4, with_torsion(POINT_TORSION)),
        ContactModel::SoftFinger { torsion_radius } => (4, with_torsion(friction * torsion_radius)),
    }
}
