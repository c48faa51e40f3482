//! Scene, robot and grasps, prepared once.

use crate::failing::refused;
use crate::posture::Rest;
use nalgebra::{Matrix3, Translation3};
use regrasp_arms::model::cover::{LinkCover, cover, covers};
use regrasp_arms::model::{ArmModel, Attached};
use regrasp_arms::plan::problem::surroundings;
use regrasp_arms::times::Limits;
use regrasp_arms::world::Obstacle;
use regrasp_arms::{Covers, World};
use regrasp_base::Budget;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_grasp::list::{GraspList, ListedGrasp};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::forces::held::Held;
use regrasp_manipulation::grasp::state::{Contacts, MAX_FINGERS, no_contact};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::motion_settings::{MotionSettings, PartsMove};
use regrasp_manipulation::settings::PhysicsSettings;
use regrasp_manipulation::task_settings::TaskSettings;
use regrasp_plan::robot_plan::HoldingPromises;
use regrasp_robot::Manipulator;
use regrasp_robot::kinematics::arm_ik::ArmIk;
use regrasp_robot::manipulator::layout::Part;
use regrasp_scene::motion::{CarriedObject, Holder};
use regrasp_scene::{HandView, MotionGoal, MotionQuery, Object, PickAndPlaceQuery, Scene, State};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

/// What hands of a task see, which their models borrow.
pub struct Prepared<'a> {
    views: Vec<HandView<'a>>,
    lists: Vec<&'a GraspList>,
    physics: PhysicsSettings,
    /// What the plan promises about holding.
    pub promises: HoldingPromises,
}

/// A grasp of a list.
pub struct Grasp {
    /// Its index in the list.
    pub index: usize,
    /// Pose of the hand's base in the object frame.
    pub object_from_hand: Pose,
    /// Direction in which the hand comes, in the object frame.
    pub direction: Vector,
    /// How far.
    pub distance: f64,
    /// Finger joints of the open hand.
    pub open: Vec<f64>,
    /// Finger joints that hold.
    pub closed: Vec<f64>,
    /// Forces.
    pub held: Held,
    /// From 0 to 1.
    pub score: f64,
    /// Indices of the list's stable poses in which the hand stays above the support.
    pub stable_poses: Vec<usize>,
}

/// A hand that can take the object.
pub struct TaskHand<'a> {
    /// Index in `Scene::hands`.
    pub index: usize,
    /// Index in `Manipulator::hands`.
    pub mounted: usize,
    /// Index of its arm in `Manipulator::arms`.
    pub arm: usize,
    /// Inverse kinematics of the arm.
    pub ik: ArmIk,
    /// Pose of the arm's mount link in the frame of the hand's base.
    pub hand_from_mount: Pose,
    /// Its finger joints in states.
    pub fingers: Range<usize>,
    /// The joints of its arm in states.
    pub arm_joints: Range<usize>,
    /// Hand and object.
    pub model: &'a Model<'a>,
    /// Its grasps.
    pub list: &'a GraspList,
    /// Those that hold, best score first.
    pub grasps: Vec<Grasp>,
}

/// All that planning needs.
pub struct Context<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What is asked.
    pub query: &'a PickAndPlaceQuery,
    /// The robot.
    pub robot: &'a Manipulator,
    /// The object.
    pub object: &'a Object,
    /// Settings.
    pub settings: &'a TaskSettings,
    /// Settings of single motions.
    pub motion: MotionSettings,
    /// Covers of links and object.
    pub covers: Arc<Covers>,
    /// Everything that rests, without the object.
    pub fixed: Arc<World>,
    /// The object alone, in its own frame.
    pub alone: World,
    /// Hands that can take the object.
    pub hands: Vec<TaskHand<'a>>,
    /// The rest posture, and what others cost against it.
    pub natural: Rest,
    /// Limits of all coordinates.
    pub limits: Limits,
    /// Acceleration of gravity in the world.
    pub gravity: Vector,
    /// Inertia of the object about its centre of mass.
    pub inertia: Matrix3<f64>,
    /// All coordinates that are no finger's.
    pub arms_and_torso: Vec<usize>,
    /// Where everything rests that the task does not move.
    pub rest: State,
    /// What hands count on.
    pub physics: &'a PhysicsSettings,
    /// What the plan promises about holding.
    pub promises: &'a HoldingPromises,
    /// Seed.
    pub seed: u64,
    /// How much may be looked at.
    pub budget: &'a Budget,
}

