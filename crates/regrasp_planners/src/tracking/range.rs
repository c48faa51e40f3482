//! Ranges of orientations R_j (Cherif 1999, sec. 4): to which the object turns while three fingertips rest, in the world, and each
//! keeps its contact.
//!
//! Three distances to the surface fix the object's position at every orientation (eq. 1 for polyhedra, eq. 2 for smooth surfaces). A
//! range ends where a contact comes to an edge of its face, or where the three normals are in one plane: the grasp is singular there.
//! Of several positions the nearest to where the object was is taken, as in sec. 4.2: the way there is followed in small turns.

use crate::tracking::grasp::TrackingGrasp;
use nalgebra::{Matrix3, Rotation3};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::surface::Surface;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::contact::rolling::Touch;
use regrasp_manipulation::model::Model;

/// Fingertips that fix where the object is.
pub const RESTING: usize = 3;
/// Turns in which the way is followed, in radians: some eight for a way of 2 s at the extreme velocity. By hand.
const STEP: f64 = 0.01;
/// Volume that the three normals span, below which they count as lying in one plane.
const SINGULAR: f64 = 1e-3;
/// Steps of Newton's method.
const MOST_STEPS: usize = 12;
/// Distance that it leaves, in metres.
const REACHED: f64 = 1e-11;
/// Nearer to a crease than this, in metres, a ball touches the crease and no face: rounding.
const ON_CREASE: f64 = 1e-9;

/// True where a ball keeps its face: on smooth surfaces always. A face of a mesh ends at creases, not at the edges of its triangles:
/// where the corners of a face are rounded, its triangles are not quite in one plane.
pub fn stays_on_its_face(surface: &Surface, from: &Touch, to: &Touch) -> bool {
    !lies_on_crease(surface, to) && surface.same_face(&from.foot, &to.foot)
}

/// True where a ball touches an edge or a vertex.
pub fn lies_on_crease(surface: &Surface, touch: &Touch) -> bool {
    surface.crease_distance(&touch.foot) <= ON_CREASE
}

/// A fingertip that rests.
#[derive(Debug, Clone, Copy)]
struct Tip {
    center_in_world: Point,
    /// Of its ball, in metres.
    radius: f64,
    /// Where it touches now.
    touch: Touch,
}

/// The range of orientations about a grasp, for three fingertips that rest.
#[derive(Debug, Clone)]
pub struct Range<'a> {
    surface: &'a Surface,
    world_from_object: Placement,
    tips: [Tip; RESTING],
}

impl<'a> Range<'a> {
    /// Of `grasp`, where the fingers `resting` rest.
    pub fn of(model: &'a Model<'_>, grasp: &TrackingGrasp, resting: [usize; RESTING]) -> Self {
        let tip = |finger: usize| Tip {
            center_in_world: grasp.tip_in_world(model, finger),
            radius: model.fingers[finger].tip_radius,
            touch: grasp.touches[finger],
        };
        Range {
            surface: &model.view.object.surface,
            world_from_object: grasp.world_from_object,
            tips: resting.map(tip),
        }
    }

    /// Where the object is after the rotation vector `turn`, in the world, about a fixed axis. None where the way there leaves the
    /// range.
    pub fn turned(&self, turn: &Vector) -> Option<Placement> {
        let n_steps = (turn.norm() / STEP).ceil().max(1.0) as usize;
        let mut object = self.world_from_object;
        for step in 1..=n_steps {
            let angle = turn * (step as f64 / n_steps as f64);
            let rotation = Rotation3::new(angle).into_inner() * self.world_from_object.rotation;
            object = self.settled(Placement { rotation, translation: object.translation })?;
        }
        Some(object)
    }

    /// True where the range has all orientations on the way of the rotation vector `turn`, in the world.
    pub fn covers(&self, turn: &Vector) -> bool {
        self.turned(turn).is_some()
    }

