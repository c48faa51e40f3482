//! One step of time: the object moves on the fingertips that rest, one fingertip moves, and forces hold all of it (Cherif 1999,
//! sec. 6.2.1 to 6.2.3).

use crate::tracking::forces::{Choice, Forces, Load, Pressing, balance};
use crate::tracking::grasp::{PerFinger, TrackingGrasp};
use crate::tracking::object_motion::ObjectMotion;
use crate::tracking::range::{lies_on_crease, stays_on_its_face};
use crate::tracking::settings::TrackingSettings;
use nalgebra::{Matrix3, Rotation3};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, UnitVector, Vector, frame, interpolate_pose};
use regrasp_grasp::contact::rolling::{Touch, roll_step, slip, turn_between};
use regrasp_manipulation::forces::limits::ForceModel;
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::{FingerModel, Model};
use regrasp_manipulation::rolling::step::RollStep;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_plan::plan::ContactMode;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_robot::kinematics::whole_pose::{has_all_directions, joints_of_pose, largest_torques, torques};

/// Corrections of a rolling step that would twist; each gains two digits.
const UNTWISTINGS: usize = 3;
/// A fingertip that slides slower than this, in metres per second, neither slides nor rolls for sure: friction has no direction.
const SLOWEST: f64 = 1e-4;

/// Joints and object go straight from step to step: half-way the tip of a long step may be turned aside by this angle.
const MOST_BENT: f64 = 2e-4;
/// Turn aside, half-way in steps, that a segment adds up: there and back it twists by twice as much, and checkers allow 2e-3.
pub const MOST_BENT_IN_SEGMENT: f64 = 5e-4;

/// Angle by which a tip slides aside of its direction in a long step, above which that is too long: between the direction of the whole and of
/// its halves, which are a quarter as far off, and out of the planes in which it touches at both ends. Checkers allow 0.02.
const MOST_TURNED_ASIDE: f64 = 0.01;

/// Work of a step, in the unit of in-hand planning: a configuration looked at. By measurement, some 50 against 2 microseconds.
pub const STEP_WORK: u64 = 25;

/// Fingers, as bits.
pub type Fingers = u32;

/// The fingers of a set, in order.
pub fn each(fingers: Fingers) -> impl Iterator<Item = usize> {
    (0..MAX_FINGERS).filter(move |finger| fingers & (1 << finger) != 0)
}

/// Who does what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roles {
    /// The fingers that move.
    pub moving: Fingers,
    /// The resting finger on which the object rolls.
    pub rolling: usize,
}

impl Roles {
    /// True where the finger moves.
    pub fn moves(&self, finger: usize) -> bool {
        self.moving & (1 << finger) != 0
    }

    /// All roles that `n` fingers can have while the object moves: `resting` of them rest, fewer where else none would move
    /// (Cherif 1999, sec. 3.1 and 8).
    pub fn all(n: usize, resting: usize) -> impl Iterator<Item = Roles> {
        let n_moving = n.saturating_sub(resting).max(1);
        let sets = (0..1u32 << n).filter(move |set| set.count_ones() as usize == n_moving);
        sets.flat_map(move |moving| {
            (0..n).map(move |rolling| Roles { moving, rolling }).filter(|roles| !roles.moves(roles.rolling))
        })
    }
}

/// How each moving fingertip turns relative to the object, about the tangents of its contact (Cherif 1999, eq. 10).
pub type Controls = [[f64; 2]; MAX_FINGERS];

/// What is asked of a step.
#[derive(Debug, Clone, Copy)]
pub struct Asked {
    /// Who does what.
    pub roles: Roles,
    /// Turn of the object, in the world, of which as many components are kept as the contacts leave free; none: it rests.
    pub turn: Option<Vector>,
    /// How the moving fingertips roll. Fingers that cannot choose follow the object without sliding.
    pub rolled: Controls,
    /// How long the step takes. More than the settings' longest step only where moving fingertips keep their faces.
    pub seconds: f64,
}

/// Why a step cannot be made (Cherif 1999, sec. 6.2.4, failures 1 to 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoStep {
    /// 1: a moving finger collides with another, or with anything but the object.
    Collision,
    /// 2: a moving finger cannot reach.
    OutOfReach,
    /// 3: a moving fingertip would touch outside its pad: with the planar part of a hemisphere.
    MovingPad,
    /// 4: the contact of this resting finger comes to an edge or vertex.
    BrokenContact(usize),
    /// 5: a resting fingertip would touch outside its pad.
    RestingPad,
    /// 6: no forces balance the weight.
    Unbalanced,
    /// 7: the resting fingers do not tell the object's motion, or it does not lead to the goal.
    Degenerate,
    /// A moving finger may not change its face, and would.
    FaceChange,
    /// In a step this long a moving finger would leave its face, or its joints would lead it aside, or one that slides would change its
    /// direction.
    TooLong,
}

