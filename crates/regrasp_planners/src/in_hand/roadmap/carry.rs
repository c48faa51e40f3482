//! Carrying out a path of the graph with fingertips that roll (Sahbani 2007, sec. IV-C and IV-D).
//!
//! Where a fingertip rolls to depends on the way that it came, so the graph keeps contacts that stay where they are: its paths
//! say which fingers change their contacts where, and to what. Carried out, each transfer rolls, and every relocation brings a
//! finger back to a contact of the graph. What does not come off is barred, and another way on sought from where the object is.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::regrasping::change::{Arrival, change_grasp, whole_transfer};
use crate::in_hand::roadmap::anchor::{QueryEnd, grasp_given};
use crate::in_hand::roadmap::graph::Passage;
use crate::in_hand::roadmap::query::{ANCHORS, RoadmapPlanner};
use regrasp_base::Rng;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_roadmap::AStar;
use std::collections::BTreeSet;

/// Edges and links that may fail before a query is begun from another anchor. By hand.
const MOST_BARRED: usize = 80;

/// Pairs of nodes between which nothing came off in this query, the smaller first.
pub type Barred = BTreeSet<(usize, usize)>;

impl RoadmapPlanner<'_> {
    /// Motions from the end of `way`, which is at the grasp of the first node of `path`, to the goal. None when too much does not
    /// come off, or no way is left.
    pub(super) fn carry_out(
        &self,
        search: &mut Search,
        mut way: Sequence,
        goal: &mut QueryEnd,
        mut path: Vec<usize>,
        a_star: &mut AStar,
    ) -> Result<Option<Sequence>, Stop> {
        let mut barred = Barred::new();
        let mut n_failed = 0;
        loop {
            let mut here = path[0];
            let mut came_off = true;
            for &next in &path[1..] {
                search.check()?;
                match self.pass(search, &way, here, next) {
                    Some(on) => (way, here) = (on, next),
                    None => {
                        barred.insert((here.min(next), here.max(next)));
                        came_off = false;
                        break;
                    }
                }
            }
            if came_off {
                if let Some(arrived) = arrive(search, &way, goal) {
                    return Ok(Some(arrived));
                }
                goal.anchors.retain(|anchor| anchor.node != here);
                goal.fill(search, self.roadmap, ANCHORS)?;
            }
            n_failed += 1;
            if n_failed > MOST_BARRED || goal.anchors.is_empty() {
                return Ok(None);
            }
            path = match self.route_from(here, goal, &barred, a_star) {
                Some(path) => path,
                None => return Ok(None),
            };
        }
    }

    /// `way` with the motion from node `here` to its neighbour `next`, as it comes out from where the way has led.
    fn pass(&self, search: &mut Search, way: &Sequence, here: usize, next: usize) -> Option<Sequence> {
        let graph = &self.roadmap.graph;
        let edge = self.roadmap.index.edge_between(here, next)?;
        match graph.edges[edge as usize].passage {
            Passage::Transfer { .. } => {
                let transfer = whole_transfer(search, way.end(), graph.pose(next))?;
                way.clone().then(transfer)
            }
            Passage::Relocation { finger, .. } => {
                let finger = usize::from(finger);
                let mut to = way.end().clone();
                to.set_contact(finger, Some(*graph.contact(next, finger)));
                to.joints[finger] = graph.joints(next, finger);
                let mut rng = Rng::child(&search.rng, "carried", 0);
                search.rng.bits();
                change_grasp(search, way, &to, Arrival::Exact, &mut rng)
            }
        }
    }
}

/// `way` taken on to the goal's pose, and there to the grasp given.
fn arrive(search: &mut Search, way: &Sequence, goal: &QueryEnd) -> Option<Sequence> {
    let transfer = whole_transfer(search, way.end(), &goal.pose)?;
    let there = way.clone().then(transfer)?;
    match &goal.given {
        None => Some(there),
        Some(given) => grasp_given(search, &there, given),
    }
}
