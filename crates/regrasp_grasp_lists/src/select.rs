//! Which of all grasps make the list: those that are far from each other, weighted by their score.

use crate::found::Found;
use crate::search::worth::holding;
use regrasp_geometry::Vector;

/// A turn of the hand by half a turn counts as this many radii of the object.
const TURN: f64 = 2.0;

/// Indices of `n_wanted` grasps, in the order in which they are chosen: the best score, then always the grasp for which the
/// distance from those chosen so far, times the score, is largest.
pub fn diverse(found: &[Found], n_wanted: usize, object_radius: f64) -> Vec<usize> {
    let Some(first) = (0..found.len()).max_by(|&a, &b| found[a].score.total_cmp(&found[b].score).then(b.cmp(&a)))
    else {
        return Vec::new();
    };
    let mut nearest = vec![f64::INFINITY; found.len()];
    let mut chosen = vec![first];
    nearest[first] = f64::NEG_INFINITY;
    while chosen.len() < n_wanted.min(found.len()) {
        let last = &found[chosen[chosen.len() - 1]];
        let (mut best, mut most) = (None, f64::NEG_INFINITY);
        for (index, grasp) in found.iter().enumerate() {
            if nearest[index] == f64::NEG_INFINITY {
                continue;
            }
            nearest[index] = nearest[index].min(distance(grasp, last, object_radius));
            let worth = nearest[index] * grasp.score.max(1e-6);
            if worth > most {
                (best, most) = (Some(index), worth);
            }
        }
        let Some(best) = best else { break };
        nearest[best] = f64::NEG_INFINITY;
        chosen.push(best);
    }
    chosen
}

/// How far apart two grasps are, in radii of the object: shift and turn of the wrist, and the mean shift of the contacts.
pub fn distance(a: &Found, b: &Found, object_radius: f64) -> f64 {
    let (from, to) = (a.state.world_from_object.inverse(), b.state.world_from_object.inverse());
    let shift = (from.translation.vector - to.translation.vector).norm() / object_radius;
    let turn = from.rotation.angle_to(&to.rotation) / std::f64::consts::PI * TURN;
    shift + turn + contacts_apart(a, b) / object_radius
}

/// Mean distance between the contacts of the same finger; a finger that touches in one grasp only is away from the centroid of the
/// other's contacts.
fn contacts_apart(a: &Found, b: &Found) -> f64 {
    let centroid = |grasp: &Found| -> Vector {
        let sum: Vector = holding(&grasp.state).map(|f| grasp.state.contacts[f].point_in_object.coords).sum();
        sum / holding(&grasp.state).count().max(1) as f64
    };
    let (of_a, of_b) = (centroid(a), centroid(b));
    let n = a.state.contacts.len();
    let sum: f64 = (0..n)
        .map(|f| {
            let point = |grasp: &Found, other: Vector| match grasp.state.contact(f) {
                Some(contact) => contact.point_in_object.coords,
                None => other,
            };
            (point(a, of_a) - point(b, of_b)).norm()
        })
        .sum();
    sum / n.max(1) as f64
}
