//! Force closure of three point contacts with friction: closed form.
//!
//! Internal forces of three contacts lie in the plane of the contacts, so each friction cone is cut by that plane to a
//! wedge (exactly: the cone is round). With forces along the triangle's sides as coordinates, the wedges are six linear
//! inequalities in three unknowns; the grasp is closed if and only if they have an interior. The centre of their extreme
//! rays is the internal force that proves it. (Li, Canny, Sastry 1989 for the plane of internal forces; the reduction
//! to wedges is ours, checked against exact cones in the tests.)

use super::GraspFrame;
use crate::contact::Contact;
use crate::margin::{margin_of_forces, response_norms};
use regrasp_geometry::Vector;

/// Margin and internal forces of three contacts; None when not closed.
pub fn prove(contacts: &[Contact; 3], frame: &GraspFrame) -> Option<(f64, [Vector; 3])> {
    let [p, q, r] = contacts.map(|contact| contact.point_in_object);
    let (pq, qr, rp) = (q - p, r - q, p - r);
    let doubled_area = pq.cross(&qr);
    let size = pq.norm_squared().max(qr.norm_squared()).max(rp.norm_squared());
    if !(doubled_area.norm_squared() > 1e-8 * size * size) {
        return None;
    }
    let plane_normal = doubled_area.normalize();
    let sides = [pq.normalize(), qr.normalize(), rp.normalize()];
    // Force on contact i in side coordinates x: along its two sides.
    //   f_0 = x_0 s_0 - x_2 s_2,  f_1 = x_1 s_1 - x_0 s_0,  f_2 = x_2 s_2 - x_1 s_1
    let mut rows = [Vector::zeros(); 6];
    for i in 0..3 {
        let (low, high) = wedge(contacts, i, &plane_normal, frame.friction)?;
        let (out, back) = (sides[i], sides[(i + 2) % 3]);
        // Inside the wedge: low x f >= 0 and f x high >= 0, both along the plane's normal.
        let mut after_low = Vector::zeros();
        let mut before_high = Vector::zeros();
        after_low[i] = low.cross(&out).dot(&plane_normal);
        after_low[(i + 2) % 3] = -low.cross(&back).dot(&plane_normal);
        before_high[i] = out.cross(&high).dot(&plane_normal);
        before_high[(i + 2) % 3] = -back.cross(&high).dot(&plane_normal);
        rows[2 * i] = after_low;
        rows[2 * i + 1] = before_high;
    }
    // Total normal force of side coordinates: the measure by which rays are made comparable.
    let pressing: Vector = Vector::from_fn(|k, _| {
        let next = (k + 1) % 3;
        -sides[k].dot(&contacts[k].normal_in_object) + sides[k].dot(&contacts[next].normal_in_object)
    });
    let center = center_of_rays(&rows, &pressing)?;
    let force = |i: usize| sides[i] * center[i] - sides[(i + 2) % 3] * center[(i + 2) % 3];
    let forces = [force(0), force(1), force(2)];
    let norms = response_norms(contacts, frame)?;
    let margin = margin_of_forces(contacts, &forces, &norms, frame);
    if margin > 0.0 { Some((margin, forces)) } else { None }
}

/// The two edges of the friction cone of contact `i` cut by the contact plane, in the order of the plane's normal.
#[inline]
fn wedge(contacts: &[Contact; 3], i: usize, plane_normal: &Vector, friction: f64) -> Option<(Vector, Vector)> {
    let inward = -contacts[i].normal_in_object.into_inner();
    let in_plane = inward - plane_normal * inward.dot(plane_normal);
    let cos_tilt = in_plane.norm();
    let cos_cone = 1.0 / (1.0 + friction * friction).sqrt();
    if cos_tilt <= cos_cone + 1e-9 {
        return None;
    }
    let middle = in_plane / cos_tilt;
    let cos_half = cos_cone / cos_tilt;
    let sin_half = (1.0 - cos_half * cos_half).sqrt();
    let aside = plane_normal.cross(&middle) * sin_half;
    Some((middle * cos_half - aside, middle * cos_half + aside))
}

