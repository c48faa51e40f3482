//! A first try with links that keep farther from everything than they must, and grasps that hold better: in a hand that
//! gives, links stray by more than plans keep them away, and what they touch then throws the object.

use super::attempts::{MOVE_THE_START, allow_more, within};
use super::duration::times_longer_to_search;
use crate::settings::{InHandSettings, Method, SearchSettings};
use regrasp_geometry::collision::support::support_value;
use regrasp_geometry::{Vector, frame};
use regrasp_manipulation::failure::Failure;
use regrasp_manipulation::settings::PhysicsSettings;
use regrasp_robot::Finger;
use regrasp_scene::HandView;

/// Directions across a link in which its width is measured.
const DIRECTIONS: usize = 32;

/// Settings and work of what is tried first, in order; none where there is nothing to try: more clearance and more closure, and
/// more clearance alone. Each has a quarter of `search_work` at most.
///
/// Where the query gives the start grasp (`gives_start`) they have no more work than twice that of a look along courses.
pub fn first_tries(
    view: &HandView,
    settings: &InHandSettings,
    search_work: u64,
    gives_start: bool,
) -> Vec<(InHandSettings, u64)> {
    let Some(wanted) = settings.search.first_try.filter(|_| settings.method == Method::Gait) else { return Vec::new() };
    let most_work = match gives_start && settings.search.courses_work > 0 {
        true => wanted.work.min(settings.search.courses_work.saturating_mul(2)),
        false => wanted.work,
    };
    let most_work = most_work / times_longer_to_search(view);
    let can_keep = |finger: &Finger| stand_back(finger).is_none_or(|back| back >= 2.0 * wanted.clearance);
    let keeps_away = wanted.clearance > settings.physics.clearance && view.hand.fingers.iter().all(can_keep);
    let closes_more = wanted.closure_margin > settings.physics.closure_margin;
    let with = |keeps_away: bool, closes_more: bool| {
        let clearance = if keeps_away { wanted.clearance } else { settings.physics.clearance };
        let closure_margin = if closes_more { wanted.closure_margin } else { settings.physics.closure_margin };
        let work = most_work.min(search_work / 4);
        let physics = PhysicsSettings { clearance, closure_margin, ..settings.physics.clone() };
        let search = SearchSettings { first_try: None, ..settings.search.clone() };
        (InHandSettings { physics, search, ..settings.clone() }, work)
    };
    match (keeps_away, closes_more) {
        (true, true) => vec![with(true, true), with(true, false)],
        (false, false) => Vec::new(),
        (keeps_away, closes_more) => vec![with(keeps_away, closes_more)],
    }
}

