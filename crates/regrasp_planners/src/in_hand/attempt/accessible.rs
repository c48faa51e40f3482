//! Where a hand reaches an object with all of its fingers: an approximation of its accessibility domain, in which the methods
//! of Saut 2011 draw object poses (section 4.2.2).

use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector, frame};
use regrasp_manipulation::model::Model;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::collections::BTreeSet;

/// Postures of each finger in which its tip is looked at.
const POSTURES: usize = 256;
/// Edge of the cells in which places are remembered, in metres.
const CELL: f64 = 0.008;
/// Share of the places drawn in cells that are known, or beside them. By hand: the others find what is not known yet.
const KNOWN_SHARE: f64 = 0.8;
/// Places drawn before one is taken that some finger may not reach.
const TRIES: usize = 64;

/// Places of the object's centre of mass, in the hand's frame, at which every fingertip comes as near as the object is large.
#[derive(Debug, Clone)]
pub struct Accessible {
    /// Tip centres of every finger over postures drawn uniformly in the joint limits.
    tips: Vec<Vec<Point>>,
    /// Largest distance of the object's centre of mass from a tip centre that touches it, finger by finger.
    reach: Vec<f64>,
    low: Point,
    high: Point,
    /// Cells of places at which a grasp was found.
    cells: BTreeSet<[i32; 3]>,
    /// The same, to draw from.
    known: Vec<[i32; 3]>,
}

impl Accessible {
    /// Measures the hand of `model` with its object.
    pub fn measure(model: &Model, rng: &mut Rng) -> Self {
        let tips: Vec<Vec<Point>> = (0..model.n_fingers()).map(|finger| draw_tips(model, finger, rng)).collect();
        let reach: Vec<f64> = model.fingers.iter().map(|finger| model.view.object.radius + finger.tip_radius).collect();
        let (mut low, mut high) = (Point::from(Vector::repeat(f64::MIN)), Point::from(Vector::repeat(f64::MAX)));
        for (tips, &reach) in tips.iter().zip(&reach) {
            let (least, most) = tips.iter().fold((tips[0].coords, tips[0].coords), |(least, most), tip| {
                (least.inf(&tip.coords), most.sup(&tip.coords))
            });
            low = Point::from(low.coords.sup(&least.add_scalar(-reach)));
            high = Point::from(high.coords.inf(&most.add_scalar(reach)));
        }
        Accessible { tips, reach, low, high, cells: BTreeSet::new(), known: Vec::new() }
    }

    /// Takes note of a pose at which a grasp was found.
    pub fn learn(&mut self, model: &Model, pose: &Pose) {
        let center = pose * model.view.object.center_of_mass;
        let cell = [center.x, center.y, center.z].map(|value| (value / CELL).floor() as i32);
        if self.cells.insert(cell) {
            self.known.push(cell);
        }
    }

    /// A pose turned uniformly, with the centre of mass uniform over the cells at which grasps were found and those beside them, or
    /// over all of these places.
    pub fn draw(&self, model: &Model, rng: &mut Rng) -> Pose {
        let turned = frame::pose_from([0.0; 3], rng.quat_xyzw());
        let is_known = !self.known.is_empty() && rng.chance(KNOWN_SHARE);
        let mut center = Point::origin();
        for _ in 0..TRIES {
            center = if is_known { self.draw_in_cells(rng) } else { self.draw_in_box(rng) };
            if self.contains(&center) {
                break;
            }
        }
        let origin = center - turned.rotation * model.view.object.center_of_mass.coords;
        Pose::from_parts(origin.coords.into(), turned.rotation)
    }

    /// True when some tip of every finger was seen as near to `center` as the object is large.
    pub fn contains(&self, center: &Point) -> bool {
        let mut fingers = self.tips.iter().zip(&self.reach);
        fingers.all(|(tips, &reach)| tips.iter().any(|tip| (tip - center).norm_squared() <= reach * reach))
    }

    fn draw_in_cells(&self, rng: &mut Rng) -> Point {
        let cell = self.known[rng.below(self.known.len())];
        Point::from(Vector::from(cell.map(|index| CELL * (f64::from(index) + rng.uniform(-1.0, 2.0)))))
    }

    fn draw_in_box(&self, rng: &mut Rng) -> Point {
        let mut center = Point::origin();
        for axis in 0..3 {
            let (low, high) = (self.low[axis], self.high[axis]);
            center[axis] = rng.uniform(low.min(high), high.max(low));
        }
        center
    }
}

/// Tip centres over random postures within the joint limits; where the limits of sums refuse all, that at rest.
fn draw_tips(model: &Model, finger: usize, rng: &mut Rng) -> Vec<Point> {
    let ik = &model.fingers[finger].ik;
    let chain = ik.chain();
    let rest = &model.view.hand.fingers[finger].rest;
    let mut tips = vec![model.fingers[finger].tip_at_rest];
    for _ in 0..POSTURES {
        let joints: Coordinates = (0..chain.n_coordinates())
            .map(|k| rng.uniform(chain.lower[k].max(rest[k] - FULL_TURN), chain.upper[k].min(rest[k] + FULL_TURN)))
            .collect();
        if chain.within_linear_limits(&joints, 0.0) {
            tips.push(ik.tip(&joints));
        }
    }
    tips
}

/// Joints without limits are drawn within half a turn of where they rest.
const FULL_TURN: f64 = std::f64::consts::PI;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::InHandSettings;
    use regrasp_robot::import::LoadOptions;
    use std::path::Path;

    /// The pencil is reversed only by bringing it back over the hand: such places are drawn, and none that a finger cannot reach.
    #[test]
    fn the_pencil_is_brought_over_the_hand_and_never_out_of_reach() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/pencil.toml");
        let loaded = regrasp_scene::load_scene(&path, &LoadOptions::default()).unwrap();
        let view = loaded.view();
        let settings = InHandSettings::default();
        let model = Model::new(&view, &settings.physics);
        let mut rng = Rng::keyed(0, "accessible", 0);
        let accessible = Accessible::measure(&model, &mut rng);
        let start = loaded.task().query(0).as_in_hand().unwrap().world_from_object_start;
        assert!(accessible.contains(&(start * view.object.center_of_mass)));
        assert!(!accessible.contains(&Point::new(0.0, 0.0, 0.4)));
        let poses: Vec<Pose> = (0..500).map(|_| accessible.draw(&model, &mut rng)).collect();
        let centers = || poses.iter().map(|pose| pose * view.object.center_of_mass);
        assert!(centers().all(|center| accessible.contains(&center)));
        let over_the_hand = centers().filter(|center| center.x.hypot(center.y) < 0.02).count();
        let far_off = centers().filter(|center| center.x.hypot(center.y) > 0.06).count();
        assert!(over_the_hand > 5 && far_off > 50, "{over_the_hand} {far_off}");
    }
}
