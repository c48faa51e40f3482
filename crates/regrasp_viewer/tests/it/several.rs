//! Stories of a scene of two hands, two objects and a support.

use crate::places::repository;
use crate::two_hands::SCENE;
use regrasp_geometry::Pose;
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use regrasp_viewer::story::{Carrier, FailureStory, OtherCarrier, Outcome, Part, Role, Story, Telling, tell};

fn load() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let hand = repository().join("assets/hands/wide_four_finger/hand.toml").canonicalize().unwrap();
    let path = folder.path().join("two_hands.toml");
    std::fs::write(&path, SCENE.replace("\"hand.toml\"", &format!("{:?}", hand.display().to_string()))).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn story_of(loaded: &LoadedScene, task: &str) -> Story {
    let failure = FailureStory {
        kind: "none".into(),
        message: String::new(),
        advice: String::new(),
        causes: Vec::new(),
        nearest_miss: None,
    };
    let options = LoadOptions::default();
    let telling = Telling {
        task: loaded.manipulation_of(loaded.task_named(task).unwrap()),
        query: None,
        outcome: Outcome::Failed(failure),
        title: None,
        facts: Vec::new(),
        roadmap: None,
        packages: &options.resolve,
    };
    tell(&telling).unwrap()
}

#[test]
fn what_rests_is_drawn_for_what_it_is() {
    let loaded = load();
    for (task, moved) in [("turn_ball", 0), ("turn_box", 1)] {
        let story = story_of(&loaded, task).scene;
        assert_eq!((story.moving_hand, story.moved_object), (moved, moved));
        assert_eq!(
            (&story.hands[..], &story.objects[..]),
            (&["right", "left"].map(String::from)[..], &["ball", "box"].map(String::from)[..])
        );
        let [own, other] = [&story.hands[moved], &story.hands[1 - moved]];
        let at_rest = |part: Part, role: Role| {
            let pieces = story.pieces.iter().filter(move |piece| piece.part == part && piece.role == role);
            pieces.filter(|piece| piece.on == Carrier::Other(OtherCarrier::World)).collect::<Vec<_>>()
        };
        for role in [Role::Collision, Role::Visual] {
            if role == Role::Visual && !story.pieces.iter().any(|piece| piece.role == role) {
                continue;
            }
            let hands = at_rest(Part::Hand, role);
            assert!(!hands.is_empty() && hands.iter().all(|piece| piece.name.starts_with(&format!("{other}/"))));
            assert!(hands.iter().all(|piece| !piece.name.starts_with(own.as_str())));
            assert_eq!(at_rest(Part::Object, role).len(), 1);
            assert_eq!(at_rest(Part::Object, role)[0].name, story.objects[1 - moved]);
            assert_eq!(at_rest(Part::Support, role).iter().map(|piece| &piece.name).collect::<Vec<_>>(), ["table"]);
            assert_eq!(at_rest(Part::Obstacle, role).iter().map(|piece| &piece.name).collect::<Vec<_>>(), ["lamp"]);
        }
    }
}

/// The hand at rest of one story is the hand that moves of the other, in its rest posture.
#[test]
fn a_hand_at_rest_stands_where_it_stands_when_it_is_its_turn() {
    let loaded = load();
    let (ball, box_) = (story_of(&loaded, "turn_ball").scene, story_of(&loaded, "turn_box").scene);
    let poses = box_.world_from_links(&loaded.state.hand_joints[1]);
    let own: Vec<(String, Pose)> = box_
        .pieces
        .iter()
        .filter(|piece| piece.role == Role::Collision)
        .filter_map(|piece| match piece.on {
            Carrier::Link(link) => Some((format!("left/{}", piece.name), poses[link] * Pose::from(&piece.from_mesh))),
            Carrier::Other(_) => None,
        })
        .collect();
    let resting: Vec<(String, Pose)> = ball
        .pieces
        .iter()
        .filter(|piece| {
            piece.role == Role::Collision && piece.part == Part::Hand && !matches!(piece.on, Carrier::Link(_))
        })
        .map(|piece| (piece.name.clone(), Pose::from(&piece.from_mesh)))
        .collect();
    assert_eq!(own.len(), resting.len());
    for ((name, pose), (other_name, other)) in own.iter().zip(&resting) {
        assert_eq!(name, other_name);
        let off = (pose.translation.vector - other.translation.vector).norm();
        assert!(off < 1e-12 && pose.rotation.angle_to(&other.rotation) < 1e-7, "{name}");
    }
}
