//! Couplings: joints whose position is a sum over other joints, and the limits that follow for those.

use crate::ids::JointId;
use arrayvec::ArrayVec;

/// Most joints that one joint may follow.
pub const MAX_TERMS: usize = 4;

/// Joints that one joint follows, with a multiplier each.
pub type Terms<L> = ArrayVec<(L, f64), MAX_TERMS>;

/// The position of a joint that follows others: the sum of `multiplier * position(leader)` over all terms, plus `offset`.
///
/// `L` names a leader: a joint of the robot, or the index of a coordinate of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling<L = JointId> {
    /// Leaders and their multipliers: at least one term, no leader twice, no multiplier zero.
    pub terms: Terms<L>,
    /// Offset, in radians or metres.
    pub offset: f64,
}

/// Why a coupling cannot be resolved to independent joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unresolved {
    /// The joint follows itself, or one that does.
    Cycle,
    /// More than [`MAX_TERMS`] independent joints lead.
    TooManyLeaders,
    /// The terms add up to nothing: no joint leads.
    NoLeader,
}

impl<L: Copy + PartialEq> Coupling<L> {
    /// Follows one leader.
    pub fn one(leader: L, multiplier: f64, offset: f64) -> Self {
        Coupling { terms: Terms::from_iter([(leader, multiplier)]), offset }
    }

    /// The coupling of an independent joint: the joint is its own leader.
    pub fn independent(leader: L) -> Self {
        Coupling::one(leader, 1.0, 0.0)
    }

    /// Position of the follower, from the positions of its leaders.
    #[inline]
    pub fn position(&self, of: impl Fn(L) -> f64) -> f64 {
        let mut products = self.terms.iter().map(|&(leader, multiplier)| multiplier * of(leader));
        // Not from zero, so that one term is one product.
        let first = products.next().unwrap_or(0.0);
        products.fold(first, |sum, product| sum + product) + self.offset
    }

    /// The same coupling with leaders that follow others themselves replaced by those: `of` says what a leader follows. Unchanged
    /// where more than [`MAX_TERMS`] would lead.
    pub fn through<'c>(&self, of: impl Fn(L) -> Option<&'c Coupling<L>>) -> Self
    where
        L: 'c,
    {
        let mut found = Coupling { terms: Terms::new(), offset: self.offset };
        let mut add = |leader: L, multiplier: f64| match found.terms.iter_mut().find(|(other, _)| *other == leader) {
            Some((_, known)) => {
                *known += multiplier;
                true
            }
            None => found.terms.try_push((leader, multiplier)).is_ok(),
        };
        let (mut offset, mut is_complete) = (self.offset, true);
        for &(leader, multiplier) in &self.terms {
            match of(leader) {
                Some(above) => {
                    offset += multiplier * above.offset;
                    is_complete &= above.terms.iter().all(|&(first, factor)| add(first, multiplier * factor));
                }
                None => is_complete &= add(leader, multiplier),
            }
        }
        if !is_complete {
            return self.clone();
        }
        found.offset = offset;
        found
    }

    /// True where both say the same but for rounding, whatever the order of their leaders.
    pub fn is_like(&self, other: &Self) -> bool {
        /// More than the rounding of a few products.
        const ROUNDING: f64 = 1e-9;
        let alike = |a: f64, b: f64| (a - b).abs() <= ROUNDING * a.abs().max(b.abs()).max(1.0);
        self.terms.len() == other.terms.len()
            && alike(self.offset, other.offset)
            && self.terms.iter().all(|&(leader, multiplier)| {
                other.terms.iter().any(|&(own, factor)| own == leader && alike(multiplier, factor))
            })
    }

    /// Lowest and highest position of the follower while each leader stays between its own two limits.
    pub fn range(&self, of: impl Fn(L) -> [f64; 2]) -> [f64; 2] {
        let end = |pick: fn(f64, f64) -> f64| {
            let ends = self.terms.iter().map(|&(leader, multiplier)| {
                let [lower, upper] = of(leader);
                pick(multiplier * lower, multiplier * upper)
            });
            ends.reduce(|sum, product| sum + product).unwrap_or(0.0) + self.offset
        };
        [end(f64::min), end(f64::max)]
    }

    /// The leader and its multiplier, where there is one alone.
    pub fn single(&self) -> Option<(L, f64)> {
        match self.terms.as_slice() {
            &[term] => Some(term),
            _ => None,
        }
    }

    /// The multiplier of `leader`; zero for joints that do not lead.
    pub fn multiplier(&self, leader: L) -> f64 {
        self.terms.iter().find(|(other, _)| *other == leader).map_or(0.0, |&(_, multiplier)| multiplier)
    }

    /// The sum of the sizes of all multipliers: how fast the follower moves at most while each leader moves at one.
    pub fn gain(&self) -> f64 {
        sum_of_sizes(&self.terms)
    }

    /// The same coupling with other names of the leaders. None where `rename` does not know one.
    pub fn renamed<M>(&self, mut rename: impl FnMut(L) -> Option<M>) -> Option<Coupling<M>> {
        let terms: Option<Terms<M>> =
            self.terms.iter().map(|&(leader, multiplier)| Some((rename(leader)?, multiplier))).collect();
        Some(Coupling { terms: terms?, offset: self.offset })
    }
}

