//! Soft finger with the elliptic approximation of its limit surface: `|f_t|^2 + (m / e)^2 <= (friction f_n)^2` with the
//! moment `m` about the normal and the torsion radius `e` (Howe, Cutkosky 1996).
//!
//! With `m / e` for a coordinate the cone is round, of the same slope as that of the point contact, in four dimensions.

use super::{Components, Directions};

/// Distance of the force from the boundary of the cone, positive inside.
#[inline]
pub fn depth(components: &Components, friction: f64) -> f64 {
    let sideways = components.tangential.norm().hypot(components.torsion);
    (friction * components.normal - sideways) / (1.0 + friction * friction).sqrt()
}

/// Largest work over forces of the cone whose normal component is one.
#[inline]
pub fn support(directions: &Directions, friction: f64) -> f64 {
    directions.normal + friction * directions.tangential.norm().hypot(directions.torsion)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::Vector;

    fn components(x: [f64; 4]) -> Components {
        Components { normal: x[0], tangential: Vector::new(x[1], x[2], 0.0), torsion: x[3] }
    }

    #[test]
    fn depth_is_the_radius_of_the_largest_ball_inside() {
        let mut rng = Rng::keyed(1, "soft finger", 0);
        let mut n_inside = 0;
        for _ in 0..200 {
            let center = [1.0, rng.normal() * 0.2, rng.normal() * 0.2, rng.normal() * 0.2];
            let inside = depth(&components(center), 0.6);
            if inside <= 0.0 {
                continue;
            }
            n_inside += 1;
            let least = (0..4000)
                .map(|_| {
                    let way: [f64; 4] = std::array::from_fn(|_| rng.normal());
                    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let moved = std::array::from_fn(|k| center[k] + way[k] * inside / length);
                    depth(&components(moved), 0.6)
                })
                .fold(f64::INFINITY, f64::min);
            assert!(least > -1e-12 && least < 0.1 * inside + 1e-3, "{least} at {inside}");
        }
        assert!(n_inside > 50, "{n_inside}");
    }

    #[test]
    fn support_agrees_with_sampling_the_rim() {
        let mut rng = Rng::keyed(2, "soft finger", 0);
        for _ in 0..20 {
            let direction: [f64; 4] = std::array::from_fn(|_| rng.normal());
            let exact = support(
                &Directions {
                    normal: direction[0],
                    tangential: Vector::new(direction[1], direction[2], 0.0),
                    torsion: direction[3],
                },
                0.8,
            );
            let sampled = (0..20_000)
                .map(|_| Vector::from(rng.direction()) * 0.8)
                .map(|rim| direction[0] + rim.dot(&Vector::new(direction[1], direction[2], direction[3])))
                .fold(f64::NEG_INFINITY, f64::max);
            assert!(sampled <= exact + 1e-12 && sampled > exact - 2e-3 * exact.abs().max(1.0), "{sampled} {exact}");
        }
    }
}
