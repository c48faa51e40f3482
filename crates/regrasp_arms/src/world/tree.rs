//! A tree of boxes over many obstacles.

/// Boxes at rest, and a tree over them: halves of the longest side.
#[derive(Debug, Clone)]
pub struct BoxTree {
    nodes: Vec<Node>,
    /// Indices of the boxes, in the order of the leaves.
    order: Vec<u32>,
    boxes: Vec<[[f32; 3]; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// Leaf: first item. Inner node: index of the second child; the first one follows its parent.
    first: u32,
    /// Number of items of a leaf; zero for inner nodes.
    n_items: u32,
}

/// Most boxes of a leaf.
const LEAF: usize = 4;

fn meets(low: &[f32; 3], high: &[f32; 3], other_low: &[f32; 3], other_high: &[f32; 3]) -> bool {
    (0..3).all(|k| low[k] <= other_high[k] && other_low[k] <= high[k])
}

impl BoxTree {
    /// The tree over boxes, each by its lowest and its highest corner.
    pub fn new(boxes: &[[[f32; 3]; 2]]) -> Self {
        let mut tree = BoxTree { nodes: Vec::new(), order: (0..boxes.len() as u32).collect(), boxes: boxes.to_vec() };
        tree.build(0, boxes.len());
        tree
    }

    fn build(&mut self, first: usize, last: usize) {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for &index in &self.order[first..last] {
            let [own_low, own_high] = self.boxes[index as usize];
            for k in 0..3 {
                low[k] = low[k].min(own_low[k]);
                high[k] = high[k].max(own_high[k]);
            }
        }
        let node = self.nodes.len();
        let n_items = last - first;
        self.nodes.push(Node { low, high, first: first as u32, n_items: n_items as u32 });
        if n_items <= LEAF {
            return;
        }
        let axis = (0..3).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        let boxes = &self.boxes;
        let middle = |index: &u32| boxes[*index as usize][0][axis] + boxes[*index as usize][1][axis];
        let half = n_items / 2;
        self.order[first..last].select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        self.build(first, first + half);
        self.nodes[node].first = self.nodes.len() as u32;
        self.nodes[node].n_items = 0;
        self.build(first + half, last);
    }

    /// Appends the indices of all boxes that meet the one from `low` to `high`, in rising order.
    pub fn meets(&self, low: [f32; 3], high: [f32; 3], found: &mut Vec<u32>) {
        let start = found.len();
        let mut stack = [0u32; 64];
        let mut n_stack = usize::from(!self.order.is_empty());
        while n_stack > 0 {
            n_stack -= 1;
            let index = stack[n_stack] as usize;
            let node = &self.nodes[index];
            if !meets(&low, &high, &node.low, &node.high) {
                continue;
            }
            if node.n_items == 0 {
                stack[n_stack] = index as u32 + 1;
                stack[n_stack + 1] = node.first;
                n_stack += 2;
                continue;
            }
            let own = &self.order[node.first as usize..(node.first + node.n_items) as usize];
            found.extend(own.iter().copied().filter(|&item| {
                let [own_low, own_high] = &self.boxes[item as usize];
                meets(&low, &high, own_low, own_high)
            }));
        }
        found[start..].sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn finds_what_a_test_of_all_finds() {
        let mut rng = Rng::keyed(2, "box_tree", 0);
        for n in [0, 1, 4, 5, 50, 700] {
            let mut draw = |size: f64| {
                let low = [0; 3].map(|_| rng.uniform(-1.0, 1.0) as f32);
                let high = [0, 1, 2].map(|k| low[k] + rng.uniform(0.0, size) as f32);
                [low, high]
            };
            let boxes: Vec<_> = (0..n).map(|_| draw(0.2)).collect();
            let tree = BoxTree::new(&boxes);
            for _ in 0..100 {
                let [low, high] = draw(0.6);
                let mut found = Vec::new();
                tree.meets(low, high, &mut found);
                let is_met = |i: &u32| meets(&low, &high, &boxes[*i as usize][0], &boxes[*i as usize][1]);
                let expected: Vec<u32> = (0..n as u32).filter(is_met).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
