//! The answers of the general routine, substituted and compared.

use crate::sample::{FRAME, columns, grasp_map, grips, least_support, models, soft, support};
use nalgebra::{DVector, Rotation3};
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector};
use regrasp_grasp::closure::{general, prove, three};
use regrasp_grasp::{Closure, Contact, ContactModel, GraspFrame, Grip, Separation, Verdict, closure_margin};

/// The margin that the forces of `closure` prove, from a singular value decomposition of the grasp map.
fn substituted(grips: &[Grip], frame: &GraspFrame, closure: &Closure) -> f64 {
    let chosen: Vec<Grip> = closure.contacts.iter().map(|&i| grips[i]).collect();
    let (map, starts) = grasp_map(&chosen, frame);
    let inverse = map.clone().pseudo_inverse(1e-9).unwrap();
    let mut forces = DVector::zeros(map.ncols());
    for (i, (grip, force)) in chosen.iter().zip(&closure.forces).enumerate() {
        for (j, column) in columns(grip, frame).iter().enumerate() {
            // Columns of a contact are orthonormal in force and moment over the torsion radius.
            forces[starts[i] + j] = match j {
                3 => force.torsion / grip.torsion_radius(),
                _ => column[..3].iter().zip(force.force.iter()).map(|(a, b)| a * b).sum(),
            };
        }
    }
    let total: f64 = (0..chosen.len()).map(|i| forces[starts[i]]).sum();
    forces /= total;
    let norm = |i: usize| inverse.rows(starts[i], starts[i + 1] - starts[i]).norm();
    let mu = frame.friction;
    let depth = |i: usize| {
        let own = forces.rows(starts[i], starts[i + 1] - starts[i]);
        match own.len() {
            1 => own[0],
            n => (mu * own[0] - own.rows(1, n - 1).norm()) / (1.0 + mu * mu).sqrt(),
        }
    };
    let t = (0..chosen.len()).map(|i| depth(i) / norm(i)).fold(f64::INFINITY, f64::min) - (&map * &forces).norm();
    t / (1.0 + t * (0..chosen.len()).map(norm).sum::<f64>())
}

fn check_separation(grips: &[Grip], frame: &GraspFrame, separation: &Separation) {
    let direction = DVector::from_column_slice(&separation.direction);
    assert!((direction.norm() - 1.0).abs() < 1e-12);
    let expected = support(grips, frame, &direction);
    assert!((separation.support.max(0.0) - expected).abs() < 1e-12, "{} {expected}", separation.support);
}

#[test]
fn both_answers_are_proved_by_substitution() {
    let mut rng = Rng::keyed(1, "closure", 0);
    let (mut n_closed, mut n_open, mut largest_support) = (0, 0, 0.0f64);
    for trial in 0..600 {
        let models = models(2 + trial % 6, &mut rng);
        let grips = grips(&models, &mut rng);
        match general::prove(&grips, &FRAME, f64::INFINITY) {
            Verdict::Closed(closure) => {
                n_closed += 1;
                let expected = substituted(&grips, &FRAME, &closure);
                assert!((closure.margin - expected).abs() < 1e-9, "trial {trial}: {} {expected}", closure.margin);
                let radius = least_support(&grips, &FRAME, &mut rng);
                assert!(closure.margin <= radius + 1e-12, "trial {trial}: {} {radius}", closure.margin);
            }
            Verdict::NotProved(separation) => {
                n_open += 1;
                check_separation(&grips, &FRAME, &separation);
            }
        }
        if let Verdict::NotProved(separation) = general::prove(&grips, &FRAME, 0.0) {
            check_separation(&grips, &FRAME, &separation);
            largest_support = largest_support.max(separation.support);
        }
    }
    assert!(n_closed > 100 && n_open > 100, "{n_closed} {n_open}");
    // Whatever was not proved to be closed was proved to be open, or nearly so.
    assert!(largest_support < 1e-7, "undecided with radius up to {largest_support}");
}