impl NoStep {
    /// Number in Cherif 1999's list; 0 for what it does not list.
    pub fn number(self) -> usize {
        match self {
            NoStep::FaceChange | NoStep::TooLong => 0,
            NoStep::Collision => 1,
            NoStep::OutOfReach => 2,
            NoStep::MovingPad => 3,
            NoStep::BrokenContact(_) => 4,
            NoStep::RestingPad => 5,
            NoStep::Unbalanced => 6,
            NoStep::Degenerate => 7,
        }
    }
}

/// Fingertip against object over a step, in the object frame.
#[derive(Debug, Clone, Copy)]
pub struct Relative {
    /// What it does.
    pub mode: ContactMode,
    /// How far its touching point slides.
    pub slid: Vector,
    /// How it turns, as a rotation vector.
    pub turned: Vector,
}

impl Relative {
    /// Fixed.
    pub const STILL: Relative =
        Relative { mode: ContactMode::Fixed, slid: Vector::new(0.0, 0.0, 0.0), turned: Vector::new(0.0, 0.0, 0.0) };
}

/// A step made.
#[derive(Debug, Clone)]
pub struct TrackingStep {
    /// Who did what.
    pub roles: Roles,
    /// How long it takes.
    pub seconds: f64,
    /// Every fingertip against the object.
    pub relative: PerFinger<Relative>,
    /// Contact forces at its beginning and at its end: some that balance. The plan gets the best ([`Stepper::best_forces_at_start`]).
    pub forces: [Forces; 2],
    /// The grasp at its end.
    pub end: TrackingGrasp,
}

/// How the object begins to turn, were forces no matter.
#[derive(Debug, Clone)]
pub struct Beginning {
    /// Its turn in the shortest step, in the world.
    pub turn: Vector,
    /// The grasp then, but for the fingers that move.
    end: TrackingGrasp,
    relative: PerFinger<Relative>,
}

/// Makes steps.
pub struct Stepper<'m, 'a> {
    /// The scene, prepared.
    pub model: &'m Model<'a>,
    /// Settings.
    pub settings: &'m TrackingSettings,
    /// Fingers that rest while the object moves.
    pub resting: usize,
    /// Weight, and what joints can exert.
    pub forces: &'m ForceModel,
    /// No joint is too weak for any forces within the limits: which of them are taken does not matter to it.
    is_always_strong: bool,
    /// Where object and fingers are: what collision tests start from.
    pub workspace: Workspace<'m>,
    /// Work so far.
    pub work: u64,
}

impl<'m, 'a> Stepper<'m, 'a> {
    /// Of a model with forces.
    ///
    /// Panics where the model has none.
    pub fn new(model: &'m Model<'a>, settings: &'m TrackingSettings) -> Self {
        let forces = model.forces.as_ref().expect("settings without forces do not validate");
        let friction = model.frame.friction.max(model.view.object.friction);
        let largest = forces.limits().largest * friction.hypot(1.0);
        let is_strong = |(index, finger): (usize, &FingerModel)| {
            let radius = finger.ik.center_in_body().coords.norm() + finger.tip_radius;
            let torques: Coordinates =
                largest_torques(finger.ik.chain(), radius).iter().map(|per_newton| per_newton * largest).collect();
            forces.allows(index, &torques)
        };
        let is_always_strong = model.fingers.iter().enumerate().all(is_strong);
        let (resting, workspace) = (settings.resting_fingers, Workspace::new(model));
        Stepper { model, settings, resting, forces, is_always_strong, workspace, work: 0 }
    }

