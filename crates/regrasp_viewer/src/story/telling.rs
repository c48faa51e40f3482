//! A story from scene, query and plan.

use super::facts::plan_facts;
use super::judged::judged;
use super::scene::scene_story;
use super::{FORMAT, FailureStory, PoseData, RoadmapStory, Story, VERSION};
use regrasp_plan::Plan;
use regrasp_plan::check::Report;
use regrasp_robot::ResolveOptions;
use regrasp_scene::{Manipulation, Query};

/// What came of a query.
#[derive(Debug, Clone)]
pub enum Outcome<'a> {
    /// A plan, and what the checker said of it in the same scene.
    Planned {
        /// The plan.
        plan: &'a Plan,
        /// What the checker said.
        report: &'a Report,
    },
    /// No plan.
    Failed(FailureStory),
}

/// What a story is made from.
#[derive(Debug, Clone)]
pub struct Telling<'a> {
    /// The hand and the object in their scene.
    pub task: Manipulation<'a>,
    /// What was asked; else what the plan says was.
    pub query: Option<&'a Query>,
    /// What came of it.
    pub outcome: Outcome<'a>,
    /// Title; the scene's name where there is none.
    pub title: Option<&'a str>,
    /// Lines of facts that the caller knows, shown first.
    pub facts: Vec<(String, String)>,
    /// A manipulation graph.
    pub roadmap: Option<RoadmapStory>,
    /// Where visual meshes are looked for.
    pub packages: &'a ResolveOptions,
}

/// The story. Err with a message when the robot contradicts itself.
pub fn tell(telling: &Telling) -> Result<Story, String> {
    let (mut scene, notes) = scene_story(&telling.task, telling.packages);
    let mut facts = telling.facts.clone();
    let mut asked: Vec<PoseData> = telling.query.map_or_else(Vec::new, |query| {
        let poses = std::iter::once(query.start()).chain(query.way()).chain([query.goal()]);
        poses.map(PoseData::from).collect()
    });
    let (plan, measured, failure) = match &telling.outcome {
        Outcome::Failed(failure) => (None, None, Some(failure.clone())),
        Outcome::Planned { plan, report } => {
            let measured = judged(&telling.task, plan, report);
            facts.extend(plan_facts(plan, report, &measured));
            if asked.is_empty() {
                let way = plan.way_poses.iter().map(|way| way.world_from_object);
                asked = std::iter::once(plan.start).chain(way).chain([plan.goal]).collect();
            }
            if let Some(forces) = &plan.promises.forces {
                scene.gravity_in_world = forces.gravity_in_world;
            }
            (Some((*plan).clone()), Some(measured), None)
        }
    };
    facts.extend(who_moves(&telling.task));
    facts.extend(notes);
    let inputs = telling.task.scene.inputs.iter();
    facts.extend(inputs.map(|input| (format!("{} {}", input.role, input.name), format!("sha256 {}", input.sha256))));
    Ok(Story {
        format: FORMAT.into(),
        version: VERSION,
        title: telling.title.unwrap_or(&telling.task.scene.name).to_owned(),
        facts,
        scene,
        asked,
        plan,
        judged: measured,
        failure,
        roadmap: telling.roadmap.clone(),
    })
}

/// What moves and what rests, in a scene of several hands or objects.
fn who_moves(task: &Manipulation) -> Option<(String, String)> {
    let scene = task.scene;
    let hands = scene.hands.iter().map(|hand| &hand.name).enumerate().filter(|(index, _)| *index != task.hand_index);
    let objects =
        scene.objects.iter().map(|object| &object.name).enumerate().filter(|(index, _)| *index != task.object_index);
    let resting: Vec<&str> = hands.chain(objects).map(|(_, name)| name.as_str()).collect();
    let [hand, object] = [&task.placed_hand().name, &task.object().name];
    (!resting.is_empty())
        .then(|| ("Moves".to_owned(), format!("{hand} moves {object}; {} at rest", resting.join(", "))))
}
