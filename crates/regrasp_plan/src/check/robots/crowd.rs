//! Groups of what stands still, so that an item far from a whole group is not compared with each of its members, and
//! bands of groups, so that one far from all groups of a band is not compared with each of them.

use crate::check::robots::items::{Items, Owner, Pair};
use regrasp_geometry::{Point, Vector};
use std::ops::Range;

/// Most members of a group.
const MEMBERS: usize = 16;
/// Most members of all groups of a band.
const BAND: usize = 256;
/// Fewer pairs with what stands still than this are looked at one by one.
const FEW: usize = 64;
/// More than any rounding of lengths, in metres.
const ROUNDING: f64 = 1e-9;

/// A ball about things that stand still.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    /// Centre, in the world.
    center: Point,
    /// Radius, in metres.
    radius: f64,
}

impl Ball {
    /// About the balls of these items.
    fn about(items: &Items, members: &[usize]) -> Self {
        let centers = || members.iter().map(|&item| items.items[item].center);
        let low = centers().fold(Vector::repeat(f64::INFINITY), |low, center| low.inf(&center.coords));
        let high = centers().fold(Vector::repeat(f64::NEG_INFINITY), |high, center| high.sup(&center.coords));
        let center = Point::from((low + high) * 0.5);
        let reach = |&item: &usize| (items.items[item].center - center).norm() + items.items[item].radius;
        Ball { center, radius: members.iter().map(reach).fold(0.0, f64::max) }
    }

    /// A lower bound of the distance between the ball with `radius` about `center` and the ball of any member, in metres.
    pub fn gap(&self, center: &Point, radius: f64) -> f64 {
        (center - self.center).norm() - radius - self.radius - ROUNDING
    }
}

/// The pairs of one item with the members of a group.
pub struct Row {
    /// A ball about the balls of all members.
    pub ball: Ball,
    /// The largest distance that one of the pairs must keep, in metres.
    pub floor: f64,
    /// Where its pairs stand in [`Crowd::in_rows`].
    pairs: Range<usize>,
}

/// The rows of one item with groups near each other.
pub struct Band {
    /// Index of the item.
    pub item: usize,
    /// Joints between the item and the body that both stand on.
    pub joints: usize,
    /// A ball about the balls of all members of the groups.
    pub ball: Ball,
    /// The largest distance that one of the pairs must keep, in metres.
    pub floor: f64,
    /// Where its rows stand in [`Crowd::rows`].
    pub rows: Range<usize>,
}

/// All pairs: those in rows, and the others.
pub struct Crowd {
    /// Rows, band by band.
    pub rows: Vec<Row>,
    /// Bands, item by item.
    pub bands: Vec<Band>,
    /// The other pairs, by index, rising.
    pub others: Vec<usize>,
    /// The pairs of all rows, by index; within a row rising.
    in_rows: Vec<usize>,
}

impl Crowd {
    /// Of these items. Valid as long as nothing is moved into or out of the world.
    pub fn new(items: &Items) -> Self {
        let (given, others): (Vec<usize>, Vec<usize>) =
            (0..items.pairs.len()).partition(|&index| items.items[items.pairs[index].b].owner == Owner::Still);
        let mut crowd = Crowd { rows: Vec::new(), bands: Vec::new(), others, in_rows: Vec::new() };
        if given.len() < FEW {
            crowd.others = (0..items.pairs.len()).collect();
            return crowd;
        }
        let mut still: Vec<usize> =
            (0..items.items.len()).filter(|&item| items.items[item].owner == Owner::Still).collect();
        let mut groups = Groups { balls: Vec::new(), of_item: vec![0; items.items.len()], bands: Vec::new() };
        groups.split(items, &mut still, false);
        crowd.in_rows.reserve(given.len());
        let of_same = |a: &usize, b: &usize| {
            let (first, second) = (&items.pairs[*a], &items.pairs[*b]);
            first.a == second.a && first.joints_a == second.joints_a
        };
        given.chunk_by(of_same).for_each(|own| crowd.add(items, &groups, own));
        crowd
    }

    /// The pairs of a row, by index, rising.
    pub fn pairs(&self, row: &Row) -> &[usize] {
        &self.in_rows[row.pairs.clone()]
    }

