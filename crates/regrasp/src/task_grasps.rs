//! Grasp lists of a task of pick and place: those that the scene names, and those that are made because it names none.

use crate::{Failure, GraspList, GraspSettings, list_grasps};
use regrasp_base::diagnostic::number;
use regrasp_base::{Budget, Diagnostic, InputError, Place, files};
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::held_at_most;
use regrasp_grasp::list::{GraspKind, format};
use regrasp_planners::FailureKind;
use regrasp_robot::manipulator::MountedHand;
use regrasp_robot::{Hand, LinkId, Robot};
use regrasp_scene::{GRASP_TOLERANCE, GraspFile, InputFile, Object, PickAndPlaceQuery, STANDARD_GRAVITY, Scene};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Grasps of a list that is made for a task. By hand: paper and scenes find plans with 20 to 40.
pub const GRASPS_OF_A_TASK: usize = 40;
/// Masses and frictions of list and scene may differ by this share: rounding.
const ROUNDING: f64 = 1e-9;
/// Centres of mass of list and scene may differ by this much, in metres.
const CENTER_TOLERANCE: f64 = 1e-6;

/// The lists of a task, each with its hand, by index in `Scene::hands`; in the order of the hands.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TaskGrasps {
    /// What was read or made.
    pub lists: Vec<(usize, GraspList)>,
    /// Hands of the robot that have no list.
    pub missing: Vec<usize>,
}

impl TaskGrasps {
    /// Adds the list of a hand that had none.
    pub fn add(&mut self, hand: usize, list: GraspList) {
        self.missing.retain(|missing| *missing != hand);
        self.lists.push((hand, list));
        self.lists.sort_by_key(|(hand, _)| *hand);
    }
}

/// Reads the lists that the scene names for the object of `query` and the hands of its robot. What a scene names for other objects is
/// not read.
///
/// Errors: a file that cannot be read; what [`format::from_json`] refuses; the list of another hand (`G740`) or of another object
/// (`G741`).
pub fn read_grasps(scene: &Scene, query: &PickAndPlaceQuery) -> Result<TaskGrasps, InputError> {
    let mut read = TaskGrasps::default();
    for hand in hands_of(scene, query) {
        let is_its = |file: &&GraspFile| file.hand == hand && file.object == query.object;
        match scene.grasp_files.iter().find(is_its) {
            Some(file) => read.lists.push((hand, read_list(&file.path, scene, query, hand)?)),
            None => read.missing.push(hand),
        }
    }
    Ok(read)
}

/// The hands that the robot of `query` carries, by index in `Scene::hands`.
pub fn hands_of(scene: &Scene, query: &PickAndPlaceQuery) -> Vec<usize> {
    let is_its = |&hand: &usize| scene.hands[hand].carrier.is_some_and(|carrier| carrier.robot == query.robot);
    (0..scene.hands.len()).filter(is_its).collect()
}

/// Reads the list at `path` for one hand and the object of `query`.
///
/// Errors: as [`read_grasps`].
pub fn read_list(path: &Path, scene: &Scene, query: &PickAndPlaceQuery, hand: usize) -> Result<GraspList, InputError> {
    let bytes = files::read(path)?;
    let list = format::from_json(path, &bytes)?;
    refuse_other_hand(path, &list, &scene.hands[hand].name, &scene.hands[hand].hand)?;
    refuse_other_hand_file(path, &list, scene, hand)?;
    refuse_other_object(path, &list, scene, query)?;
    Ok(list)
}

/// True where `own`, a name in the robot's tree, is `listed` in the hand's own file.
fn is_named(own: &str, listed: &str) -> bool {
    own == listed || own.strip_suffix(listed).is_some_and(|front| front.ends_with('/'))
}

/// Errors: other fingers, joints or base link (`G740`).
fn refuse_other_hand(path: &Path, list: &GraspList, name: &str, hand: &Hand) -> Result<(), InputError> {
    let fingers: Vec<String> = hand.fingers.iter().map(|finger| finger.name.clone()).collect();
    let base = hand.robot.links[hand.base.0].name.clone();
    let record = &list.hand;
    let pairs = [
        ("base link", vec![base], std::slice::from_ref(&record.base_link)),
        ("fingers", fingers, record.fingers.as_slice()),
        ("joints", hand.joint_names(), record.joint_names.as_slice()),
    ];
    for (what, own, listed) in pairs {
        let is_same = own.len() == listed.len() && own.iter().zip(listed).all(|(own, listed)| is_named(own, listed));
        if !is_same {
            let problem = format!("is a list of hand \"{}\", with {what} {}", record.name, listed.join(", "));
            let diagnostic = Diagnostic::new("G740", Place::file(path), problem).element("hand", name);
            return Err(diagnostic.expected(format!("{what} {}", own.join(", "))).fix(MAKE_AGAIN).into());
        }
    }
    Ok(())
}