    /// Takes the step from `grasp`, where the workspace is; the workspace is then at its end, else where it was.
    pub fn step(&mut self, grasp: &TrackingGrasp, asked: &Asked) -> Result<TrackingStep, NoStep> {
        self.work += STEP_WORK;
        let model = self.model;
        let Roles { moving, rolling } = asked.roles;
        let resting: PerFinger<usize> = each(model.all_fingers() & !moving).collect();
        let (object, rest_touches) = match &asked.turn {
            None => (grasp.world_from_object, resting.iter().map(|&finger| grasp.touches[finger]).collect()),
            Some(turn) => {
                let motion = ObjectMotion::new(model, grasp, &resting, rolling, turn).ok_or(NoStep::Degenerate)?;
                motion.step(turn).ok_or(NoStep::Degenerate)?
            }
        };
        let mut end = grasp.clone();
        end.bent = 0.0;
        end.world_from_object = object;
        for (&finger, touch) in resting.iter().zip(&rest_touches) {
            end.touches[finger] = *touch;
            if !stays_on_its_face(&model.view.object.surface, &grasp.touches[finger], touch) {
                return Err(NoStep::BrokenContact(finger));
            }
            if !model.fingers[finger].pad_faces(&grasp.joints[finger], &end.normal_in_world(finger)) {
                return Err(NoStep::RestingPad);
            }
        }
        for finger in each(moving) {
            self.move_finger(finger, grasp, asked, &mut end)?;
        }
        let relative = self.relative(grasp, &end, asked)?;
        let forces = self.balanced(grasp, &end, &relative, asked.seconds)?;
        self.workspace.roll_to(&end.contacts());
        if !self.workspace.step(&object.to_pose(), &end.joints, TipMode::AllHold) {
            return Err(NoStep::Collision);
        }
        Ok(TrackingStep { roles: asked.roles, seconds: asked.seconds, relative, forces, end })
    }

    /// A moving finger at the end of the step.
    fn move_finger(
        &self,
        moving: usize,
        grasp: &TrackingGrasp,
        asked: &Asked,
        end: &mut TrackingGrasp,
    ) -> Result<(), NoStep> {
        let model = self.model;
        let finger = &model.fingers[moving];
        let chain = finger.ik.chain();
        let start = &grasp.touches[moving];
        let is_long = asked.seconds > self.settings.time_step;
        let touch = if has_all_directions(chain) {
            let (x, y) = frame::tangents(&UnitVector::new_unchecked(start.ball.normal));
            let [about_x, about_y] = asked.rolled[moving];
            let turn = x.into_inner() * about_x + y.into_inner() * about_y;
            let (turn, touch) = self.roll_purely(moving, start, &turn).ok_or(NoStep::OutOfReach)?;
            let object_from_link = Rotation3::new(turn).into_inner() * grasp.object_from_link(moving);
            let rotation = end.world_from_object.rotation * object_from_link;
            let center = end.world_from_object.point(&touch.ball.center);
            let translation = center.coords - rotation * finger.ik.center_in_body().coords;
            let link = Placement { rotation, translation };
            let joints = joints_of_pose(chain, &grasp.joints[moving], &link).ok_or(NoStep::OutOfReach)?;
            let middle: Coordinates = grasp.joints[moving].iter().zip(&joints).map(|(a, b)| 0.5 * (a + b)).collect();
            let from = &grasp.world_from_link[moving].rotation;
            let whole = turn_between(from, &link.rotation);
            let half_way = chain.last_frame(&middle).rotation;
            let aside = (turn_between(from, &half_way) - 0.5 * whole).norm();
            let rotations = [
                grasp.object_from_link(moving),
                object_half_way(grasp, end).rotation.transpose() * half_way,
                object_from_link,
            ];
            let twist = twist_by_halves(&rotations, [&start.ball.normal, &touch.ball.normal]);
            let bent = aside.max(0.5 * twist) + 0.5 * self.twist_over_edge(start, &touch, &turn);
            match is_long {
                true if bent > MOST_BENT => return Err(NoStep::TooLong),
                // Near where its wrist is singular.
                false if bent > MOST_BENT_IN_SEGMENT => return Err(NoStep::OutOfReach),
                _ => end.bent = end.bent.max(bent),
            }
            end.world_from_link[moving] = chain.last_frame(&joints);
            end.joints[moving] = joints;
            touch
        } else {
            let (from, to) = (grasp.world_from_object, end.world_from_object);
            let (from_pose, to_pose) = (from.to_pose(), to.to_pose());
            let between = |t: f64| Placement::from(&interpolate_pose(&from_pose, &to_pose, t));
            let step = RollStep::new(model, moving, &start.contact(), &grasp.joints[moving], &from, &to);
            let allowed = 0.2 * regrasp_manipulation::tolerances::CONTACT_TOLERANCE;
            let rolled = step.fine(between, allowed).map_err(|_| NoStep::OutOfReach)?;
            end.world_from_link[moving] = chain.last_frame(&rolled.joints);
            end.joints[moving] = rolled.joints;
            let center = to.point_to_child(&end.world_from_link[moving].point(finger.ik.center_in_body()));
            Touch::of(&model.view.object.surface, &center).ok_or(NoStep::OutOfReach)?
        };
        if !stays_on_its_face(&model.view.object.surface, start, &touch) {
            let longest = if self.settings.face_changes { self.settings.longest_step } else { self.settings.time_step };
            if asked.seconds > longest {
                return Err(NoStep::TooLong);
            }
            if !self.settings.face_changes {
                return Err(NoStep::FaceChange);
            }
        }
        end.touches[moving] = touch;
        let tip = end.world_from_link[moving].point(finger.ik.center_in_body());
        if model.view.reach.is_some_and(|reach| (tip - finger.tip_at_rest).norm() > reach) {
            return Err(NoStep::OutOfReach);
        }
        if !finger.pad_faces(&end.joints[moving], &end.normal_in_world(moving)) {
            return Err(NoStep::MovingPad);
        }
        Ok(())
    }

