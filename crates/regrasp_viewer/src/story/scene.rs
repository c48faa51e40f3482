//! A scene told body by body: hands, parts of robots, objects, supports, obstacles.

use super::links::{Drives, Tree};
use super::pieces::{DrawnLinks, Pieces};
use super::{Carrier, FingerStory, HandStory, JointStory, ObjectStory, PoseData, RobotPartStory, SceneStory};
use regrasp_geometry::Pose;
use regrasp_robot::{Hand, JointId, LinkId, Manipulator, Part, ResolveOptions};
use regrasp_scene::{Manipulation, is_of_hand};

/// The scene, with remarks on what could not be shown as it is. Visual meshes are looked for in `packages`.
pub(super) fn scene_story(task: &Manipulation, packages: &ResolveOptions) -> (SceneStory, Vec<(String, String)>) {
    let scene = task.scene;
    let mut pieces = Pieces::new(packages);
    let mut hands: Vec<HandStory> = Vec::new();
    let add_hand = |index: usize, pieces: &mut Pieces| {
        let tree = tree_of_hand(task, index);
        let placed = &scene.hands[index];
        let of_body = if index == task.hand_index { String::new() } else { format!(" of {}", placed.name) };
        pieces.add_links(&DrawnLinks {
            robot: &placed.hand.robot,
            fingers: &placed.hand.fingers,
            tree: &tree,
            own: &|link| drawn_with(task, index, link),
            on: &|place| Carrier::Hand(index, place),
            of_body: &of_body,
        });
        hand_story(task, index, tree)
    };
    let moving = add_hand(task.hand_index, &mut pieces);
    add_bodies(task, &mut pieces);
    let robot_parts = robot_parts(task, &mut pieces);
    for index in 0..scene.hands.len() {
        hands.push(if index == task.hand_index { moving.clone() } else { add_hand(index, &mut pieces) });
    }
    let (pieces, meshes, notes) = pieces.finish();
    let object = |(object, at_rest): (&regrasp_scene::Object, &Pose)| ObjectStory {
        name: object.name.clone(),
        world_from_object: PoseData::from(at_rest),
    };
    let story = SceneStory {
        hands,
        moving_hand: task.hand_index,
        robot_parts,
        objects: scene.objects.iter().zip(&task.state.world_from_objects).map(object).collect(),
        moved_object: task.object_index,
        supports: scene.supports.iter().map(|support| support.body.name.clone()).collect(),
        obstacles: scene.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
        friction: task.object().friction,
        gravity_in_world: scene.gravity().in_world().map(Into::into),
        meshes,
        pieces,
    };
    (story, notes)
}

/// Objects, the one that is moved first, obstacles and supports.
fn add_bodies(task: &Manipulation, pieces: &mut Pieces) {
    let scene = task.scene;
    let mut add_object =
        |index: usize| pieces.add_body(Carrier::Object(index), &Pose::identity(), &scene.objects[index].shape);
    add_object(task.object_index);
    (0..scene.objects.len()).filter(|index| *index != task.object_index).for_each(add_object);
    let obstacles = scene.obstacles.iter().enumerate().map(|(k, body)| (Carrier::Obstacle(k), body));
    let supports = scene.supports.iter().enumerate().map(|(k, support)| (Carrier::Support(k), &support.body));
    for (on, body) in obstacles.chain(supports) {
        pieces.add_body(on, &body.placed.parent_from_shape, &body.placed.shape);
    }
}

/// True where the pieces of `link` are drawn with the hand: of hands that share links, the one that moves, else the first.
fn drawn_with(task: &Manipulation, index: usize, link: LinkId) -> bool {
    let Some(carrier) = task.scene.hands[index].carrier else { return true };
    let hands = task.scene.hands.iter().enumerate();
    let mut same_robot = hands.filter(|(_, other)| other.carrier.is_some_and(|other| other.robot == carrier.robot));
    let comes_before = |other: usize| other != index && (other == task.hand_index || other < index);
    is_of_hand(task.scene, index, link)
        && (index == task.hand_index
            || !same_robot.any(|(other, _)| comes_before(other) && is_of_hand(task.scene, other, link)))
}

fn tree_of_hand(task: &Manipulation, index: usize) -> Tree {
    let placed = &task.scene.hands[index];
    let hand = &placed.hand;
    let fingers = (0i32..).zip(&hand.fingers);
    let fingers: Vec<i32> =
        fingers.flat_map(|(f, finger)| std::iter::repeat_n(f, finger.chain.n_coordinates())).collect();
    let by_itself = |joint: JointId| {
        let limits = hand.robot.joints[joint.0].limits;
        limits.map_or(0.0, |limits| 0f64.max(limits.lower).min(limits.upper))
    };
    let carried = placed.carrier.map(|carrier| {
        (&task.scene.robots[carrier.robot].layout, task.state.joints_of_robot(task.scene, carrier.robot))
    });
    let held = |joint: JointId| {
        let own = carried.as_ref().and_then(|(layout, joints)| {
            layout.coordinates.iter().position(|coordinate| coordinate.joint == joint).map(|k| joints[k])
        });
        own.unwrap_or_else(|| by_itself(joint))
    };
    let drives = Drives { names: &hand.joint_names(), fingers: &fingers, held: &held };
    let mut tree = Tree::new(&hand.robot, &|link| is_of_hand(task.scene, index, link), &drives);
    tree.place_hand(hand, &task.state.world_from_hand(task.scene, index));
    tree
}

