//! Groups of what stands still, so that an item far from a whole group is not compared with each of its members.

use crate::check::robots::items::{Items, Owner};
use regrasp_geometry::{Point, Vector};

/// Most members of a group.
const MEMBERS: usize = 16;
/// Fewer pairs with what stands still than this are looked at one by one.
const FEW: usize = 64;
/// More than any rounding of lengths, in metres.
const ROUNDING: f64 = 1e-9;

/// The pairs of one item with the members of a group.
pub struct Row {
    /// Index of the item.
    pub item: usize,
    /// Joints between the item and the body that both stand on.
    pub joints: usize,
    /// Centre of a ball about the balls of all members, in the world.
    center: Point,
    /// Radius of that ball, in metres.
    radius: f64,
    /// The largest distance that one of the pairs must keep, in metres.
    pub floor: f64,
    /// The pairs, by index, rising.
    pub pairs: Vec<usize>,
}

impl Row {
    /// A lower bound of the distance between the ball with `radius` about `center` and the ball of any member, in metres.
    pub fn gap(&self, center: &Point, radius: f64) -> f64 {
        (center - self.center).norm() - radius - self.radius - ROUNDING
    }
}

/// All pairs: those in rows, and the others.
pub struct Crowd {
    /// Pairs with what stands still.
    pub rows: Vec<Row>,
    /// The other pairs, by index, rising.
    pub others: Vec<usize>,
}

impl Crowd {
    /// Of these items. Valid as long as nothing is moved into or out of the world.
    pub fn new(items: &Items) -> Self {
        let (in_rows, others): (Vec<usize>, Vec<usize>) =
            (0..items.pairs.len()).partition(|&index| items.items[items.pairs[index].b].owner == Owner::Still);
        if in_rows.len() < FEW {
            return Crowd { rows: Vec::new(), others: (0..items.pairs.len()).collect() };
        }
        let mut still: Vec<usize> =
            (0..items.items.len()).filter(|&item| items.items[item].owner == Owner::Still).collect();
        let mut groups = Vec::new();
        split(items, &mut still, &mut groups);
        let mut group_of = vec![0; items.items.len()];
        for (group, (_, _, members)) in groups.iter().enumerate() {
            members.iter().for_each(|&member| group_of[member] = group);
        }
        let mut rows: Vec<Row> = Vec::new();
        // By group: the row of the item that is looked at.
        let mut row_of = vec![usize::MAX; groups.len()];
        for index in in_rows {
            let pair = items.pairs[index];
            let group = group_of[pair.b];
            let known = rows.get(row_of[group]).is_some_and(|row| row.item == pair.a && row.joints == pair.joints_a);
            if !known {
                row_of[group] = rows.len();
                let (center, radius, _) = groups[group];
                let (item, joints) = (pair.a, pair.joints_a);
                rows.push(Row { item, joints, center, radius, floor: pair.floor, pairs: Vec::new() });
            }
            let row = &mut rows[row_of[group]];
            row.floor = row.floor.max(pair.floor);
            row.pairs.push(index);
        }
        Crowd { rows, others }
    }
}

/// Groups of items near each other: halves along the longest side.
fn split(items: &Items, members: &mut [usize], groups: &mut Vec<(Point, f64, Vec<usize>)>) {
    let center = |item: usize| items.items[item].center;
    let (mut low, mut high) = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
    for &item in members.iter() {
        (low, high) = (low.inf(&center(item).coords), high.sup(&center(item).coords));
    }
    if members.len() <= MEMBERS {
        let middle = Point::from((low + high) * 0.5);
        let reach = |&item: &usize| (center(item) - middle).norm() + items.items[item].radius;
        let radius = members.iter().map(reach).fold(0.0, f64::max);
        groups.push((middle, radius, members.to_vec()));
        return;
    }
    let axis = (high - low).imax();
    let half = members.len() / 2;
    members.select_nth_unstable_by(half, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
    let (first, second) = members.split_at_mut(half);
    split(items, first, groups);
    split(items, second, groups);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::robots::items::{Item, Pair};
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
        for n_still in [0, 3, 40, 300] {
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
            for row in &crowd.rows {
                let first = &items.items[row.item];
                for &index in &row.pairs {
                    let pair = items.pairs[index];
                    let second = &items.items[pair.b];
                    let gap = (first.center - second.center).norm() - first.radius - second.radius;
                    assert!(row.gap(&first.center, first.radius) <= gap);
                    assert!(pair.a == row.item && pair.joints_a == row.joints && pair.floor <= row.floor);
                }
                assert!(row.pairs.len() <= MEMBERS);
                seen.extend(&row.pairs);
            }
            seen.sort_unstable();
            assert_eq!(seen, (0..items.pairs.len()).collect::<Vec<_>>());
        }
    }
}