    /// Rolls the ball of `finger` by the rotation vector `asked`, in the object frame, less what would twist it about the normal
    /// half-way; the rotation vector and where the ball then touches.
    fn roll_purely(&self, finger: usize, from: &Touch, asked: &Vector) -> Option<(Vector, Touch)> {
        let mut turn = *asked;
        let mut to = self.roll(finger, from, &turn)?;
        for _ in 0..UNTWISTINGS {
            let middle = (from.ball.normal + to.ball.normal).normalize();
            turn = asked - middle * middle.dot(asked);
            to = self.roll(finger, from, &turn)?;
        }
        Some((turn, to))
    }

    /// How far a ball at most twists about its normal that rolls by the rotation vector `turn` onto an edge or off one. It does not twist
    /// half-way, nor on the whole where its normal turns evenly; but on the face the normal stands still.
    fn twist_over_edge(&self, from: &Touch, to: &Touch, turn: &Vector) -> f64 {
        let surface = &self.model.view.object.surface;
        let is_even = match [from, to].map(|touch| lies_on_crease(surface, touch)) {
            [false, false] => surface.same_face(&from.foot, &to.foot),
            [from_edge, to_edge] => from_edge && to_edge,
        };
        if is_even { 0.0 } else { 0.5 * turn.norm() * (to.ball.normal - from.ball.normal).norm() }
    }

    /// Where the ball of `finger` touches after it has rolled by the rotation vector `turn`, in the object frame.
    fn roll(&self, finger: usize, from: &Touch, turn: &Vector) -> Option<Touch> {
        let surface = &self.model.view.object.surface;
        roll_step(|center| Touch::of(surface, center), self.model.fingers[finger].tip_radius, from, turn)
    }

    /// Fingertips against the object, as Cherif 1999, table 1 has it.
    fn relative(
        &self,
        grasp: &TrackingGrasp,
        end: &TrackingGrasp,
        asked: &Asked,
    ) -> Result<PerFinger<Relative>, NoStep> {
        let model = self.model;
        let of = |finger: usize| {
            let turned = turn_between(&grasp.object_from_link(finger), &end.object_from_link(finger));
            let radius = model.fingers[finger].tip_radius;
            let slid = slip(radius, &grasp.touches[finger].ball, &end.touches[finger].ball, &turned);
            let mode = if asked.roles.moves(finger) {
                match has_all_directions(model.fingers[finger].ik.chain()) {
                    true => ContactMode::PureRolling,
                    false => ContactMode::Rolling,
                }
            } else if asked.turn.is_none() {
                ContactMode::Fixed
            } else if finger == asked.roles.rolling {
                ContactMode::Rolling
            } else if slid.norm() < SLOWEST * asked.seconds {
                return Err(NoStep::Degenerate);
            } else {
                ContactMode::Sliding
            };
            let slid = match mode {
                ContactMode::Sliding => self.slid_by_halves(grasp, end, finger, &slid, asked)?,
                _ => slid,
            };
            Ok(Relative { mode, slid, turned })
        };
        (0..model.n_fingers()).map(of).collect()
    }

