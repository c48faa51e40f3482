//! Grasp lists as arrays for numpy, without pickle.

use crate::arrays::Numbers;
use crate::error::ExportError;
use crate::npz::{Npz, integers, names, npy, refuse_too_long, texts};
use regrasp_plan::grasps::GraspList;

/// The bytes of an `.npz` file with the arrays of `list`: g grasps, j joints, f fingers. NaN stands where a finger does not touch.
///
/// Errors: a name so long that an array of names would be huge.
pub fn to_npz(list: &GraspList) -> Result<Vec<u8>, ExportError> {
    refuse_too_long("the joint names", &list.hand.joint_names)?;
    refuse_too_long("the finger names", &list.hand.fingers)?;
    refuse_too_long("the tool's name", std::slice::from_ref(&list.tool))?;
    refuse_too_long("the object's name", std::slice::from_ref(&list.object.name))?;
    let (n_grasps, n_joints, n_fingers) = (list.grasps.len(), list.hand.joint_names.len(), list.hand.fingers.len());
    let grasps = &list.grasps;
    let mut file = Npz::new();
    file.add("format", &texts(&[], &["regrasp-grasp-arrays"]));
    file.add("format_version", &integers(&[], &[1]));
    file.add("tool", &texts(&[], &[&list.tool]));
    file.add("object", &texts(&[], &[&list.object.name]));
    file.add("joint_names", &names(&list.hand.joint_names));
    file.add("fingers", &names(&list.hand.fingers));
    let mut add = |name: &str, shape: &[usize], values: Vec<f64>| {
        let values = Numbers::Floats(&values);
        file.add(name, &npy(values.numpy_type(), shape, values.to_bytes()));
    };
    let each =
        |of: &dyn Fn(&regrasp_plan::grasps::ListedGrasp) -> Vec<f64>| grasps.iter().flat_map(of).collect::<Vec<f64>>();
    add("positions", &[n_grasps, 3], each(&|grasp| grasp.object_from_hand.position.to_vec()));
    add("quat_xyzw", &[n_grasps, 4], each(&|grasp| grasp.object_from_hand.quat_xyzw.to_vec()));
    add("joints", &[n_grasps, n_joints], each(&|grasp| grasp.joints.clone()));
    add("open_joints", &[n_grasps, n_joints], each(&|grasp| grasp.open_joints.clone()));
    add("joint_torques", &[n_grasps, n_joints], each(&|grasp| grasp.joint_torques.clone()));
    add("approach_directions", &[n_grasps, 3], each(&|grasp| grasp.approach.direction_in_object.to_vec()));
    add("approach_distances", &[n_grasps], each(&|grasp| vec![grasp.approach.distance]));
    add("margins", &[n_grasps], each(&|grasp| vec![grasp.margin]));
    add("scores", &[n_grasps], each(&|grasp| vec![grasp.score]));
    let of_contacts = |of: &dyn Fn(&regrasp_plan::grasps::ListedContact) -> [f64; 3]| {
        each(&|grasp| {
            let of_finger = |finger: &String| {
                let contact = grasp.contacts.iter().find(|contact| contact.finger == *finger);
                contact.map_or([f64::NAN; 3], of)
            };
            list.hand.fingers.iter().flat_map(of_finger).collect()
        })
    };
    let shape = [n_grasps, n_fingers, 3];
    add("contact_points_in_object", &shape, of_contacts(&|contact| contact.point_in_object));
    add("contact_normals_in_object", &shape, of_contacts(&|contact| contact.normal_in_object));
    add("contact_forces_in_object", &shape, of_contacts(&|contact| contact.force_in_object));
    Ok(file.finish())
}