/// Sum of the sizes of multipliers.
fn sum_of_sizes<L>(terms: &Terms<L>) -> f64 {
    terms.iter().map(|(_, multiplier)| multiplier.abs()).reduce(|sum, size| sum + size).unwrap_or(0.0)
}

/// The couplings of all joints to independent ones, where `direct` has what each joint follows. None for independent joints.
pub(crate) fn resolve(direct: &[Option<Coupling>]) -> Vec<Result<Option<Coupling>, Unresolved>> {
    let depths = depths(direct);
    direct
        .iter()
        .zip(&depths)
        .map(|(own, depth)| match (own, depth) {
            (None, _) => Ok(None),
            (Some(_), None) => Err(Unresolved::Cycle),
            (Some(own), Some(_)) => resolve_one(direct, &depths, own).map(Some),
        })
        .collect()
}

/// How many couplings lie between each joint and independent ones, at most. None for joints that follow themselves and those
/// that follow them.
fn depths(direct: &[Option<Coupling>]) -> Vec<Option<usize>> {
    let mut depths: Vec<Option<usize>> = direct.iter().map(|coupling| coupling.is_none().then_some(0)).collect();
    let mut is_changed = true;
    while std::mem::take(&mut is_changed) {
        for (joint, coupling) in direct.iter().enumerate() {
            let (None, Some(coupling)) = (depths[joint], coupling) else { continue };
            let leaders: Option<Vec<usize>> = coupling.terms.iter().map(|(leader, _)| depths[leader.0]).collect();
            if let Some(deepest) = leaders.and_then(|leaders| leaders.into_iter().max()) {
                depths[joint] = Some(deepest + 1);
                is_changed = true;
            }
        }
    }
    depths
}

/// Replaces leaders that follow others by what they follow, the deepest first: each is replaced once.
fn resolve_one(direct: &[Option<Coupling>], depths: &[Option<usize>], own: &Coupling) -> Result<Coupling, Unresolved> {
    let (mut terms, mut offset) = (own.terms.to_vec(), own.offset);
    while let Some(at) = (0..terms.len()).max_by_key(|&k| depths[terms[k].0.0]) {
        let (leader, multiplier) = terms[at];
        let Some(next) = &direct[leader.0] else { break };
        terms.remove(at);
        offset += multiplier * next.offset;
        for &(leader, factor) in &next.terms {
            match terms.iter_mut().find(|(other, _)| *other == leader) {
                Some((_, sum)) => *sum += multiplier * factor,
                None => terms.push((leader, multiplier * factor)),
            }
        }
    }
    // Terms that cancel leave rounding behind.
    let least = 1e-12 * own.gain().min(1.0);
    if terms.len() > 1 || own.terms.len() > 1 {
        terms.retain(|(_, multiplier)| multiplier.abs() > least);
    }
    terms.sort_by_key(|(leader, _)| *leader);
    match terms.len() {
        0 => Err(Unresolved::NoLeader),
        1..=MAX_TERMS => Ok(Coupling { terms: terms.into_iter().collect(), offset }),
        _ => Err(Unresolved::TooManyLeaders),
    }
}

/// `lower <= sum of multiplier * coordinate <= upper`: what the limits of a follower ask of several leaders at once.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearLimit {
    /// Name of the joint whose limits these are.
    pub joint: String,
    /// Coordinates and their multipliers: two or more.
    pub terms: Terms<usize>,
    /// Lowest sum; minus infinity where there is none.
    pub lower: f64,
    /// Highest sum.
    pub upper: f64,
}