    /// How far the tip of a finger that rests slides in the two halves of a step, of which the whole says `slid`.
    ///
    /// Errors: the step is longer than the shortest, and the two say different directions.
    fn slid_by_halves(
        &self,
        grasp: &TrackingGrasp,
        end: &TrackingGrasp,
        finger: usize,
        slid: &Vector,
        asked: &Asked,
    ) -> Result<Vector, NoStep> {
        if asked.seconds <= self.settings.time_step {
            return Ok(*slid);
        }
        // Halves tell nothing of a tip that comes down from an edge.
        if lies_on_crease(&self.model.view.object.surface, &grasp.touches[finger]) {
            return Err(NoStep::TooLong);
        }
        let of_model = &self.model.fingers[finger];
        let between = object_half_way(grasp, end);
        let center = between.point_to_child(&grasp.world_from_link[finger].point(of_model.ik.center_in_body()));
        let middle = Touch::of(&self.model.view.object.surface, &center).ok_or(NoStep::TooLong)?;
        let object_from_link = between.rotation.transpose() * grasp.world_from_link[finger].rotation;
        let half = |from: &Touch, to: &Touch, turn: &Vector| slip(of_model.tip_radius, &from.ball, &to.ball, turn);
        let first = turn_between(&grasp.object_from_link(finger), &object_from_link);
        let second = turn_between(&object_from_link, &end.object_from_link(finger));
        let halves = half(&grasp.touches[finger], &middle, &first) + half(&middle, &end.touches[finger], &second);
        // Plans say it across the normals at both ends.
        let tilt = |touch: &Touch| (touch.ball.normal.dot(&halves) / halves.norm()).abs();
        let aside = slid.angle(&halves) + tilt(&grasp.touches[finger]).max(tilt(&end.touches[finger]));
        if aside > MOST_TURNED_ASIDE { Err(NoStep::TooLong) } else { Ok(halves) }
    }

    /// Some forces at both ends of a step, with the sliding of the step.
    fn balanced(
        &self,
        grasp: &TrackingGrasp,
        end: &TrackingGrasp,
        relative: &PerFinger<Relative>,
        seconds: f64,
    ) -> Result<[Forces; 2], NoStep> {
        let weight = self.forces.weight_in_world();
        let at = |here, near: Option<&Forces>| {
            self.balanced_under(&weight, (here, grasp, end), (relative, seconds), near, Choice::Any)
        };
        let at_end = at(end, None)?;
        Ok([at(grasp, Some(&at_end))?, at_end])
    }

    /// The best forces at the beginning of `step`, which begins at `start`.
    pub fn best_forces_at_start(&self, start: &TrackingGrasp, step: &TrackingStep) -> Forces {
        self.best_forces(start, (start, step), &step.forces[0])
    }

    /// The best forces at the end of `step`, which begins at `start`.
    pub fn best_forces_at_end(&self, start: &TrackingGrasp, step: &TrackingStep) -> Forces {
        self.best_forces(&step.end, (start, step), &step.forces[1])
    }

    /// The best forces near those of the search. These balance too, and are kept should the best not be found from them.
    fn best_forces(
        &self,
        here: &TrackingGrasp,
        (start, step): (&TrackingGrasp, &TrackingStep),
        near: &Forces,
    ) -> Forces {
        let weight = self.forces.weight_in_world();
        let grasps = (here, start, &step.end);
        let of_step = (&step.relative, step.seconds);
        self.balanced_under(&weight, grasps, of_step, Some(near), Choice::Best).unwrap_or_else(|_| near.clone())
    }

    /// Forces at `grasp` where nothing moves.
    pub fn balanced_at_rest(&self, grasp: &TrackingGrasp, choice: Choice) -> Result<Forces, NoStep> {
        let relative: PerFinger<Relative> = grasp.touches.iter().map(|_| Relative::STILL).collect();
        let at_rest = (&relative, self.settings.time_step);
        self.balanced_under(&self.forces.weight_in_world(), (grasp, grasp, grasp), at_rest, None, choice)
    }

