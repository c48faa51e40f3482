//! What a plan of a whole robot is about: the robot, what it carries, and by what. Taken from the query, else from the plan.

use crate::check::continuity::same_positions;
use crate::check::robots::tree::{Frame, Tree};
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::robot_plan::RobotPlan;
use regrasp_geometry::Pose;
use regrasp_robot::{LinkId, Manipulator};
use regrasp_scene::motion::MOTION;
use regrasp_scene::{Holder, MotionQuery, Scene};

/// An object that the robot carries.
#[derive(Debug, Clone)]
pub struct Carried {
    /// Index in `Scene::objects`.
    pub object: usize,
    /// Index in `RobotPlan::objects`.
    pub in_plan: usize,
    /// Name of what holds it.
    pub holder: String,
    /// The link that it goes with.
    pub link: LinkId,
    /// The first link of what holds it.
    pub first_link: LinkId,
    /// The body of that link.
    pub body: usize,
    /// Where the object is in the frame of that body.
    pub body_from_object: Frame,
}

impl Carried {
    /// True for a link of what holds the object: its first link, and all links that this one carries.
    pub fn is_held_by(&self, robot: &Manipulator, link: LinkId) -> bool {
        let robot = &robot.robot;
        link == self.first_link || robot.joints_to(link).iter().any(|id| robot.joints[id.0].child == self.first_link)
    }
}

/// A plan's robot and what it carries.
pub struct Question<'a> {
    /// Index in `Scene::robots`.
    pub index: usize,
    /// The robot.
    pub robot: &'a Manipulator,
    /// The robot as the checker sees it.
    pub tree: Tree,
    /// Names of the joint vector.
    pub joint_names: Vec<String>,
    /// What it carries, all through the plan.
    pub carried: Vec<Carried>,
}

fn wrong(kind: Kind, message: String) -> Violation {
    Violation::new(kind, message)
}

impl<'a> Question<'a> {
    /// Err with a violation: the plan is of another task, robot, hand or object than the scene or the query.
    pub fn new(scene: &'a Scene, query: Option<&MotionQuery>, plan: &RobotPlan) -> Result<Self, Violation> {
        let asked = query.map(|query| (query.robot, query.name.as_str()));
        let mut question = Question::of_task(MOTION, scene, asked, plan)?;
        question.read_carried(scene, query, plan)?;
        Ok(question)
    }

    /// The robot of a plan for `task`, which carries nothing yet; `asked` has the robot and the name that the query says.
    ///
    /// Err with a violation: the plan is of another task or robot than the scene or the query.
    pub fn of_task(
        task: &str,
        scene: &'a Scene,
        asked: Option<(usize, &str)>,
        plan: &RobotPlan,
    ) -> Result<Self, Violation> {
        let of_scene = |message: String| wrong(Kind::WrongScene, message);
        if plan.task != task {
            return Err(of_scene(format!("the plan's task is \"{}\", not \"{task}\"", plan.task)));
        }
        let [of_plan] = plan.robots.as_slice() else {
            return Err(of_scene(format!("the plan moves {} robots; one is judged", plan.robots.len())));
        };
        let index = scene.robots.iter().position(|robot| robot.name == of_plan.name);
        let Some(index) = index.filter(|index| asked.is_none_or(|(robot, _)| robot == *index)) else {
            return Err(of_scene(format!("the plan's robot \"{}\" is not the one asked for", of_plan.name)));
        };
        if let Some((_, name)) = asked.filter(|(_, name)| *name != plan.query) {
            return Err(of_scene(format!("the plan answers the task \"{}\", not \"{name}\"", plan.query)));
        }
        let robot = &scene.robots[index];
        let joint_names = of_plan.joint_names.clone();
        if joint_names != robot.layout.names() {
            let expected = robot.layout.names().join(", ");
            return Err(of_scene(format!("the joints of the plan are not those of the robot: {expected}")));
        }
        if !same_positions(&of_plan.held_joints, &robot.held_joints) {
            let [seen, expected] = [&of_plan.held_joints, &robot.held_joints].map(|positions| format!("{positions:?}"));
            return Err(of_scene(format!("the plan's joints that stand still are {seen}, the robot's {expected}")));
        }
        let tree = Tree::of(robot, &joint_names).map_err(of_scene)?;
        Ok(Question { index, robot, tree, joint_names, carried: Vec::new() })
    }

    fn read_carried(&mut self, scene: &Scene, query: Option<&MotionQuery>, plan: &RobotPlan) -> Result<(), Violation> {
        for (in_plan, name) in plan.objects.iter().enumerate() {
            let Some(object) = scene.object_named(name) else {
                return Err(wrong(Kind::WrongScene, format!("the scene has no object \"{name}\"")));
            };
            if self.carried.iter().any(|known| known.object == object) {
                return Err(wrong(Kind::WrongScene, format!("the plan names object \"{name}\" twice")));
            }
            let holder = match query {
                Some(query) => query.carried.iter().find(|carried| carried.object == object).map(|c| c.holder),
                None => self.named_holder(scene, plan, name),
            };
            let link = holder.and_then(|holder| {
                Some((holder, holder.link(scene, self.index)?, holder.first_link(scene, self.index)?))
            });
            let Some((holder, link, first_link)) = link else {
                let message = format!("the plan moves object \"{name}\", which no hand of the robot is asked to carry");
                return Err(wrong(Kind::WrongHolder, message).subjects([name.as_str()]));
            };
            let (body, body_from_link) = *self.tree.link(link);
            let holder = holder.name(scene, self.index).to_owned();
            // Where the object is in the hand is found when the start is known to be sound.
            let body_from_object = body_from_link;
            self.carried.push(Carried { object, in_plan, holder, link, first_link, body, body_from_object });
        }
        let asked = query.map_or(&[][..], |query| &query.carried);
        let left_out = asked.iter().find(|asked| self.carried.iter().all(|known| known.object != asked.object));
        match left_out {
            Some(asked) => {
                let name = &scene.objects[asked.object].name;
                let message = format!("the plan leaves out object \"{name}\", which is to be carried");
                Err(wrong(Kind::WrongHolder, message).subjects([name.as_str()]))
            }
            None => Ok(()),
        }
    }

    /// The holder that the plan's first segment names.
    fn named_holder(&self, scene: &Scene, plan: &RobotPlan, object: &str) -> Option<Holder> {
        let [name] = plan.segments.first()?.held_by.get(object)?.as_slice() else { return None };
        let arm = || self.robot.arm_named(name).map(Holder::Arm);
        scene.hand_named(name).map(Holder::Hand).or_else(arm)
    }

    /// Takes over where the objects are in their hands, while the robot is at `joints`.
    pub fn take_hold(&mut self, joints: &[f64], world_from_objects: &[Pose]) {
        let (mut frames, mut axes) = (Vec::new(), Vec::new());
        self.tree.frames(joints, &mut frames, &mut axes);
        for carried in &mut self.carried {
            let body = frames[carried.body].pose();
            carried.body_from_object = Frame::of(&(body.inverse() * world_from_objects[carried.in_plan]));
        }
    }
}