/// Limits no wider than this leave one coordinate no choice: [`LinearLimit::settle`]. In radians or metres.
pub const TIE_WIDTH: f64 = 1e-8;

impl LinearLimit {
    /// The limits `lower..=upper` of the joint called `joint`, which follows several coordinates.
    pub fn new(joint: String, coupling: &Coupling<usize>, [lower, upper]: [f64; 2]) -> Self {
        let offset = coupling.offset;
        LinearLimit { joint, terms: coupling.terms.clone(), lower: lower - offset, upper: upper - offset }
    }

    /// The sum at `coordinates`.
    pub fn sum(&self, coordinates: &[f64]) -> f64 {
        self.terms.iter().map(|&(k, multiplier)| multiplier * coordinates[k]).sum()
    }

    /// Room to the nearer limit, negative beyond it: how far every coordinate may move before the limit is reached.
    pub fn room(&self, coordinates: &[f64]) -> f64 {
        let sum = self.sum(coordinates);
        (sum - self.lower).min(self.upper - sum) / sum_of_sizes(&self.terms)
    }

    /// Where the limit ties its first coordinate to the others, with no room but rounding: brings that coordinate to where they have it.
    pub fn settle(&self, coordinates: &mut [f64]) {
        if self.upper - self.lower > TIE_WIDTH {
            return;
        }
        if let Some(&(first, multiplier)) = self.terms.first() {
            let others: f64 = self.terms[1..].iter().map(|&(k, multiplier)| multiplier * coordinates[k]).sum();
            coordinates[first] = (0.5 * (self.lower + self.upper) - others) / multiplier;
        }
    }

    /// The same limit over coordinates that start at `first` in a longer vector.
    pub fn shifted(&self, first: usize) -> Self {
        let mut shifted = self.clone();
        shifted.terms.iter_mut().for_each(|(k, _)| *k += first);
        shifted
    }
}

/// Narrows the limits of coordinates to those of a joint that follows one of them; of several, the limit of their sum.
pub(crate) fn limit_leaders(
    name: &str,
    drive: &Coupling<usize>,
    limits: [f64; 2],
    (lower, upper): (&mut [f64], &mut [f64]),
) -> Option<LinearLimit> {
    let Some((coordinate, multiplier)) = drive.single() else {
        return Some(LinearLimit::new(name.to_owned(), drive, limits));
    };
    let ends = limits.map(|position| (position - drive.offset) / multiplier);
    lower[coordinate] = lower[coordinate].max(ends[0].min(ends[1]));
    upper[coordinate] = upper[coordinate].min(ends[0].max(ends[1]));
    None
}

