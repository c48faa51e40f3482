//! The scene: hand, object, obstacles.

use crate::gravity::Gravity;
use crate::limits::Limits;
use crate::object::Object;
use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::Hand;
use std::path::PathBuf;

/// Something fixed in the world that nothing may touch.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// Name, unique in the scene.
    pub name: String,
    /// Its shape, placed in the world.
    pub placed: PlacedShape,
    /// For a mesh, what collision tests ask of it.
    pub mesh_body: Option<MeshBody>,
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

/// Everything a planner plans in. Never changes after loading.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name: the scene file's name without its extension.
    pub name: String,
    /// The hand, already placed in the world: every pose it gives is in the world frame.
    pub hand: Hand,
    /// Radius, in metres, of the balls that the centres of the fingertips may not leave: each is about where the tip is in the
    /// rest posture (paper 003, section 7: 0.1 m). None where the joints alone say what a finger reaches.
    pub reach: Option<f64>,
    /// The object.
    pub object: Object,
    /// Obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Gravity, where the file states it; along the world's -Z otherwise.
    pub gravity: Option<Gravity>,
    /// What a plan may ask of hand and object.
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
}
