//! Settings of the search for grasp lists. Every default says where it comes from.

use regrasp_grasp::list::{GraspKind, ScoreWeights};
use regrasp_manipulation::settings::{ForceSettings, PhysicsSettings};
use serde::{Deserialize, Serialize};

/// What is searched for, and how. Lengths in metres, angles in radians.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraspSettings {
    /// How grasps come about.
    pub kind: GraspKind,
    /// Grasps that are kept. Default: the aim of a list is variety; 100 grasps show it.
    pub grasps: usize,
    /// Frames of the grid: orientations are the finest of 72, 576, 4608 and so on that leaves at least as many positions as
    /// `least_positions`. Default 600 positions times 576 orientations.
    pub frames: u64,
    /// See `frames`. By hand.
    pub least_positions: u64,
    /// Closure margin of every grasp, with the friction margin. By hand: the planner of motions in the hand asks for half as much.
    pub margin: f64,
    /// The object's friction coefficient is divided by this before margins and forces count on it. As for plans.
    pub friction_margin: f64,
    /// Weights of the score.
    pub weights: ScoreWeights,
    /// Limits of contact forces.
    pub forces: ForceSettings,
    /// Smallest distance between bodies that must not touch. As for plans.
    pub clearance: f64,
    /// Joints keep this distance from their limits. As for plans.
    pub limit_margin: f64,
    /// The finger that touches first, by its name; none: a finger called thumb, else the one that opposes the others.
    pub first_finger: Option<String>,
    /// Fingers that hold at least; soft fingertips: 2. Saut 2010, sec. IV-A.2: 3.
    pub least_contacts: usize,
    /// Most spheres of a finger's workspace, and the least radius of one (Saut 2010, algorithm 1: k_max, r_min). By hand.
    pub most_spheres: usize,
    /// See `most_spheres`.
    pub least_sphere: f64,
    /// Distance of the points of the surface; none: half the smallest tip radius.
    pub surface_step: Option<f64>,
    /// Contacts of a finger that are kept in a frame.
    pub contacts_per_finger: usize,
    /// Contacts of a finger that inverse kinematics is asked about in a frame.
    pub tries_per_finger: usize,
    /// Grasps that are found before the list is chosen among them, for each that is kept. By measurement: more adds little variety.
    pub found_per_grasp: f64,
    /// Trials of refinement for each grasp; 0: none.
    pub refinement_trials: usize,
    /// Length of the straight line on which the open hand comes.
    pub approach_distance: f64,
    /// Heights to which fingertips lift off to open the hand, tried in this order.
    pub open_heights: Vec<f64>,
    /// Least tipping angle of a stable pose. By simulation: 5 degrees. Objects that tip over sooner do so when the first finger touches.
    pub tipping_angle: f64,
    /// Threads. The list does not depend on it.
    #[serde(skip)]
    pub n_threads: usize,
}

impl Default for GraspSettings {
    fn default() -> Self {
        GraspSettings {
            kind: GraspKind::Precision,
            grasps: 100,
            frames: 600 * 576,
            least_positions: 100,
            margin: 0.01,
            friction_margin: 1.5,
            weights: ScoreWeights::default(),
            forces: ForceSettings { normal_force: [0.5, 40.0], cone_weight: 0.0, ..ForceSettings::default() },
            clearance: 0.0002,
            limit_margin: 0.01,
            first_finger: None,
            least_contacts: 3,
            most_spheres: 60,
            least_sphere: 0.003,
            surface_step: None,
            contacts_per_finger: 5,
            tries_per_finger: 16,
            found_per_grasp: 2.0,
            refinement_trials: 400,
            approach_distance: 0.1,
            open_heights: vec![0.03, 0.02, 0.012, 0.006],
            tipping_angle: 0.0873,
            n_threads: 1,
        }
    }
}

/// Most grasps, frames and spheres that make sense: a list of more is not read.
const MOST_GRASPS: usize = 1_000_000;
/// See [`MOST_GRASPS`].
const MOST_FRAMES: u64 = 10_000_000_000;
/// See [`MOST_GRASPS`].
const MOST_OF_A_KIND: usize = 10_000;

impl GraspSettings {
    /// What is wrong with the settings, if anything.
    pub fn validate(&self) -> Result<(), String> {
        let counts = [
            ("grasps", self.grasps, 1, MOST_GRASPS),
            ("least_contacts", self.least_contacts, 2, 6),
            ("most_spheres", self.most_spheres, 1, MOST_OF_A_KIND),
            ("contacts_per_finger", self.contacts_per_finger, 1, 16),
            ("tries_per_finger", self.tries_per_finger, 1, MOST_OF_A_KIND),
            ("refinement_trials", self.refinement_trials, 0, MOST_OF_A_KIND),
            ("open_heights", self.open_heights.len(), 1, 100),
        ];
        if let Some((name, seen, low, high)) = counts.into_iter().find(|(_, n, low, high)| !(low..=high).contains(&n)) {
            return Err(format!("{name} is {seen}; it must be between {low} and {high}"));
        }
        if !(1..=MOST_FRAMES).contains(&self.frames) || self.least_positions == 0 {
            return Err(format!(
                "frames is {}; it must be between 1 and {MOST_FRAMES}, least_positions above 0",
                self.frames
            ));
        }
        let numbers = [
            ("margin", self.margin, 0.0, 0.999),
            ("friction_margin", self.friction_margin, 1.0, 100.0),
            ("clearance", self.clearance, 1e-6, 0.1),
            ("limit_margin", self.limit_margin, 0.0, 1.0),
            ("least_sphere", self.least_sphere, 1e-5, 1.0),
            ("surface_step", self.surface_step.unwrap_or(0.01), 1e-4, 1.0),
            ("found_per_grasp", self.found_per_grasp, 1.0, 100.0),
            ("approach_distance", self.approach_distance, 0.02, 1.0),
            ("tipping_angle", self.tipping_angle, 0.0, 1.5),
        ];
        let heights = self.open_heights.iter().map(|height| ("open_heights", *height, 0.001, 0.5));
        if let Some((name, seen, low, high)) =
            numbers.into_iter().chain(heights).find(|(_, value, low, high)| !(low..=high).contains(&value))
        {
            return Err(format!("{name} is {seen}; it must be between {low} and {high}"));
        }
        self.weights.validate()?;
        self.forces.validate()
    }

    /// The settings of motions, forces and closure behind these.
    pub(crate) fn physics(&self) -> PhysicsSettings {
        PhysicsSettings {
            friction_margin: self.friction_margin,
            closure_margin: self.margin,
            clearance: self.clearance,
            limit_margin: self.limit_margin,
            forces: Some(self.forces),
            ..PhysicsSettings::default()
        }
    }
}
