//! Grasps whose answer is known in closed form.

use crate::sample::soft;
use regrasp_base::Rng;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::closure::{general, prove, three};
use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip, Verdict};

fn frame(friction: f64) -> GraspFrame {
    GraspFrame { center_of_mass: Point::origin(), torque_scale: 1.0, friction }
}

/// A contact at `point` with outward `normal`.
fn grip(point: [f64; 3], normal: [f64; 3], model: ContactModel) -> Grip {
    let normal_in_object = UnitVector::new_normalize(Vector::from(normal));
    Grip { contact: Contact { point_in_object: Point::from(point), normal_in_object }, model }
}

#[test]
fn two_opposed_soft_fingers_have_their_known_margin() {
    // By symmetry the best internal force is along the normals, one half each, of depth mu / sqrt(1 + mu^2) / 2. With
    // the Gram matrix diag(2, 2, 2, 2, 2, 2 e^2) each s^2 is 3/4 (pushing) + 2/4 (turning) + 1 / (4 e^2) (torsion).
    for (friction, radius) in [(0.8, 0.15), (0.3, 0.5), (1.2, 0.05f64)] {
        let grips = [1.0, -1.0].map(|z| grip([0.0, 0.0, z], [0.0, 0.0, z], soft(radius)));
        let s = (1.25 + 0.25 / (radius * radius)).sqrt();
        let t = 0.5 * friction / (1.0f64 + friction * friction).sqrt() / s;
        let best = t / (1.0 + 2.0 * t * s);
        let found = general::prove(&grips, &frame(friction), f64::INFINITY).margin();
        assert!(found <= best + 1e-12 && found > 0.97 * best, "{found} of {best}");
    }
}

#[test]
fn three_points_on_a_great_circle_have_their_known_margin() {
    let grips: [Grip; 3] = std::array::from_fn(|i| {
        let angle = i as f64 * std::f64::consts::TAU / 3.0;
        let at = [angle.cos(), angle.sin(), 0.0];
        grip(at, at, ContactModel::Point)
    });
    let (best, _) = three::prove(&grips.map(|grip| grip.contact), &frame(0.5)).unwrap();
    let found = general::prove(&grips, &frame(0.5), f64::INFINITY).margin();
    assert!(found <= best + 1e-12 && found > 0.97 * best, "{found} of {best}");
}

#[test]
fn two_points_one_contact_and_a_frictionless_ball_are_open() {
    let pair = |model| [1.0, -1.0].map(|z| grip([0.0, 0.0, z], [0.0, 0.0, z], model));
    let is_open = |grips: &[Grip], friction| matches!(prove(grips, &frame(friction), 0.0), Verdict::NotProved(_));
    assert!(is_open(&pair(ContactModel::Point), 0.8));
    assert!(is_open(&pair(soft(0.1))[..1], 0.8));
    assert!(is_open(&pair(soft(0.1)), 0.0));
    assert!(is_open(&[], 0.8));
    let ball: Vec<Grip> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .iter()
        .flat_map(|&at| {
            [1.0, -1.0].map(|sign| grip(at.map(|x| x * sign), at.map(|x| x * sign), ContactModel::Frictionless))
        })
        .collect();
    assert!(is_open(&ball, 0.8));
}

#[test]
fn two_soft_fingers_are_closed_where_the_line_between_them_is_inside_both_cones() {
    // Sufficient by the force along the line. With normals in one plane it is necessary too: torsion then has no part
    // in any internal force that turns the line of force.
    let mut rng = Rng::keyed(3, "closed forms", 0);
    let (mut n_closed, mut n_open) = (0, 0);
    for _ in 0..2000 {
        let friction = rng.uniform(0.2, 1.0);
        let (a, b) = (rng.uniform(-1.2, 1.2), rng.uniform(-1.2, 1.2));
        let slack = friction.atan() - a.abs().max(b.abs());
        if slack.abs() < 1e-4 {
            continue;
        }
        let grips = [
            grip([-1.0, 0.0, 0.0], [-a.cos(), a.sin(), 0.0], soft(0.1)),
            grip([1.0, 0.0, 0.0], [b.cos(), b.sin(), 0.0], soft(0.2)),
        ];
        let closed = matches!(general::prove(&grips, &frame(friction), 0.0), Verdict::Closed(_));
        assert_eq!(closed, slack > 0.0, "angles {a} {b}, friction {friction}");
        if closed { n_closed += 1 } else { n_open += 1 }
    }
    assert!(n_closed > 300 && n_open > 300, "{n_closed} {n_open}");
}

#[test]
fn six_frictionless_contacts_never_close_and_seven_can() {
    // Two opposed contacts on each pair of faces of a cube, set off the middle so that each pair turns the cube one way;
    // a seventh turns it back.
    let mut grips = Vec::new();
    for k in 0..3 {
        for sign in [1.0, -1.0] {
            let mut point = Vector::zeros();
            let mut normal = Vector::zeros();
            (point[k], normal[k]) = (sign, sign);
            point[(k + 1) % 3] = 0.4 * sign;
            grips.push(grip(point.into(), normal.into(), ContactModel::Frictionless));
        }
    }
    assert!(matches!(general::prove(&grips, &frame(0.5), 0.0), Verdict::NotProved(_)));
    let corner: Vec<Grip> = [
        ([1.0, 0.5, 0.5], [1.0, 0.0, 0.0]),
        ([1.0, -0.5, -0.2], [1.0, 0.0, 0.0]),
        ([-1.0, 0.0, 0.1], [-1.0, 0.0, 0.0]),
        ([0.3, 1.0, 0.5], [0.0, 1.0, 0.0]),
        ([-0.2, -1.0, 0.4], [0.0, -1.0, 0.0]),
        ([0.1, 0.2, 1.0], [0.0, 0.0, 1.0]),
        ([0.0, -0.3, -1.0], [0.0, 0.0, -1.0]),
    ]
    .map(|(point, normal)| grip(point, normal, ContactModel::Frictionless))
    .to_vec();
    // Which of the two it is, the linear program of `polyhedral` says for random ones; six of these are always open.
    for left_out in 0..7 {
        let six: Vec<Grip> = (0..7).filter(|&i| i != left_out).map(|i| corner[i]).collect();
        assert!(matches!(general::prove(&six, &frame(0.5), 0.0), Verdict::NotProved(_)));
    }
}

#[test]
fn skew_soft_fingers_may_be_closed_where_the_line_is_just_outside_a_cone() {
    // Torsion lets the line of force turn towards a normal that lies askew of the other: what textbooks say of the
    // joining line is sufficient, not necessary. Without skew it is both.
    let closed = |beyond: f64, skew: f64| {
        let angle = 0.5f64.atan() + beyond;
        let grips = [
            grip([-1.0, 0.0, 0.0], [-angle.cos(), angle.sin(), 0.0], soft(0.5)),
            grip([1.0, 0.0, 0.0], [skew.cos(), 0.0, skew.sin()], soft(0.5)),
        ];
        matches!(general::prove(&grips, &frame(0.5), 0.0), Verdict::Closed(_))
    };
    assert!(closed(-1e-4, 0.0) && !closed(1e-4, 0.0));
    assert!(closed(1e-4, 0.3) && closed(1e-3, 0.3) && !closed(0.05, 0.3));
}
