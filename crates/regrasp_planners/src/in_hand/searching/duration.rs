//! How long configurations take. Work is counted in them, and in some hands one takes as long as many in others.

use regrasp_robot::Finger;
use regrasp_robot::tip::CurvedTip;
use regrasp_scene::HandView;

/// How many times longer the same work takes where fingertips that are meshes roll on meshes. Measured on scans in the LEAP hand: 135 to 190
/// microseconds a configuration, where the Allegro's balls take 3.
const MESHES_ON_MESHES: u64 = 16;
/// The same where they roll on other shapes. Measured on queries between random poses of a sphere: 22 microseconds (LEAP) and 2.5 (Allegro).
const MESHES: u64 = 8;
/// The same for hands of more than four fingers, whose sets of fingers are many. Measured on the Shadow hand: a configuration takes 22
/// microseconds where it takes 7 in the Allegro.
const MANY_FINGERS: u64 = 4;
/// Fingers up to which they are not many.
const FEW_FINGERS: usize = 4;

/// How many times longer than in a hand of four fingers with balls a configuration takes, about.
pub fn times_longer(view: &HandView) -> u64 {
    match (has_mesh_tips(view), view.object.surface.mesh().is_some()) {
        (true, true) => MESHES_ON_MESHES,
        (true, false) => MESHES,
        (false, _) => for_many_fingers(view),
    }
}

/// The same where a search for a plan is to get less work: with all of it, first tries would take up to a minute where meshes roll on
/// meshes. Where they roll on other shapes, they are worth their time: a sphere in the LEAP hand took 1.28 s with it, and 1.79 s with a
/// quarter.
pub fn times_longer_to_search(view: &HandView) -> u64 {
    match has_mesh_tips(view) && view.object.surface.mesh().is_some() {
        true => MESHES_ON_MESHES,
        false => for_many_fingers(view),
    }
}

fn for_many_fingers(view: &HandView) -> u64 {
    if view.hand.fingers.len() > FEW_FINGERS { MANY_FINGERS } else { 1 }
}

fn has_mesh_tips(view: &HandView) -> bool {
    let is_mesh = |finger: &Finger| matches!(finger.tip.curved(), Some(CurvedTip::Smooth(_)));
    view.hand.fingers.iter().any(is_mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::{ConvexHull, Point, Vector};
    use regrasp_robot::LoadOptions;
    use regrasp_robot::tip::smooth_hull::SmoothHull;
    use regrasp_robot::tip::{HullSurface, TipShape};
    use std::path::Path;

    /// Of a scene whose text is changed, and one of whose fingertips may be a cube.
    fn asked(name: &str, (from, to): (&str, &str), has_mesh_tip: bool) -> [u64; 2] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from));
        let bytes = text.replace(from, to).into_bytes();
        let mut loaded = regrasp_scene::load_scene_text(&path, bytes, &LoadOptions::default()).unwrap();
        if has_mesh_tip {
            let sign = |k: u32, bit: u32| f64::from(k >> bit & 1) - 0.5;
            let corner = |k: u32| Point::from(Vector::new(sign(k, 0), sign(k, 1), sign(k, 2)) * 0.01);
            let cube = ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
            let (surface, misfit) = SmoothHull::near(&cube, None).unwrap();
            let surface = HullSurface::Smooth(surface.into());
            loaded.scene.hands[0].hand.fingers[1].tip.shape =
                TipShape::Hull { hull: cube.into(), surface, misfit, elements: vec![] };
        }
        let view = loaded.view();
        [times_longer(&view), times_longer_to_search(&view)]
    }

    #[test]
    fn hands_with_mesh_tips_or_many_fingers_take_longer() {
        let same = ("radius = 0.032", "radius = 0.032");
        let mesh = ("sphere = { radius = 0.032 }", "mesh = { file = \"../assets/objects/icosahedron.obj\" }");
        assert_eq!(asked("sphere_90x.toml", same, false), [1, 1]);
        assert_eq!(asked("sphere_90x.toml", mesh, false), [1, 1]);
        assert_eq!(asked("sphere_90x.toml", same, true), [8, 1]);
        assert_eq!(asked("sphere_90x.toml", mesh, true), [16, 16]);
        assert_eq!(asked("six_finger_box_90x.toml", ("friction", "friction"), false), [4, 4]);
        assert_eq!(asked("six_finger_box_90x.toml", ("friction", "friction"), true), [8, 4]);
    }
}
