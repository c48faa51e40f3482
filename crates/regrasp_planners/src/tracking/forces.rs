//! Contact forces at one moment: the linear program of paper 003, eq. (13).
//!
//! Friction of fingertips that do not slide is in pyramids of four sides inscribed in their cones, that of those which slide
//! has its full size and pulls the object along with the fingertip. The forces balance the weight and each finger presses
//! within its limits. Among them those of least power: `P = -q' . (f_ext + G f')`, with `f'` the tangential parts
//! (minimum power principle, Peshkin and Sanderson 1989); what is then left open goes to small forces.

use arrayvec::ArrayVec;
use regrasp_geometry::{Point, UnitVector, Vector, frame};
use regrasp_grasp::wrench::linear_program::{LinearProgram, MAX_ROWS, NoSolution};

use crate::in_hand::model::MAX_FINGERS;

/// What a newton of normal force costs beside the power, in watts: by hand, some hundredths of what sliding costs.
const PRESSING_COST: f64 = 1e-4;

/// A fingertip on the object, in the object frame.
#[derive(Debug, Clone, Copy)]
pub struct Pressing {
    /// Contact.
    pub point: Point,
    /// Outward normal of the object.
    pub normal: Vector,
    /// Unit vector along which the fingertip slides over the object; none where it does not slide.
    pub slides_along: Option<Vector>,
    /// Velocity of the object's point at the contact, in the object frame, in metres per second.
    pub object_velocity: Vector,
}

/// What forces have to do.
#[derive(Debug, Clone, Copy)]
pub struct Load {
    /// Weight, in newtons, in the object frame.
    pub weight: Vector,
    /// Centre of mass, in the object frame.
    pub center_of_mass: Point,
    /// Length by which torques are divided.
    pub torque_scale: f64,
    /// Friction of fingertips that do not slide.
    pub friction: f64,
    /// Friction of those that do.
    pub sliding_friction: f64,
    /// Least and largest normal force, in newtons.
    pub normal_force: [f64; 2],
}

/// Forces on the object, in the object frame, one per fingertip.
pub type Forces = ArrayVec<Vector, MAX_FINGERS>;

/// Forces that balance the load.
///
/// Errors: there are none.
pub fn balance(contacts: &[Pressing], load: &Load) -> Result<Forces, NoSolution> {
    let whole = Program::new(contacts, load, false).solve()?;
    let [_, largest] = load.normal_force;
    let too_hard = |(contact, force): (&Pressing, &Vector)| -contact.normal.dot(force) > largest * (1.0 + 1e-12);
    // All together press with no more than all largest forces; where one alone presses too hard, it is told.
    if !contacts.iter().zip(&whole).any(too_hard) {
        return Ok(whole);
    }
    Program::new(contacts, load, true).solve()
}

struct Program {
    program: LinearProgram,
    /// Force of a unit of each column, and whose.
    unit_forces: ArrayVec<(usize, Vector), 32>,
    /// What every finger exerts to begin with.
    least: Forces,
}

impl Program {
    fn new(contacts: &[Pressing], load: &Load, limits_each: bool) -> Self {
        let [least, largest] = load.normal_force;
        let wrench = |point: &Point, force: &Vector| {
            let moment = (point - load.center_of_mass).cross(force) / load.torque_scale;
            [force.x, force.y, force.z, moment.x, moment.y, moment.z]
        };
        // Least forces are given in advance: along the inward normal, or as the sliding asks.
        let given: Forces = contacts
            .iter()
            .map(|contact| {
                let friction = contact.slides_along.map_or(Vector::zeros(), |along| along * load.sliding_friction);
                (friction - contact.normal) * least
            })
            .collect();
        let mut right = [0.0; MAX_ROWS];
        for (contact, force) in contacts.iter().zip(&given) {
            for (row, part) in right.iter_mut().zip(wrench(&contact.point, force)) {
                *row -= part;
            }
        }
        for (row, part) in right.iter_mut().zip([load.weight.x, load.weight.y, load.weight.z]) {
            *row -= part;
        }
        let n_limits = if limits_each { contacts.len() } else { 1 };
        let room = largest - least;
        for row in &mut right[6..6 + n_limits] {
            *row = if limits_each { room } else { room * contacts.len() as f64 };
        }
        let limit_row = |contact: usize| 6 + if limits_each { contact } else { 0 };
        let mut program = LinearProgram::new(&right[..6 + n_limits]);
        let mut unit_forces = ArrayVec::new();
        let mut add = |index: usize, contact: &Pressing, tangential: Vector| {
            let force = tangential - contact.normal;
            let mut column = [0.0; MAX_ROWS];
            column[..6].copy_from_slice(&wrench(&contact.point, &force));
            column[limit_row(index)] = 1.0;
            program.add(column, PRESSING_COST - contact.object_velocity.dot(&tangential));
            unit_forces.push((index, force));
        };
        for (index, contact) in contacts.iter().enumerate() {
            match contact.slides_along {
                Some(along) => add(index, contact, along * load.sliding_friction),
                None => {
                    let (x, y) = frame::tangents(&UnitVector::new_unchecked(contact.normal));
                    for side in [x.into_inner(), -x.into_inner(), y.into_inner(), -y.into_inner()] {
                        add(index, contact, side * load.friction);
                    }
                }
            }
        }
        for limit in 0..n_limits {
            let mut column = [0.0; MAX_ROWS];
            column[6 + limit] = 1.0;
            program.add(column, 0.0);
        }
        Program { program, unit_forces, least: given }
    }

