//! Times of forward and inverse kinematics, best of several rounds, in nanoseconds per call.
#![allow(clippy::print_stdout)]

use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::finger_ik::{FingerIk, IkSettings, Preference};
use regrasp_robot::kinematics::motion_bound::MotionBound;
use regrasp_robot::{Chain, ChainJoint, Coupling, JointMotion};
use std::hint::black_box;
use std::time::Instant;

fn chain(joints: &[(Vector, Vector, [f64; 2])]) -> Chain {
    let turning = |(i, (origin, axis, _)): (usize, &(Vector, Vector, [f64; 2]))| ChainJoint {
        parent_from_joint: Pose::new(*origin, Vector::zeros()),
        axis: UnitVector::new_normalize(*axis),
        motion: JointMotion::Turn,
        drive: Coupling::independent(i),
    };
    Chain::new(
        joints.iter().enumerate().map(turning).collect(),
        (0..joints.len()).map(|i| format!("joint_{i}")).collect(),
        joints.iter().map(|joint| joint.2[0]).collect(),
        joints.iter().map(|joint| joint.2[1]).collect(),
    )
}

/// The wide hand's finger.
fn wide() -> (Chain, Point) {
    let joints = [
        (Vector::new(0.045, 0.0, 0.0), Vector::x(), [-0.61, 0.61]),
        (Vector::zeros(), -Vector::y(), [-1.31, 1.05]),
        (Vector::new(0.0, 0.0, 0.058), -Vector::y(), [0.09, 2.01]),
    ];
    (chain(&joints), Point::new(0.0, 0.0, 0.05))
}

/// A finger whose axes neither meet nor are parallel.
fn skew() -> (Chain, Point) {
    let joints = [
        (Vector::new(0.045, 0.0, 0.0), Vector::new(1.0, 0.2, 0.1), [-0.61, 0.61]),
        (Vector::new(0.005, 0.01, 0.01), Vector::new(0.1, -1.0, 0.2), [-1.31, 1.05]),
        (Vector::new(0.0, 0.004, 0.058), Vector::new(0.3, -1.0, 0.0), [0.09, 2.01]),
    ];
    (chain(&joints), Point::new(0.0, 0.0, 0.05))
}

/// A finger of Allegro's dimensions.
fn allegro() -> (Chain, Point) {
    let joints = [
        (Vector::new(0.0, 0.0435, -0.0015), Vector::z(), [-0.47, 0.47]),
        (Vector::new(0.0, 0.0, 0.0164), Vector::y(), [-0.196, 1.61]),
        (Vector::new(0.0, 0.0, 0.054), Vector::y(), [-0.174, 1.709]),
        (Vector::new(0.0, 0.0, 0.0384), Vector::y(), [-0.227, 1.618]),
    ];
    (chain(&joints), Point::new(0.0, 0.0, 0.0267))
}

fn report<T>(name: &str, inputs: &[T], mut call: impl FnMut(&T)) {
    let mut best = f64::INFINITY;
    for _ in 0..60 {
        let start = Instant::now();
        inputs.iter().for_each(&mut call);
        best = best.min(start.elapsed().as_nanos() as f64 / inputs.len() as f64);
    }
    println!("{name:52} {best:9.1} ns");
}

fn main() {
    let settings = IkSettings::default();
    for (name, (chain, center)) in [("wide 3R", wide()), ("skew 3R", skew()), ("allegro 4R", allegro())] {
        let mut rng = Rng::keyed(1, name, 0);
        let ik = FingerIk::new(&chain, &center);
        let postures: Vec<Vec<f64>> = (0..512)
            .map(|_| (0..chain.lower.len()).map(|k| rng.uniform(chain.lower[k], chain.upper[k])).collect())
            .collect();
        let targets: Vec<Point> = postures.iter().map(|q| ik.tip(q)).collect();
        // A target 1 mm and one 5 mm away from each posture's tip.
        let near = |distance: f64, rng: &mut Rng| -> Vec<(Vec<f64>, Point)> {
            let moved = |q: &Vec<f64>| (q.clone(), ik.tip(q) + Vector::from(rng.direction()) * distance);
            postures.iter().map(moved).collect()
        };
        let (near_1, near_5) = (near(0.001, &mut rng), near(0.005, &mut rng));
        let wish = settings_with(Vector::new(1.0, 0.3, 0.0));
        let mut poses = Vec::new();
        report(&format!("{name}: forward (poses)"), &postures, |q| {
            chain.forward(black_box(q), &mut poses);
            black_box(&poses);
        });
        let mut frames = vec![BodyFrame::IDENTITY; chain.joints.len()];
        report(&format!("{name}: forward_frames"), &postures, |q| {
            chain.forward_frames(black_box(q), &mut frames);
            black_box(&frames);
        });
        let mut solutions = Vec::new();
        report(&format!("{name}: solve_all"), if ik.is_closed_form() { &targets } else { &targets[..16] }, |target| {
            solutions.clear();
            ik.solve_all(black_box(target), &settings, &mut solutions);
        });
        report(&format!("{name}: solve_random"), &targets, |target| {
            black_box(ik.solve_random(black_box(target), &settings, &mut rng));
        });
        report(&format!("{name}: solve_random with preference"), &targets, |target| {
            black_box(ik.solve_random(black_box(target), &wish, &mut rng));
        });
        report(&format!("{name}: solve_near, 1 mm"), &near_1, |(q, target)| {
            black_box(ik.solve_near(black_box(target), q, &settings));
        });
        report(&format!("{name}: solve_near, 5 mm"), &near_5, |(q, target)| {
            black_box(ik.solve_near(black_box(target), q, &settings));
        });
        report(&format!("{name}: solve_near, 5 mm, with preference"), &near_5, |(q, target)| {
            black_box(ik.solve_near(black_box(target), q, &wish));
        });
        let last = chain.joints.len() - 1;
        let bound = MotionBound::new(&chain, last, &center, 0.005);
        report(&format!("{name}: motion bounds, both orders"), &postures, |q| {
            black_box(bound.first_order(black_box(q)) + bound.chord_deviation(black_box(q)));
        });
        let n_tracked = near_5.iter().filter(|(q, target)| ik.solve_near(target, q, &settings).is_some()).count();
        let tip_axis = |q: &[f64]| chain.last_frame(q).vector(&center.coords.normalize());
        let wanted = Vector::new(1.0, 0.3, 0.0).normalize();
        let solved: Vec<_> = targets.iter().filter_map(|target| ik.solve_random(target, &wish, &mut rng)).collect();
        let mean = solved.iter().map(|q| tip_axis(q).dot(&wanted)).sum::<f64>() / solved.len() as f64;
        println!("{name}: {} of 512 solved, mean cosine to the preference {mean:.3}", solved.len());
        println!("{name}: 5 mm steps followed: {n_tracked} of {} (the others may be out of reach)", near_5.len());
    }
}

fn settings_with(direction: Vector) -> IkSettings {
    let preference =
        Some(Preference { tip_axis_in_base: UnitVector::new_normalize(direction), weight: 1.0, damping: 0.0 });
    IkSettings { preference, ..IkSettings::default() }
}