    /// The object moved to where the fingertips touch, at the orientation of `near`; none at and beyond the end of the range.
    fn settled(&self, near: Placement) -> Option<Placement> {
        let mut object = near;
        for _ in 0..MOST_STEPS {
            let mut normals = Matrix3::zeros();
            let mut left = Vector::zeros();
            let mut on_faces = true;
            for (row, tip) in self.tips.iter().enumerate() {
                let touch = Touch::of(self.surface, &object.point_to_child(&tip.center_in_world))?;
                normals.set_row(row, &object.vector(&touch.ball.normal).transpose());
                left[row] = touch.distance - tip.radius;
                on_faces = on_faces && stays_on_its_face(self.surface, &tip.touch, &touch);
            }
            if normals.determinant().abs() < SINGULAR {
                return None;
            }
            if left.amax() < REACHED {
                return on_faces.then_some(object);
            }
            // Away from a tip, along its normal, the distance shrinks as the object follows.
            object.translation += normals.lu().solve(&left)?;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::Shape;

    const RADIUS: f64 = 0.03;

    /// Balls that touch `shape` where rays from its middle along `directions` leave it; the object stands at `object`.
    fn range<'a>(surface: &'a Surface, object: Placement, directions: [Vector; RESTING]) -> Range<'a> {
        let tip = |direction: Vector| {
            let foot = surface.cast_ray(&Point::origin(), &nalgebra::Unit::new_normalize(direction)).unwrap();
            let center = foot.point_in_object + foot.normal_in_object.into_inner() * RADIUS;
            let touch = Touch::of(surface, &center).unwrap();
            Tip { center_in_world: object.point(&center), radius: RADIUS, touch }
        };
        Range { surface, world_from_object: object, tips: directions.map(tip) }
    }

    fn drawn_pose(rng: &mut Rng) -> Placement {
        let angle = Vector::from(rng.direction()) * rng.uniform(0.0, 3.0);
        let rotation = Rotation3::new(angle).into_inner();
        Placement { rotation, translation: Vector::from(rng.direction()) * 0.2 }
    }

