//! Where fingertips reach: tip centres over sampled postures, gathered in voxels.

use super::touch::Touch;
use crate::hand::Hand;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Vector};

/// Most voxels along an axis: larger hands get larger voxels.
const MOST_VOXELS: usize = 64;
/// Edge of the smallest voxels, in metres.
const SMALLEST_VOXEL: f64 = 0.004;
/// Postures from which it is known which links touch whatever the joints do.
const ALWAYS_POSTURES: usize = 200;
/// Directions that are told apart: those of a voxel's neighbours.
pub const DIRECTIONS: usize = 26;
/// A direction counts as along an axis where its part along it is above this share of the largest part: tan(22.5 degrees).
const ALONG: f64 = 0.414;

/// Where the fingertips of a hand reach, in the hand's frame. Each finger is looked at alone: postures count in which it touches
/// neither itself nor the palm.
#[derive(Debug, Clone)]
pub struct TipReach {
    low: Point,
    pitch: f64,
    counts: [usize; 3],
    n_fingers: usize,
    /// Per voxel and finger: from which directions the last link comes to a tip that is there, as bits; 0 where none is.
    from: Vec<u32>,
}

/// Voxels that some number of fingers reach.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TipRegion {
    /// Least number of fingers.
    pub n_fingers: usize,
    /// Corner with the smallest coordinates, in metres.
    pub low: [f64; 3],
    /// Corner with the largest coordinates, in metres.
    pub high: [f64; 3],
    /// Mean of its voxels, in metres.
    pub middle: [f64; 3],
    /// Its volume, in cubic metres.
    pub volume: f64,
}

impl TipReach {
    /// Samples `n_postures` postures, uniform in the joint limits; joints without limits within a quarter of a turn from rest.
    pub fn sample(hand: &Hand, n_postures: usize, rng: &mut Rng) -> Self {
        let touch = Touch::new(hand);
        let always = touch.count(ALWAYS_POSTURES, rng);
        let excused: Vec<bool> = always.iter().map(|&count| count == ALWAYS_POSTURES).collect();
        let mut tips: Vec<(usize, Point, Vector)> = Vec::with_capacity(n_postures * hand.fingers.len());
        for _ in 0..n_postures {
            let posture = touch.draw_posture_near_rest(rng);
            let blocked = touch.fingers_in_their_own_way(&posture, &excused);
            for (f, finger) in hand.fingers.iter().enumerate().filter(|(f, _)| !blocked[*f]) {
                let body = finger.chain.last_frame(&posture[f]);
                let tip = body.point(&finger.tip.center_in_body);
                tips.push((f, tip, body.translation - tip.coords));
            }
        }
        let (low, high) = tips
            .iter()
            .fold((Point::from(Vector::repeat(f64::MAX)), Point::from(Vector::repeat(f64::MIN))), |(l, h), t| {
                (Point::from(l.coords.inf(&t.1.coords)), Point::from(h.coords.sup(&t.1.coords)))
            });
        if tips.is_empty() {
            let n_fingers = hand.fingers.len();
            return TipReach {
                low: Point::origin(),
                pitch: SMALLEST_VOXEL,
                counts: [0; 3],
                n_fingers,
                from: Vec::new(),
            };
        }
        let size = high - low;
        let pitch = (size.max() / (MOST_VOXELS - 1) as f64).max(SMALLEST_VOXEL);
        let counts: [usize; 3] = std::array::from_fn(|axis| (size[axis] / pitch) as usize + 1);
        let n_fingers = hand.fingers.len();
        let mut reach =
            TipReach { low, pitch, counts, n_fingers, from: vec![0; counts.iter().product::<usize>() * n_fingers] };
        for (finger, tip, back) in &tips {
            if let Some(voxel) = reach.voxel(tip) {
                reach.from[voxel * n_fingers + finger] |= 1 << direction_of(back);
            }
        }
        reach
    }

    /// The same, where the fingers whose bit is set in `fingers` reach every voxel within `by` voxels of one that they reach too. Tips that
    /// move on a surface or a line meet few of the places that are asked about.
    #[must_use]
    pub fn widened(&self, fingers: u32, by: usize) -> Self {
        let mut wide = self.clone();
        let [nx, ny, nz] = self.counts;
        let around = |at: usize, n: usize| at.saturating_sub(by)..(at + by + 1).min(n);
        for finger in (0..self.n_fingers).filter(|finger| fingers & (1 << finger) != 0) {
            for voxel in 0..nx * ny * nz {
                let from = self.from[voxel * self.n_fingers + finger];
                if from == 0 {
                    continue;
                }
                for z in around(voxel / (nx * ny), nz) {
                    for y in around(voxel / nx % ny, ny) {
                        for x in around(voxel % nx, nx) {
                            wide.from[((z * ny + y) * nx + x) * self.n_fingers + finger] |= from;
                        }
                    }
                }
            }
        }
        wide
    }

    #[inline]
    fn voxel(&self, point: &Point) -> Option<usize> {
        let at = (point - self.low) / self.pitch;
        let mut index = 0;
        for axis in (0..3).rev() {
            if !(at[axis] >= 0.0 && (at[axis] as usize) < self.counts[axis]) {
                return None;
            }
            index = index * self.counts[axis] + at[axis] as usize;
        }
        Some(index)
    }

