//! Combinations of candidates: which grasps are closed, which of their fingers can be released, how far they follow.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::freedom::Freedom;
use crate::settings::{ReleaseRule, SearchSettings};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::workspace::Workspace;

/// A combination with its worth.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Which option each finger takes.
    pub choice: Choice,
    /// Share of the way that all fingers follow, plus a bonus for releasable fingers, less a fee per relocation.
    pub worth: f64,
}

/// Which options of two fingers are in each other's way, found out when first asked for.
#[derive(Debug)]
pub struct ClashTable {
    n_fingers: usize,
    n_options: usize,
    known: Vec<Option<bool>>,
}

impl ClashTable {
    /// An empty table over `options[finger]`.
    pub fn new(options: &[Vec<Candidate>]) -> Self {
        let n_options = options.iter().map(Vec::len).max().unwrap_or(0);
        let n_fingers = options.len();
        ClashTable { n_fingers, n_options, known: vec![None; (n_fingers * n_options).pow(2)] }
    }

    fn is_clear(&mut self, workspace: &mut Workspace, options: &[Vec<Candidate>], choice: &Choice) -> bool {
        (0..choice.len()).all(|f| (f + 1..choice.len()).all(|g| self.pair(workspace, options, f, g, choice)))
    }

    /// True when fingers `f` < `g` keep clear of each other with the options chosen.
    pub fn pair(
        &mut self,
        workspace: &mut Workspace,
        options: &[Vec<Candidate>],
        f: usize,
        g: usize,
        choice: &Choice,
    ) -> bool {
        let (a, b) = (choice[f], choice[g]);
        let index = ((f * self.n_fingers + g) * self.n_options + a) * self.n_options + b;
        *self.known[index]
            .get_or_insert_with(|| workspace.fingers_are_clear((f, &options[f][a].joints), (g, &options[g][b].joints)))
    }
}

/// The best closed combinations of `options` that fit together, with no more free fingers than the settings allow, best
/// first: of those that triples of points or pairs of soft fingertips close; of all, where there are none of these.
///
/// With `least_follow`, option 0 of a finger is where it is, others cost a relocation, and all must follow at least that share
/// of the way. `freedom` says which share of the way a combination leaves to the object.
pub fn rank(
    search: &mut Search,
    options: &[Vec<Candidate>],
    table: &mut ClosureTable,
    freedom: Option<&Freedom>,
    least_follow: Option<f64>,
    n_wanted: usize,
) -> Vec<Ranked> {
    let model = search.model();
    let keeps_first = least_follow.is_some();
    let least_follow = least_follow.unwrap_or(0.0);
    let mut clashes = ClashTable::new(options);
    let n = options.len();
    let most_free = most_free(model, &search.settings.search);
    let n_choices: usize = options.iter().map(Vec::len).product();
    let mut rough: Vec<Ranked> = Vec::with_capacity(n_choices);
    for code in 0..n_choices {
        let mut rest = code;
        let mut choice = Choice::new();
        for finger_options in options {
            choice.push(rest % finger_options.len());
            rest /= finger_options.len();
        }
        let n_free = (0..n).filter(|&f| options[f][choice[f]].contact.is_none()).count();
        if n_free > most_free {
            continue;
        }
        let n_moved = if keeps_first { choice.iter().filter(|&&option| option != 0).count() } else { 0 };
        if keeps_first && n_moved == 0 {
            continue;
        }
        let follow = (0..n).map(|f| options[f][choice[f]].follow).fold(1.0, f64::min);
        let follow = follow * freedom.map_or(1.0, |freedom| freedom.share(&choice));
        if follow < least_follow {
            continue;
        }
        rough.push(Ranked { choice, worth: follow - RELOCATION_FEE * n_moved as f64 });
    }
    rough.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    // Five fingers with ten options have 100,000 combinations: by measurement on the Shadow hand, margins of larger sets took 60 % of the time
    // of a search for places.
    if table.sees_larger() {
        let ranked = table.of_few(|table| closed_of(search, options, table, &mut clashes, &rough, n_wanted));
        if !ranked.is_empty() {
            return ranked;
        }
    }
    closed_of(search, options, table, &mut clashes, &rough, n_wanted)
}

/// The best of `rough`, which are sorted by their worth without the bonus, that are closed and clear.
fn closed_of(
    search: &mut Search,
    options: &[Vec<Candidate>],
    table: &mut ClosureTable,
    clashes: &mut ClashTable,
    rough: &[Ranked],
    n_wanted: usize,
) -> Vec<Ranked> {
    let model = search.model();
    let n = options.len();
    let all = (1u32 << n) - 1;
    let n_before = table.n_larger();
    let mut ranked: Vec<Ranked> = Vec::new();
    for candidate in rough {
        // The bonus is at most RELEASE_BONUS: nothing later can overtake what is already there.
        let is_late = ranked.len() >= n_wanted && candidate.worth + RELEASE_BONUS < ranked[n_wanted - 1].worth;
        if is_late || table.n_larger() > n_before + MOST_LARGER {
            break;
        }
        if !table.is_closed(&candidate.choice, all) {
            continue;
        }
        let n_releasable = table.n_releasable(&candidate.choice);
        let rule = search.settings.search.release_rule;
        let needs_release = model.may_release && !search.holds_only;
        if (n_releasable == 0 && needs_release) || (rule == ReleaseRule::EverywhereEveryFinger && n_releasable < n) {
            continue;
        }
        if !clashes.is_clear(&mut search.workspace, options, &candidate.choice) {
            continue;
        }
        let mut candidate = candidate.clone();
        candidate.worth += RELEASE_BONUS * n_releasable.saturating_sub(1) as f64 / (n - 1) as f64;
        let place = ranked.partition_point(|other| other.worth >= candidate.worth);
        ranked.insert(place, candidate);
        ranked.truncate(n_wanted);
    }
    ranked
}

/// Larger sets of fingers looked at for one ranking, those of the most worthy combinations first. By hand.
const MOST_LARGER: usize = 2_000;

/// Share of the way that a relocation must gain to be worth it. By hand.
const RELOCATION_FEE: f64 = 0.08;

/// Share of the way that a grasp with every finger releasable is worth over one with a single one. By hand.
const RELEASE_BONUS: f64 = 0.3;

/// Most fingers that may be free at a time: those at least that cannot follow the object.
pub fn most_free(model: &Model, settings: &SearchSettings) -> usize {
    let n_closing = model.closing_fingers().count_ones() as usize;
    match settings.release_rule {
        ReleaseRule::WhereOthersHold => model.n_fingers().saturating_sub(settings.least_holding).max(n_closing),
        ReleaseRule::EverywhereEveryFinger => 0,
    }
}
