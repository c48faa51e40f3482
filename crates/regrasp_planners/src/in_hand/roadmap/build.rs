//! Building: places are spread over the region; grasps are sown at each, turned into others by gaits, taken to the places
//! nearby as far as they reach, and joined with each other wherever they meet.
//!
//! Each stage works on all places at once, from the graph as the stage before left it, with random numbers keyed by stage
//! and place; what was found is added in the order of places. So the graph is the same on any number of threads.

use crate::in_hand::attempt::search::{Context, Search, Stop};
use crate::in_hand::recording::validate::follow_relocation;
use crate::in_hand::refusals::refuse_impossible;
use crate::in_hand::regrasping::change::{Arrival, transfer_regrasp};
use crate::in_hand::roadmap::graph::{FootholdIds, Graph, Leg, Lists, contact_ids};
use crate::in_hand::roadmap::grasps::{Reached, spread_contacts};
use crate::in_hand::roadmap::identity::Identity;
use crate::in_hand::roadmap::index::{Costs, component_sizes, components};
use crate::in_hand::roadmap::region::{Region, nearest_places, spread_places};
use crate::in_hand::roadmap::registry::Registry;
use crate::in_hand::roadmap::rolling;
use crate::in_hand::roadmap::route::evenly;
use crate::in_hand::roadmap::stage::{AtPlace, Found, Origin};
use crate::in_hand::roadmap::{About, GraspRoadmap};
use crate::settings::{InHandSettings, Method};
use rayon::prelude::*;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::following::refuse_fingers_that_cannot_follow;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence, Step};
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::{Model, releasable};
use regrasp_manipulation::recording::pieces::dynamics;
use regrasp_manipulation::relocation::{Foothold, relocate};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_scene::HandView;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicUsize;

/// How a roadmap is built.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildSettings {
    /// Object poses.
    pub places: usize,
    /// Grasps per place, on average: there are as many contacts as that needs.
    pub grasps: usize,
    /// Places nearby that a grasp is taken to.
    pub neighbours: usize,
    /// Most grasps that are taken from one place to another, where contacts stay where they are.
    pub transfers: usize,
    /// Grasps of each place that are taken to the places nearby, where fingertips roll.
    pub hubs: usize,
    /// What a relocation costs, as an angle of the object in radians.
    pub relocation_cost: f64,
}

impl Default for BuildSettings {
    fn default() -> Self {
        BuildSettings { places: 400, grasps: 200, neighbours: 40, transfers: 20, hubs: 2, relocation_cost: 0.7 }
    }
}

impl BuildSettings {
    /// What is wrong with the settings, if anything.
    pub fn validate(&self) -> Result<(), String> {
        if !(1..=MAX_PLACES).contains(&self.places) {
            return Err(format!("places is {}; it must be from 1 to {MAX_PLACES}", self.places));
        }
        if self.grasps == 0 || self.neighbours == 0 || self.transfers == 0 || self.hubs == 0 {
            return Err("grasps, neighbours, transfers and hubs must be at least 1".into());
        }
        if !(self.relocation_cost > 0.0 && self.relocation_cost <= 100.0) {
            return Err(format!("relocation_cost is {}; it must be above 0 and at most 100", self.relocation_cost));
        }
        Ok(())
    }
}

/// Most places: each is compared with all others.
const MAX_PLACES: usize = 100_000;

/// What a build tells its caller after each stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuildStage {
    /// The stage that has ended.
    pub name: &'static str,
    /// Grasps so far.
    pub nodes: usize,
    /// Motions so far.
    pub edges: usize,
    /// Configurations looked at so far.
    pub work: u64,
}

/// Builds a roadmap of `view` over `region`, which is in the hand's frame, with `settings.n_threads` threads.
///
/// Where the settings say that fingertips roll, they roll in the transfers of the graph, and its motions have contact forces and times.
///
/// Failures: a hand that can never do it, a spent budget, an interruption, or no grasp anywhere. Panics if settings or
/// region are not valid.
pub fn build_roadmap(
    view: &HandView,
    region: &Region,
    build: &BuildSettings,
    settings: &InHandSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(BuildStage) + Sync),
) -> Result<GraspRoadmap, Failure> {
    let valid = settings.validate().and_then(|()| build.validate()).and_then(|()| region.validate());
    valid.map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    let settings = InHandSettings { method: Method::Gait, ..settings.clone() };
    let mut within = settings.within(&view.limits);
    // Grasps of the graph are held by all fingers.
    within.search.least_holding = view.hand.fingers.len();
    let model = Model::new(view, &within.physics);
    refuse_impossible(&model)?;
    refuse_fingers_that_cannot_follow(&model)?;
    let mut builder = Builder::new(&model, &within, region, build, seed, budget, progress)?;
    builder.run()?;
    let about = About {
        identity: Identity::of(view),
        region: *region,
        settings,
        build: build.clone(),
        seed,
        n_grown: 0,
        costs: Costs { turn_length: model.turn_length(), relocation: build.relocation_cost * model.turn_length() },
        dynamics: if model.any_rolls() { dynamics(&model) } else { Vec::new() },
    };
    let graph = largest_component(&builder.registry.into_graph());
    if graph.edges.is_empty() {
        let message = "no grasp that could be changed was found at any pose of the region".to_owned();
        return Err(Failure::bare(FailureKind::WorkSpent, message, "choose a region within the fingers' reach"));
    }
    Ok(GraspRoadmap::new(about, graph))
}

