//! Links between grasps: what the roadmaps of Saut 2011 have for edges, and the local methods that make them.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::moving::grasp_path::GraspPath;
use crate::in_hand::regrasping::change::{Arrival, regrasp_transfer, transfer_regrasp};
use regrasp_base::Rng;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_roadmap::space::Space;
use regrasp_roadmap::visibility_prm::VisibilityPrm;
use std::rc::Rc;

/// The manipulation graph.
pub type Roadmap = VisibilityPrm<GraspState, Link>;

/// An edge of the manipulation graph, from one node to another. It can be gone both ways.
#[derive(Debug, Clone)]
pub enum Link {
    /// A path in GS_n, to be decomposed.
    Grasp(Rc<GraspPath>),
    /// Feasible motions.
    Steps(Rc<Sequence>),
}

/// How two grasps are linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalMethod {
    /// By a linear path in GS_n (Saut 2011, sec. 4.2.2).
    GraspPath,
    /// By one transfer-regrasp or regrasp-transfer ("classic method", Saut 2011, sec. 5.1).
    TransferRegrasp,
}

/// GS_n with a local method, as the visibility PRM asks about it.
pub struct GraspSpace<'s, 'a> {
    /// The search.
    pub search: &'s mut Search<'a>,
    /// How grasps are linked.
    pub local_method: LocalMethod,
    /// Set when the search is to stop; from then on nothing is linked.
    pub stop: Option<Stop>,
}

impl Space for GraspSpace<'_, '_> {
    type Point = GraspState;
    type Motion = Link;

    fn sample(&mut self, _: &mut Rng) -> Option<GraspState> {
        crate::in_hand::grasps::sample::draw_state(self.search)
    }

    fn distance(&self, a: &GraspState, b: &GraspState) -> f64 {
        distance(self.search, a, b)
    }

    fn connect(&mut self, a: &GraspState, b: &GraspState) -> Option<Link> {
        self.stop = self.stop.or_else(|| self.search.check().err());
        if self.stop.is_some() {
            return None;
        }
        match self.local_method {
            LocalMethod::GraspPath => GraspPath::between(self.search, a, b).map(|path| Link::Grasp(Rc::new(path))),
            LocalMethod::TransferRegrasp => single_sequence(self.search, a, b).map(|steps| Link::Steps(Rc::new(steps))),
        }
    }
}

/// Distance of two grasps: of their poses, and on average of their contacts.
pub fn distance(search: &Search, a: &GraspState, b: &GraspState) -> f64 {
    let apart: f64 =
        a.contacts.iter().zip(&b.contacts).map(|(p, q)| (p.point_in_object - q.point_in_object).norm()).sum();
    search.distance(&a.world_from_object, &b.world_from_object) + apart / a.contacts.len() as f64
}

/// One transfer and one regrasp, in either order (Saut 2011, sec. 4.3): from exactly `from` to exactly `to`.
pub fn single_sequence(search: &mut Search, from: &GraspState, to: &GraspState) -> Option<Sequence> {
    let mut rng = Rng::child(&search.rng, "single_sequence", 0);
    search.rng.bits();
    transfer_regrasp(search, from, to, Arrival::Exact, &mut rng)
        .or_else(|| regrasp_transfer(search, from, to, Arrival::Exact, &mut rng))
}