#[test]
fn hard_triples_agree_with_the_closed_form() {
    let mut rng = Rng::keyed(2, "closure", 0);
    let (mut n_closed, mut n_open, mut least_ratio) = (0, 0, f64::INFINITY);
    for trial in 0..4000 {
        let triple: [Grip; 3] = grips(&[ContactModel::Point; 3], &mut rng).try_into().unwrap();
        let closed_form = three::prove(&triple.map(|grip| grip.contact), &FRAME);
        match (general::prove(&triple, &FRAME, f64::INFINITY), closed_form) {
            (Verdict::Closed(closure), Some((margin, _))) => {
                n_closed += 1;
                least_ratio = least_ratio.min(closure.margin / margin);
            }
            (Verdict::NotProved(_), None) => n_open += 1,
            (Verdict::Closed(closure), None) => {
                assert!(closure.margin < 1e-4, "trial {trial}: the closed form misses {}", closure.margin);
            }
            (Verdict::NotProved(separation), Some((margin, _))) => {
                panic!("trial {trial}: margin {margin}, but support {}", separation.support);
            }
        }
    }
    assert!(n_closed > 200 && n_open > 200, "{n_closed} {n_open}");
    assert!(least_ratio > 0.95, "{least_ratio}");
}

#[test]
fn a_margin_asked_for_is_given_or_bounded_away() {
    let mut rng = Rng::keyed(3, "closure", 0);
    let mut n_given = 0;
    for trial in 0..600 {
        let grips = grips(&models(2 + trial % 5, &mut rng), &mut rng);
        let most = general::prove(&grips, &FRAME, f64::INFINITY).margin();
        for enough in [0.3 * most, 0.9 * most, 1.1 * most, 0.01] {
            let found = general::prove(&grips, &FRAME, enough).margin();
            assert!(found <= 1.05 * most, "trial {trial}: {found} of {most}");
            if enough < most {
                assert!(found >= enough, "trial {trial}: {found}, {enough} asked for, {most} possible");
                n_given += 1;
            }
        }
    }
    assert!(n_given > 200, "{n_given}");
}

#[test]
fn closure_grows_with_contacts_friction_and_torsion() {
    let mut rng = Rng::keyed(4, "closure", 0);
    let is_closed = |grips: &[Grip], frame: &GraspFrame| matches!(prove(grips, frame, 0.0), Verdict::Closed(_));
    let mut n_closed = 0;
    for _ in 0..800 {
        let grips = grips(&[soft(0.004), ContactModel::Point, soft(0.006)], &mut rng);
        let larger = |grip: &Grip, factor: f64| Grip {
            model: match grip.model {
                ContactModel::SoftFinger { torsion_radius } => soft(torsion_radius * factor),
                other => other,
            },
            ..*grip
        };
        if !is_closed(&grips, &FRAME) {
            continue;
        }
        n_closed += 1;
        let softer: Vec<Grip> = grips.iter().map(|grip| larger(grip, 3.0)).collect();
        assert!(is_closed(&softer, &FRAME));
        assert!(is_closed(&grips, &GraspFrame { friction: 0.7, ..FRAME }));
        let mut more = grips.clone();
        more.extend(crate::sample::grips(&[ContactModel::Frictionless], &mut rng));
        assert!(is_closed(&more, &FRAME));
    }
    assert!(n_closed > 30, "{n_closed}");
}

#[test]
fn the_margin_does_not_depend_on_the_frame_or_the_unit_of_length() {
    let mut rng = Rng::keyed(5, "closure", 0);
    let mut compared = 0;
    for trial in 0..300 {
        let grips = grips(&models(2 + trial % 5, &mut rng), &mut rng);
        let rotation = Rotation3::new(regrasp_geometry::Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
        let moved: Vec<Grip> = grips
            .iter()
            .map(|grip| Grip {
                contact: Contact {
                    point_in_object: Point::from(rotation * grip.contact.point_in_object.coords * 10.0),
                    normal_in_object: UnitVector::new_normalize(rotation * grip.contact.normal_in_object.into_inner()),
                },
                model: match grip.model {
                    ContactModel::SoftFinger { torsion_radius } => soft(10.0 * torsion_radius),
                    other => other,
                },
            })
            .collect();
        let frame = GraspFrame {
            center_of_mass: Point::from(rotation * FRAME.center_of_mass.coords * 10.0),
            torque_scale: 0.3,
            ..FRAME
        };
        let (before, after) =
            (closure_margin(&grips, &FRAME, f64::INFINITY), closure_margin(&moved, &frame, f64::INFINITY));
        assert!((before - after).abs() < 1e-7, "{before} {after}");
        compared += usize::from(before > 0.0);
    }
    assert!(compared > 50, "{compared}");
}