/// Says in the failure of the usual search how near first tries came that `missed` too, where they came nearer on the same leg.
pub fn tell(failure: &mut Failure, missed: Vec<Failure>) {
    let own = failure.nearest_miss.as_ref().map_or(f64::INFINITY, |miss| miss.angle_left);
    let same_leg = missed.into_iter().filter(|tried| tried.leg == failure.leg).filter_map(|tried| tried.nearest_miss);
    let nearest = same_leg.min_by(|a, b| a.angle_left.total_cmp(&b.angle_left));
    let Some(nearest) = nearest.filter(|nearest| nearest.angle_left < own) else { return };
    failure.message.push_str(&format!("; a first try, which asks for more (first_try), came {}", within(&nearest)));
    if failure.advice.starts_with(MOVE_THE_START) {
        // It found grasps there.
        failure.advice = allow_more(failure.kind).into();
    }
    failure.nearest_miss = Some(nearest);
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
    use regrasp_geometry::{ConvexHull, Point};
    use regrasp_manipulation::failure::{FailureKind, NearestMiss};
    use regrasp_plan::plan::PoseData;
    use regrasp_robot::LoadOptions;
    use regrasp_robot::tip::smooth_hull::SmoothHull;
    use regrasp_robot::tip::{HullSurface, TipShape};

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
            first_tries(&view, &settings, 1000, false)
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
        let with_start = first_tries(&view, &hurried, 1_000_000, true);
        assert_eq!(asked(&with_start), [(usual.physics.clearance, wanted.closure_margin, 140)]);
        let nearer = FirstTry { clearance: 0.0005, work: 90, ..wanted };
        let both = [(0.0005, wanted.closure_margin, 90), (0.0005, usual.physics.closure_margin, 90)];
        assert_eq!(asked(&with(nearer)), both);
    }

    #[test]
    fn fingertips_that_are_meshes_on_a_mesh_have_a_sixteenth() {
        let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let sphere = "sphere = { radius = 0.032 }";
        let usual = std::fs::read_to_string(scenes.join("sphere_90x.toml")).unwrap();
        let cube: Vec<Point> =
            (0..8).map(|k| Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 0.01).collect();
        let cube = ConvexHull::new(&cube.iter().map(|p| p - Vector::repeat(0.005)).collect::<Vec<_>>()).unwrap();
        let (surface, misfit) = SmoothHull::near(&cube, None).unwrap();
        let tries = |object: &str, has_mesh_tip: bool| -> Vec<u64> {
            assert!(usual.contains(sphere));
            let bytes = usual.replace(sphere, object).into_bytes();
            let path = scenes.join("stone.toml");
            let mut loaded = regrasp_scene::load_scene_text(&path, bytes, &LoadOptions::default()).unwrap();
            if has_mesh_tip {
                loaded.scene.hands[0].hand.fingers[2].tip.shape = TipShape::Hull {
                    hull: cube.clone().into(),
                    surface: HullSurface::Smooth(surface.clone().into()),
                    misfit,
                    elements: vec![],
                };
            }
            let tries = first_tries(&loaded.view(), &InHandSettings::default(), 10_000_000, false);
            assert!(!tries.is_empty());
            tries.into_iter().map(|(_, work)| work).collect()
        };
        let mesh = "mesh = { file = \"../assets/objects/icosahedron.obj\" }";
        assert_eq!(tries(mesh, false), tries(sphere, false));
        assert_eq!(tries(mesh, true), tries(sphere, true).iter().map(|work| work / 16).collect::<Vec<u64>>());
    }

    #[test]
    fn hands_of_more_than_four_fingers_have_a_quarter() {
        let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let tries = |scene: &str| -> Vec<u64> {
            let loaded = regrasp_scene::load_scene(&scenes.join(scene), &LoadOptions::default()).unwrap();
            let tries = first_tries(&loaded.view(), &InHandSettings::default(), 10_000_000, false);
            tries.into_iter().map(|(_, work)| work).collect()
        };
        let of_four = tries("box_90x.toml");
        assert!(!of_four.is_empty());
        assert_eq!(tries("six_finger_box_90x.toml"), of_four.iter().map(|work| work / 4).collect::<Vec<u64>>());
    }

    #[test]
    fn failures_tell_of_first_tries_that_came_nearer() {
        let missed = |leg: Option<usize>, degrees: Option<f64>| {
            let mut failure = Failure::bare(FailureKind::TimeLimit, "no plan".into(), "allow more time");
            failure.leg = leg;
            failure.nearest_miss = degrees.map(|degrees| {
                Box::new(NearestMiss {
                    world_from_object: PoseData::from(&regrasp_geometry::Pose::identity()),
                    angle_left: f64::to_radians(degrees),
                    distance_left: 0.001,
                    joints: vec![],
                })
            });
            failure
        };
        let left = |failure: &Failure| failure.nearest_miss.as_ref().map(|miss| miss.angle_left.to_degrees().round());
        let tries =
            || vec![missed(None, Some(40.0)), missed(None, None), missed(None, Some(30.0)), missed(Some(1), Some(5.0))];
        let mut never_began = missed(None, None);
        tell(&mut never_began, tries());
        assert_eq!(left(&never_began), Some(30.0));
        assert_eq!(
            never_began.message,
            "no plan; a first try, which asks for more (first_try), came within 30.0 degrees and 1.0 mm"
        );
        let mut misled = Failure { advice: format!("{MOVE_THE_START} (mostly: out of reach)"), ..missed(None, None) };
        tell(&mut misled, tries());
        assert_eq!(misled.advice, "allow more time (--time-limit, time_limit)");
        let mut nearer = missed(None, Some(20.0));
        tell(&mut nearer, tries());
        assert_eq!((left(&nearer), nearer.message.as_str()), (Some(20.0), "no plan"));
    }
}
