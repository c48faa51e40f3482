use super::*;
use regrasp_base::Rng;
use regrasp_geometry::UnitVector;
use regrasp_grasp::{Contact, GraspFrame, closure, closure_margin};

fn soft(torsion_radius: f64) -> ContactModel {
    ContactModel::SoftFinger { torsion_radius }
}

fn sphere_contact(direction: [f64; 3], radius: f64) -> Grip {
    let normal = UnitVector::new_normalize(Vector::from(direction));
    let contact = Contact { point_in_object: Point::from(normal.into_inner() * radius), normal_in_object: normal };
    Grip { contact, model: ContactModel::Point }
}

fn body(friction: f64) -> HeldBody {
    HeldBody { center_of_mass: Point::origin(), torque_scale: 0.03, friction }
}

fn random_contacts(n_contacts: usize, rng: &mut Rng) -> Vec<Grip> {
    (0..n_contacts).map(|_| sphere_contact(rng.direction(), 0.03)).collect()
}

/// Contacts of all three models, with normals that are not a sphere's.
fn random_mixed(n_contacts: usize, rng: &mut Rng) -> Vec<Grip> {
    let mut grips = random_contacts(n_contacts, rng);
    for grip in &mut grips {
        grip.contact.normal_in_object =
            UnitVector::new_normalize(grip.contact.normal_in_object.into_inner() + Vector::from(rng.direction()) * 0.3);
        grip.model = match rng.below(4) {
            0 => ContactModel::Frictionless,
            1 => ContactModel::Point,
            _ => soft(rng.uniform(0.002, 0.01)),
        };
    }
    grips
}

/// Smallest sum of normal forces with which `grips` resist `wrench`, by another cone program.
fn effort_against(grips: &[Grip], body: &HeldBody, wrench: &[f64; 6]) -> Option<f64> {
    let (map, cones) = grasp_map(grips, body);
    let n_forces = map.ncols();
    let mut constraints = DMatrix::zeros(6 + n_forces, n_forces);
    constraints.view_mut((0, 0), (6, n_forces)).copy_from(&map);
    let mut cost = vec![0.0; n_forces];
    let mut kinds = vec![SupportedConeT::ZeroConeT(6)];
    for cone in &cones {
        cost[cone.start] = 1.0;
        for k in cone.clone() {
            constraints[(6 + k, k)] = -1.0;
        }
        constraints[(6 + cone.start, cone.start)] = if cone.len() == 1 { -1.0 } else { -body.friction };
        kinds.push(SupportedConeT::SecondOrderConeT(cone.len()));
    }
    let mut right_side = vec![0.0; 6 + n_forces];
    right_side[..6].copy_from_slice(wrench);
    let forces = DVector::from_vec(solve(&cost, &constraints, &right_side, &kinds)?);
    let error = (&map * &forces - DVector::from_column_slice(wrench)).norm();
    (error < 1e-6).then(|| cones.iter().map(|cone| forces[cone.start]).sum())
}

#[test]
fn every_wrench_within_the_margin_is_resisted_with_unit_effort() {
    let mut rng = Rng::keyed(1, "closure", 0);
    let mut closed = 0;
    for trial in 0..60 {
        let contacts = match trial % 2 {
            0 => random_contacts(3 + trial % 3, &mut rng),
            _ => random_mixed(2 + trial % 4, &mut rng),
        };
        let margin = margin(&contacts, &body(0.8));
        if margin == 0.0 {
            continue;
        }
        closed += 1;
        for _ in 0..40 {
            let direction: [f64; 6] = std::array::from_fn(|_| rng.normal());
            let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            let effort = effort_against(&contacts, &body(0.8), &direction.map(|x| x * margin / norm)).unwrap();
            assert!(effort <= 1.0 + 1e-6, "effort {effort} at margin {margin}");
        }
    }
    assert!(closed > 15, "{closed}");
}