impl<'a> Prepared<'a> {
    /// Errors: lists of other hands or objects; a gravity without direction; a robot without a list.
    pub fn new(
        scene: &'a Scene,
        query: &PickAndPlaceQuery,
        lists: &'a [(usize, GraspList)],
        settings: &TaskSettings,
    ) -> Result<Self, Failure> {
        let object = &scene.objects[query.object];
        if scene.gravity().in_world().is_none() {
            let message = "start: the scene's gravity has no direction, so that nothing rests on a support".to_owned();
            return Err(refused(FailureKind::Impossible, message, "give gravity a direction"));
        }
        let mut prepared = Prepared {
            views: Vec::new(),
            lists: Vec::new(),
            physics: PhysicsSettings { forces: Some(settings.forces), ..PhysicsSettings::default() },
            promises: HoldingPromises {
                contact_tolerance: regrasp_manipulation::tolerances::CONTACT_TOLERANCE,
                friction_margin: 1.0,
                required_margin: f64::INFINITY,
                torque_scale: object.radius,
                normal_force: settings.forces.normal_force,
            },
        };
        let promises = &mut prepared.promises;
        let mut friction_margin = f64::INFINITY;
        for (hand, list) in lists {
            let Some(placed) = scene.hands.get(*hand) else { continue };
            if placed.carrier.is_none_or(|carrier| carrier.robot != query.robot) {
                let message = format!("grasp lists: the robot does not carry the hand \"{}\"", placed.name);
                return Err(refused(FailureKind::Impossible, message, "give lists of the hands of this robot"));
            }
            if list.hand.joint_names.len() != placed.hand.n_joints() {
                let message = format!(
                    "grasp lists: a list for the hand \"{}\" has {} joints, and the hand has {}",
                    placed.name,
                    list.hand.joint_names.len(),
                    placed.hand.n_joints()
                );
                return Err(refused(FailureKind::Impossible, message, "make the list with this hand"));
            }
            friction_margin = friction_margin.min(list.promises.friction_margin);
            promises.required_margin = promises.required_margin.min(list.promises.required_margin);
            promises.normal_force[0] = promises.normal_force[0].max(list.promises.normal_force[0]);
            promises.normal_force[1] = promises.normal_force[1].min(list.promises.normal_force[1]);
            prepared.lists.push(list);
            prepared.views.push(HandView {
                hand_index: *hand,
                object_index: query.object,
                hand_name: &placed.name,
                hand: &placed.hand,
                held_joints: placed.held_joints(),
                world_from_hand: Pose::identity(),
                reach: None,
                object,
                obstacles: Cow::Borrowed(&[]),
                n_beside_palm: 0,
                gravity: scene.gravity(),
                limits: scene.limits,
                inputs: &[],
            });
        }
        if prepared.views.is_empty() {
            let message = format!("grasp lists: there is no list of grasps of \"{}\"", object.name);
            return Err(refused(FailureKind::Impossible, message, "make lists with `regrasp grasps`"));
        }
        let physics = &mut prepared.physics;
        physics.friction_margin = friction_margin.max(1.0);
        let forces = regrasp_manipulation::settings::ForceSettings {
            normal_force: prepared.promises.normal_force,
            squeeze: settings
                .forces
                .squeeze
                .clamp(prepared.promises.normal_force[0], prepared.promises.normal_force[1]),
            ..settings.forces
        };
        forces.validate().map_err(|problem| Failure::of_settings(&problem))?;
        physics.forces = Some(forces);
        // The scene's limits bound both.
        let within = physics.within(&scene.limits);
        prepared.promises.friction_margin = within.friction_margin;
        if let Some(forces) = within.forces {
            prepared.promises.normal_force = forces.normal_force;
        }
        Ok(prepared)
    }

    /// Hand and object of each list.
    pub fn models(&self) -> Vec<Model<'_>> {
        self.views.iter().map(|view| Model::new(view, &self.physics)).collect()
    }
}