/// Left and right hands often have the same names: their files tell them apart. Errors: another hand file (`G740`).
fn refuse_other_hand_file(path: &Path, list: &GraspList, scene: &Scene, hand: usize) -> Result<(), InputError> {
    let placed = &scene.hands[hand];
    let carrier = placed.carrier.map(|carrier| &scene.robots[carrier.robot].hands[carrier.hand]);
    let file = carrier.and_then(|mounted| mounted.file.as_ref());
    let is_its = |input: &&InputFile| input.role == "hand" && Some(&input.path) == file;
    let (Some(own), Some(listed)) =
        (scene.inputs.iter().find(is_its), list.inputs.iter().find(|input| input.role == "hand"))
    else {
        return Ok(());
    };
    if own.sha256 == listed.sha256 {
        return Ok(());
    }
    let problem = format!("was made with the hand file {} (sha256 {})", listed.name, listed.sha256);
    let diagnostic = Diagnostic::new("G740", Place::file(path), problem).element("hand", &placed.name);
    let expected = format!("the hand file {} (sha256 {})", own.name, own.sha256);
    Err(diagnostic.expected(expected).fix(MAKE_AGAIN).into())
}

/// What helps against a list that is not for this hand and object.
const MAKE_AGAIN: &str =
    "name the list of this hand and object, make it with `regrasp grasps`, or leave it out of `grasps`";

/// Errors: another mass, centre of mass, friction, shape or mesh (`G741`).
fn refuse_other_object(
    path: &Path,
    list: &GraspList,
    scene: &Scene,
    query: &PickAndPlaceQuery,
) -> Result<(), InputError> {
    let object = &scene.objects[query.object];
    let refuse = |problem: String, expected: String| -> Result<(), InputError> {
        let diagnostic = Diagnostic::new("G741", Place::file(path), problem).element("object", &object.name);
        Err(diagnostic.expected(expected).fix(MAKE_AGAIN).into())
    };
    let numbers = [
        ("mass", "kg", list.object.mass, object.mass),
        ("friction", "between fingertip and object", list.object.friction, object.friction),
    ];
    for (what, unit, listed, own) in numbers {
        if (listed - own).abs() > ROUNDING * own {
            let problem = format!("counts on a {what} of {} {unit}", number(listed));
            return refuse(problem, format!("{} {unit}, as the scene says", number(own)));
        }
    }
    let off = (Vector::from(list.object.center_of_mass) - object.center_of_mass.coords).norm();
    if off > CENTER_TOLERANCE {
        let [x, y, z] = list.object.center_of_mass.map(number);
        let own: [f64; 3] = object.center_of_mass.into();
        let [a, b, c] = own.map(number);
        let problem = format!("has the centre of mass [{x}, {y}, {z}] m");
        return refuse(problem, format!("[{a}, {b}, {c}] m, as the scene's object has"));
    }
    for (index, grasp) in list.grasps.iter().enumerate() {
        for contact in &grasp.contacts {
            let point = Point::from(contact.point_in_object);
            let off = (object.surface.project(&point).point_in_object - point).norm();
            if off > GRASP_TOLERANCE {
                let problem = format!(
                    "has a contact of finger \"{}\" in grasp {index} that is {:.2} mm off the object's surface",
                    contact.finger,
                    1e3 * off
                );
                return refuse(problem, format!("contacts within {:.1} mm of it", 1e3 * GRASP_TOLERANCE));
            }
        }
    }
    let mut meshes = list.inputs.iter().filter(|input| input.role == "mesh");
    let known: BTreeSet<&str> = scene.inputs.iter().map(|input| input.sha256.as_str()).collect();
    match meshes.find(|input| !known.contains(input.sha256.as_str())) {
        Some(input) => {
            let problem = format!("was made with the mesh {} (sha256 {})", input.name, input.sha256);
            refuse(problem, "a mesh that this scene reads too".into())
        }
        None => Ok(()),
    }
}