/// The largest component, the first one of equals.
fn largest_component(graph: &Graph) -> Graph {
    let components = components(graph);
    let largest = component_sizes(&components).first().map(|&(node, _)| node);
    graph.only(|node| Some(components.representative(node)) == largest)
}

struct Builder<'b> {
    model: &'b Model<'b>,
    settings: &'b InHandSettings,
    build: &'b BuildSettings,
    seed: u64,
    budget: &'b Budget,
    progress: &'b (dyn Fn(BuildStage) + Sync),
    threads: rayon::ThreadPool,
    registry: Registry,
    /// Places near each place, nearest first.
    near: Vec<Vec<u32>>,
    work: u64,
}

/// Most contacts per finger.
const MAX_CONTACTS: usize = 96;
/// Numbers of contacts that are tried for the number of grasps asked for.
const CONTACT_COUNTS: [usize; 14] = [4, 6, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48, 64, MAX_CONTACTS];
/// Places at which that is tried.
const TRIAL_PLACES: usize = 24;
/// A place has at most this many times the grasps asked for on average.
const CROWD: usize = 4;

impl<'b> Builder<'b> {
    fn new(
        model: &'b Model<'b>,
        settings: &'b InHandSettings,
        region: &Region,
        build: &'b BuildSettings,
        seed: u64,
        budget: &'b Budget,
        progress: &'b (dyn Fn(BuildStage) + Sync),
    ) -> Result<Self, Failure> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(settings.n_threads).build().map_err(|error| {
            Failure::bare(FailureKind::Impossible, format!("no threads to work with: {error}"), "ask for fewer threads")
        })?;
        let mut registry = Registry::new(Graph::new(model.fingers.iter().map(|f| f.ik.chain().n_coordinates())));
        let places = spread_places(model, region, build.places, seed);
        let near = |place: usize| -> Vec<u32> {
            let n_near = build.neighbours;
            let others = nearest_places(&places, &places[place], model.turn_length(), n_near, |other| other != place);
            others.into_iter().map(|(_, other)| other as u32).collect()
        };
        let near = threads.install(|| (0..places.len()).into_par_iter().map(near).collect());
        for place in places {
            registry.add_place(place);
        }
        Ok(Builder { model, settings, build, seed, budget, progress, threads, registry, near, work: 0 })
    }

    fn run(&mut self) -> Result<(), Failure> {
        let contacts = self.choose_contacts()?;
        self.stage("grasps", |builder, search, at| builder.grasps(search, at, &contacts))?;
        if self.model.any_rolls() {
            self.stage("transfers", |builder, search, at| {
                rolling::rolled(search, at, &builder.near[at.place], builder.build.hubs)
            })?;
            return self
                .stage("relocations", |builder, search, at| rolling::joined(search, at, &builder.near[at.place]));
        }
        self.stage("transfers", |builder, search, at| builder.transfers(search, at))?;
        self.stage("relocations", |builder, search, at| builder.relocations(search, at))
    }

    /// Works on every place.
    fn at_places<T: Send>(
        &self,
        name: &str,
        places: &[usize],
        work_on: impl Fn(&mut Search, &AtPlace) -> Result<T, Stop> + Sync,
    ) -> Result<(Vec<T>, u64), Failure> {
        let graph = self.registry.graph();
        let by_place = graph.nodes.iter().enumerate().map(|(index, node)| (node.place, index as u32));
        let nodes_at = Lists::new(graph.places.len(), by_place);
        let winner = AtomicUsize::new(usize::MAX);
        let on_place = |&place: &usize| {
            let pose = graph.places[place];
            let (model, settings, seed, budget) = (self.model, self.settings, self.seed, self.budget);
            let context = Context { model, settings, seed, budget, winner: &winner, progress: &|_| {} };
            let mut search = Search::new(context, [pose, pose], 0, u64::MAX);
            search.rng = Rng::keyed(self.seed, name, place as u64);
            let at = AtPlace { graph, place, pose, nodes_at: &nodes_at };
            let outcome = work_on(&mut search, &at);
            (outcome, search.workspace.work)
        };
        let outcomes: Vec<_> = self.threads.install(|| places.par_iter().map(on_place).collect());
        let mut work = 0;
        let mut done = Vec::with_capacity(places.len());
        for (outcome, of_place) in outcomes {
            work += of_place;
            done.push(outcome.map_err(|stop| stopped(&stop))?);
        }
        if self.work + work >= self.budget.max_work {
            return Err(stopped(&Stop::Budget(Interrupt::WorkSpent)));
        }
        Ok((done, work))
    }

    /// Works on every place and adds what was found.
    fn stage(
        &mut self,
        name: &'static str,
        work_on: impl Fn(&Self, &mut Search, &AtPlace) -> Result<Vec<Found>, Stop> + Sync,
    ) -> Result<(), Failure> {
        let all: Vec<usize> = (0..self.near.len()).collect();
        let (found, work) = self.at_places(name, &all, |search, at| work_on(self, search, at))?;
        self.work += work;
        for (place, found) in found.into_iter().enumerate() {
            for Found { origin, legs } in found {
                let from = match origin {
                    Origin::Node(node) => node,
                    Origin::New(state) => self.registry.node_of(place as u32, &state),
                };
                self.registry.add_legs(from, &legs);
            }
        }
        let graph = self.registry.graph();
        (self.progress)(BuildStage { name, nodes: graph.nodes.len(), edges: graph.edges.len(), work: self.work });
        Ok(())
    }

    /// As many contacts as give the number of grasps asked for, by trial at some places.
    fn choose_contacts(&mut self) -> Result<Vec<Vec<Contact>>, Failure> {
        let contacts = spread_contacts(self.model, MAX_CONTACTS, self.seed);
        let n_places = self.near.len();
        let trial: Vec<usize> = (0..n_places).step_by((n_places / TRIAL_PLACES).max(1)).collect();
        let wanted = self.build.grasps;
        let (counts, work) = self.at_places("contacts", &trial, |search, at| {
            let reached = Reached::at(search, &at.pose, &contacts);
            let mut counts = Vec::new();
            for n in CONTACT_COUNTS {
                search.check()?;
                counts.push(reached.of_first(n).grasps(search, &at.pose, CROWD * wanted).len());
                if counts.last().is_some_and(|&count| count >= CROWD * wanted) {
                    break;
                }
            }
            counts.resize(CONTACT_COUNTS.len(), CROWD * wanted);
            Ok(counts)
        })?;
        self.work += work;
        let fits = |which: &usize| {
            let total: usize = counts.iter().map(|of_place| of_place[*which]).sum();
            total <= wanted * counts.len()
        };
        let best = (0..CONTACT_COUNTS.len()).rev().find(fits).unwrap_or(0);
        let n_contacts = CONTACT_COUNTS[best];
        Ok(contacts.into_iter().map(|of_finger| of_finger.into_iter().take(n_contacts).collect()).collect())
    }

    /// All grasps at a place.
    fn grasps(&self, search: &mut Search, at: &AtPlace, contacts: &[Vec<Contact>]) -> Result<Vec<Found>, Stop> {
        search.check()?;
        let reached = Reached::at(search, &at.pose, contacts);
        let grasps = reached.grasps(search, &at.pose, CROWD * self.build.grasps);
        Ok(grasps.into_iter().map(|state| Found { origin: Origin::New(state), legs: Vec::new() }).collect())
    }

    /// Grasps that are taken to places nearby where the same contacts make a grasp too.
    fn transfers(&self, search: &mut Search, at: &AtPlace) -> Result<Vec<Found>, Stop> {
        let mut found = Vec::new();
        for &other in self.near[at.place].iter() {
            // Each pair of places once, unless only one is near the other.
            let is_mutual = self.near[other as usize].contains(&(at.place as u32));
            if is_mutual && (other as usize) < at.place {
                continue;
            }
            let there: BTreeMap<_, u32> =
                at.nodes_at.of(other as usize).iter().map(|&to| (contact_ids(at.graph, to as usize), to)).collect();
            let pair_of = |&from: &u32| there.get(&contact_ids(at.graph, from as usize)).map(|&to| (from, to));
            let mut shared: Vec<(u32, u32)> = at.nodes().iter().filter_map(pair_of).collect();
            search.rng.shuffle(&mut shared);
            let mut n_taken = 0;
            for (from, to) in shared {
                search.check()?;
                let (state, wanted) = (at.graph.state(from as usize), at.graph.state(to as usize));
                let mut rng = Rng::child(&search.rng, "transfer", u64::from(from));
                // Where a hand reaches the contacts in several ways, fingers may have to change their postures there.
                if let Some(way) = transfer_regrasp(search, &state, &wanted, Arrival::Exact, &mut rng) {
                    found.push(Found { origin: Origin::Node(from), legs: legs_of(&way, |_| other) });
                    n_taken += 1;
                    if n_taken == self.build.transfers {
                        break;
                    }
                }
            }
        }
        Ok(found)
    }

    /// Relocations between grasps of a place that differ in one finger.
    fn relocations(&self, search: &mut Search, at: &AtPlace) -> Result<Vec<Found>, Stop> {
        let mut found = Vec::new();
        let mut ways = Ways::default();
        for finger in 0..self.model.n_fingers() {
            let mut alike: BTreeMap<FootholdIds, Vec<u32>> = BTreeMap::new();
            for &node in at.nodes() {
                let mut others = at.graph.nodes[node as usize].footholds;
                others[finger] = 0;
                alike.entry(others).or_default().push(node);
            }
            for nodes in alike.values().filter(|nodes| nodes.len() > 1) {
                search.check()?;
                let contacts = at.graph.state(nodes[0] as usize).contacts;
                if releasable(self.model, &contacts, self.model.all_fingers()) & (1 << finger) == 0 {
                    continue;
                }
                for (k, &from) in nodes.iter().enumerate() {
                    for &to in &nodes[k + 1..] {
                        if let Some(path) = ways.find(search, at, finger, from, to) {
                            let contact = *at.graph.contact(to as usize, finger);
                            let legs = vec![Leg::Relocation { finger, path, contact }];
                            found.push(Found { origin: Origin::Node(from), legs });
                        }
                    }
                }
            }
        }
        Ok(found)
    }
}

