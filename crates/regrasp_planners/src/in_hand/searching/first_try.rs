//! A first try with links that keep farther from everything than they must, and grasps that hold better: in a hand that
//! gives, links stray by more than plans keep them away, and what they touch then throws the object.

use crate::settings::{InHandSettings, Method, SearchSettings};
use regrasp_base::Budget;
use regrasp_geometry::collision::support::support_value;
use regrasp_geometry::{Vector, frame};
use regrasp_manipulation::settings::PhysicsSettings;
use regrasp_robot::Finger;
use regrasp_scene::HandView;

/// Directions across a link in which its width is measured.
const DIRECTIONS: usize = 32;

/// Share of the work for the try that asks for both; by hand.
const SHARE_FOR_BOTH: f64 = 1.0 / 3.0;

/// Settings and work of what is tried first, in order; none where there is nothing to try: more clearance and more closure, and
/// more clearance alone.
///
/// Where the query gives the start grasp (`gives_start`) they have no more work than twice that of a look along courses.
pub fn first_tries(
    view: &HandView,
    settings: &InHandSettings,
    budget: &Budget,
    gives_start: bool,
) -> Vec<(InHandSettings, u64)> {
    let Some(wanted) = settings.search.first_try.filter(|_| settings.method == Method::Gait) else { return Vec::new() };
    let most_work = match gives_start && settings.search.courses_work > 0 {
        true => wanted.work.min(settings.search.courses_work.saturating_mul(2)),
        false => wanted.work,
    };
    let can_keep = |finger: &Finger| stand_back(finger).is_none_or(|back| back >= 2.0 * wanted.clearance);
    let keeps_away = wanted.clearance > settings.physics.clearance && view.hand.fingers.iter().all(can_keep);
    let closes_more = wanted.closure_margin > settings.physics.closure_margin;
    let with = |keeps_away: bool, closes_more: bool, share: f64| {
        let clearance = if keeps_away { wanted.clearance } else { settings.physics.clearance };
        let closure_margin = if closes_more { wanted.closure_margin } else { settings.physics.closure_margin };
        let work = ((most_work as f64 * share) as u64).min(budget.max_work / 4);
        let physics = PhysicsSettings { clearance, closure_margin, ..settings.physics.clone() };
        let search = SearchSettings { first_try: None, ..settings.search.clone() };
        (InHandSettings { physics, search, ..settings.clone() }, work)
    };
    match (keeps_away, closes_more) {
        (true, true) => vec![with(true, true, SHARE_FOR_BOTH), with(true, false, 1.0)],
        (false, false) => Vec::new(),
        (keeps_away, closes_more) => vec![with(keeps_away, closes_more, 1.0)],
    }
}

/// How far the link behind a round tip stands back behind it where it is thinnest, in metres: no finger keeps its last link
/// farther from a plane that its tip touches, whichever way it turns. None for tips without such a link, and for sharp ones.
fn stand_back(finger: &Finger) -> Option<f64> {
    let last = finger.chain.joints.len() - 1;
    let (x, y) = frame::tangents(&nalgebra::Unit::try_new(finger.tip.center_in_body.coords, 1e-6)?);
    let behind = || finger.shapes.iter().filter(|shape| shape.body == last && !shape.is_tip);
    if behind().next().is_none() || finger.tip.radius() == 0.0 {
        return None;
    }
    let width = |across: &Vector| {
        let reach = behind().map(|shape| {
            let body_from_shape = &shape.placed.parent_from_shape;
            let own = support_value(&shape.placed.shape, &(body_from_shape.rotation.inverse() * across), &mut 0);
            body_from_shape.translation.vector.dot(across) + own
        });
        reach.fold(0.0, f64::max)
    };
    let thinnest = (0..DIRECTIONS).map(|k| {
        let (sine, cosine) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        width(&(x.into_inner() * cosine + y.into_inner() * sine))
    });
    Some(finger.tip.radius() - thinnest.fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::FirstTry;
    use regrasp_robot::LoadOptions;

    #[test]
    fn the_wide_hand_stands_back_by_what_its_urdf_says() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
        let loaded = regrasp_scene::load_scene(&path, &LoadOptions::default()).unwrap();
        let view = loaded.view();
        // Tips of 5 mm on capsules of 4 mm.
        for finger in &view.hand.fingers {
            assert!((stand_back(finger).unwrap() - 0.001).abs() < 1e-9);
        }
        let with = |wanted: FirstTry| {
            let search = SearchSettings { first_try: Some(wanted), ..SearchSettings::default() };
            let settings = InHandSettings { search, ..InHandSettings::default() };
            first_tries(&view, &settings, &Budget::work(1000), false)
        };
        let (usual, wanted) = (InHandSettings::default(), FirstTry::default());
        assert!(with(FirstTry { closure_margin: 0.0, ..wanted }).is_empty());
        let asked = |tries: &[(InHandSettings, u64)]| -> Vec<(f64, f64, u64)> {
            assert!(tries.iter().all(|(settings, _)| settings.search.first_try.is_none()));
            tries
                .iter()
                .map(|(settings, work)| (settings.physics.clearance, settings.physics.closure_margin, *work))
                .collect()
        };
        assert_eq!(asked(&with(wanted)), [(usual.physics.clearance, wanted.closure_margin, 250)]);
        let search = SearchSettings { first_try: Some(wanted), courses_work: 70, ..SearchSettings::default() };
        let hurried = InHandSettings { search, ..InHandSettings::default() };
        let with_start = first_tries(&view, &hurried, &Budget::work(1_000_000), true);
        assert_eq!(asked(&with_start), [(usual.physics.clearance, wanted.closure_margin, 140)]);
        let nearer = FirstTry { clearance: 0.0005, work: 90, ..wanted };
        let both = [(0.0005, wanted.closure_margin, 30), (0.0005, usual.physics.closure_margin, 90)];
        assert_eq!(asked(&with(nearer)), both);
    }
}
