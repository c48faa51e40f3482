//! Point contact with Coulomb friction (PCWF): forces `f` with `|f_t| <= friction * f_n`, exactly.
//!
//! Forces are on the object; the normal force is along the inward normal.

use regrasp_geometry::{UnitVector, Vector};

/// Normal component of `force` on a contact with outward normal `normal`.
#[inline]
pub fn normal_force(force: &Vector, normal: &UnitVector) -> f64 {
    -force.dot(normal)
}

/// Distance of `force` from the boundary of the cone, positive inside.
///
/// Inside it is exact; outside it is negative and at least as small as minus the distance from the cone divided by
/// the sine of its half angle, which is all that is asked of it.
#[inline]
pub fn depth(force: &Vector, normal: &UnitVector, friction: f64) -> f64 {
    let pressing = normal_force(force, normal);
    let tangential = (force + normal.into_inner() * pressing).norm();
    (friction * pressing - tangential) / (1.0 + friction * friction).sqrt()
}

/// Largest value of `direction . f` over forces of the cone whose normal component is one.
#[inline]
pub fn support(direction: &Vector, normal: &UnitVector, friction: f64) -> f64 {
    let pressing = -direction.dot(normal);
    pressing + friction * (direction + normal.into_inner() * pressing).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn depth_is_the_radius_of_the_largest_ball_inside() {
        let normal = UnitVector::new_normalize(Vector::new(0.2, -0.4, 0.9));
        let mut rng = Rng::keyed(1, "cone", 0);
        for _ in 0..200 {
            let force = -normal.into_inner() + Vector::from(rng.direction()) * rng.uniform(0.0, 0.5);
            let inside = depth(&force, &normal, 0.6);
            if inside <= 0.0 {
                continue;
            }
            let least = (0..4000)
                .map(|_| depth(&(force + Vector::from(rng.direction()) * inside), &normal, 0.6))
                .fold(f64::INFINITY, f64::min);
            assert!(least > -1e-12 && least < 0.05 * inside + 1e-3, "{least} at {inside}");
        }
    }

    #[test]
    fn support_agrees_with_sampling_the_rim() {
        let normal = UnitVector::new_normalize(Vector::new(0.2, -0.4, 0.9));
        let (x, y) = regrasp_geometry::frame::tangents(&normal);
        let mut rng = Rng::keyed(2, "cone", 0);
        for _ in 0..50 {
            let direction = Vector::from(rng.direction());
            let sampled = (0..3600)
                .map(|k| f64::from(k) * std::f64::consts::TAU / 3600.0)
                .map(|t| {
                    direction.dot(&(-normal.into_inner() + 0.8 * (x.into_inner() * t.cos() + y.into_inner() * t.sin())))
                })
                .fold(f64::NEG_INFINITY, f64::max);
            assert!((support(&direction, &normal, 0.8) - sampled).abs() < 1e-5);
        }
    }
}
