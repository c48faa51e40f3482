//! The list of what was found.

use crate::found::Found;
use crate::prepared::Prepared;
use crate::search::worth::{held, holding};
use regrasp_geometry::stable::Standing;
use regrasp_grasp::list::{
    Approach, FORMAT, FORMAT_VERSION, GraspList, GraspPromises, GraspStatistics, HandRecord, ListedContact,
    ListedGrasp, ObjectRecord, StablePose,
};
use regrasp_grasp::record::PoseData;
use regrasp_manipulation::tolerances::CONTACT_TOLERANCE;
use regrasp_robot::ContactModel;

/// The list with `grasps`; no files are known here.
pub fn list(prepared: &Prepared, statistics: GraspStatistics, grasps: &[Found]) -> GraspList {
    let model = prepared.model;
    let (hand, object, settings) = (model.view.hand, model.view.object, prepared.settings);
    let promised = prepared.forces.promises();
    GraspList {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        kind: settings.kind,
        seed: prepared.seed,
        settings: serde_json::to_value(settings).expect("settings always serialise"),
        source: None,
        inputs: Vec::new(),
        hand: HandRecord {
            name: hand.robot.name.clone(),
            base_link: hand.robot.links[hand.base.0].name.clone(),
            fingers: hand.fingers.iter().map(|finger| finger.name.clone()).collect(),
            joint_names: hand.joint_names(),
            held_joints: hand.held_joints(),
        },
        object: ObjectRecord {
            name: object.name.clone(),
            mass: object.mass,
            center_of_mass: object.center_of_mass.into(),
            friction: object.friction,
        },
        promises: GraspPromises {
            contact_tolerance: CONTACT_TOLERANCE,
            friction: model.frame.friction,
            friction_margin: model.settings.friction_margin,
            required_margin: settings.margin,
            torque_scale: model.frame.torque_scale,
            normal_force: promised.normal_force,
            joint_torques: promised.joint_torques,
            tipping_angle: settings.tipping_angle,
        },
        stable_poses: prepared.standing.iter().map(stable_pose).collect(),
        statistics,
        grasps: grasps.iter().map(|found| grasp(prepared, found)).collect(),
    }
}

fn grasp(prepared: &Prepared, found: &Found) -> ListedGrasp {
    let hand = prepared.model.view.hand;
    let state = &found.state;
    let held = held(prepared, &state.world_from_object, state);
    let mut contacts = Vec::new();
    let mut joint_torques: Vec<Vec<f64>> = state.joints.iter().map(|joints| vec![0.0; joints.len()]).collect();
    for (index, f) in holding(state).enumerate() {
        let (contact, exerted) = (state.contacts[f], found.forces[index]);
        let is_soft = matches!(prepared.model.fingers[f].contact, ContactModel::SoftFinger { .. });
        joint_torques[f] = held.torques(index, &exerted).to_vec();
        contacts.push(ListedContact {
            finger: hand.fingers[f].name.clone(),
            link: hand.robot.links[hand.fingers[f].tip.link.0].name.clone(),
            point_in_object: contact.point_in_object.into(),
            normal_in_object: contact.normal_in_object.into_inner().into(),
            force_in_object: exerted.force.into(),
            torsion: is_soft.then_some(exerted.torsion),
        });
    }
    ListedGrasp {
        object_from_hand: PoseData::from(&state.world_from_object.inverse()),
        joints: state.joints.iter().flatten().copied().collect(),
        open_joints: found.way.open.iter().flatten().copied().collect(),
        approach: Approach {
            direction_in_object: found.way.direction.into(),
            distance: prepared.settings.approach_distance,
        },
        contacts,
        joint_torques: joint_torques.into_iter().flatten().collect(),
        margin: found.margin,
        margin_before_refinement: found.margin_before,
        score: found.score,
        scores: found.scores,
        stable_poses: found.stable_poses.clone(),
    }
}

fn stable_pose(standing: &Standing) -> StablePose {
    StablePose { down_in_object: standing.down.into(), height: standing.height, tipping_angle: standing.tipping_angle }
}