#[test]
fn the_margin_is_below_the_upper_bound_and_both_vanish_together() {
    let mut rng = Rng::keyed(2, "closure", 0);
    let (mut closed, mut open) = (0, 0);
    let (mut smallest_of_points, mut smallest_of_mixed) = (f64::INFINITY, f64::INFINITY);
    for trial in 0..300 {
        let contacts = match trial % 4 {
            0..2 => random_contacts(3 + trial % 2, &mut rng),
            _ => random_mixed(2 + trial % 5, &mut rng),
        };
        let lower = margin(&contacts, &body(0.5));
        let upper = ferrari_canny_upper(&contacts, &body(0.5), 2000, &mut rng);
        assert!(lower <= upper + 1e-9, "{lower} > {upper}");
        if lower > 0.0 {
            closed += 1;
            let smallest = if trial % 4 < 2 { &mut smallest_of_points } else { &mut smallest_of_mixed };
            *smallest = smallest.min(lower / upper);
        } else {
            open += 1;
            // Not proved closed, so a direction that (almost) no contact can push along must exist. With little torsion
            // the search does not find it; there the planner's separation does, in the grasp crate's tests.
            if trial % 4 < 2 {
                assert!(upper < 1e-3, "trial {trial}: not closed, but every direction has support {upper}");
            }
        }
    }
    assert!(closed > 40 && open > 40, "{closed} closed, {open} open");
    assert!(smallest_of_points > 0.05 && smallest_of_mixed > 0.005, "{smallest_of_points} {smallest_of_mixed}");
}

#[test]
fn three_contacts_on_an_equator_close_and_two_or_a_half_sphere_do_not() {
    let third = std::f64::consts::TAU / 3.0;
    let equator: Vec<Grip> =
        (0..3).map(|i| sphere_contact([(third * i as f64).cos(), (third * i as f64).sin(), 0.0], 0.03)).collect();
    assert!(margin(&equator, &body(0.8)) > 0.05);
    assert_eq!(margin(&equator[..2], &body(0.8)), 0.0);
    assert_eq!(margin(&equator, &body(0.0)), 0.0);
    let half: Vec<Grip> =
        [[1.0, 0.0, 0.5], [-1.0, 0.3, 0.6], [0.0, 1.0, 0.7]].map(|d| sphere_contact(d, 0.03)).to_vec();
    assert_eq!(margin(&half, &body(0.2)), 0.0);
}

#[test]
fn the_margin_does_not_depend_on_the_frame_or_the_unit_of_length() {
    let mut rng = Rng::keyed(3, "closure", 0);
    let mut compared = 0;
    for _ in 0..60 {
        let contacts = random_mixed(4, &mut rng);
        let before = margin(&contacts, &body(0.7));
        let motion = regrasp_geometry::pose_from([0.0; 3], rng.quat_xyzw());
        let moved: Vec<Grip> = contacts
            .iter()
            .map(|grip| Grip {
                contact: Contact {
                    point_in_object: Point::from((motion * grip.contact.point_in_object).coords * 10.0),
                    normal_in_object: UnitVector::new_normalize(motion * grip.contact.normal_in_object.into_inner()),
                },
                model: match grip.model {
                    ContactModel::SoftFinger { torsion_radius } => soft(10.0 * torsion_radius),
                    other => other,
                },
            })
            .collect();
        let scaled = HeldBody { torque_scale: 0.3, ..body(0.7) };
        let after = margin(&moved, &scaled);
        assert!((before - after).abs() < 1e-7, "{before} {after}");
        compared += usize::from(before > 0.0);
    }
    assert!(compared > 20, "{compared}");
}

#[test]
fn two_soft_fingers_hold_and_without_torsion_they_do_not() {
    let pair = |model| [[0.0, 0.0, 1.0], [0.1, 0.0, -1.0]].map(|at| Grip { model, ..sphere_contact(at, 0.03) });
    let held = margin(&pair(soft(0.005)), &body(0.8));
    assert!(held > 0.03, "{held}");
    assert!(margin(&pair(soft(0.0005)), &body(0.8)) < 0.2 * held);
    assert_eq!(margin(&pair(ContactModel::Point), &body(0.8)), 0.0);
    assert_eq!(margin(&pair(ContactModel::Frictionless), &body(0.8)), 0.0);
    assert_eq!(margin(&pair(soft(0.005)), &body(0.0)), 0.0);
    // One torsion is enough for the two.
    let one_soft = [pair(soft(0.005))[0], pair(ContactModel::Point)[1]];
    assert!(margin(&one_soft, &body(0.8)) > 0.01);
}