/// Coordinates near `near` that keep all limits: projections in turn onto the limits, each by the shortest way
/// (Agmon 1954). None where no such coordinates are found.
pub(crate) fn bring_within(limits: &[LinearLimit], [lower, upper]: [&[f64]; 2], near: &[f64]) -> Option<Vec<f64>> {
    /// Rounds of projections. Each goes a share of the way that depends on the angles between limits alone.
    const ROUNDS: usize = 1000;
    let mut coordinates = near.to_vec();
    for _ in 0..ROUNDS {
        for limit in limits {
            let sum = limit.sum(&coordinates);
            let missing = sum.clamp(limit.lower, limit.upper) - sum;
            if missing != 0.0 {
                let square: f64 = limit.terms.iter().map(|(_, multiplier)| multiplier * multiplier).sum();
                // A little too far: where the limits leave a whole region, its inside is reached after finitely many rounds.
                let width = limit.upper - limit.lower;
                let aim = missing + missing.signum() * (1e-9f64).min(0.5 * width);
                limit.terms.iter().for_each(|&(k, multiplier)| coordinates[k] += multiplier * aim / square);
            }
        }
        coordinates.iter_mut().zip(lower.iter().zip(upper)).for_each(|(q, (low, high))| *q = q.clamp(*low, *high));
        if limits.iter().all(|limit| limit.room(&coordinates) >= 0.0) {
            return Some(coordinates);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coupling(terms: &[(usize, f64)], offset: f64) -> Option<Coupling> {
        Some(Coupling { terms: terms.iter().map(|&(k, m)| (JointId(k), m)).collect(), offset })
    }

    #[test]
    fn followers_of_followers_follow_independent_joints() {
        // 3 = -1 - 2 + 0.1, 4 = 2 * 3 + 0.5 * 1 + 1, 5 = 4 - 3.
        let direct = [
            None,
            None,
            None,
            coupling(&[(1, -1.0), (2, -1.0)], 0.1),
            coupling(&[(3, 2.0), (1, 0.5)], 1.0),
            coupling(&[(4, 1.0), (3, -1.0)], 0.0),
        ];
        assert_eq!(resolve(&direct)[0], Ok(None));
        let four = resolve(&direct)[4].clone().unwrap().unwrap();
        let value = |joint: JointId| [0.3, -0.7, 1.1][joint.0];
        let three = 0.7 - 1.1 + 0.1;
        assert!((four.position(value) - (2.0 * three + 0.5 * -0.7 + 1.0)).abs() < 1e-15);
        let five = resolve(&direct)[5].clone().unwrap().unwrap();
        assert!((five.position(value) - (2.0 * three + 0.5 * -0.7 + 1.0 - three)).abs() < 1e-15);
        assert!(five.terms.iter().all(|(leader, _)| direct[leader.0].is_none()));
    }

    #[test]
    fn cycles_cancelled_terms_and_too_many_leaders_are_refused() {
        let cycle = [coupling(&[(1, 1.0)], 0.0), coupling(&[(2, 1.0), (0, 1.0)], 0.0), None];
        assert_eq!(resolve(&cycle)[0], Err(Unresolved::Cycle));
        let behind = [coupling(&[(1, 1.0)], 0.0), coupling(&[(0, 1.0)], 0.0), coupling(&[(0, 1.0)], 0.0)];
        assert!(resolve(&behind).iter().all(|found| *found == Err(Unresolved::Cycle)));
        let cancelled = [None, coupling(&[(0, 0.1)], 0.0), coupling(&[(1, 3.0), (0, -0.3)], 0.0)];
        assert_eq!(resolve(&cancelled)[2], Err(Unresolved::NoLeader));
        let mut many: Vec<Option<Coupling>> = vec![None; 7];
        many[5] = coupling(&[(0, 1.0), (1, 1.0), (2, 1.0)], 0.0);
        many[6] = coupling(&[(5, 1.0), (3, 1.0), (4, 1.0)], 0.0);
        assert_eq!(resolve(&many)[6], Err(Unresolved::TooManyLeaders));
    }

    #[test]
    fn ranges_hold_and_are_reached() {
        let coupling = Coupling { terms: Terms::from_iter([(0, -1.0), (1, 2.0)]), offset: 0.5 };
        let limits = [[-1.0, 2.0], [0.5, 3.0]];
        assert_eq!(coupling.range(|k: usize| limits[k]), [-0.5, 7.5]);
        let corners = [[2.0, 0.5], [-1.0, 3.0]].map(|at: [f64; 2]| coupling.position(|k| at[k]));
        assert_eq!(corners, [-0.5, 7.5]);
        assert_eq!(Coupling::one(0usize, -2.0, 0.5).range(|_| [-1.0, 2.0]), [-3.5, 2.5]);
    }

    #[test]
    fn points_are_brought_within_limits_or_there_are_none() {
        let coupling = Coupling { terms: Terms::from_iter([(0, 1.0), (1, 1.0)]), offset: 0.0 };
        let limit = |range| LinearLimit::new("follower".into(), &coupling, range);
        let (lower, upper) = ([-1.2, 0.0], [1.5, 2.3]);
        let within = |range, near: [f64; 2]| bring_within(&[limit(range)], [&lower, &upper], &near);
        let kept = within([0.0, 2.0], [0.2, 0.3]).unwrap();
        assert_eq!(kept, [0.2, 0.3]);
        for near in [[-1.2, 0.0], [1.5, 2.3], [1.5, 0.0]] {
            let found = within([0.0, 2.0], near).unwrap();
            let sum = found[0] + found[1];
            assert!((0.0..=2.0).contains(&sum) && (0..2).all(|k| found[k] >= lower[k] && found[k] <= upper[k]));
        }
        assert_eq!(within([4.0, 5.0], [0.0, 1.0]), None);
    }
}
