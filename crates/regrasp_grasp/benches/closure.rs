//! Times of force closure, best of several rounds, in nanoseconds per call.
#![allow(clippy::print_stdout)]

use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::closure::{general, three};
use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip, Verdict};
use std::hint::black_box;
use std::time::Instant;

const SOFT: ContactModel = ContactModel::SoftFinger { torsion_radius: 0.005 };
const FRAME: GraspFrame =
    GraspFrame { center_of_mass: Point::new(0.001, -0.002, 0.003), torque_scale: 0.03, friction: 0.8 };

/// Contacts on a sphere, about `spread` away from being evenly opposed.
fn grips(n: usize, models: &[ContactModel], spread: f64, rng: &mut Rng) -> Vec<Grip> {
    let pole = Vector::from(rng.direction());
    let side = pole.cross(&Vector::from(rng.direction())).normalize();
    (0..n)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            let about = pole * angle.cos() + side * angle.sin();
            let normal = UnitVector::new_normalize(about + Vector::from(rng.direction()) * spread);
            let contact =
                Contact { point_in_object: Point::from(normal.into_inner() * 0.03), normal_in_object: normal };
            Grip { contact, model: models[i % models.len()] }
        })
        .collect()
}

fn report(name: &str, sets: &[Vec<Grip>], enough: f64) {
    let is_closed = |grips: &Vec<Grip>| matches!(general::prove(grips, &FRAME, enough), Verdict::Closed(_));
    for wanted in [true, false] {
        let chosen: Vec<&Vec<Grip>> = sets.iter().filter(|set| is_closed(set) == wanted).collect();
        if chosen.is_empty() {
            continue;
        }
        let time = best_of(|| {
            for set in &chosen {
                black_box(general::prove(black_box(set), &FRAME, enough));
            }
        });
        let word = if wanted { "closed" } else { "open" };
        println!("{name:<44} {word:<6} {:>7.0} ns  ({} sets)", time / chosen.len() as f64, chosen.len());
    }
}

fn best_of(mut round: impl FnMut()) -> f64 {
    (0..15)
        .map(|_| {
            let start = Instant::now();
            round();
            start.elapsed().as_nanos() as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() {
    let mut rng = Rng::keyed(1, "closure bench", 0);
    for enough in [0.0, 0.005, f64::INFINITY] {
        println!("margin asked for: {enough}");
        let pairs: Vec<_> = (0..500).map(|_| grips(2, &[SOFT], 0.8, &mut rng)).collect();
        report("two soft fingers, opposed", &pairs, enough);
        let pairs: Vec<_> = (0..500).map(|_| grips(2, &[SOFT], 3.0, &mut rng)).collect();
        report("two soft fingers, anywhere", &pairs, enough);
        for n in 3..=6 {
            let hard: Vec<_> = (0..500).map(|_| grips(n, &[ContactModel::Point], 1.0, &mut rng)).collect();
            report(&format!("{n} points"), &hard, enough);
            let mixed: Vec<_> = (0..500)
                .map(|_| grips(n, &[SOFT, ContactModel::Point, ContactModel::Frictionless], 1.0, &mut rng))
                .collect();
            report(&format!("{n} mixed"), &mixed, enough);
            let soft: Vec<_> = (0..500).map(|_| grips(n, &[SOFT], 1.0, &mut rng)).collect();
            report(&format!("{n} soft fingers"), &soft, enough);
        }
    }
    let triples: Vec<_> = (0..500).map(|_| grips(3, &[ContactModel::Point], 1.0, &mut rng)).collect();
    let time = best_of(|| {
        for set in &triples {
            let contacts: [Contact; 3] = std::array::from_fn(|i| set[i].contact);
            black_box(three::prove(black_box(&contacts), &FRAME));
        }
    });
    println!("{:<44} {:>14.0} ns", "three points, closed form", time / 500.0);
}
