//! Which links of a hand touch each other, in one posture and over many.

use crate::hand::{Finger, Hand};
use crate::robot::LinkId;
use regrasp_base::Rng;
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Vector};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI};

/// Pairs of links of a hand that are tested against each other, with everything needed to test them.
pub(crate) struct Touch<'h> {
    hand: &'h Hand,
    shapes: Vec<BodyShape<'h>>,
    /// The pairs, smaller link first.
    pub pairs: Vec<(LinkId, LinkId)>,
    /// Per pair, the pairs of shapes.
    shape_pairs: Vec<Vec<(usize, usize)>>,
}

struct BodyShape<'h> {
    link: LinkId,
    /// Finger and body; none for the palm.
    body: Option<(usize, usize)>,
    placed: &'h PlacedShape,
    center: Point,
    radius: f64,
}

impl<'h> Touch<'h> {
    /// All pairs of links of different bodies that are not allowed to touch.
    pub fn new(hand: &'h Hand) -> Self {
        let mut shapes: Vec<BodyShape> = Vec::new();
        let mut add = |link, body, placed: &'h PlacedShape| {
            let (center, radius) = placed.shape.bounding_sphere();
            shapes.push(BodyShape { link, body, placed, center, radius });
        };
        for shape in &hand.palm {
            add(shape.link, None, &shape.placed);
        }
        for (f, finger) in hand.fingers.iter().enumerate() {
            for shape in &finger.shapes {
                add(shape.link, Some((f, shape.body)), &shape.placed);
            }
        }
        let mut pairs = BTreeSet::new();
        for (i, a) in shapes.iter().enumerate() {
            for b in &shapes[..i] {
                if a.body != b.body && !hand.may_touch(a.link, b.link) {
                    pairs.insert((a.link.min(b.link), a.link.max(b.link)));
                }
            }
        }
        let pairs: Vec<(LinkId, LinkId)> = pairs.into_iter().collect();
        let shape_pairs = pairs
            .iter()
            .map(|&(a, b)| {
                let of_link = |link: LinkId| {
                    let all = shapes.iter().enumerate();
                    all.filter(move |(_, shape)| shape.link == link).map(|(i, _)| i)
                };
                of_link(a).flat_map(|i| of_link(b).map(move |j| (i, j))).collect()
            })
            .collect();
        Touch { hand, shapes, pairs, shape_pairs }
    }

    /// Per pair, whether it touches (or cannot be proved apart) in `posture`: one joint vector per finger.
    pub fn touching(&self, posture: &[Vec<f64>]) -> Vec<bool> {
        let at = self.placed(posture);
        self.shape_pairs.iter().map(|pairs| pairs.iter().any(|pair| self.shapes_touch(&at, pair))).collect()
    }

    /// Per finger, whether it touches itself or the palm in `posture`, but for the `excused` pairs.
    pub fn fingers_in_their_own_way(&self, posture: &[Vec<f64>], excused: &[bool]) -> Vec<bool> {
        let at = self.placed(posture);
        let mut blocked = vec![false; self.hand.fingers.len()];
        for (pairs, _) in self.shape_pairs.iter().zip(excused).filter(|(_, excused)| !**excused) {
            for pair in pairs {
                let of = [pair.0, pair.1].map(|shape| self.shapes[shape].body.map(|(finger, _)| finger));
                let finger = match of {
                    [Some(finger), None] | [None, Some(finger)] => finger,
                    [Some(one), Some(other)] if one == other => one,
                    _ => continue,
                };
                if !blocked[finger] && self.shapes_touch(&at, pair) {
                    blocked[finger] = true;
                }
            }
        }
        blocked
    }

    /// Per pair, whether it is of one finger.
    pub fn of_one_finger(&self) -> Vec<bool> {
        let finger = |shape: usize| self.shapes[shape].body.map(|(finger, _)| finger);
        let is_of_one = |pair: &(usize, usize)| finger(pair.0).is_some() && finger(pair.0) == finger(pair.1);
        self.shape_pairs.iter().map(|pairs| pairs.first().is_some_and(is_of_one)).collect()
    }

    /// Per pair, whether it is one of those `asked` for, and nearer than `distance` in `posture`.
    pub fn near(&self, asked: &[bool], posture: &[Vec<f64>], distance: f64) -> Vec<bool> {
        let at = self.placed(posture);
        let is_near = |pair: &(usize, usize)| self.shapes_are_within(&at, pair, distance);
        self.shape_pairs.iter().zip(asked).map(|(pairs, asked)| *asked && pairs.iter().any(is_near)).collect()
    }

    /// Where every shape is, and the centre of its bounding ball.
    fn placed(&self, posture: &[Vec<f64>]) -> Vec<(Placement, Point)> {
        let bodies: Vec<Vec<Pose>> = self
            .hand
            .fingers
            .iter()
            .zip(posture)
            .map(|(finger, coordinates)| {
                let mut poses = Vec::new();
                finger.chain.forward(coordinates, &mut poses);
                poses
            })
            .collect();
        self.shapes
            .iter()
            .map(|shape| {
                let pose = match shape.body {
                    None => shape.placed.parent_from_shape,
                    Some((finger, body)) => bodies[finger][body] * shape.placed.parent_from_shape,
                };
                let rotation = pose.rotation.to_rotation_matrix().into_inner();
                (Placement { rotation, translation: pose.translation.vector }, pose * shape.center)
            })
            .collect()
    }

    /// True where the links of all tips are farther from the palm than `distance`, in metres.
    pub fn tips_keep_off_the_palm(&self, posture: &[Vec<f64>], distance: f64) -> bool {
        let at = self.placed(posture);
        let is_tip = |body: Option<(usize, usize)>| {
            body.is_some_and(|(finger, body)| body + 1 == self.hand.fingers[finger].chain.joints.len())
        };
        let tips = (0..self.shapes.len()).filter(|&i| is_tip(self.shapes[i].body));
        let palm = || (0..self.shapes.len()).filter(|&j| self.shapes[j].body.is_none());
        tips.into_iter().all(|i| palm().all(|j| !self.shapes_are_within(&at, &(i, j), distance)))
    }

    fn shapes_touch(&self, at: &[(Placement, Point)], pair: &(usize, usize)) -> bool {
        self.shapes_are_within(at, pair, 0.0)
    }

    fn shapes_are_within(&self, at: &[(Placement, Point)], &(i, j): &(usize, usize), distance: f64) -> bool {
        let (a, b) = (&self.shapes[i], &self.shapes[j]);
        if (at[i].1 - at[j].1).norm() > a.radius + b.radius + distance {
            return false;
        }
        let (mut direction, mut hints) = (Vector::zeros(), [0, 0]);
        let first = Placed { shape: &a.placed.shape, at: &at[i].0 };
        let second = Placed { shape: &b.placed.shape, at: &at[j].0 };
        let answer = separation(first, second, distance, distance, &mut direction, &mut hints);
        !matches!(answer, Separation::SeparatedBy(_))
    }

    /// A posture, uniform in the limits of joints and brought within those of sums. Joints without limits turn once.
    pub fn draw_posture(&self, rng: &mut Rng) -> Vec<Vec<f64>> {
        self.draw_within(PI, |_, _| 0.0, rng)
    }

    /// The same, but joints without limits turn by at most a quarter of a turn from rest, either way: fingers that hold an object between them
    /// do not turn away from it.
    pub fn draw_posture_near_rest(&self, rng: &mut Rng) -> Vec<Vec<f64>> {
        self.draw_within(FRAC_PI_2, |finger, k| finger.rest[k], rng)
    }

    /// Joints without limits turn by at most `turn`, in radians, from `middle`.
    fn draw_within(&self, turn: f64, middle: impl Fn(&Finger, usize) -> f64, rng: &mut Rng) -> Vec<Vec<f64>> {
        let mut of_finger = |finger: &Finger| {
            let end = |end: f64, k: usize| if end.is_finite() { end } else { middle(finger, k) + turn.copysign(end) };
            let ends = finger.chain.lower.iter().zip(&finger.chain.upper).enumerate();
            let drawn: Vec<f64> = ends.map(|(k, (&low, &high))| rng.uniform(end(low, k), end(high, k))).collect();
            finger.chain.bring_within_limits(&drawn).unwrap_or(drawn)
        };
        self.hand.fingers.iter().map(&mut of_finger).collect()
    }

    /// Per pair, in how many of `n_postures` postures, uniform in the limits of joints and brought within those of sums, it touches.
    pub fn count(&self, n_postures: usize, rng: &mut Rng) -> Vec<usize> {
        let mut counts = vec![0; self.pairs.len()];
        for _ in 0..n_postures {
            let posture = self.draw_posture(rng);
            for (count, touches) in counts.iter_mut().zip(self.touching(&posture)) {
                *count += usize::from(touches);
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{LoadOptions, load_hand};
    use regrasp_geometry::Shape;
    use std::path::Path;

    /// Points along the core of a sphere or capsule, and its radius.
    fn core(shape: &Shape, world_from_shape: &Pose) -> Option<(Vec<Point>, f64)> {
        let (half_length, radius) = match shape {
            Shape::Sphere { radius } => (0.0, *radius),
            Shape::Capsule { half_length, radius } => (*half_length, *radius),
            _ => return None,
        };
        let at = |k: i32| world_from_shape * Point::new(0.0, 0.0, half_length * f64::from(k) / 100.0);
        Some(((-100..=100).map(at).collect(), radius))
    }

    #[test]
    fn joints_without_limits_are_drawn_near_rest_where_that_is_asked() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
        let mut hand = load_hand(&path, &LoadOptions::default()).unwrap().hand;
        let finger = &mut hand.fingers[1];
        (finger.chain.lower[0], finger.chain.upper[0], finger.rest[0]) = (f64::NEG_INFINITY, f64::INFINITY, 0.4);
        let (touch, mut rng) = (Touch::new(&hand), Rng::keyed(0, "test", 0));
        let (mut near, mut any) = (0.0f64, 0.0f64);
        for _ in 0..500 {
            let posture = touch.draw_posture_near_rest(&mut rng);
            near = near.max((posture[1][0] - 0.4).abs());
            any = any.max(touch.draw_posture(&mut rng)[1][0].abs());
            let within = hand.fingers.iter().zip(&posture).all(|(finger, q)| finger.chain.within_limits(q, 1e-12));
            assert!(within, "{posture:?}");
        }
        assert!((1.5..=FRAC_PI_2).contains(&near) && (3.0..=PI).contains(&any), "{near} {any}");
    }

    #[test]
    fn fingers_of_capsules_touch_where_their_cores_are_near() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
        let hand = load_hand(&path, &LoadOptions::default()).unwrap().hand;
        let touch = Touch::new(&hand);
        let mut rng = Rng::keyed(7, "touch", 0);
        let (mut n_touching, mut n_apart) = (0, 0);
        for _ in 0..150 {
            let posture: Vec<Vec<f64>> = hand
                .fingers
                .iter()
                .map(|f| f.chain.lower.iter().zip(&f.chain.upper).map(|(&l, &h)| rng.uniform(l, h)).collect())
                .collect();
            let touching = touch.touching(&posture);
            let cores: Vec<_> = touch
                .shapes
                .iter()
                .map(|shape| {
                    let (finger, body) = shape.body?;
                    let mut poses = Vec::new();
                    hand.fingers[finger].chain.forward(&posture[finger], &mut poses);
                    core(&shape.placed.shape, &(poses[body] * shape.placed.parent_from_shape))
                })
                .collect();
            for (pair, touches) in touching.into_iter().enumerate() {
                let gaps: Option<Vec<f64>> = touch.shape_pairs[pair]
                    .iter()
                    .map(|&(i, j)| {
                        let ((a, r), (b, s)) = (cores[i].as_ref()?, cores[j].as_ref()?);
                        let distances = a.iter().flat_map(|p| b.iter().map(move |q| (p - q).norm()));
                        Some(distances.fold(f64::INFINITY, f64::min) - r - s)
                    })
                    .collect();
                // The palm is no capsule; gaps of less than half a sampling step decide nothing.
                let Some(gap) = gaps.map(|gaps| gaps.into_iter().fold(f64::INFINITY, f64::min)) else { continue };
                if gap.abs() > 0.3e-3 {
                    assert_eq!(touches, gap < 0.0, "{:?} {gap}", touch.pairs[pair]);
                    *(if touches { &mut n_touching } else { &mut n_apart }) += 1;
                }
            }
        }
        assert!(n_touching > 50 && n_apart > 1_000, "{n_touching} {n_apart}");
    }
}
