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