    /// How far the object turns about `axis` before it leaves the range, in radians; at most `most`.
    fn extent(range: &Range, axis: &Vector, most: f64) -> f64 {
        if range.covers(&(axis * most)) {
            return most;
        }
        let (mut inside, mut outside) = (0.0, most);
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if range.covers(&(axis * middle)) { inside = middle } else { outside = middle }
        }
        inside
    }

    /// A second way, Cherif 1999, eq. 1, for a cuboid: planes of faces about a point tip, a linear system for the position, and four
    /// inequalities for each contact. The smallest amount by which a contact is inside its face, in metres; below 0 outside.
    fn least_inside(
        half: &Vector,
        faces: &[Vector; 3],
        centers: &[Point; 3],
        rotation: &Matrix3<f64>,
    ) -> (f64, Vector) {
        let mut rows = Matrix3::zeros();
        let mut right = Vector::zeros();
        for (row, (face, center)) in faces.iter().zip(centers).enumerate() {
            rows.set_row(row, &face.transpose());
            right[row] = face.dot(&(rotation.transpose() * center.coords)) - face.abs().dot(half) - RADIUS;
        }
        // The object's origin as its own axes see it.
        let origin = rows.try_inverse().unwrap() * right;
        let mut least = f64::INFINITY;
        for (face, center) in faces.iter().zip(centers) {
            let contact = rotation.transpose() * center.coords - origin - face * RADIUS;
            for axis in (0..3).filter(|axis| face[*axis] == 0.0) {
                least = least.min(half[axis] - contact[axis].abs());
            }
        }
        (least, rotation * origin)
    }

    #[test]
    fn on_a_cuboid_the_range_is_that_of_the_linear_system_and_the_inequalities() {
        let half = Vector::new(0.1, 0.07, 0.05);
        let surface = Surface::of(&Shape::Cuboid { half_extents: half }).unwrap();
        let faces = [Vector::x(), -Vector::y(), Vector::z()];
        let mut rng = Rng::keyed(3, "range_cuboid", 0);
        let (mut n_inside, mut n_outside) = (0, 0);
        for _ in 0..200 {
            let object = drawn_pose(&mut rng);
            let aside = |rng: &mut Rng, face: Vector| {
                let place = half.map(|length| length * rng.uniform(-0.9, 0.9));
                place - face.component_mul(&face).component_mul(&place) + face.component_mul(&half)
            };
            let points = faces.map(|face| aside(&mut rng, face));
            let range = range(&surface, object, points);
            let centers = range.tips.map(|tip| tip.center_in_world);
            let turn = Vector::from(rng.direction()) * rng.uniform(0.0, 1.0);
            let found = range.turned(&turn);
            // The smallest on the way: one end may be inside and the middle not.
            let all: Vec<(f64, Vector)> = (0..=400)
                .map(|k| {
                    let rotation = Rotation3::new(turn * (f64::from(k) / 400.0)).into_inner() * object.rotation;
                    least_inside(&half, &faces, &centers, &rotation)
                })
                .collect();
            let least = all.iter().map(|(least, _)| *least).fold(f64::INFINITY, f64::min);
            match found {
                Some(found) => {
                    assert!(least > -1e-4, "outside by {least}");
                    assert!((found.translation - all[400].1).norm() < 1e-9);
                    n_inside += 1;
                }
                None => {
                    assert!(least < 1e-9, "inside by {least}");
                    n_outside += 1;
                }
            }
        }
        assert!(n_inside > 40 && n_outside > 40, "{n_inside} inside, {n_outside} outside");
    }

    /// Three balls fix the middle of a sphere (it lies where three spheres meet): the range has every orientation.
    #[test]
    fn a_sphere_turns_to_every_orientation_where_it_is() {
        let surface = Surface::of(&Shape::Sphere { radius: 0.08 }).unwrap();
        let mut rng = Rng::keyed(4, "range_sphere", 0);
        let object = drawn_pose(&mut rng);
        let range = range(&surface, object, [Vector::x(), Vector::y(), Vector::new(-1.0, -0.5, 0.8)]);
        for _ in 0..20 {
            let turn = Vector::from(rng.direction()) * 3.1;
            let turned = range.turned(&turn).unwrap();
            assert!((turned.translation - object.translation).norm() < 1e-9);
        }
        // In one plane they fix nothing.
        let flat = self::range(&surface, object, [Vector::x(), Vector::y(), Vector::new(-1.0, -0.5, 0.0)]);
        assert!(!flat.covers(&(Vector::x() * 1e-3)));
    }

    /// The distance of a point from an ellipsoid by its Lagrange multiplier, by halving: shares no line with the surface.
    fn distance_to_ellipsoid(radii: &Vector, point: &Point) -> f64 {
        let at = |t: f64| Vector::from_fn(|k, _| point[k] * radii[k] * radii[k] / (radii[k] * radii[k] + t));
        let over = |t: f64| at(t).component_div(radii).norm_squared() - 1.0;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if over(middle) > 0.0 { low = middle } else { high = middle }
        }
        (at(low) - point.coords).norm()
    }

    #[test]
    fn an_ellipsoid_keeps_its_three_distances_and_the_position_near_the_last_one() {
        let radii = Vector::new(0.09, 0.09, 0.12);
        let surface = Surface::of(&Shape::Ellipsoid { radii }).unwrap();
        let mut rng = Rng::keyed(5, "range_ellipsoid", 0);
        let mut n_found = 0;
        for _ in 0..60 {
            let object = drawn_pose(&mut rng);
            let directions = [(); 3].map(|()| Vector::from(rng.direction()));
            let range = range(&surface, object, directions);
            let axis = Vector::from(rng.direction());
            let Some(far) = range.turned(&(axis * 0.5)) else { continue };
            n_found += 1;
            for tip in &range.tips {
                let center = far.point_to_child(&tip.center_in_world);
                assert!((distance_to_ellipsoid(&radii, &center) - RADIUS).abs() < 1e-9);
            }
            // In ten times smaller steps the same position comes out: none was jumped over.
            let mut finely = object;
            for k in 1..=500 {
                let rotation = Rotation3::new(axis * (0.001 * f64::from(k))).into_inner() * object.rotation;
                finely = range.settled(Placement { rotation, translation: finely.translation }).unwrap();
            }
            assert!((finely.translation - far.translation).norm() < 1e-8);
        }
        assert!(n_found > 15, "{n_found}");
    }

    /// Sec. 4.1.2: with the fingertips back on their contacts the range has the structure of the first one, about the orientation
    /// that was reached. So a way of any length is covered by as many ranges as the first one goes into it.
    #[test]
    fn ranges_that_are_begun_anew_cover_a_way_of_any_length() {
        let half = Vector::new(0.1, 0.07, 0.05);
        let surface = Surface::of(&Shape::Cuboid { half_extents: half }).unwrap();
        let points = [Vector::new(0.1, 0.01, 0.01), Vector::new(0.02, -0.07, 0.0), Vector::new(-0.01, 0.02, 0.05)];
        let axis = Vector::new(1.0, 2.0, -1.5).normalize();
        let object = drawn_pose(&mut Rng::keyed(6, "range_cover", 0));
        let first = extent(&range(&surface, object, points), &axis, 3.0);
        assert!(first > 0.05 && first < 1.5, "{first}");
        let length = std::f64::consts::PI;
        let (mut at, mut n_ranges, mut covered) = (object, 0, 0.0);
        while covered < length {
            let range = range(&surface, at, points);
            let on = extent(&range, &axis, 3.0);
            assert!((on - first).abs() < 1e-6, "range {n_ranges}: {on}, the first {first}");
            // Close to the end of the range, not at it.
            let go = (0.999 * on).min(length - covered);
            at = range.turned(&(axis * go)).unwrap();
            covered += go;
            n_ranges += 1;
            if covered > length - 1e-12 {
                break;
            }
        }
        assert!(f64::from(n_ranges) <= (length / first).ceil() + 1.0, "{n_ranges} ranges of {first} for {length}");
        let whole = Rotation3::new(axis * length).into_inner() * object.rotation;
        assert!((at.rotation - whole).norm() < 1e-9);
    }
}
