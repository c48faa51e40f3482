//! Settings of the search. Every default says where it comes from.

use serde::{Deserialize, Serialize};

/// Which algorithm plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Gait trees from start and goal that meet: relocate with look-ahead, transfer as far as possible. The default, by
    /// measurement.
    Gait,
    /// Saut 2011: visibility PRM in GS_n, components joined by transfer-regrasp paths, dichotomic decomposition.
    Visibility,
    /// Saut 2011's baseline: visibility PRM whose local method is one transfer-regrasp or regrasp-transfer.
    Classic,
}

impl Method {
    /// As settings, plans and command lines spell it.
    pub fn name(self) -> &'static str {
        match self {
            Method::Gait => "gait",
            Method::Visibility => "visibility",
            Method::Classic => "classic",
        }
    }
}

/// When a finger may let go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReleaseRule {
    /// Where the other fingers are closed; grasps in between need closure of all only. The default: on real hands the
    /// Saut 2011's rule leaves too little (by measurement on a prototype).
    WhereOthersHold,
    /// Every set of n-1 fingers is closed in every grasp (Saut 2011, sec. 4.2.2).
    EverywhereEveryFinger,
}

/// A first try of the planner with more room than it asks for in the end.
///
/// Carried out on joints that give, links stray from their planned places by up to a millimetre: of 20 plans for cubes in the
/// Allegro hand that dropped the cube in simulation with the usual clearance, 18 had links that touched what they should not
/// (docs/benchmarks/replay). Fingertips that turn on the spot drag the object along, which plans for point contacts do not
/// know of: of 50 plans that turn a sphere below the palm, 6 ended more than 2 mm or 2 degrees off in simulation with the
/// usual closure margin, none with four times as much.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FirstTry {
    /// Smallest distance between bodies that must not touch, in metres. Where the links cannot keep it, the usual
    /// clearance holds.
    pub clearance: f64,
    /// Force-closure margin of every set of holding fingers, if it is larger than the usual one.
    pub closure_margin: f64,
    /// Work of each of two tries, for both and for the clearance alone, after which the planner goes on with the usual values; a sixteenth
    /// of it where fingertips that are meshes roll on a mesh, and a quarter in hands of more than four fingers, which take so much longer. By
    /// measurement, 12 seeds of five turns in an Allegro hand: 55 of 60 are found by then, with 150,000 for the clearance alone 57;
    /// allegro/cube57_x, box_y and cylinder20_x hardly ever.
    pub work: u64,
}

impl Default for FirstTry {
    fn default() -> Self {
        FirstTry { clearance: 0.001, closure_margin: 0.02, work: 50_000 }
    }
}

/// How grasps and motions are looked for. Lengths in metres, angles in radians.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSettings {
    /// When a finger may lift. The methods of Saut 2011 always use `everywhere_every_finger`.
    pub release_rule: ReleaseRule,
    /// A first search that asks for more clearance and a larger margin; `null` for none.
    pub first_try: Option<FirstTry>,
    /// How far the object may deviate from the straight path from start to goal, in metres; at most 1. By measurement
    /// on allegro/box_y: 20 mm solves more within a work limit than 12 or 30.
    pub wander_distance: f64,
    /// How far the object may turn away from that path: standard deviation in radians. Origin: measurements on a
    /// prototype.
    pub wander_angle: f64,
    /// Share of poses drawn as far from the straight path as the object is large, because long objects must travel to
    /// turn (Saut 2011, sec. 5.1, example 3). By measurement: with 0.2 the pencil takes a fifth of the work of 0.
    /// Against 0.1 it saves 20 % on allegro/cube57_x and 32 % on box_y, and costs 50 % on cylinder20_y and 24 % on
    /// cube57_y.
    pub far_share: f64,
    /// Share of poses drawn straight out of a narrow passage, where start or goal lies in one (Saut 2011, sec. 5.1,
    /// example 4).
    pub passage_share: f64,
    /// Share of extensions towards the goal; the others go towards a pose nearby. Origin: measurements on a prototype,
    /// 0.75.
    pub goal_share: f64,
    /// Penalty of a pose for every earlier attempt at it, as a share of the object's radius.
    pub try_fee: f64,
    /// Share of extensions whose relocations need not bring the object closer to the goal. They change the grasp in dead
    /// ends.
    pub aimless_share: f64,
    /// New contacts examined per finger and extension. By measurement, see docs/benchmarks.md.
    pub candidates: usize,
    /// How many of these contacts are kept and combined to grasps.
    pub candidates_kept: usize,
    /// Least number of fingers that hold while the object moves; the others may be free (paths through GS_k, Saut 2011,
    /// sec. 3.1). With the number of fingers of the hand, or more, all hold.
    pub least_holding: usize,
    /// Whether a hand of three or more fingers that can never change its grasp, such as three hard fingertips, tries a
    /// single transfer. Without it such a hand is refused at once. Two fingers always try.
    pub transfers_alone: bool,
    /// Extensions tried at a pose before one of them may lift fingers and leave them free.
    pub free_after: u32,
    /// Share of the later extensions that may do so.
    pub free_share: f64,
    /// Work after which a search starts again from nothing; it grows with every fourth restart. By measurement, 20
    /// seeds: against 300,000 a million saves 30 % on allegro/box_x and about a tenth on cube45_x and cube57_x, and
    /// costs a quarter on cylinder20_x.
    pub restart_work: u64,
    /// Work after which a search that has no plan yet ends; `null` for all that is allowed. What is allowed beyond that is for better
    /// plans.
    pub search_work: Option<u64>,
    /// Work spent on gaits along straight and bent courses after a short look by trees, where the query gives the start grasp
    /// and fingertips roll; first tries then have at most twice as much. 0 for neither. By measurement on chains of goals
    /// with the cube in the Allegro hand, 90 queries and 600,000 configurations: 71 are solved with and without, in 1.8 s instead
    /// of 2.6 s on the mean, and the motion is a seventh shorter. That of the wide hand's sphere is a sixth longer.
    pub courses_work: u64,
    /// Random shortcuts tried on the plan found. Origin: measurements on a prototype.
    pub shortcuts: usize,
}

impl Default for SearchSettings {
    fn default() -> Self {
        SearchSettings {
            release_rule: ReleaseRule::WhereOthersHold,
            first_try: Some(FirstTry::default()),
            wander_distance: 0.02,
            wander_angle: 0.4,
            far_share: 0.2,
            passage_share: 0.5,
            goal_share: 0.7,
            try_fee: 0.6,
            aimless_share: 0.6,
            candidates: 6,
            candidates_kept: 3,
            least_holding: 2,
            transfers_alone: false,
            free_after: 3,
            free_share: 0.5,
            restart_work: 1_000_000,
            search_work: None,
            courses_work: 15_000,
            shortcuts: 8,
        }
    }
}
