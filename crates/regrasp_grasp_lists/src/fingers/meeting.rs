//! Where the workspaces of the fingers meet, and which finger touches first.

use super::spheres::Workspheres;
use regrasp_geometry::{Point, Vector};
use regrasp_robot::Hand;

/// The centre of what most workspaces share, in the hand frame: grasp frames have their origin there.
pub fn meeting_point(fingers: &[Workspheres]) -> Point {
    let (mut most, mut sum, mut n_points) = (0, Vector::zeros(), 0.0);
    for point in fingers.iter().flat_map(|finger| &finger.inside) {
        let n_fingers = fingers.iter().filter(|finger| finger.holds(point)).count();
        if n_fingers > most {
            (most, sum, n_points) = (n_fingers, Vector::zeros(), 0.0);
        }
        if n_fingers == most {
            sum += point.coords;
            n_points += 1.0;
        }
    }
    if most >= 2 {
        return Point::from(sum / n_points);
    }
    // No two workspaces share anything: the middle between them.
    let centers = fingers.iter().map(|finger| finger.bound.center.coords);
    Point::from(centers.sum::<Vector>() / fingers.len().max(1) as f64)
}

/// The finger that touches first: the one asked for, else a thumb by its name, else the finger whose place at rest is farthest
/// from the middle of the others. Errors: no finger of the name asked for.
pub fn first_finger(hand: &Hand, asked: Option<&str>) -> Result<usize, String> {
    if let Some(name) = asked {
        let names: Vec<&str> = hand.fingers.iter().map(|finger| finger.name.as_str()).collect();
        return hand
            .finger_named(name)
            .map(|finger| finger.0)
            .ok_or_else(|| format!("first_finger is \"{name}\"; the hand has {}", names.join(", ")));
    }
    let is_thumb = |name: &str| {
        let name = name.to_lowercase();
        name.contains("thumb") || name.starts_with("th")
    };
    if let Some(finger) = hand.fingers.iter().position(|finger| is_thumb(&finger.name)) {
        return Ok(finger);
    }
    let tips: Vec<Vector> = hand.fingers.iter().map(|finger| finger.ik.tip(&finger.rest).coords).collect();
    let sum: Vector = tips.iter().sum();
    let apart = |tip: &Vector| (tip - (sum - tip) / (tips.len().max(2) - 1) as f64).norm();
    let farthest = (0..tips.len()).max_by(|&a, &b| apart(&tips[a]).total_cmp(&apart(&tips[b])).then(b.cmp(&a)));
    Ok(farthest.unwrap_or(0))
}