#[test]
fn the_planners_margins_are_below_these_and_near_them() {
    let mut rng = Rng::keyed(4, "closure", 0);
    let (mut n_closed, mut n_open, mut least_ratio) = (0, 0, f64::INFINITY);
    for trial in 0..400 {
        let grips = random_mixed(2 + trial % 5, &mut rng);
        let body = body(rng.uniform(0.3, 1.0));
        let frame = GraspFrame {
            center_of_mass: body.center_of_mass,
            torque_scale: body.torque_scale,
            friction: body.friction,
        };
        let of_all = closure::general::prove(&grips, &frame, f64::INFINITY).margin();
        let best_of_all = solved_margin(&grips, &body).map_or(0.0, |(margin, _)| margin);
        assert!(of_all <= best_of_all + 1e-9, "trial {trial}: {of_all} above {best_of_all}");
        if best_of_all > 1e-6 {
            n_closed += 1;
            least_ratio = least_ratio.min(of_all / best_of_all);
        } else {
            n_open += 1;
        }
        let (planned, checked) = (closure_margin(&grips, &frame, f64::INFINITY), margin(&grips, &body));
        assert!(planned <= checked + 1e-9, "trial {trial}: {planned} above {checked}");
        assert!(planned > 0.0 || checked < 1e-6, "trial {trial}: the planner misses {checked}");
    }
    assert!(n_closed > 80 && n_open > 80, "{n_closed} {n_open}");
    assert!(least_ratio > 0.9, "{least_ratio}");
}

#[test]
fn forces_found_for_contacts_nearby_prove_a_little_less() {
    let mut rng = Rng::keyed(5, "closure", 0);
    let mut n_useful = 0;
    for trial in 0..200 {
        let grips = random_mixed(3 + trial % 3, &mut rng);
        let body = body(0.8);
        let Some((margin_here, proof)) = certified_margin(&grips, &body).filter(|(margin, _)| *margin > 0.01) else {
            continue;
        };
        assert!((margin_by(&proof, &grips, &body) - margin_here).abs() < 1e-9);
        let mut moved = grips.clone();
        for grip in &mut moved {
            grip.contact.point_in_object += Vector::from(rng.direction()) * 3e-4;
            let tilted = grip.contact.normal_in_object.into_inner() + Vector::from(rng.direction()) * 0.01;
            grip.contact.normal_in_object = UnitVector::new_normalize(tilted);
        }
        let (there, tried) = (margin(&moved, &body), margin_by(&proof, &moved, &body));
        assert!(tried <= there + 1e-9, "trial {trial}: {tried} above {there}");
        n_useful += usize::from(tried > 0.5 * there);
        // Of other contacts they prove no more than is true.
        let others = random_mixed(3 + trial % 3, &mut rng);
        assert!(margin_by(&proof, &others, &body) <= margin(&others, &body) + 1e-9);
    }
    assert!(n_useful > 40, "{n_useful}");
}

#[test]
fn many_contacts_are_judged_without_trying_all_subsets() {
    let mut rng = Rng::keyed(7, "many contacts", 0);
    let body = body(0.6);
    for n_contacts in [7, 8, 9] {
        let grips = random_contacts(n_contacts, &mut rng);
        let mut all = SubsetSearch { grips: &grips, body: &body, best: None };
        (0..1u64 << n_contacts).for_each(|subset| _ = all.look(subset));
        let (of_all, found) = (all.best.map_or(0.0, |(margin, _)| margin), margin(&grips, &body));
        assert!(found <= of_all && found >= 0.9 * of_all, "{n_contacts}: {found} of {of_all}");
    }
    // Far more than any hand has.
    assert!(margin(&random_contacts(20, &mut rng), &body) > 0.0);
}
