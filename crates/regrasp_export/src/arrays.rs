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
    /// Names of the hands that move, h of them.
    pub hands: Vec<String>,
    /// Names of the objects that are moved, o of them.
    pub objects: Vec<String>,
    /// j: index in `hands` of the hand of each joint.
    pub hand_of_joint: Vec<i64>,
    /// f: index in `hands` of the hand of each finger.
    pub hand_of_finger: Vec<i64>,
    /// Names of all that hold an object in any segment, k of them, each once, in the order in which they first do: hands and
    /// supports.
    pub holders: Vec<String>,
    /// Names of the joints, j of them, in the order of the columns of joint arrays.
    pub joint_names: Vec<String>,
    /// Names of the joints that stand still all along.
    pub held_joint_names: Vec<String>,
    /// Where each of them stands.
    pub held_joints: Vec<f64>,
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
    /// s: index of the finger that moves, of several the first, -1 in transfers.
    pub segment_moving_fingers: Vec<i64>,
    /// s x f: 1 where the finger moves in a regrasp or in tracking, else 0.
    pub segment_moves: Vec<i64>,
    /// s: index of the finger that the object rolls on in tracking, else -1.
    pub segment_rolling_fingers: Vec<i64>,
    /// s x o x k: 1 where the holder holds the object all through the segment, else 0.
    pub segment_held_by: Vec<i64>,
    /// s + 1: index of the first waypoint of each segment, and n.
    pub segment_starts: Vec<i64>,
}

/// One numeric array: row-major, the waypoint first.
#[derive(Debug, Clone, PartialEq)]
pub struct NumericArray<'a> {
    /// Its name: that of the field of [`PlanArrays`].
    pub name: &'static str,
    /// Its length along every axis.
    pub shape: Vec<usize>,
    /// Its numbers; as many as the product of the shape.
    pub data: Numbers<'a>,
}

/// Numbers of one type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Numbers<'a> {
    /// Of 64 bits.
    Floats(&'a [f64]),
    /// Of 64 bits, with a sign.
    Integers(&'a [i64]),
    /// Of 8 bits, without a sign.
    Bytes(&'a [u8]),
}

impl Numbers<'_> {
    /// What numpy calls the type, in the byte order of [`Numbers::to_bytes`].
    pub fn numpy_type(&self) -> &'static str {
        match self {
            Numbers::Floats(_) => "<f8",
            Numbers::Integers(_) => "<i8",
            Numbers::Bytes(_) => "|u1",
        }
    }

    /// The numbers one after another, the least byte first.
    pub fn to_bytes(&self) -> Vec<u8> {
        match self {
            Numbers::Floats(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Numbers::Integers(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Numbers::Bytes(values) => values.to_vec(),
        }
    }
}

/// Names of contact modes, in the order of the numbers in [`PlanArrays::contact_modes`].
pub const CONTACT_MODES: [&str; 7] =
    ["free", "fixed", "rolling", "pure_rolling", "twisting", "pure_sliding", "sliding"];

/// Name of a kind of segment, as plan files spell it.
pub fn kind_name(kind: SegmentKind) -> &'static str {
    match kind {
        SegmentKind::Transfer => "transfer",
        SegmentKind::Regrasp => "regrasp",
        SegmentKind::Tracking => "tracking",
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
        let mut holders: Vec<String> = Vec::new();
        for holder in plan.segments.iter().flat_map(|segment| &segment.held_by) {
            if !holders.contains(holder) {
                holders.push(holder.clone());
            }
        }
        let of_segments = plan.segments.iter().zip(0_i64..);
        PlanArrays {
            n_waypoints: waypoints.len(),
            hands: vec![plan.hand.clone()],
            objects: vec![plan.object.clone()],
            hand_of_joint: vec![0; plan.joint_names.len()],
            hand_of_finger: vec![0; plan.fingers.len()],
            joint_names: plan.joint_names.clone(),
            held_joint_names: plan.held_joints.keys().cloned().collect(),
            held_joints: plan.held_joints.values().copied().collect(),
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
            segment_moves: plan
                .segments
                .iter()
                .flat_map(|segment| {
                    let moves = |name| segment.moving_fingers().any(|moving| moving == name);
                    plan.fingers.iter().map(move |name| i64::from(moves(name)))
                })
                .collect(),
            segment_rolling_fingers: plan
                .segments
                .iter()
                .map(|segment| finger_number(&plan.fingers, segment.rolling_finger.as_deref()))
                .collect(),
            segment_held_by: plan
                .segments
                .iter()
                .flat_map(|segment| holders.iter().map(|holder| i64::from(segment.held_by.contains(holder))))
                .collect(),
            holders,
            segment_starts,
        }
    }

    /// All numeric arrays over the waypoints, in the order of the fields; those over segments are not among them.
    /// `joint_torques` is left out in plans without forces.
    pub fn numeric(&self) -> Vec<NumericArray<'_>> {
        use Numbers::{Bytes, Floats, Integers};
        let (n, j, f) = (self.n_waypoints, self.joint_names.len(), self.fingers.len());
        let mut arrays = Vec::new();
        let mut add = |name, shape: &[usize], data| arrays.push(NumericArray { name, shape: shape.to_vec(), data });
        add("times", &[n], Floats(&self.times));
        add("joints", &[n, j], Floats(&self.joints));
        add("joint_velocities", &[n, j], Floats(&self.joint_velocities));
        if let Some(torques) = &self.joint_torques {
            add("joint_torques", &[n, j], Floats(torques));
        }
        add("object_positions", &[n, 3], Floats(&self.object_positions));
        add("object_quat_xyzw", &[n, 4], Floats(&self.object_quat_xyzw));
        add("contact_modes", &[n, f], Bytes(&self.contact_modes));
        add("contact_points_in_object", &[n, f, 3], Floats(&self.contact_points_in_object));
        add("contact_normals_in_object", &[n, f, 3], Floats(&self.contact_normals_in_object));
        add("contact_forces_in_object", &[n, f, 3], Floats(&self.contact_forces_in_object));
        add("contact_torsions", &[n, f], Floats(&self.contact_torsions));
        add("segment_of_waypoint", &[n], Integers(&self.segment_of_waypoint));
        arrays
    }
}

pub(crate) fn mode_number(mode: ContactMode) -> u8 {
    match mode {
        ContactMode::Free => 0,
        ContactMode::Fixed => 1,
        ContactMode::Rolling => 2,
        ContactMode::PureRolling => 3,
        ContactMode::Twisting => 4,
        ContactMode::PureSliding => 5,
        ContactMode::Sliding => 6,
    }
}

fn finger_number(fingers: &[String], name: Option<&str>) -> i64 {
    fingers.iter().zip(0..).find(|(finger, _)| Some(finger.as_str()) == name).map_or(-1, |(_, index)| index)
}