/// Ways of single fingers at one place that were found with some grasp of the others: they are often free with another.
#[derive(Default)]
struct Ways {
    known: BTreeMap<(usize, u32, u32), Vec<Vec<Coordinates>>>,
}

/// Ways remembered between two footholds.
const WAYS: usize = 3;

impl Ways {
    /// A way of `finger` from its foothold at one node to that at another, with the others where both have them.
    fn find(
        &mut self,
        search: &mut Search,
        at: &AtPlace,
        finger: usize,
        from: u32,
        to: u32,
    ) -> Option<Vec<Coordinates>> {
        let (start, end) = (at.graph.state(from as usize), at.graph.state(to as usize));
        let foothold = |node: u32| at.graph.nodes[node as usize].footholds[finger];
        let known = self.known.entry((finger, foothold(from), foothold(to))).or_default();
        let contacts = [Some(&start.contacts[finger]), Some(&end.contacts[finger])];
        for path in known.iter() {
            search.workspace.set(&at.pose, &start.joints, &start.contacts);
            if follow_relocation(&mut search.workspace, &at.pose, finger, contacts, path).is_ok() {
                return Some(path[1..].to_vec());
            }
        }
        if known.len() >= WAYS {
            return None;
        }
        search.workspace.set(&at.pose, &start.joints, &start.contacts);
        let stand = |state: &'_ GraspState| (state.contacts[finger], state.joints[finger].clone());
        let ((a, joints_a), (b, joints_b)) = (stand(&start), stand(&end));
        let mut rng = Rng::child(&search.rng, "way", 0);
        search.rng.bits();
        let (leave, arrive) =
            (Foothold { contact: Some(&a), joints: &joints_a }, Foothold { contact: Some(&b), joints: &joints_b });
        let path = relocate(&mut search.workspace, &at.pose, finger, leave, arrive, &mut rng)?;
        known.push(std::iter::once(joints_a).chain(path.iter().cloned()).collect());
        Some(path)
    }
}

fn stopped(stop: &Stop) -> Failure {
    let advice = "allow more work or time, or ask for fewer places";
    Failure::bare(stop.kind(), "the roadmap was not finished".into(), advice)
}

/// A sequence as the graph keeps it; `place_of` says which place a transfer leads to.
pub(super) fn legs_of(way: &Sequence, mut place_of: impl FnMut(&Pose) -> u32) -> Vec<Leg> {
    let leg_of = |(index, step): (usize, &Step)| match step.motion() {
        Motion::Transfer(moments) => Leg::Transfer {
            place: place_of(&step.end().world_from_object),
            joints: step.end().joints.clone(),
            between: evenly(&way.state_before(index).world_from_object, moments),
        },
        Motion::Regrasp { finger, path } => {
            Leg::Relocation { finger: *finger, path: path.clone(), contact: step.end().contacts[*finger] }
        }
    };
    way.steps().iter().enumerate().map(leg_of).collect()
}