    /// Sorts pairs of one item by group.
    fn add(&mut self, items: &Items, groups: &Groups, own: &[usize]) {
        let group_of = |index: &usize| groups.of_item[items.pairs[*index].b];
        // By group, the end of its pairs; before they are written, the place of the next one.
        let mut ends = vec![0; groups.balls.len()];
        own.iter().for_each(|index| ends[group_of(index)] += 1);
        let mut first = self.in_rows.len();
        let mut next = first;
        for end in &mut ends {
            next += std::mem::replace(end, next);
        }
        self.in_rows.resize(next, 0);
        for index in own {
            let place = &mut ends[group_of(index)];
            self.in_rows[*place] = *index;
            *place += 1;
        }
        let Pair { a: item, joints_a: joints, .. } = items.pairs[own[0]];
        for (ball, own_groups) in &groups.bands {
            let (first_row, mut largest) = (self.rows.len(), f64::NEG_INFINITY);
            for group in own_groups.clone() {
                let pairs = first..ends[group];
                first = ends[group];
                let floors = self.in_rows[pairs.clone()].iter().map(|&index| items.pairs[index].floor);
                let floor = floors.fold(f64::NEG_INFINITY, f64::max);
                if !pairs.is_empty() {
                    self.rows.push(Row { ball: groups.balls[group], floor, pairs });
                    largest = largest.max(floor);
                }
            }
            if first_row < self.rows.len() {
                self.bands.push(Band { item, joints, ball: *ball, floor: largest, rows: first_row..self.rows.len() });
            }
        }
    }
}

/// Groups of items near each other.
struct Groups {
    /// By group.
    balls: Vec<Ball>,
    /// By item, its group.
    of_item: Vec<usize>,
    /// Groups near each other, by index.
    bands: Vec<(Ball, Range<usize>)>,
}

impl Groups {
    /// Halves along the longest side.
    fn split(&mut self, items: &Items, members: &mut [usize], is_in_band: bool) {
        let first = self.balls.len();
        if !is_in_band && members.len() <= BAND {
            let ball = Ball::about(items, members);
            self.split(items, members, true);
            return self.bands.push((ball, first..self.balls.len()));
        }
        if members.len() <= MEMBERS {
            members.iter().for_each(|&item| self.of_item[item] = first);
            return self.balls.push(Ball::about(items, members));
        }
        let center = |item: usize| items.items[item].center;
        let (mut low, mut high) = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
        for &item in members.iter() {
            (low, high) = (low.inf(&center(item).coords), high.sup(&center(item).coords));
        }
        let axis = (high - low).imax();
        let half = members.len() / 2;
        members.select_nth_unstable_by(half, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
        let (first, second) = members.split_at_mut(half);
        self.split(items, first, is_in_band);
        self.split(items, second, is_in_band);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::robots::items::Item;
    use crate::check::robots::tree::Frame;
    use regrasp_base::Rng;
    use regrasp_geometry::reference::ReferenceShape;
    use regrasp_geometry::{Pose, Shape};
    use regrasp_robot::LinkId;

    fn item(rng: &mut Rng, owner: Owner) -> Item {
        let radius = rng.uniform(0.01, 0.2);
        let shape = ReferenceShape::new(&Shape::Sphere { radius }).expect("a ball");
        let center = Point::from([0; 3].map(|_| rng.uniform(-1.0, 1.0)));
        Item {
            name: String::new(),
            owner,
            body: 0,
            shape,
            frame: Frame::of(&Pose::identity()),
            center,
            radius,
            spin_radius: 0.0,
            stands: owner == Owner::Still,
            tip_of: None,
            support: None,
            is_for_tips_only: false,
            is_hull: false,
            is_own_tip: false,
        }
    }

    #[test]
    fn every_pair_is_in_one_place_and_no_row_is_nearer_than_it_says() {
        let mut rng = Rng::keyed(3, "crowd", 0);
        for n_still in [0, 3, 40, 300, 1500] {
            let mut items = Items { items: Vec::new(), pairs: Vec::new() };
            (0..5).for_each(|l| items.items.push(item(&mut rng, Owner::Link(LinkId(l)))));
            (0..n_still).for_each(|_| items.items.push(item(&mut rng, Owner::Still)));
            for a in 0..5 {
                for b in a + 1..items.items.len() {
                    let floor = rng.uniform(-0.1, 0.1);
                    items.pairs.push(Pair { a, b, joints_a: a, joints_b: 0, floor });
                }
            }
            let crowd = Crowd::new(&items);
            let mut seen: Vec<usize> = crowd.others.clone();
            let mut n_rows = 0;
            for band in &crowd.bands {
                let first = &items.items[band.item];
                assert_eq!(band.rows.start, n_rows, "bands follow each other");
                n_rows = band.rows.end;
                for row in &crowd.rows[band.rows.clone()] {
                    for &index in crowd.pairs(row) {
                        let pair = items.pairs[index];
                        let second = &items.items[pair.b];
                        let gap = (first.center - second.center).norm() - first.radius - second.radius;
                        assert!(row.ball.gap(&first.center, first.radius) <= gap);
                        assert!(band.ball.gap(&first.center, first.radius) <= gap);
                        assert!(pair.a == band.item && pair.joints_a == band.joints);
                        assert!(pair.floor <= row.floor && row.floor <= band.floor);
                    }
                    assert!((1..=MEMBERS).contains(&crowd.pairs(row).len()));
                    seen.extend(crowd.pairs(row));
                }
            }
            assert_eq!(n_rows, crowd.rows.len());
            seen.sort_unstable();
            assert_eq!(seen, (0..items.pairs.len()).collect::<Vec<_>>());
        }
    }
}