impl<'a> Context<'a> {
    /// Errors: no hand has a grasp that holds.
    pub fn new(
        (scene, state): (&'a Scene, &State),
        query: &'a PickAndPlaceQuery,
        (prepared, models): (&'a Prepared<'a>, &'a [Model<'a>]),
        settings: &'a TaskSettings,
        (seed, budget): (u64, &'a Budget),
    ) -> Result<Self, Failure> {
        let robot = &scene.robots[query.robot];
        let object = &scene.objects[query.object];
        let carried = CarriedObject {
            object: query.object,
            holder: Holder::Arm(0),
            world_from_object: query.world_from_object_start,
        };
        // The object counts as carried: it is left out.
        let motion = MotionQuery { carried: vec![carried], ..motion_of(query, query.start.clone(), query.end.clone()) };
        let fixed = Arc::new(World::new(surroundings(scene, state, &motion)));
        let own = PlacedShape { parent_from_shape: Pose::identity(), shape: object.solid().clone() };
        let covers = Covers {
            links: links_with_tips(robot),
            objects: BTreeMap::from([(query.object, cover(std::slice::from_ref(&own)))]),
        };
        let mut hands = Vec::new();
        for ((view, list), model) in prepared.views.iter().zip(&prepared.lists).zip(models) {
            hands.extend(task_hand(robot, scene, view.hand_index, list, model, &prepared.promises));
        }
        if hands.iter().all(|hand| hand.grasps.is_empty()) {
            let message = format!(
                "grasp lists: no grasp of \"{}\" is of a hand on an arm of six joints or more and closes the object with the scene's \
                 friction",
                object.name
            );
            return Err(refused(FailureKind::Impossible, message, "make longer lists of this object"));
        }
        let coordinates = &robot.layout.coordinates;
        let is_finger = |k: usize| matches!(coordinates[k].part, Part::Hand(_));
        let all: Vec<usize> = (0..coordinates.len()).collect();
        let inertia = regrasp_geometry::mass::solid_properties(&object.shape).map_or_else(
            |_| Matrix3::from_diagonal_element(0.4 * object.mass * object.radius * object.radius),
            |solid| solid.inertia_per_density * (object.mass / solid.volume),
        );
        let gravity = scene.gravity().in_world().unwrap_or_else(Vector::zeros);
        let up = (-gravity).try_normalize(1e-9).unwrap_or_else(Vector::zeros);
        Ok(Context {
            scene,
            query,
            robot,
            object,
            settings,
            motion: MotionSettings {
                clearance: settings.clearance,
                method: settings.method,
                parts: settings.parts,
                largest_rounding: match settings.parts {
                    PartsMove::AtOnce => MotionSettings::default().largest_rounding,
                    PartsMove::InTurn => 0.0,
                },
                search_margin: settings.search_margin,
                shortcuts: settings.shortcuts,
                max_samples: settings.max_samples,
                ..MotionSettings::default()
            },
            covers: Arc::new(covers),
            fixed,
            alone: World::new(vec![Obstacle { name: object.name.clone(), placed: own }]),
            hands,
            natural: Rest::new(robot, &up, settings.posture),
            limits: regrasp_arms::plan::limits(scene, robot, &all),
            gravity,
            inertia,
            arms_and_torso: all.iter().copied().filter(|&k| !is_finger(k)).collect(),
            rest: state.clone(),
            physics: &prepared.physics,
            promises: &prepared.promises,
            seed,
            budget,
        })
    }

    /// Up, against gravity.
    pub fn up(&self) -> Vector {
        -self.gravity.normalize()
    }

    /// Everything that rests, with the object at a pose.
    pub fn with_object(&self, world_from_object: &Pose) -> World {
        self.fixed.with(&self.alone, world_from_object)
    }

    /// The robot with coordinates `free`, all others as in `state`; carrying the object where `carried` says by which hand and where it
    /// is in the frame of that hand.
    pub fn model(&self, state: &[f64], free: &[usize], carried: Option<(usize, &Pose)>) -> ArmModel {
        let attached: Vec<Attached> = carried.iter().map(|(hand, pose)| self.attached(*hand, pose, &[])).collect();
        ArmModel::new(self.robot, &self.covers.links, &attached, state, free)
    }

    /// The object in the hand `hand`; the hands of `others` touch it too.
    pub fn attached(&self, hand: usize, hand_from_object: &Pose, others: &[usize]) -> Attached {
        let mut may_touch = BTreeSet::new();
        for &holder in [hand].iter().chain(others) {
            let mounted = self.hands[holder].mounted;
            let links = (0..self.robot.robot.links.len()).map(regrasp_robot::LinkId);
            may_touch.extend(links.filter(|link| self.robot.part_of(*link) == Part::Hand(mounted)));
        }
        Attached {
            name: self.object.name.clone(),
            link: self.robot.hands[self.hands[hand].mounted].hand.base,
            cover: self.covers.objects[&self.query.object].moved(hand_from_object),
            may_touch,
        }
    }

    /// Where the base of a hand is.
    pub fn world_from_hand(&self, hand: usize, state: &[f64]) -> Pose {
        self.robot.world_from_hand(self.hands[hand].mounted, state)
    }

    /// Coordinates of the common part that move the arm of a hand.
    pub fn common_above(&self, hand: usize) -> Vec<usize> {
        let above = self.robot.coordinates_above(self.robot.arms[self.hands[hand].arm].mount);
        let coordinates = &self.robot.layout.coordinates;
        above.into_iter().filter(|&k| coordinates[k].part == Part::Common).collect()
    }

    /// Name of a hand in the scene.
    pub fn hand_name(&self, hand: usize) -> &'a str {
        &self.scene.hands[self.hands[hand].index].name
    }
}

