//! A tree of configurations that grows, and its nearest node.
//!
//! Distances are in single precision: the answer is the node of the least one, of equals the first.

use crate::lanes::{F8, LANES};

/// Nodes with their parents.
#[derive(Debug, Clone)]
pub struct Tree {
    dimension: usize,
    /// Node by node.
    values: Vec<f64>,
    /// Eight nodes after the other, coordinate by coordinate.
    blocks: Vec<F8>,
    parents: Vec<u32>,
    /// By node: samples farther than this are not for it (Jaillet et al. 2005).
    pub(super) radii: Vec<f32>,
    arch: pulp::Arch,
}

/// Farther than any node.
const NOWHERE: f32 = f32::INFINITY;

impl Tree {
    /// An empty tree of configurations of this many coordinates.
    pub fn new(dimension: usize) -> Self {
        Tree {
            dimension,
            values: Vec::new(),
            blocks: Vec::new(),
            parents: Vec::new(),
            radii: Vec::new(),
            arch: pulp::Arch::new(),
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// True without a node.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// Adds a node below `parent`; a root where that is the node itself.
    pub fn push(&mut self, configuration: &[f64], parent: usize) -> usize {
        let node = self.parents.len();
        if node % LANES == 0 {
            self.blocks.extend(std::iter::repeat_n(F8::splat(NOWHERE), self.dimension));
        }
        let first = self.blocks.len() - self.dimension;
        for (block, value) in self.blocks[first..].iter_mut().zip(configuration) {
            block.0[node % LANES] = *value as f32;
        }
        self.values.extend_from_slice(configuration);
        self.parents.push(parent as u32);
        self.radii.push(f32::INFINITY);
        node
    }

    /// The configuration of a node.
    pub fn configuration(&self, node: usize) -> &[f64] {
        &self.values[node * self.dimension..(node + 1) * self.dimension]
    }

    /// The node nearest to `configuration`, and the square of the distance. Panics without nodes.
    pub fn nearest(&self, configuration: &[f64]) -> (usize, f32) {
        assert!(!self.is_empty(), "a tree without nodes");
        self.arch.dispatch(Nearest { tree: self, configuration })
    }

    #[inline(always)]
    fn nearest_of_all(&self, configuration: &[f64]) -> (usize, f32) {
        let mut best = F8::splat(f32::INFINITY);
        let mut rounds = [0u32; LANES];
        for (round, block) in self.blocks.chunks_exact(self.dimension).enumerate() {
            let mut sum = F8::ZERO;
            for k in 0..self.dimension {
                let d = block[k] - configuration[k] as f32;
                sum = sum + d * d;
            }
            for l in 0..LANES {
                let is_nearer = sum.0[l] < best.0[l];
                rounds[l] = if is_nearer { round as u32 } else { rounds[l] };
                best.0[l] = if is_nearer { sum.0[l] } else { best.0[l] };
            }
        }
        let nodes = (0..LANES).map(|l| (best.0[l], rounds[l] as usize * LANES + l));
        let nearest = nodes.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map_or((0, f32::INFINITY), |(distance, node)| (node.min(self.len() - 1), distance))
    }

    /// Configurations from a node to its root.
    pub fn way_to_root(&self, node: usize) -> Vec<Vec<f64>> {
        let mut way = vec![self.configuration(node).to_vec()];
        let mut at = node;
        while self.parents[at] as usize != at {
            at = self.parents[at] as usize;
            way.push(self.configuration(at).to_vec());
        }
        way
    }
}

/// The search for the nearest node, compiled for the vector instructions of the machine.
struct Nearest<'t> {
    tree: &'t Tree,
    configuration: &'t [f64],
}

impl pulp::NullaryFnOnce for Nearest<'_> {
    type Output = (usize, f32);

    #[inline(always)]
    fn call(self) -> (usize, f32) {
        self.tree.nearest_of_all(self.configuration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn the_nearest_node_is_the_first_of_the_nearest() {
        for dimension in [1, 3, 7, 14] {
            let mut rng = Rng::keyed(4, "tree", dimension as u64);
            let mut tree = Tree::new(dimension);
            // Coarse values: many ties.
            let mut draw = || (0..dimension).map(|_| (rng.unit() * 4.0).floor()).collect::<Vec<f64>>();
            for n in 0..600 {
                tree.push(&draw(), n / 2);
                let asked = draw();
                let square = |node: usize| {
                    let own = tree.configuration(node).iter().zip(&asked);
                    own.map(|(a, b)| (*a as f32 - *b as f32).powi(2)).sum::<f32>()
                };
                let expected =
                    (0..tree.len()).min_by(|&a, &b| square(a).total_cmp(&square(b)).then(a.cmp(&b))).unwrap();
                assert_eq!(tree.nearest(&asked), (expected, square(expected)));
            }
        }
    }
}
