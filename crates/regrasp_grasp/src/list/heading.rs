//! Hand, object and promises of a grasp list.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The hand of a list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandRecord {
    /// Name of the robot file's robot.
    pub name: String,
    /// The link whose frame is the hand frame.
    pub base_link: String,
    /// Names of its fingers.
    pub fingers: Vec<String>,
    /// Names of its joints, in the order of every joint vector.
    pub joint_names: Vec<String>,
    /// Its joints that no grasp moves, and where each of them stands, in radians or metres: independent joints that belong to no finger,
    /// such as a wrist's. Absent where there are none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub held_joints: BTreeMap<String, f64>,
}

/// The object of a list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectRecord {
    /// Name.
    pub name: String,
    /// Mass, in kilograms.
    pub mass: f64,
    /// Centre of mass, in the object frame.
    pub center_of_mass: [f64; 3],
    /// Friction coefficient between fingertips and object.
    pub friction: f64,
}

impl ObjectRecord {
    /// Every number of it.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + use<> {
        [self.mass, self.friction].into_iter().chain(self.center_of_mass)
    }
}

/// How a mesh file became the object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshRecord {
    /// Factor of all lengths of the file.
    pub scale: f64,
    /// Mass, in kilograms.
    pub mass: f64,
    /// Friction coefficient.
    pub friction: f64,
    /// Contacts keep this distance from creases, in metres; absent: the default of scene files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_distance: Option<f64>,
    /// Edges that fold by more than this are creases, in degrees; absent: the default of scene files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crease_angle_deg: Option<f64>,
}

/// The files that a list was made from, as the command named them: relative to the list's folder or to the current folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraspSource {
    /// Hand file or URDF.
    pub hand: String,
    /// Scene file, of which the first task's object is used; or a mesh.
    pub object: String,
    /// How the mesh became the object; absent for a scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshRecord>,
    /// Torsion radius of fingertips of which the hand file says nothing, in metres: they are soft. Absent: points with friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion_radius: Option<f64>,
}

/// What holds for every grasp of a list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraspPromises {
    /// Largest distance of a fingertip from its contact, in metres.
    pub contact_tolerance: f64,
    /// Friction coefficient that margins and forces count on: the object's over `friction_margin`.
    pub friction: f64,
    /// What the object's friction coefficient is divided by, at least 1.
    pub friction_margin: f64,
    /// Closure margin that every grasp has at least.
    pub required_margin: f64,
    /// Length by which torques are divided, in metres: the largest distance of the object's surface from its centre of mass.
    pub torque_scale: f64,
    /// Least and largest normal force of a contact, in newtons.
    pub normal_force: [f64; 2],
    /// Largest torque of every joint, in N m or N; null where there is no limit.
    pub joint_torques: Vec<Option<f64>>,
    /// Least tipping angle of every stable pose, in radians.
    pub tipping_angle: f64,
}

impl GraspPromises {
    /// Every number of it.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let scalars = [
            self.contact_tolerance,
            self.friction,
            self.friction_margin,
            self.required_margin,
            self.torque_scale,
            self.tipping_angle,
        ];
        scalars.into_iter().chain(self.normal_force).chain(self.joint_torques.iter().flatten().copied())
    }
}

/// A pose in which the object stands on a plane by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StablePose {
    /// The direction in which things fall, a unit vector in the object frame.
    pub down_in_object: [f64; 3],
    /// Distance of the supporting plane from the object's origin along `down_in_object`, in metres.
    pub height: f64,
    /// Least angle by which the support can be tilted until the object tips over, in radians: a proven lower bound.
    pub tipping_angle: f64,
}

impl StablePose {
    /// Every number of it.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + use<> {
        self.down_in_object.into_iter().chain([self.height, self.tipping_angle])
    }
}

/// Counts of the search for a list.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GraspStatistics {
    /// Frames of the grid.
    pub frames: u64,
    /// Frames that were looked at.
    pub frames_tried: u64,
    /// Frames that gave no grasp, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Grasps that were found, before `--grasps` of them were kept.
    pub found: u64,
    /// Configurations examined.
    pub work: u64,
    /// True when a time limit or the user cut the search: another run may find more.
    pub cut_by_time: bool,
}