/// Mean of the extreme rays of the cone `rows x >= 0`, each scaled to `pressing . x = 1`; None without an interior.
#[inline]
fn center_of_rays(rows: &[Vector; 6], pressing: &Vector) -> Option<Vector> {
    let mut sum = Vector::zeros();
    let mut n_rays = 0u32;
    for i in 0..6 {
        for j in i + 1..6 {
            let mut ray = rows[i].cross(&rows[j]);
            let scale = pressing.dot(&ray);
            if scale.abs() < 1e-12 {
                continue;
            }
            ray /= scale;
            if (0..6).all(|k| k == i || k == j || rows[k].dot(&ray) >= -1e-12) {
                sum += ray;
                n_rays += 1;
            }
        }
    }
    if n_rays < 3 { None } else { Some(sum / f64::from(n_rays)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::friction_cone;
    use regrasp_base::Rng;
    use regrasp_geometry::{Point, UnitVector};

    fn random_contacts(rng: &mut Rng) -> [Contact; 3] {
        std::array::from_fn(|_| {
            let direction = UnitVector::new_normalize(Vector::from(rng.direction()));
            Contact { point_in_object: Point::from(direction.into_inner() * 0.03), normal_in_object: direction }
        })
    }

    const FRAME: GraspFrame =
        GraspFrame { center_of_mass: Point::new(0.001, -0.002, 0.003), torque_scale: 0.03, friction: 0.5 };

    /// Support function of the hull of wrenches: positive in every direction if and only if the grasp is closed.
    fn support(contacts: &[Contact; 3], force: &Vector, torque: &Vector) -> f64 {
        contacts
            .iter()
            .map(|c| {
                let arm = (c.point_in_object - FRAME.center_of_mass) / FRAME.torque_scale;
                friction_cone::support(&(force + torque.cross(&arm)), &c.normal_in_object, FRAME.friction)
            })
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Smallest support value found by descent from many directions: an upper bound of the Ferrari-Canny radius.
    fn least_support(contacts: &[Contact; 3], rng: &mut Rng) -> f64 {
        let mut least = f64::INFINITY;
        for _ in 0..12 {
            let mut draw = || nalgebra::Vector6::from_fn(|_, _| rng.normal());
            let mut u = draw().normalize();
            let value = |u: &nalgebra::Vector6<f64>| {
                support(contacts, &u.fixed_rows::<3>(0).into_owned(), &u.fixed_rows::<3>(3).into_owned())
            };
            let mut best = value(&u);
            let mut radius = 0.5;
            while radius > 1e-4 {
                let mut improved = false;
                for _ in 0..60 {
                    let next = (u + draw().normalize() * radius).normalize();
                    let next_value = value(&next);
                    if next_value < best {
                        (u, best, improved) = (next, next_value, true);
                    }
                }
                if !improved {
                    radius *= 0.6;
                }
            }
            least = least.min(best);
        }
        least
    }

    #[test]
    fn the_margin_is_below_the_support_in_every_direction_and_closed_agrees_with_it() {
        let mut rng = Rng::keyed(21, "three", 0);
        let (mut n_closed, mut n_open) = (0, 0);
        for _ in 0..250 {
            let contacts = random_contacts(&mut rng);
            let upper = least_support(&contacts, &mut rng);
            match prove(&contacts, &FRAME) {
                Some((margin, _)) => {
                    n_closed += 1;
                    assert!(margin <= upper + 1e-12, "margin {margin} above the support {upper}");
                }
                None => {
                    n_open += 1;
                    assert!(upper < 2e-3, "missed a closed grasp with radius {upper}");
                }
            }
        }
        assert!(n_closed > 30 && n_open > 30, "{n_closed} {n_open}");
    }

    #[test]
    fn three_contacts_on_a_great_circle_have_their_known_margin() {
        // By symmetry the best internal force is along the normals, one third each; its depth is mu / sqrt(1 + mu^2) / 3.
        let contacts: [Contact; 3] = std::array::from_fn(|i| {
            let angle = i as f64 * std::f64::consts::TAU / 3.0;
            let normal = UnitVector::new_normalize(Vector::new(angle.cos(), angle.sin(), 0.0));
            Contact { point_in_object: Point::from(normal.into_inner()), normal_in_object: normal }
        });
        let frame = GraspFrame { center_of_mass: Point::origin(), torque_scale: 1.0, friction: 0.5 };
        let (margin, _) = prove(&contacts, &frame).unwrap();
        // |P_i|^2 = 3 / 9 + |[r]^T J^-1|^2 with J = diag(3/2, 3/2, 3): 1/9 + 1/9... summed over the two rows.
        let turning = (2.0f64 / 3.0).powi(2) + (1.0f64 / 3.0).powi(2);
        let s = (1.0f64 / 3.0 + turning).sqrt();
        let t = 0.5 / 1.25f64.sqrt() / 3.0 / s;
        assert!((margin - t / (1.0 + 3.0 * t * s)).abs() < 1e-12, "{margin}");
    }

    #[test]
    fn collinear_and_one_sided_contacts_are_open() {
        let up = UnitVector::new_unchecked(Vector::z());
        let at = |x: f64, y: f64| Contact { point_in_object: Point::new(x, y, 0.0), normal_in_object: up };
        assert!(prove(&[at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0)], &FRAME).is_none());
        assert!(prove(&[at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], &FRAME).is_none());
    }
}
