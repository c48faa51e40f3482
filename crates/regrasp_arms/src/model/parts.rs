//! Parts of a robot that move on their own: arms, and what carries several of them.

use super::ArmModel;
use std::collections::BTreeSet;

/// Coordinates that belong together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// Coordinates that move several arms, by index in configurations.
    pub common: Vec<usize>,
    /// Coordinates of each arm. No body is moved by two of them.
    pub arms: Vec<Vec<usize>>,
}

impl ArmModel {
    /// The parts of the robot: two coordinates belong to one arm where some body is moved by both, common ones left out. Common are
    /// those that move bodies of several arms.
    pub fn parts(&self) -> Parts {
        let n = self.dimension();
        // Coordinates that move each body.
        let movers: Vec<Vec<usize>> =
            self.bodies.iter().map(|body| body.speed.iter().map(|term| term.coordinate).collect()).collect();
        let common: BTreeSet<usize> = (0..n).filter(|&k| self.is_common(k, &movers)).collect();
        let mut arm_of: Vec<usize> = (0..n).collect();
        for body in &movers {
            let own: Vec<usize> = body.iter().copied().filter(|k| !common.contains(k)).collect();
            for &k in own.iter().skip(1) {
                let (from, to) = (arm_of[k], arm_of[own[0]]);
                arm_of.iter_mut().filter(|arm| **arm == from).for_each(|arm| *arm = to);
            }
        }
        let mut arms: Vec<Vec<usize>> = Vec::new();
        for first in 0..n {
            let own: Vec<usize> = (0..n).filter(|k| !common.contains(k) && arm_of[*k] == arm_of[first]).collect();
            if own.first() == Some(&first) {
                arms.push(own);
            }
        }
        Parts { common: common.into_iter().collect(), arms }
    }

    /// True where bodies below coordinate `k` are moved by sets of coordinates of which neither holds the other.
    fn is_common(&self, k: usize, movers: &[Vec<usize>]) -> bool {
        let below: Vec<BTreeSet<usize>> =
            movers.iter().filter(|own| own.contains(&k)).map(|own| own.iter().copied().collect()).collect();
        // Fingers of one hand are no arms: branches count where they share no coordinate but those above both.
        below.iter().enumerate().any(|(i, a)| {
            below[..i].iter().any(|b| {
                let (left, right) = (a.difference(b).count(), b.difference(a).count());
                left >= LEAST_ARM && right >= LEAST_ARM
            })
        })
    }

    /// True where one of `coordinates` moves the body.
    pub fn is_moved_by(&self, body: usize, coordinates: &[usize]) -> bool {
        self.bodies[body].speed.iter().any(|term| coordinates.contains(&term.coordinate))
    }
}

/// A branch of fewer coordinates is no arm.
const LEAST_ARM: usize = 5;
