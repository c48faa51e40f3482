//! Connected components of a growing graph.
//!
//! Union-find with path halving (Tarjan, van Leeuwen 1984). The representative is always the smallest node of the
//! component, so that it doesn't depend on the order of unions.

/// Components of nodes `0..len`.
#[derive(Debug, Clone, Default)]
pub struct Components {
    /// A node of the same component with a smaller index, or the node itself.
    parents: Vec<usize>,
    n_components: usize,
}

impl Components {
    /// No nodes.
    pub fn new() -> Self {
        Components::default()
    }

    /// Adds a node in a component of its own; its index.
    pub fn push(&mut self) -> usize {
        self.parents.push(self.parents.len());
        self.n_components += 1;
        self.parents.len() - 1
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// True when there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// Number of components.
    pub fn n_components(&self) -> usize {
        self.n_components
    }

    /// The smallest node of the component of `node`.
    pub fn representative(&self, node: usize) -> usize {
        let mut node = node;
        while self.parents[node] != node {
            node = self.parents[node];
        }
        node
    }

    /// Joins the components of `a` and `b`; false when they were one already.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.halve(a), self.halve(b));
        if a == b {
            return false;
        }
        self.parents[a.max(b)] = a.min(b);
        self.n_components -= 1;
        true
    }

    /// True when `a` and `b` are in the same component.
    pub fn same(&self, a: usize, b: usize) -> bool {
        self.representative(a) == self.representative(b)
    }

    /// Representatives of all components, in rising order.
    pub fn representatives(&self) -> impl Iterator<Item = usize> + '_ {
        self.parents.iter().enumerate().filter(|&(node, &parent)| node == parent).map(|(node, _)| node)
    }

    /// As `representative`, shortening the way on the way.
    fn halve(&mut self, node: usize) -> usize {
        let mut node = node;
        while self.parents[node] != node {
            self.parents[node] = self.parents[self.parents[node]];
            node = self.parents[node];
        }
        node
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn agrees_with_repainting() {
        let mut rng = Rng::keyed(1, "components", 0);
        for _ in 0..50 {
            let mut components = Components::new();
            let mut colours: Vec<usize> = (0..40).map(|_| components.push()).collect();
            for _ in 0..30 {
                let (a, b) = (rng.below(40), rng.below(40));
                let (from, to) = (colours[a].max(colours[b]), colours[a].min(colours[b]));
                assert_eq!(components.join(a, b), from != to);
                colours.iter_mut().filter(|colour| **colour == from).for_each(|colour| *colour = to);
                for (node, &colour) in colours.iter().enumerate() {
                    assert_eq!(components.representative(node), colour);
                }
            }
            let mut distinct = colours.clone();
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(components.representatives().collect::<Vec<_>>(), distinct);
            assert_eq!(components.n_components(), distinct.len());
        }
    }
}