    fn solve(&self) -> Result<Forces, NoSolution> {
        let shares = self.program.solve()?;
        let mut forces = self.least.clone();
        for ((contact, unit_force), share) in self.unit_forces.iter().zip(&shares) {
            forces[*contact] += unit_force * *share;
        }
        Ok(forces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_grasp::wrench::{ForceLimits, ForceProblem, JointRows, Wrench, can_balance};
    use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip};

    const LOAD: Load = Load {
        weight: Vector::new(1.0, -2.0, -9.0),
        center_of_mass: Point::new(0.004, -0.003, 0.002),
        torque_scale: 0.1,
        friction: 0.6,
        sliding_friction: 0.7,
        normal_force: [0.1, 60.0],
    };

    /// Four contacts all round a ball of 0.1 m, of which some slide.
    fn contacts(rng: &mut Rng) -> Vec<Pressing> {
        let of = |_| {
            let normal = Vector::from(rng.direction());
            let along = Vector::from(rng.direction()).cross(&normal).normalize();
            Pressing {
                point: Point::from(normal * 0.1),
                normal,
                slides_along: rng.chance(0.4).then_some(along),
                object_velocity: Vector::from(rng.direction()).cross(&normal) * 0.01,
            }
        };
        (0..4).map(of).collect()
    }

    #[test]
    fn forces_balance_and_obey_the_law_of_their_contact() {
        let mut rng = Rng::keyed(1, "tracking_forces", 0);
        let mut n_balanced = 0;
        for _ in 0..2000 {
            let contacts = contacts(&mut rng);
            let Ok(forces) = balance(&contacts, &LOAD) else { continue };
            n_balanced += 1;
            let (mut sum, mut moment) = (LOAD.weight, Vector::zeros());
            for (contact, force) in contacts.iter().zip(&forces) {
                sum += force;
                moment += (contact.point - LOAD.center_of_mass).cross(force);
                let pressing = -contact.normal.dot(force);
                let tangential = force + contact.normal * pressing;
                assert!(pressing > 0.1 - 1e-9 && pressing < 60.0 + 1e-9);
                match contact.slides_along {
                    Some(along) => assert!((tangential - along * (0.7 * pressing)).norm() < 1e-9),
                    None => assert!(tangential.norm() < 0.6 * pressing + 1e-9),
                }
            }
            assert!(sum.norm() < 1e-9 && moment.norm() < 1e-10, "{sum:?} {moment:?}");
        }
        assert!(n_balanced > 50, "{n_balanced}");
    }

    /// Pyramids lie in the exact cones: where another solver finds no forces in these, there are none in those; the other way
    /// round some are lost.
    #[test]
    fn what_exact_cones_do_not_hold_pyramids_do_not() {
        let mut rng = Rng::keyed(2, "tracking_forces", 0);
        let frame = GraspFrame {
            center_of_mass: LOAD.center_of_mass,
            torque_scale: LOAD.torque_scale,
            friction: LOAD.friction,
        };
        let [least, largest] = LOAD.normal_force;
        let (mut n_both, mut n_lost) = (0, 0);
        for _ in 0..600 {
            let contacts: Vec<Pressing> =
                contacts(&mut rng).into_iter().map(|contact| Pressing { slides_along: None, ..contact }).collect();
            let grips: Vec<Grip> = contacts
                .iter()
                .map(|contact| Grip {
                    contact: Contact {
                        point_in_object: contact.point,
                        normal_in_object: UnitVector::new_unchecked(contact.normal),
                    },
                    model: ContactModel::Point,
                })
                .collect();
            let joints: Vec<JointRows> = grips.iter().map(|_| JointRows::new()).collect();
            let problem = ForceProblem {
                grips: &grips,
                joints: &joints,
                reserves: &[],
                frame: &frame,
                load: Wrench::at_center_of_mass(LOAD.weight),
                limits: ForceLimits { least, largest, squeeze: 4.0, squeeze_weight: 0.2 },
            };
            match (balance(&contacts, &LOAD).is_ok(), can_balance(&problem)) {
                (true, exact) => {
                    assert!(exact, "forces in the pyramids, but none in the cones");
                    n_both += 1;
                }
                (false, true) => n_lost += 1,
                (false, false) => {}
            }
        }
        assert!(n_both > 50 && n_lost > 0 && n_lost < n_both, "{n_both} {n_lost}");
    }
}
