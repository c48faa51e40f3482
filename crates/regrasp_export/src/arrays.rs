//! A plan as arrays over all waypoints, of all segments in order: row-major, the waypoint first.
//!
//! The last waypoint of a segment and the first of the next are both there: they differ in forces, and may in time.

use regrasp_plan::{ContactMode, ContactState, Plan, SegmentKind, Waypoint};

/// The arrays of a plan with n waypoints, j joints, f fingers and s segments. Units as in the plan; NaN where a finger that
/// does not touch the object has no value.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanArrays {
    /// n: number of waypoints, of all segments together.
    pub n_waypoints: usize,
    /// Names of the joints, j of them, in the order of the columns of joint arrays.
    pub joint_names: Vec<String>,
    /// Names of the fingers, f of them, in the order of the columns of contact arrays.
    pub fingers: Vec<String>,
    /// n: seconds from the start.
    pub times: Vec<f64>,
    /// n x j: positions of the joints.
    pub joints: Vec<f64>,
    /// n x j: their velocities.
    pub joint_velocities: Vec<f64>,
    /// n x j: their torques; none in plans without forces.
    pub joint_torques: Option<Vec<f64>>,
    /// n x 3: position of the object in the world.
    pub object_positions: Vec<f64>,
    /// n x 4: its orientation, x y z w, w >= 0.
    pub object_quat_xyzw: Vec<f64>,
    /// n x f: index in [`CONTACT_MODES`].
    pub contact_modes: Vec<u8>,
    /// n x f x 3: contact points in the object frame.
    pub contact_points_in_object: Vec<f64>,
    /// n x f x 3: outward normals of the object there.
    pub contact_normals_in_object: Vec<f64>,
    /// n x f x 3: forces on the object, in the object frame; NaN in plans without forces.
    pub contact_forces_in_object: Vec<f64>,
    /// n x f: moments about the outward normals; NaN for point contacts.
    pub contact_torsions: Vec<f64>,
    /// n: index of the segment of the waypoint.
    pub segment_of_waypoint: Vec<i64>,
    /// s: kind of each segment.
    pub segment_kinds: Vec<SegmentKind>,
    /// s: index of the finger that moves, -1 in transfers.
    pub segment_moving_fingers: Vec<i64>,
    /// s + 1: index of the first waypoint of each segment, and n.
    pub segment_starts: Vec<i64>,
}

/// Names of contact modes, in the order of the numbers in [`PlanArrays::contact_modes`].
pub const CONTACT_MODES: [&str; 3] = ["free", "fixed", "rolling"];

/// Name of a kind of segment, as plan files spell it.
pub fn kind_name(kind: SegmentKind) -> &'static str {
    match kind {
        SegmentKind::Transfer => "transfer",
        SegmentKind::Regrasp => "regrasp",
    }
}

impl PlanArrays {
    /// The arrays of `plan`.
    pub fn new(plan: &Plan) -> Self {
        let waypoints: Vec<&Waypoint> = plan.segments.iter().flat_map(|segment| &segment.waypoints).collect();
        let contacts = || waypoints.iter().flat_map(|waypoint| &waypoint.contacts);
        let of_joints = |pick: fn(&Waypoint) -> &[f64]| -> Vec<f64> {
            waypoints.iter().flat_map(|waypoint| pick(waypoint).iter().copied()).collect()
        };
        let of_contacts = |pick: fn(&ContactState) -> Option<[f64; 3]>| -> Vec<f64> {
            contacts().flat_map(|contact| pick(contact).unwrap_or([f64::NAN; 3])).collect()
        };
        let torques = of_joints(|waypoint| &waypoint.joint_torques);
        let mut segment_starts = vec![0];
        for segment in &plan.segments {
            segment_starts.push(segment_starts[segment_starts.len() - 1] + segment.waypoints.len() as i64);
        }
        let of_segments = plan.segments.iter().zip(0_i64..);
        PlanArrays {
            n_waypoints: waypoints.len(),
            joint_names: plan.joint_names.clone(),
            fingers: plan.fingers.clone(),
            times: waypoints.iter().map(|waypoint| waypoint.time).collect(),
            joints: of_joints(|waypoint| &waypoint.joints),
            joint_velocities: of_joints(|waypoint| &waypoint.joint_velocities),
            joint_torques: (torques.len() == waypoints.len() * plan.joint_names.len() && !torques.is_empty())
                .then_some(torques),
            object_positions: waypoints.iter().flat_map(|waypoint| waypoint.world_from_object.position).collect(),
            object_quat_xyzw: waypoints.iter().flat_map(|waypoint| waypoint.world_from_object.quat_xyzw).collect(),
            contact_modes: contacts().map(|contact| mode_number(contact.mode)).collect(),
            contact_points_in_object: of_contacts(|contact| contact.point_in_object),
            contact_normals_in_object: of_contacts(|contact| contact.normal_in_object),
            contact_forces_in_object: of_contacts(|contact| contact.force_in_object),
            contact_torsions: contacts().map(|contact| contact.torsion.unwrap_or(f64::NAN)).collect(),
            segment_of_waypoint: of_segments
                .flat_map(|(segment, index)| segment.waypoints.iter().map(move |_| index))
                .collect(),
            segment_kinds: plan.segments.iter().map(|segment| segment.kind).collect(),
            segment_moving_fingers: plan
                .segments
                .iter()
                .map(|segment| finger_number(&plan.fingers, segment.moving_finger.as_deref()))
                .collect(),
            segment_starts,
        }
    }
}

fn mode_number(mode: ContactMode) -> u8 {
    match mode {
        ContactMode::Free => 0,
        ContactMode::Fixed => 1,
        ContactMode::Rolling => 2,
    }
}

fn finger_number(fingers: &[String], name: Option<&str>) -> i64 {
    fingers.iter().zip(0..).find(|(finger, _)| Some(finger.as_str()) == name).map_or(-1, |(_, index)| index)
}
