//! Contact forces at one moment (Cherif 1999, sec. 6.2.3).
//!
//! They balance the weight, each finger presses within its limits, and friction of fingertips that slide has its full size and
//! pulls the object along with the fingertip. That of the others is in
//!
//! - pyramids of four sides inscribed in the cones: the linear program of eq. (13). Of all forces those of least power
//!   `P = -q' . (f_ext + G f')`, with `f'` the tangential parts (minimum power principle, Peshkin and Sanderson 1989); what is
//!   then left open goes to small forces. They lie at corners of what is allowed, and jump from corner to corner;
//! - the exact cones: forces well inside, those of `regrasp_grasp::wrench::distribute_if_any`, which changes little where contacts
//!   change little; to a search any are good (`Choice::Any`). Least power is a wish beside its own for small forces across the normal and for the normal force of the settings: together
//!   they ask for `|f_t|^2 + POWER P`.

use crate::tracking::settings::Cones;
use arrayvec::ArrayVec;
use regrasp_geometry::{Point, UnitVector, Vector, frame};
use regrasp_grasp::wrench::linear_program::{LinearProgram, MAX_ROWS, NoSolution};
use regrasp_grasp::wrench::{ForceLimits, ForceProblem, Rubbing, Wrench, any_inside, distribute_if_any};
use regrasp_grasp::{Contact, ContactForce, ContactModel, GraspFrame, Grip};
use regrasp_manipulation::grasp::state::MAX_FINGERS;

/// What a watt counts against squares of newtons: by hand. At 2.5 mm/s, the speed of the football's surface, forces of
/// half a newton along the motion are wished for.
const POWER: f64 = 400.0;

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
    /// Least and largest normal force, in newtons; in exact cones that wished for, too.
    pub limits: ForceLimits,
    /// Where forces of fingertips that do not slide are.
    pub cones: Cones,
}

/// No forces balance the load within the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotBalanced;

/// Forces on the object, in the object frame, one per fingertip.
pub type Forces = ArrayVec<Vector, MAX_FINGERS>;

/// Which of the forces that balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The best.
    Best,
    /// In exact cones any that are inside the limits, in half of the time: a search asks only whether there are any. In pyramids the best.
    Any,
}

/// Forces that balance the load; `near` may be those of a moment close by.
///
/// Errors: there are none; in exact cones, none that keep some distance from every limit.
pub fn balance(
    contacts: &[Pressing],
    load: &Load,
    near: Option<&Forces>,
    choice: Choice,
) -> Result<Forces, NotBalanced> {
    match load.cones {
        Cones::Pyramid => in_pyramids(contacts, load).map_err(|_| NotBalanced),
        Cones::Exact => in_cones(contacts, load, near, choice),
    }
}

fn in_cones(contacts: &[Pressing], load: &Load, near: Option<&Forces>, choice: Choice) -> Result<Forces, NotBalanced> {
    let grip = |contact: &Pressing| Grip {
        contact: Contact {
            point_in_object: contact.point,
            normal_in_object: UnitVector::new_unchecked(contact.normal),
        },
        model: ContactModel::Point,
    };
    let rubbing = |contact: &Pressing| {
        let velocity = contact.object_velocity;
        Rubbing {
            sliding: contact.slides_along.map(|along| along * load.sliding_friction),
            wish: (velocity - contact.normal * contact.normal.dot(&velocity)) * (0.5 * POWER),
        }
    };
    let grips: ArrayVec<Grip, MAX_FINGERS> = contacts.iter().map(grip).collect();
    let rubbing: ArrayVec<Rubbing, MAX_FINGERS> = contacts.iter().map(rubbing).collect();
    let frame =
        GraspFrame { center_of_mass: load.center_of_mass, torque_scale: load.torque_scale, friction: load.friction };
    let problem = ForceProblem {
        grips: &grips,
        joints: &[],
        reserves: &[],
        rubbing: &rubbing,
        frame: &frame,
        load: Wrench::at_center_of_mass(load.weight),
        limits: load.limits,
    };
    let exerted = |force: &Vector| ContactForce { force: *force, torsion: 0.0 };
    let near: Option<ArrayVec<ContactForce, MAX_FINGERS>> = near.map(|forces| forces.iter().map(exerted).collect());
    let found = match choice {
        Choice::Best => distribute_if_any(&problem, near.as_deref()),
        Choice::Any => any_inside(&problem, near.as_deref()),
    };
    let found = found.ok_or(NotBalanced)?;
    Ok(found.iter().map(|exerted| exerted.force).collect())
}