    /// Forces at `here`, an end of the step between two grasps in which the fingertips move as `relative` has it in `seconds`, under a weight in the
    /// world that need not be the object's own; `near` may be those of a moment close by.
    fn balanced_under(
        &self,
        weight: &Vector,
        (here, from, to): (&TrackingGrasp, &TrackingGrasp, &TrackingGrasp),
        (relative, seconds): (&PerFinger<Relative>, f64),
        near: Option<&Forces>,
        choice: Choice,
    ) -> Result<Forces, NoStep> {
        let (model, object) = (self.model, &here.world_from_object);
        let load = self.load(weight, object);
        let pressing = |finger: usize| {
            let Relative { mode, slid, .. } = &relative[finger];
            let (point, normal) = (here.touches[finger].foot.point_in_object, here.touches[finger].ball.normal);
            let across = slid - normal * normal.dot(slid);
            let moved = to.world_from_object.point(&point) - from.world_from_object.point(&point);
            Pressing {
                point,
                normal,
                slides_along: mode.slides().then(|| across.normalize()),
                object_velocity: object.vector_to_child(&moved) / seconds,
            }
        };
        let contacts: PerFinger<Pressing> = (0..model.n_fingers()).map(pressing).collect();
        let choice = if self.is_always_strong { choice } else { Choice::Best };
        let forces = balance(&contacts, &load, near, choice).map_err(|_| NoStep::Unbalanced)?;
        if self.is_always_strong {
            return Ok(forces);
        }
        let is_strong = |finger: usize| {
            let contact = object.point(&contacts[finger].point);
            let torques = self.torques(here, finger, &contact, &object.vector(&forces[finger]));
            self.forces.allows(finger, &torques)
        };
        if (0..model.n_fingers()).all(is_strong) { Ok(forces) } else { Err(NoStep::Unbalanced) }
    }

    /// How the object would begin to turn in these roles, along `wanted` or against it; none where the contacts tell no motion.
    pub fn beginning(&self, grasp: &TrackingGrasp, roles: Roles, wanted: &Vector) -> Option<Beginning> {
        let model = self.model;
        let resting: PerFinger<usize> = each(model.all_fingers() & !roles.moving).collect();
        let motion = ObjectMotion::new(model, grasp, &resting, roles.rolling, wanted)?;
        let (_, allowed) = motion.twist(wanted);
        let seconds = self.settings.time_step;
        let turn = allowed * (self.settings.object_velocity * seconds / allowed.amax());
        let (object, touches) = motion.step(&turn)?;
        let mut end = grasp.clone();
        end.world_from_object = object;
        for (&finger, touch) in resting.iter().zip(&touches) {
            end.touches[finger] = *touch;
        }
        let asked = Asked { roles, turn: Some(turn), rolled: Controls::default(), seconds };
        let relative = self.relative(grasp, &end, &asked).ok()?;
        Some(Beginning { turn, end, relative })
    }

    /// True where forces hold the object at the beginning of `beginning`, which is at `grasp`, under `weight`, in the world: it need not be
    /// the object's own. Forces are all that counts.
    pub fn is_held_under(&self, weight: &Vector, grasp: &TrackingGrasp, beginning: &Beginning) -> bool {
        let step = (&beginning.relative, self.settings.time_step);
        self.balanced_under(weight, (grasp, grasp, &beginning.end), step, None, Choice::Any).is_ok()
    }

    /// What forces have to do with the object at `object`; `weight` is in the world.
    fn load(&self, weight: &Vector, object: &Placement) -> Load {
        let frame = &self.model.frame;
        Load {
            weight: object.vector_to_child(weight),
            center_of_mass: frame.center_of_mass,
            torque_scale: frame.torque_scale,
            friction: frame.friction,
            sliding_friction: self.model.view.object.friction,
            limits: *self.forces.limits(),
            cones: self.settings.cones,
        }
    }

    /// Torques of a finger that exerts `force` at `contact`, both in the world.
    pub fn torques(&self, grasp: &TrackingGrasp, finger: usize, contact: &Point, force: &Vector) -> Coordinates {
        torques(self.model.fingers[finger].ik.chain(), &grasp.joints[finger], contact, force)
    }
}

/// Where the object is half-way in a step.
fn object_half_way(grasp: &TrackingGrasp, end: &TrackingGrasp) -> Placement {
    let [from, to] = [grasp, end].map(|grasp| grasp.world_from_object.to_pose());
    Placement::from(&interpolate_pose(&from, &to, 0.5))
}

/// How far a ball twists about its normal in the two halves of a step, of which these are the rotations in the object frame and the normals
/// at both ends. It does not twist on the whole, but half-way joints and object are in the middle of ways of their own.
fn twist_by_halves(rotations: &[Matrix3<f64>; 3], [first, last]: [&Vector; 2]) -> f64 {
    let twist = |half: usize, normal: Vector| {
        turn_between(&rotations[half], &rotations[half + 1]).dot(&normal.normalize()).abs()
    };
    twist(0, 3.0 * first + last) + twist(1, first + 3.0 * last)
}
