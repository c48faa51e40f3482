//! Settings of motions: what contacts do, what is kept, and how plans are carried out. Every default says where it comes from.

use super::{ForceSettings, SpeedSettings};
use regrasp_scene::Limits;
use serde::{Deserialize, Serialize};

/// What contacts do while the object moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TransferMode {
    /// Round fingertips roll without slipping, and contacts travel on both surfaces (Sahbani 2007, sec. IV-C). Sharp tips keep
    /// their contacts. The default: real tips roll, and in a simulation plans that ignore it end 12 to 29 degrees off
    /// (by simulation of a prototype).
    Rolling,
    /// Contacts stay where they are on the object (Saut 2011, sec. 3.2), as if tips were points.
    Fixed,
}

/// What motions keep, and how they are carried out. Lengths in metres, angles in radians.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicsSettings {
    /// What contacts do while the object moves: `rolling` or `fixed`.
    pub transfer: TransferMode,
    /// Force closure and forces use the scene's friction coefficient divided by this number, at least 1. In simulation
    /// of a prototype 1.5 kept 20 of 20 plans, and 1 kept 2 of 8.
    pub friction_margin: f64,
    /// Force-closure margin of every set of holding fingers; dimensionless, in `[0, 1)`. See `regrasp_grasp::margin`. By
    /// hand: a good grasp of three fingers has about ten times the default.
    pub closure_margin: f64,
    /// Longest step of the object or a fingertip between waypoints, in metres. Origin: measurements on a prototype, 2 to
    /// 3 mm.
    pub step: f64,
    /// Smallest distance between bodies that must not touch, in metres. Those that are nearer at a given start may stay so near, by half of
    /// their distance there or more, and 0.02 mm at least (0.1 mm for the tip of a free finger). By hand.
    pub clearance: f64,
    /// How much farther contacts keep from edges than the object's `edge_distance`, in metres: fingertips never land quite where they
    /// should. Contacts of a given start that are nearer may only roll away from the edge. Without effect where `edge_distance` is 0.
    pub edge_margin: f64,
    /// How far the tip link of a holding finger may press into the object in the model, in metres. By hand: well below
    /// the contact tolerance of 0.5 mm.
    pub contact_allowance: f64,
    /// Distance that joints keep from their limits, but at most a twentieth of the shortest range of a joint of the finger. Origin: measurements on a prototype.
    pub limit_margin: f64,
    /// Largest change of a joint in one step that counts as continuous. Origin: measurements on a prototype.
    pub joint_step: f64,
    /// Heights to which a finger lifts, in metres, tried in this order. Origin: measurements on a prototype.
    pub lift_heights: Vec<f64>,
    /// Attempts of RRT-Connect to find a path for a moving finger. Origin: measurements on a prototype.
    pub rrt_iterations: usize,
    /// Contact forces along the plan; `null` for plans without forces.
    pub forces: Option<ForceSettings>,
    /// Speeds and accelerations of the plan.
    pub speed: SpeedSettings,
}

impl Default for PhysicsSettings {
    fn default() -> Self {
        PhysicsSettings {
            transfer: TransferMode::Rolling,
            friction_margin: 1.5,
            closure_margin: 0.005,
            step: 0.003,
            clearance: 0.0002,
            edge_margin: 0.0,
            contact_allowance: 0.0003,
            limit_margin: 0.01,
            joint_step: 0.4,
            lift_heights: vec![0.006, 0.0024, 0.001, 0.0004],
            rrt_iterations: 100,
            forces: Some(ForceSettings::default()),
            speed: SpeedSettings::default(),
        }
    }
}

impl PhysicsSettings {
    /// The same within the limits of a scene, which no plan may exceed.
    #[must_use]
    pub fn within(&self, limits: &Limits) -> Self {
        let mut within = self.clone();
        let speed = &mut within.speed;
        speed.largest_speed = speed.largest_speed.min(limits.largest_speed);
        speed.joint_velocity = speed.joint_velocity.min(limits.joint_velocity);
        speed.joint_acceleration = speed.joint_acceleration.min(limits.joint_acceleration);
        if let Some(forces) = &mut within.forces {
            forces.normal_force = forces.normal_force.map(|force| force.min(limits.normal_force));
            forces.squeeze = forces.squeeze.min(limits.normal_force);
        }
        within.friction_margin =
            limits.friction_margin.map_or(self.friction_margin, |least| self.friction_margin.max(least));
        within
    }
}
