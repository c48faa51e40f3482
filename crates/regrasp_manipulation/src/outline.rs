//! What a graph of grasps looks like: object poses, which of them hang together, and how; for pictures.

use regrasp_geometry::Pose;
use regrasp_roadmap::Components;

/// Grasps and the motions between them, without fingers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    /// Nodes, in the order in which they were made.
    pub nodes: Vec<OutlineNode>,
    /// Motions.
    pub edges: Vec<OutlineEdge>,
}

/// Where the object is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlineNode {
    /// Pose of the object.
    pub world_from_object: Pose,
    /// Connected component, 0 the largest; of equals the one that was begun first.
    pub component: usize,
}

/// A motion between two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct OutlineEdge {
    /// The nodes.
    pub nodes: [usize; 2],
    /// True when a finger changes its contact on the way.
    pub changes_grasp: bool,
}

impl Outline {
    /// Poses and motions between them, with components counted.
    pub fn new(poses: Vec<Pose>, edges: Vec<OutlineEdge>) -> Self {
        let mut joined = Components::new();
        poses.iter().for_each(|_| {
            joined.push();
        });
        for edge in &edges {
            joined.join(edge.nodes[0], edge.nodes[1]);
        }
        let mut sizes = vec![0usize; poses.len()];
        (0..poses.len()).for_each(|node| sizes[joined.representative(node)] += 1);
        let mut order: Vec<usize> = (0..poses.len()).filter(|&node| sizes[node] > 0).collect();
        order.sort_by_key(|&node| std::cmp::Reverse(sizes[node]));
        let mut number = vec![0; poses.len()];
        order.iter().enumerate().for_each(|(k, &node)| number[node] = k);
        let node = |(index, world_from_object)| OutlineNode {
            world_from_object,
            component: number[joined.representative(index)],
        };
        Outline { nodes: poses.into_iter().enumerate().map(node).collect(), edges }
    }

    /// The same graph with every pose of the object replaced by `moved` of it.
    #[must_use]
    pub(crate) fn moved_by(mut self, moved: impl Fn(&Pose) -> Pose) -> Self {
        self.nodes.iter_mut().for_each(|node| node.world_from_object = moved(&node.world_from_object));
        self
    }

    /// Number of connected components.
    pub fn n_components(&self) -> usize {
        self.nodes.iter().map(|node| node.component + 1).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn components_are_those_of_spreading_numbers_and_the_largest_comes_first() {
        let mut rng = Rng::keyed(4, "outline", 0);
        for n in [0, 1, 7, 40] {
            let edges: Vec<OutlineEdge> = (0..n / 2)
                .map(|_| OutlineEdge { nodes: [rng.below(n), rng.below(n)], changes_grasp: rng.chance(0.5) })
                .collect();
            let outline = Outline::new(vec![Pose::identity(); n], edges.clone());
            // The smallest node of each component, by spreading it until nothing changes.
            let mut least: Vec<usize> = (0..n).collect();
            for _ in 0..n {
                for edge in &edges {
                    let smaller = least[edge.nodes[0]].min(least[edge.nodes[1]]);
                    edge.nodes.iter().for_each(|&node| least[node] = smaller);
                }
            }
            for a in 0..n {
                for b in 0..n {
                    let same = outline.nodes[a].component == outline.nodes[b].component;
                    assert_eq!(same, least[a] == least[b], "{a} {b}");
                }
            }
            let size = |k: usize| outline.nodes.iter().filter(|node| node.component == k).count();
            let sizes: Vec<usize> = (0..outline.n_components()).map(size).collect();
            assert!(sizes.is_sorted_by(|a, b| a >= b) && !sizes.contains(&0), "{sizes:?}");
            assert_eq!(sizes.iter().sum::<usize>(), n);
        }
    }
}