fn hand_story(task: &Manipulation, index: usize, tree: Tree) -> HandStory {
    let placed = &task.scene.hands[index];
    let hand = &placed.hand;
    let limits = hand.fingers.iter().flat_map(|f| f.chain.lower.iter().copied().zip(f.chain.upper.iter().copied()));
    let names = hand.joint_names();
    let joints = names.iter().zip(limits).zip(&task.state.hand_joints[index]);
    let effort_of = |name: &str| hand.robot.joint_named(name).and_then(|id| hand.robot.joints[id.0].limits?.effort);
    let joint =
        |((name, limits), at_rest): ((&String, (f64, f64)), &f64)| joint_story(name, *at_rest, limits, effort_of(name));
    HandStory {
        name: placed.name.clone(),
        joints: joints.map(joint).collect(),
        fingers: fingers(hand, &tree),
        links: tree.links,
    }
}

fn joint_story(name: &str, at_rest: f64, (lower, upper): (f64, f64), effort: Option<f64>) -> JointStory {
    let finite = |value: f64| value.is_finite().then_some(value);
    JointStory { name: name.to_owned(), at_rest, lower: finite(lower), upper: finite(upper), effort }
}

fn fingers(hand: &Hand, tree: &Tree) -> Vec<FingerStory> {
    let story = |finger: &regrasp_robot::Finger| {
        let link = finger.tip.link;
        let center = hand.robot.fixed_pose_in_body(link).inverse() * finger.tip.center_in_body;
        FingerStory {
            name: finger.name.clone(),
            tip_link: tree.place_of(link),
            tip_center_in_link: center.coords.into(),
            tip_radius: finger.tip.radius(),
        }
    };
    hand.fingers.iter().map(story).collect()
}

/// Common parts and arms of all robots, without the links that count as a hand's.
fn robot_parts(task: &Manipulation, pieces: &mut Pieces) -> Vec<RobotPartStory> {
    let mut parts: Vec<RobotPartStory> = Vec::new();
    for (index, robot) in task.scene.robots.iter().enumerate() {
        let arms = (0..robot.arms.len()).map(Part::Arm);
        for part in std::iter::once(Part::Common).chain(arms) {
            let joints = task.state.joints_of_robot(task.scene, index);
            let own = |link| robot.part_of(link) == part && !is_of_any_hand(task, index, link);
            let (story, tree) = robot_part(robot, part, &joints, &own);
            if story.links.is_empty() {
                continue;
            }
            pieces.add_links(&DrawnLinks {
                robot: &robot.robot,
                fingers: &[],
                tree: &tree,
                own: &|_| true,
                on: &|place| Carrier::RobotPart(parts.len(), place),
                of_body: &format!(" of {}", story.name),
            });
            parts.push(story);
        }
    }
    parts
}

fn is_of_any_hand(task: &Manipulation, robot: usize, link: LinkId) -> bool {
    let hands = task.scene.hands.iter().enumerate();
    let mut of_robot = hands.filter(|(_, hand)| hand.carrier.is_some_and(|carrier| carrier.robot == robot));
    of_robot.any(|(index, _)| is_of_hand(task.scene, index, link))
}

/// A part of a robot at `state`, one value per coordinate of the robot.
fn robot_part(robot: &Manipulator, part: Part, state: &[f64], own: &dyn Fn(LinkId) -> bool) -> (RobotPartStory, Tree) {
    let range = robot.layout.range(part);
    let names: Vec<String> = robot.layout.coordinates[range.clone()].iter().map(|own| own.name.clone()).collect();
    let held = |joint: JointId| {
        let coordinates = robot.layout.coordinates.iter().zip(state);
        coordinates.filter(|(coordinate, _)| coordinate.joint == joint).map(|(_, position)| *position).sum()
    };
    let mut tree = Tree::new(&robot.robot, own, &Drives { names: &names, fingers: &[], held: &held });
    let mut world_from_link = Vec::new();
    robot.link_poses(state, &mut world_from_link);
    tree.place_part(&robot.robot, &world_from_link, robot.world_from_root());
    let name = match part {
        Part::Arm(arm) => format!("{}/{}", robot.name, robot.arms[arm].name),
        Part::Common | Part::Hand(_) => robot.name.clone(),
    };
    let joints = robot.layout.coordinates[range.clone()].iter().zip(&state[range]).map(|(joint, at_rest)| {
        let effort = robot.robot.joints[joint.joint.0].limits.and_then(|limits| limits.effort);
        joint_story(&joint.name, *at_rest, (joint.lower, joint.upper), effort)
    });
    (RobotPartStory { name, joints: joints.collect(), links: tree.links.clone() }, tree)
}