/// Settings of the lists that are made for tasks: those of `regrasp grasps`, with fewer grasps, and the kind that fits the hand.
pub fn settings_of_made_lists(hand: &Hand, n_threads: usize) -> GraspSettings {
    GraspSettings { kind: kind_for(hand), grasps: GRASPS_OF_A_TASK, n_threads, ..GraspSettings::default() }
}

/// How a hand like this takes objects.
pub fn kind_for(hand: &Hand) -> GraspKind {
    let fewest = hand.fingers.iter().map(|finger| finger.rest.len()).min().unwrap_or(0);
    match (hand.fingers.len(), fewest) {
        (2, 0..=1) => GraspKind::Gripper,
        (_, 0..=2) => GraspKind::Closing,
        _ => GraspKind::Precision,
    }
}

/// Refuses an object that is too heavy for every hand of the robot, before any list is made: all fingertips of a hand together, at the largest
/// normal force, press with less than its weight.
///
/// Errors: the weight, and what the strongest hand holds at most.
pub fn refuse_too_heavy(scene: &Scene, query: &PickAndPlaceQuery) -> Result<(), Failure> {
    let object = &scene.objects[query.object];
    let settings = GraspSettings::default();
    let normal_force = settings.forces.normal_force[1].min(scene.limits.normal_force);
    let friction = object.friction / settings.friction_margin;
    let of_hand = |hand: usize| (held_at_most(scene.hands[hand].hand.fingers.len(), normal_force, friction), hand);
    let strongest = hands_of(scene, query).into_iter().map(of_hand).max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((held, hand)) = strongest else { return Ok(()) };
    let weight = object.mass * STANDARD_GRAVITY;
    if weight <= held {
        return Ok(());
    }
    let message = format!(
        "start: \"{}\" weighs {weight:.0} N, and the fingertips of hand \"{}\" press with at most {held:.0} N together",
        object.name, scene.hands[hand].name
    );
    let advice = "name a lighter object, or a larger normal_force in [limits]";
    Err(Failure::bare(FailureKind::StartInvalid, message, advice))
}

/// Makes the list of a hand that a robot carries and of the object of `query`, from what the scene knows: no file is read. Names are
/// those of the hand's own file.
///
/// Errors: why there is no grasp.
pub fn make_list(
    scene: &Scene,
    query: &PickAndPlaceQuery,
    hand: usize,
    (settings, seed): (&GraspSettings, u64),
    budget: &Budget,
) -> Result<GraspList, Failure> {
    let (object, name) = (&scene.objects[query.object], &scene.hands[hand].name);
    let alone = match scene.hands[hand].carrier {
        Some(carrier) => alone(&scene.robots[carrier.robot].hands[carrier.hand]),
        None => scene.hands[hand].hand.clone(),
    };
    let list = list_grasps(&alone, object, settings, seed, budget).map_err(|mut failure| {
        failure.message = format!("hand \"{name}\": {}", failure.message);
        failure
    })?;
    Ok(in_own_names(list, name, object))
}

/// The hand without the robot that carries it: links that it does not bring have no geometry.
fn alone(mounted: &MountedHand) -> Hand {
    let own = links_below(&mounted.hand.robot, mounted.top);
    let mut robot = Robot::clone(&mounted.hand.robot);
    let others = robot.links.iter_mut().enumerate().filter(|(index, _)| !own.contains(&LinkId(*index)));
    others.for_each(|(_, link)| link.collision.clear());
    Hand { robot: Arc::new(robot), ..mounted.hand.clone() }
}

/// A link and all that hangs on it.
fn links_below(robot: &Robot, top: LinkId) -> BTreeSet<LinkId> {
    let (mut below, mut waiting) = (BTreeSet::new(), vec![top]);
    while let Some(link) = waiting.pop() {
        if below.insert(link) {
            waiting.extend(robot.joints_from(link).map(|joint| robot.joints[joint.0].child));
        }
    }
    below
}

/// The list with the names of the hand's own file: the tree puts `HAND/` in front.
fn in_own_names(mut list: GraspList, hand: &str, object: &Object) -> GraspList {
    let front = format!("{hand}/");
    let own = |name: &mut String| {
        if let Some(rest) = name.strip_prefix(&front) {
            *name = rest.to_owned();
        }
    };
    own(&mut list.hand.base_link);
    list.hand.joint_names.iter_mut().for_each(own);
    list.grasps.iter_mut().flat_map(|grasp| &mut grasp.contacts).for_each(|contact| own(&mut contact.link));
    hand.clone_into(&mut list.hand.name);
    object.name.clone_into(&mut list.object.name);
    list
}
