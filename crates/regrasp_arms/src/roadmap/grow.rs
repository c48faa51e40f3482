//! Graphs that grow: what queries found and the graph did not have becomes part of it (Saut 2010, sec. V-B).

use super::roads::Roads;
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::world::World;

/// Nodes of the graph that one of a way is tried to be joined to, at most.
const LINKS: usize = 5;

impl Roads {
    /// The graph with `ways`, and the number of nodes that they added. A way has states of the robot, one value per coordinate in radians
    /// or metres; motions between them are straight. `model` and `world` are what the graph was made for: a motion is taken where it is
    /// certified for them at the graph's clearance, whatever the query knew. What is left out cuts a way into several.
    pub fn grown_by(&self, ways: &[Vec<Vec<f64>>], model: &ArmModel, world: &World) -> (Roads, usize) {
        let settings = ColliderSettings { clearance: self.graph.clearance, ..ColliderSettings::default() };
        let mut exact = Collider::new(model, world, settings);
        let (mut grown, mut n_added) = (self.clone(), 0);
        for way in ways {
            let way: Vec<Vec<f64>> = way.iter().map(|state| model.configuration_of(state)).collect();
            for part in free_parts(&way, &mut exact) {
                n_added += part.len();
                grown.add(part, &mut exact);
            }
        }
        (grown, n_added)
    }

    /// Makes a way of certified motions part of the graph. Each of its nodes is joined to the nearest one of the graph that can be
    /// reached straight.
    pub(super) fn add(&mut self, way: &[Vec<f64>], exact: &mut Collider) {
        let first = self.graph.graph.nodes.len();
        let mut edges: Vec<[usize; 2]> = (1..way.len()).map(|k| [first + k - 1, first + k]).collect();
        for (k, configuration) in way.iter().enumerate() {
            let is_joined =
                |&node: &usize| exact.is_certified_free(&Track::straight(&self.graph.graph.nodes[node], configuration));
            edges.extend(self.nearest(configuration, LINKS).into_iter().find(is_joined).map(|node| [node, first + k]));
        }
        self.enrich(way.to_vec(), &edges);
    }
}

/// Parts of a way whose motions are certified.
fn free_parts<'w>(way: &'w [Vec<f64>], exact: &mut Collider) -> Vec<&'w [Vec<f64>]> {
    let mut parts = Vec::new();
    let mut first = 0;
    for k in 1..=way.len() {
        let goes_on = k < way.len() && exact.is_certified_free(&Track::straight(&way[k - 1], &way[k]));
        if !goes_on {
            // A configuration by itself is no way.
            parts.extend((k - first > 1).then(|| &way[first..k]));
            first = k;
        }
    }
    parts
}
