//! The scene: hands, objects, supports, obstacles. What moves is in [`crate::State`].

use crate::gravity::Gravity;
use crate::limits::Limits;
use crate::object::Object;
use crate::pick_and_place::GraspFile;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::{Hand, Manipulator};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Something fixed in the world that nothing may touch.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// Name, unique among the bodies of the scene.
    pub name: String,
    /// Its shape, placed in the world.
    pub placed: PlacedShape,
    /// For a mesh, what collision tests ask of it.
    pub mesh_body: Option<MeshBody>,
}

/// Something fixed in the world that objects may stand on. Hands keep away from it, as from an obstacle.
#[derive(Debug, Clone)]
pub struct Support {
    /// Its name, its shape placed in the world, and what collision tests ask of it.
    pub body: Obstacle,
}

/// A hand with its place in the scene.
#[derive(Debug, Clone)]
pub struct SceneHand {
    /// Name, unique among the bodies of the scene.
    pub name: String,
    /// The hand, in its own frame.
    pub hand: Hand,
    /// Where its base stands, in the world; for a hand that a robot carries, while that robot waits in its rest posture.
    pub world_from_hand: Pose,
    /// The robot that carries it. None for a hand that stands by itself.
    pub carrier: Option<HandCarrier>,
    /// Radius, in metres, of the balls that the centres of the fingertips may not leave: each is about where the tip is in the
    /// rest posture (Cherif & Gupta 1999, sec. 7: 0.1 m). None where the joints alone say what a finger reaches.
    pub reach: Option<f64>,
}

impl SceneHand {
    /// As [`Hand::held_joints`]; none for a hand that a robot carries, whose joints are the robot's.
    pub fn held_joints(&self) -> BTreeMap<String, f64> {
        match self.carrier {
            None => self.hand.held_joints(),
            Some(_) => BTreeMap::new(),
        }
    }
}

/// Which hand of which robot a hand is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HandCarrier {
    /// Index in [`Scene::robots`].
    pub robot: usize,
    /// Index in `Manipulator::hands`.
    pub hand: usize,
}

/// A file that the scene was made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// What it is for: `scene`, `hand`, `urdf`, `srdf`, `mesh`.
    pub role: String,
    /// How the scene names it: relative to the scene file, or `package://`.
    pub name: String,
    /// Where it was found.
    pub path: PathBuf,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

/// Everything that planners plan in and the checker judges by. Never changes after loading.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name: the scene file's name without its extension.
    pub name: String,
    /// The robots that carry hands.
    pub robots: Vec<Manipulator>,
    /// The hands, those of robots first, in the order of the file. At least one.
    pub hands: Vec<SceneHand>,
    /// The objects that hands can move, in the order of the file. At least one.
    pub objects: Vec<Object>,
    /// Lists of grasps that the file names, object by object, in the order of the hands.
    pub grasp_files: Vec<GraspFile>,
    /// What objects may stand on.
    pub supports: Vec<Support>,
    /// What nothing may touch.
    pub obstacles: Vec<Obstacle>,
    /// Gravity, where the file states it; along the world's -Z otherwise.
    pub gravity: Option<Gravity>,
    /// What a plan may ask of hands and objects.
    pub limits: Limits,
    /// The files it was read from, the scene file first.
    pub inputs: Vec<InputFile>,
}

impl Scene {
    /// Gravity as planners plan with it and the checker judges by it.
    pub fn gravity(&self) -> Gravity {
        self.gravity.unwrap_or_default()
    }

    /// The same scene under another gravity, whatever its file says.
    #[must_use]
    pub fn under_gravity(mut self, gravity: Gravity) -> Self {
        self.gravity = Some(gravity);
        self
    }

    /// Index of the hand called `name`.
    pub fn hand_named(&self, name: &str) -> Option<usize> {
        self.hands.iter().position(|hand| hand.name == name)
    }

    /// Index of the object called `name`.
    pub fn object_named(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }
}