/// A query of a motion of the task's robot.
pub fn motion_of(query: &PickAndPlaceQuery, start: Vec<f64>, goal: Vec<f64>) -> MotionQuery {
    MotionQuery {
        name: query.name.clone(),
        robot: query.robot,
        start,
        goal: MotionGoal::Joints(goal),
        carried: Vec::new(),
    }
}

/// Covers of the links, with fingertips that are no collision geometry.
fn links_with_tips(robot: &Manipulator) -> Vec<LinkCover> {
    let mut links = covers(&robot.robot);
    let rest = robot.layout.rest();
    let mut poses = Vec::new();
    robot.link_poses(&rest, &mut poses);
    for (index, mounted) in robot.hands.iter().enumerate() {
        let joints = robot.finger_joints(index, &rest);
        let world_from_hand = poses[mounted.hand.base.0];
        let mut first = 0;
        for finger in &mounted.hand.fingers {
            let n = finger.chain.n_coordinates();
            let own = &joints[first..first + n];
            first += n;
            let Some(tip) = finger.tip.own_shape() else { continue };
            let last = finger.chain.last_frame(own);
            let hand_from_body = pose_of(&last);
            let link = finger.tip.link.0;
            let link_from_body = poses[link].inverse() * world_from_hand * hand_from_body;
            let mut shapes = robot.robot.links[link].collision.clone();
            shapes.push(PlacedShape {
                parent_from_shape: link_from_body * tip.parent_from_shape,
                shape: tip.shape.clone(),
            });
            links[link] = cover(&shapes);
        }
    }
    links
}

fn pose_of(frame: &regrasp_robot::kinematics::body_frame::BodyFrame) -> Pose {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(frame.rotation);
    Pose::from_parts(Translation3::from(frame.translation), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

/// None for a hand that no arm of six joints carries.
fn task_hand<'a>(
    robot: &Manipulator,
    scene: &Scene,
    index: usize,
    list: &'a GraspList,
    model: &'a Model<'a>,
    promises: &HoldingPromises,
) -> Option<TaskHand<'a>> {
    let mounted = scene.hands[index].carrier?.hand;
    let arm = robot.hands[mounted].arm?;
    let ik = ArmIk::new(robot, arm).ok()?;
    let mut poses = Vec::new();
    robot.link_poses(&robot.layout.rest(), &mut poses);
    let base = robot.hands[mounted].hand.base;
    let hand_from_mount = poses[base.0].inverse() * poses[robot.arms[arm].mount.0];
    let first = robot.layout.range(Part::Hand(mounted)).start;
    let first_of_arm = robot.layout.range(Part::Arm(arm)).start;
    let grasps = list.grasps.iter().enumerate();
    let grasps = grasps.filter_map(|(index, listed)| grasp(index, listed, model, promises));
    Some(TaskHand {
        index,
        mounted,
        arm,
        ik,
        hand_from_mount,
        fingers: first..first + robot.hands[mounted].hand.n_joints(),
        arm_joints: first_of_arm..first_of_arm + robot.arms[arm].chain.n_coordinates(),
        model,
        list,
        grasps: grasps.collect(),
    })
}

/// None where the grasp does not close the object with the friction that is counted on.
fn grasp(index: usize, listed: &ListedGrasp, model: &Model, promises: &HoldingPromises) -> Option<Grasp> {
    let hand = model.view.hand;
    let mut contacts: Contacts = (0..model.n_fingers()).map(|_| no_contact()).collect();
    let mut holding = 0u32;
    for contact in &listed.contacts {
        let finger = hand.finger_named(&contact.finger)?.0;
        holding |= 1 << finger;
        contacts[finger] = Contact {
            point_in_object: contact.point_in_object.into(),
            normal_in_object: UnitVector::new_normalize(Vector::from(contact.normal_in_object)),
        };
    }
    if holding == 0 || model.n_fingers() > MAX_FINGERS {
        return None;
    }
    if model.closure_margin_up_to(&contacts, holding, promises.required_margin) < promises.required_margin {
        return None;
    }
    let object_from_hand = Pose::from(&listed.object_from_hand);
    let mut rest = listed.joints.iter().copied();
    let joints: Vec<Vec<f64>> =
        hand.fingers.iter().map(|finger| rest.by_ref().take(finger.chain.n_coordinates()).collect()).collect();
    let placement = Placement::from(&object_from_hand.inverse());
    let forces = model.forces.as_ref()?;
    let held = Held::new(model, forces, &placement, &contacts, holding, |finger| &joints[finger]);
    Some(Grasp {
        index,
        object_from_hand,
        direction: Vector::from(listed.approach.direction_in_object),
        distance: listed.approach.distance,
        open: listed.open_joints.clone(),
        closed: listed.joints.clone(),
        held,
        score: listed.score,
        stable_poses: listed.stable_poses.clone(),
    })
}
