//! What a best-first search has still to look at.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Entries in the order of a best-first search: the least estimate first; of equal estimates the one that has come farthest;
/// of those the least number. The order in which they were added does not matter where numbers differ.
#[derive(Debug, Clone)]
pub struct OpenList<T> {
    entries: BinaryHeap<Entry<T>>,
}

/// How good an entry is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// What the whole way costs, as far as one can tell.
    pub estimate: f64,
    /// What the way so far costs; zero where that must not matter.
    pub cost: f64,
    /// Decides between equals, such as the index of a node.
    pub number: usize,
}

impl Rank {
    /// A rank without a way so far.
    pub fn of(estimate: f64, number: usize) -> Self {
        Rank { estimate, cost: 0.0, number }
    }

    /// Greater is better.
    fn against(&self, other: &Self) -> Ordering {
        let farther = self.cost.total_cmp(&other.cost);
        other.estimate.total_cmp(&self.estimate).then(farther).then(other.number.cmp(&self.number))
    }
}

#[derive(Debug, Clone)]
struct Entry<T> {
    rank: Rank,
    item: T,
}

impl<T> Ord for Entry<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank.against(&other.rank)
    }
}

impl<T> PartialOrd for Entry<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> PartialEq for Entry<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for Entry<T> {}

impl<T> Default for OpenList<T> {
    fn default() -> Self {
        OpenList { entries: BinaryHeap::new() }
    }
}

impl<T> OpenList<T> {
    /// An empty list.
    pub fn new() -> Self {
        OpenList::default()
    }

    /// Adds an entry.
    pub fn push(&mut self, rank: Rank, item: T) {
        self.entries.push(Entry { rank, item });
    }

    /// Takes the best entry.
    pub fn pop(&mut self) -> Option<(Rank, T)> {
        self.entries.pop().map(|entry| (entry.rank, entry.item))
    }

    /// Forgets all entries, and keeps the memory.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

impl<T> Extend<(Rank, T)> for OpenList<T> {
    /// Adds many entries in time linear in their number.
    fn extend<I: IntoIterator<Item = (Rank, T)>>(&mut self, ranked: I) {
        self.entries.extend(ranked.into_iter().map(|(rank, item)| Entry { rank, item }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn entries_come_in_the_order_that_sorting_gives() {
        let mut rng = Rng::keyed(1, "open_list", 0);
        let mut ranks: Vec<Rank> =
            (0..500).map(|number| Rank { estimate: rng.below(9) as f64, cost: rng.below(3) as f64, number }).collect();
        let mut open = OpenList::new();
        open.extend(ranks[..300].iter().map(|&rank| (rank, ())));
        for &rank in &ranks[300..] {
            open.push(rank, ());
        }
        ranks.sort_by(|a, b| {
            (a.estimate, -a.cost, a.number).partial_cmp(&(b.estimate, -b.cost, b.number)).expect("no NaN")
        });
        let popped: Vec<Rank> = std::iter::from_fn(|| open.pop()).map(|(rank, ())| rank).collect();
        assert_eq!(popped, ranks);
    }
}
