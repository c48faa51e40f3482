//! Transfers in which the tips of the sample hand roll over the ball, integrated here in tiny steps: the condition is that
//! the touching points of link and object have one velocity, solved for the joint rates. The checker looks at poses only.

use crate::sample::{self, Grasp, OBJECT_RADIUS, TIP_RADIUS};
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::{ContactMode, ContactState, Plan, Segment};
use regrasp_scene::Scene;

/// Steps of the integration between two waypoints.
const N_SUBSTEPS: usize = 20;

/// The object's course: it turns about a fixed axis of the hand and shifts, at constant rates.
#[derive(Clone, Copy)]
pub struct Course {
    pub from: Pose,
    pub turn: Vector,
    pub shift: Vector,
}

impl Course {
    pub fn pose(&self, t: f64) -> Pose {
        let rotation = UnitQuaternion::from_scaled_axis(self.turn * t) * self.from.rotation;
        Pose::from_parts(Translation3::from(self.from.translation.vector + self.shift * t), rotation)
    }

    /// Velocity of the object's point that is at `point` in the hand.
    fn velocity(&self, t: f64, point: &Point) -> Vector {
        self.shift + self.turn.cross(&(point - self.pose(t) * Point::origin()))
    }
}

/// Rates of a finger's joints with which its tip rolls on the ball.
fn rolling_rates(f: usize, joints: &[f64; 3], course: &Course, t: f64) -> [f64; 3] {
    let (axes, center) = sample::finger_axes(f, joints);
    let normal = (center - course.pose(t) * Point::origin()).normalize();
    let touching = center - normal * TIP_RADIUS;
    let columns = axes.map(|(origin, axis)| axis.cross(&(touching - origin)));
    let rates = Matrix3::from_columns(&columns).lu().solve(&course.velocity(t, &touching)).expect("no singular finger");
    rates.into()
}

/// One step of the classical method of Runge and Kutta.
fn runge_kutta(f: usize, joints: &[f64; 3], course: &Course, t: f64, h: f64) -> [f64; 3] {
    let ahead = |rates: &[f64; 3], by: f64| std::array::from_fn(|k| joints[k] + by * rates[k]);
    let first = rolling_rates(f, joints, course, t);
    let second = rolling_rates(f, &ahead(&first, 0.5 * h), course, t + 0.5 * h);
    let third = rolling_rates(f, &ahead(&second, 0.5 * h), course, t + 0.5 * h);
    let fourth = rolling_rates(f, &ahead(&third, h), course, t + h);
    std::array::from_fn(|k| joints[k] + h / 6.0 * (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k]))
}

/// A transfer in which every finger rolls, from a grasp; the grasp it ends in, by directions from the centre.
pub fn transfer(course: &Course, grasp: &Grasp, n_steps: usize) -> (Segment, Grasp) {
    let mut now = *grasp;
    let mut waypoint = sample::waypoint(&course.from, grasp, None);
    let roll_all = |contacts: &mut [ContactState]| contacts.iter_mut().for_each(|c| c.mode = ContactMode::Rolling);
    roll_all(&mut waypoint.contacts);
    let mut waypoints = vec![waypoint.clone()];
    for step in 0..n_steps {
        for f in 0..sample::N_FINGERS {
            let mut joints = [0, 1, 2].map(|k| waypoint.joints[3 * f + k]);
            for substep in 0..N_SUBSTEPS {
                let h = 1.0 / (n_steps * N_SUBSTEPS) as f64;
                joints = runge_kutta(f, &joints, course, (step * N_SUBSTEPS + substep) as f64 * h, h);
            }
            let pose = course.pose((step + 1) as f64 / n_steps as f64);
            let (_, center) = sample::finger_axes(f, &joints);
            now[f] = (pose.inverse() * center).coords.normalize();
            waypoint.joints[3 * f..3 * f + 3].copy_from_slice(&joints);
            waypoint.contacts[f] =
                ContactState::at(ContactMode::Rolling, (now[f] * OBJECT_RADIUS).into(), now[f].into());
            waypoint.world_from_object = (&(sample::world_from_hand() * pose)).into();
        }
        waypoints.push(waypoint.clone());
    }
    (Segment::transfer(waypoints), now)
}

/// Rolling transfer, relocation of a finger, rolling transfer.
pub fn plan(scene: &Scene, n_steps: usize) -> Plan {
    let from = Pose::translation(0.0, 0.0, 0.078);
    let first = Course { from, turn: Vector::new(0.02, 0.06, 0.2), shift: Vector::new(0.001, -0.001, 0.002) };
    let (rolled, grasp) = transfer(&first, &sample::START_GRASP.map(|(a, e)| sample::around(a, e)), n_steps);
    let (relocated, grasp) = sample::regrasp(&first.pose(1.0), &grasp, 1, sample::around(65.0, 2.0), 0.004);
    let last =
        Course { from: first.pose(1.0), turn: Vector::new(-0.05, 0.0, 0.15), shift: Vector::new(0.0, 0.002, -0.002) };
    let (rolled_again, _) = transfer(&last, &grasp, n_steps);
    sample::plan_of(scene, &from, &last.pose(1.0), vec![rolled, relocated, rolled_again])
}
