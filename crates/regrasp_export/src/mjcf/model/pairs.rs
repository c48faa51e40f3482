//! Which geoms of the model may touch, and with what friction.
//!
//! One rule. The hand and the object of the plan may touch what the checker keeps them apart from
//! (`regrasp_scene::collision_pairs`): themselves, each other and everything around them. An object that stands on a support may
//! touch everything. What is held in place, by a weld or by servos, does not collide with what else is held in place.

use super::MjcfModel;
use crate::mjcf::object::Hold;
use crate::mjcf::tip::{POINT_TORSION, ROLLING, friction_of};
use crate::mjcf::xml::{Xml, numbers};
use regrasp_scene::{FingerShapeId, HandView, collision_pairs};
use std::collections::BTreeSet;

/// Writes pairs, each once.
struct Pairs<'x> {
    xml: &'x mut Xml,
    written: BTreeSet<[String; 2]>,
}

impl Pairs<'_> {
    /// True the first time that the two are named, in any order.
    fn is_new(&mut self, a: &str, b: &str) -> bool {
        self.written.insert([a.min(b).to_owned(), a.max(b).to_owned()])
    }

    fn planned(&mut self, tip: &str, object: &str, (condim, coefficients): (u8, [f64; 5])) {
        if self.is_new(tip, object) {
            let what = [("geom1", tip.to_owned()), ("geom2", object.to_owned()), ("condim", condim.to_string())];
            self.xml.leaf("pair", &[&what[..], &[("friction", numbers(coefficients))]].concat());
        }
    }

    fn unplanned(&mut self, a: &str, b: &str, friction: f64) {
        if self.is_new(a, b) {
            let coefficients = [friction, friction, POINT_TORSION, ROLLING, ROLLING];
            let what = [("class", "unplanned".to_owned()), ("geom1", a.to_owned()), ("geom2", b.to_owned())];
            self.xml.leaf("pair", &[&what[..], &[("friction", numbers(coefficients))]].concat());
        }
    }
}

/// Writes the pairs: fingertips with the object as the plan means them, then what should never touch, then what stands on
/// supports.
pub(super) fn write(xml: &mut Xml, model: &MjcfModel) {
    xml.open("contact", &[]);
    let mut pairs = Pairs { xml, written: BTreeSet::new() };
    add_moved(&mut pairs, model);
    for object in model.objects.iter().filter(|object| object.hold == Hold::Support) {
        let own = &object.names.geoms;
        let names = &model.names;
        let fixed = names.supports.iter().chain(&names.obstacles).chain(&names.links).map(String::as_str);
        let hands = model.names.hands.iter().flat_map(|hand| hand.geoms());
        let objects = model.names.objects.iter().flat_map(|other| &other.geoms).map(String::as_str);
        for other in fixed.chain(hands).chain(objects).filter(|other| !own.iter().any(|part| part == other)) {
            own.iter().for_each(|part| pairs.unplanned(part, other, object.object.friction));
        }
    }
    xml.close();
}

/// The pairs of the hand and the object that the plan moves.
fn add_moved(pairs: &mut Pairs, model: &MjcfModel) {
    let view = HandView::of(model.task);
    let found = collision_pairs(&view);
    let (hand, object) = (&model.names.hands[view.hand_index], &model.names.objects[view.object_index].geoms);
    let around = model.names.around(model.task);
    let friction = view.object.friction;
    for (finger, tips) in view.hand.fingers.iter().zip(&hand.touching) {
        for tip in tips {
            object.iter().for_each(|part| pairs.planned(tip, part, friction_of(finger, friction)));
        }
    }
    let of_finger = |id: FingerShapeId| hand.fingers[id.finger.0][id.shape].as_str();
    for &id in &found.link_object {
        object.iter().for_each(|part| pairs.unplanned(of_finger(id), part, friction));
    }
    for &(a, b) in found.finger_finger.iter().chain(&found.within_finger) {
        pairs.unplanned(of_finger(a), of_finger(b), friction);
    }
    for &(id, palm) in &found.finger_palm {
        pairs.unplanned(of_finger(id), &hand.palm[palm], friction);
    }
    for &(id, obstacle) in &found.finger_obstacle {
        around[obstacle].iter().for_each(|geom| pairs.unplanned(of_finger(id), geom, friction));
    }
    for &palm in &found.palm_object {
        object.iter().for_each(|part| pairs.unplanned(&hand.palm[palm], part, friction));
    }
    for &obstacle in &found.object_obstacle {
        for geom in around[obstacle] {
            object.iter().for_each(|part| pairs.unplanned(geom, part, friction));
        }
    }
}