    /// From which of the [`DIRECTIONS`] the last link of each finger comes to a tip centre at `point`, as bits. None outside of
    /// what was sampled.
    #[inline]
    pub fn directions_at(&self, point: &Point) -> Option<&[u32]> {
        let voxel = self.voxel(point)?;
        Some(&self.from[voxel * self.n_fingers..(voxel + 1) * self.n_fingers])
    }

    /// Number of fingers whose tip centre reaches the voxel around `point`.
    pub fn n_fingers_at(&self, point: &Point) -> usize {
        self.directions_at(point).map_or(0, |fingers| fingers.iter().filter(|directions| **directions != 0).count())
    }

    /// Centres of the voxels that at least `n_fingers` fingers reach.
    pub fn voxels(&self, n_fingers: usize) -> Vec<Point> {
        // Without any posture there is no voxel.
        let n_voxels = self.from.len() / self.n_fingers.max(1);
        let center = |index: usize| {
            let [nx, ny, _] = self.counts;
            let at = Vector::new((index % nx) as f64, (index / nx % ny) as f64, (index / (nx * ny)) as f64);
            self.low + (at + Vector::repeat(0.5)) * self.pitch
        };
        (0..n_voxels).map(center).filter(|point| self.n_fingers_at(point) >= n_fingers).collect()
    }

    /// What at least `n_fingers` fingers reach; None where they reach no voxel in common.
    pub fn region(&self, n_fingers: usize) -> Option<TipRegion> {
        let voxels = self.voxels(n_fingers);
        let first = voxels.first()?;
        let half = Vector::repeat(0.5 * self.pitch);
        let (low, high) = voxels
            .iter()
            .fold((first.coords, first.coords), |(low, high), point| (low.inf(&point.coords), high.sup(&point.coords)));
        let middle = voxels.iter().map(|point| point.coords).sum::<Vector>() / voxels.len() as f64;
        Some(TipRegion {
            n_fingers,
            low: (low - half).into(),
            high: (high + half).into(),
            middle: middle.into(),
            volume: voxels.len() as f64 * self.pitch.powi(3),
        })
    }

    /// Edge of the voxels, in metres.
    pub fn pitch(&self) -> f64 {
        self.pitch
    }
}

/// The one of [`DIRECTIONS`] that `vector` is nearest to; 0 for the zero vector.
fn direction_of(vector: &Vector) -> u32 {
    let most = vector.amax();
    if !(most > 0.0) {
        return 0;
    }
    let part = |value: f64| if value.abs() < ALONG * most { 1 } else { 1 + value.signum() as i32 };
    let code = (part(vector.x) + 3 * part(vector.y) + 9 * part(vector.z)) as u32;
    // The middle one, which no direction has, is left out.
    if code > 13 { code - 1 } else { code }
}

/// The [`DIRECTIONS`], of length one.
pub fn directions() -> [Vector; DIRECTIONS] {
    std::array::from_fn(|index| {
        let code = if index >= 13 { index + 1 } else { index };
        let part = |value: usize| value as f64 - 1.0;
        Vector::new(part(code % 3), part(code / 3 % 3), part(code / 9)).normalize()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{LoadOptions, load_hand};
    use std::path::Path;

    #[test]
    fn directions_are_told_apart() {
        for (index, direction) in directions().iter().enumerate() {
            assert_eq!(direction_of(direction) as usize, index);
        }
        let mut rng = Rng::keyed(3, "directions", 0);
        for _ in 0..1000 {
            let vector = Vector::from(rng.direction());
            let told = directions()[direction_of(&vector) as usize];
            assert!(told.dot(&vector) > 0.85, "{vector:?} {told:?}");
        }
    }

    /// The wide hand has a closed form: every voxel that is reached holds a point that inverse kinematics reaches, and nearly every
    /// point that inverse kinematics reaches lies in a voxel that was seen.
    #[test]
    fn voxels_are_where_inverse_kinematics_reaches() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger/hand.toml");
        let hand = load_hand(&path, &LoadOptions::default()).unwrap().hand;
        let reach = TipReach::sample(&hand, 20_000, &mut Rng::keyed(0, "reach", 0));
        let settings = crate::kinematics::finger_ik::IkSettings { limit_margin: 0.0, preference: None, max_step: 10.0 };
        let mut rng = Rng::keyed(1, "reach_test", 0);
        let (mut n_both, mut n_ik_only, mut n_far) = (0, 0, 0);
        for _ in 0..20_000 {
            let point = Point::new(rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-0.05, 0.12));
            let seen = reach.directions_at(&point).map_or(0, |fingers| fingers[0]) != 0;
            let reached =
                |at: &Point| hand.fingers[0].ik.solve_random(at, &settings, &mut Rng::keyed(0, "ik", 0)).is_some();
            match (seen, reached(&point)) {
                (true, true) => n_both += 1,
                (false, true) => n_ik_only += 1,
                // The point is not reached: some point within the diagonal of a voxel is.
                (true, false) => {
                    let near = (0..200).any(|_| {
                        reached(&(point + Vector::from(rng.direction()) * (reach.pitch() * 1.733 * rng.unit())))
                    });
                    n_far += usize::from(!near);
                }
                (false, false) => {}
            }
        }
        assert!(n_both > 1000 && n_far == 0, "{n_both} {n_far}");
        // What is left out touches the palm or the finger itself, or is at the rim.
        assert!(n_ik_only < n_both / 5, "{n_ik_only} {n_both}");
    }
}
