//! Fingers of one or two independent joints, and flat ones: their tips come to no point that is chosen beforehand. They find contacts by
//! closing: along a straight line in their joints, until the tip touches.

use crate::grasp::touch::touch_on_way;
use crate::grasp::usable::is_usable;
use crate::model::Model;
use crate::workspace::Workspace;
use nalgebra::{Rotation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Lines tried for one contact.
const LINES: usize = 12;
/// Postures drawn for the end of a line, of which that counts where the tip is nearest to the object. By hand.
const ENDS: usize = 4;
/// Work of a line, in configurations: some twenty distances between tip and surface.
const LINE_WORK: u64 = 3;
/// Range of a joint without limits, in radians or metres, to both sides.
const ENDLESS: f64 = std::f64::consts::PI;

/// A contact that `finger` makes when it closes on the object at `world_from_object`, with its joints there.
///
/// None when no line drawn leads to one from which the finger can be lifted again, clear of everything but the other fingers; and when the
/// work allowed is spent.
pub fn draw_touch(
    workspace: &mut Workspace,
    finger: usize,
    world_from_object: &Placement,
    rng: &mut Rng,
) -> Option<(Contact, Coordinates)> {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(world_from_object.rotation));
    let hand_from_object = Pose::from_parts(world_from_object.translation.into(), rotation);
    let has_one_line = has_one_line(workspace.model, finger);
    let backwards = has_one_line && rng.chance(0.5);
    // A finger that reaches points as well has other ways to a contact.
    let n_lines = if has_one_line || !workspace.model.fingers[finger].closes() { 2 } else { LINES };
    for index in 0..n_lines {
        if workspace.is_spent_on_draws() {
            return None;
        }
        let model = workspace.model;
        let mut line = draw_line(model, finger, world_from_object, rng);
        if has_one_line && (index % 2 == 1) != backwards {
            line.reverse();
        }
        let [open, closed] = line;
        workspace.count_draws(LINE_WORK);
        let touch = touch_on_way(model, finger, &hand_from_object, &open, &closed);
        let Some((contact, joints)) = touch else { continue };
        let chain = model.fingers[finger].ik.chain();
        if chain.within_limits(&joints, model.fingers[finger].limit_margin)
            && is_usable(workspace, finger, &contact, &joints, world_from_object)
        {
            return Some((contact, joints));
        }
    }
    None
}

/// True for a finger of a single joint: it closes along one line, to either side.
fn has_one_line(model: &Model, finger: usize) -> bool {
    model.fingers[finger].ik.chain().n_coordinates() == 1
}

/// Ends of a line in the joints of `finger`: of a single joint those of its range, else drawn, the second one with the tip near the
/// object.
fn draw_line(model: &Model, finger: usize, world_from_object: &Placement, rng: &mut Rng) -> [Coordinates; 2] {
    let ik = &model.fingers[finger].ik;
    let chain = ik.chain();
    let n = chain.n_coordinates();
    let range = |k: usize| {
        let margin = model.fingers[finger].limit_margin;
        let (low, high) = (chain.lower[k].max(-ENDLESS) + margin, chain.upper[k].min(ENDLESS) - margin);
        (low, high.max(low))
    };
    let draw = |rng: &mut Rng| -> Coordinates {
        (0..n)
            .map(|k| {
                let (low, high) = range(k);
                rng.uniform(low, high)
            })
            .collect()
    };
    if n == 1 {
        let (low, high) = range(0);
        return [low, high].map(|end| Coordinates::from_iter([end]));
    }
    let center = world_from_object.point(&model.frame.center_of_mass);
    let open = draw(rng);
    let ends: Vec<Coordinates> = (0..ENDS).map(|_| draw(rng)).collect();
    let distance = |joints: &Coordinates| (ik.tip(joints) - center).norm();
    let nearest = ends.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    [open, nearest.unwrap_or_else(|| draw(rng))]
}
