//! Contacts of plans of whole robots as arrays: a column for every finger of every hand.

use crate::arrays::{CONTACT_MODES, Numbers, mode_number};
use crate::npz::{Npz, integers, names, npy, texts};
use regrasp_plan::ContactMode;
use regrasp_plan::robot_plan::{RobotContact, RobotPlan};

/// The arrays. NaN where a finger does not touch.
pub(super) struct ContactArrays {
    pub hands: Vec<String>,
    /// `HAND/FINGER`, hand by hand.
    pub fingers: Vec<String>,
    hand_of_finger: Vec<i64>,
    modes: Vec<u8>,
    objects: Vec<i64>,
    points: Vec<f64>,
    normals: Vec<f64>,
    forces: Vec<f64>,
    torsions: Vec<f64>,
}

impl ContactArrays {
    pub fn of(plan: &RobotPlan) -> Self {
        let columns: Vec<(usize, &str, &str)> = (plan.hands.iter().enumerate())
            .flat_map(|(h, hand)| hand.fingers.iter().map(move |finger| (h, hand.name.as_str(), finger.as_str())))
            .collect();
        let mut arrays = ContactArrays {
            hands: plan.hands.iter().map(|hand| hand.name.clone()).collect(),
            fingers: columns.iter().map(|(_, hand, finger)| format!("{hand}/{finger}")).collect(),
            hand_of_finger: columns.iter().map(|(hand, ..)| *hand as i64).collect(),
            modes: Vec::new(),
            objects: Vec::new(),
            points: Vec::new(),
            normals: Vec::new(),
            forces: Vec::new(),
            torsions: Vec::new(),
        };
        for waypoint in plan.waypoints() {
            for (_, hand, finger) in &columns {
                let contact = waypoint.contacts.iter().find(|own| own.hand == *hand && own.finger == *finger);
                arrays.add(plan, contact);
            }
        }
        arrays
    }

    fn add(&mut self, plan: &RobotPlan, contact: Option<&RobotContact>) {
        self.modes.push(mode_number(contact.map_or(ContactMode::Free, |contact| contact.mode)));
        let object = contact.and_then(|contact| plan.objects.iter().position(|object| *object == contact.object));
        self.objects.push(object.map_or(-1, |object| object as i64));
        let vector = |of: fn(&RobotContact) -> Option<[f64; 3]>| contact.and_then(of).unwrap_or([f64::NAN; 3]);
        self.points.extend(vector(|contact| Some(contact.point_in_object)));
        self.normals.extend(vector(|contact| Some(contact.normal_in_object)));
        self.forces.extend(vector(|contact| contact.force_in_object));
        self.torsions.push(contact.and_then(|contact| contact.torsion).unwrap_or(f64::NAN));
    }

    /// Adds the arrays, of `n` waypoints.
    pub fn add_to(&self, file: &mut Npz, n: usize) {
        let f = self.fingers.len();
        let floats = |shape: &[usize], values: &[f64]| {
            let values = Numbers::Floats(values);
            npy(values.numpy_type(), shape, values.to_bytes())
        };
        file.add("hands", &names(&self.hands));
        file.add("fingers", &names(&self.fingers));
        file.add("hand_of_finger", &integers(&[f], &self.hand_of_finger));
        file.add("contact_mode_names", &texts(&[CONTACT_MODES.len()], &CONTACT_MODES));
        file.add("contact_modes", &npy("|u1", &[n, f], self.modes.clone()));
        file.add("contact_objects", &integers(&[n, f], &self.objects));
        file.add("contact_points_in_object", &floats(&[n, f, 3], &self.points));
        file.add("contact_normals_in_object", &floats(&[n, f, 3], &self.normals));
        file.add("contact_forces_in_object", &floats(&[n, f, 3], &self.forces));
        file.add("contact_torsions", &floats(&[n, f], &self.torsions));
    }
}