fn in_pyramids(contacts: &[Pressing], load: &Load) -> Result<Forces, NoSolution> {
    let whole = Program::new(contacts, load, false).solve()?;
    let largest = load.limits.largest;
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
        let ForceLimits { least, largest, .. } = load.limits;
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

    const LOAD: Load = Load {
        weight: Vector::new(1.0, -2.0, -9.0),
        center_of_mass: Point::new(0.004, -0.003, 0.002),
        torque_scale: 0.1,
        friction: 0.6,
        sliding_friction: 0.7,
        limits: ForceLimits { least: 0.1, largest: 60.0, squeeze: 4.0, squeeze_weight: 0.2, cone_weight: 0.0 },
        cones: Cones::Pyramid,
    };
    const EXACT: Load = Load { cones: Cones::Exact, ..LOAD };

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
        for load in [LOAD, EXACT] {
            let mut rng = Rng::keyed(1, "tracking_forces", 0);
            let mut n_balanced = 0;
            for _ in 0..2000 {
                let contacts = contacts(&mut rng);
                let Ok(forces) = balance(&contacts, &load, None, Choice::Best) else { continue };
                n_balanced += 1;
                let (mut sum, mut moment) = (load.weight, Vector::zeros());
                for (contact, force) in contacts.iter().zip(&forces) {
                    sum += force;
                    moment += (contact.point - load.center_of_mass).cross(force);
                    let pressing = -contact.normal.dot(force);
                    let tangential = force + contact.normal * pressing;
                    assert!(pressing > 0.1 - 1e-9 && pressing < 60.0 + 1e-9);
                    match contact.slides_along {
                        Some(along) => assert!((tangential - along * (0.7 * pressing)).norm() < 1e-9 * 0.7 * pressing),
                        None => assert!(tangential.norm() < 0.6 * pressing + 1e-9),
                    }
                }
                assert!(sum.norm() < 1e-9 && moment.norm() < 1e-10, "{sum:?} {moment:?}");
                let near: Forces = forces.iter().map(|force| force * 1.01).collect();
                let again = balance(&contacts, &load, Some(&near), Choice::Best).unwrap();
                let apart = again.iter().zip(&forces).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                assert!(apart < 1e-6, "where the search for forces begins does not matter: {apart}");
            }
            assert!(n_balanced > 50, "{n_balanced}");
        }
    }

    /// Pyramids lie in the exact cones, for which another solver finds forces: what keeps room in those has forces in these,
    /// and beside that these hold some more.
    #[test]
    fn what_pyramids_hold_exact_cones_hold() {
        let mut rng = Rng::keyed(2, "tracking_forces", 0);
        let with_room =
            Load { friction: 0.59, limits: ForceLimits { least: 0.11, largest: 59.9, ..LOAD.limits }, ..LOAD };
        let (mut n_both, mut n_lost) = (0, 0);
        for _ in 0..3000 {
            let contacts = contacts(&mut rng);
            let exact = balance(&contacts, &EXACT, None, Choice::Best).is_ok();
            if balance(&contacts, &with_room, None, Choice::Best).is_ok() {
                assert!(exact, "forces in the pyramids, but none in the cones");
                n_both += 1;
            } else if exact && balance(&contacts, &LOAD, None, Choice::Best).is_err() {
                n_lost += 1;
            }
        }
        assert!(n_both > 50 && n_lost > 0 && n_lost < n_both, "{n_both} {n_lost}");
    }

    /// Of two minima the one with a wish for less power has less: with the wish for power the forces are the minimum of
    /// `A + POWER P`, without it of `A`.
    #[test]
    fn power_is_less_with_the_wish_than_without() {
        let mut rng = Rng::keyed(3, "tracking_forces", 0);
        let (mut n_seen, mut less) = (0, 0.0);
        for _ in 0..2000 {
            let contacts = contacts(&mut rng);
            let still: Vec<Pressing> =
                contacts.iter().map(|contact| Pressing { object_velocity: Vector::zeros(), ..*contact }).collect();
            let (Ok(wished), Ok(without)) =
                (balance(&contacts, &EXACT, None, Choice::Best), balance(&still, &EXACT, None, Choice::Best))
            else {
                continue;
            };
            let power = |forces: &Forces| -> f64 {
                let of = |(contact, force): (&Pressing, &Vector)| {
                    let across = force - contact.normal * contact.normal.dot(force);
                    -contact.object_velocity.dot(&across)
                };
                contacts.iter().zip(forces).map(of).sum()
            };
            assert!(power(&wished) < power(&without) + 1e-9);
            less += power(&without) - power(&wished);
            n_seen += 1;
        }
        assert!(n_seen > 50 && less > 1e-3 * f64::from(n_seen), "{n_seen} {less}");
    }
}
