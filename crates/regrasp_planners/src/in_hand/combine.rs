//! Combinations of candidates: which grasps are closed, which of their fingers can be released, how far they follow.

use super::candidates::Candidate;
use super::model::{MAX_FINGERS, Model};
use super::settings::ReleaseRule;
use super::workspace::Workspace;
use arrayvec::ArrayVec;
use regrasp_grasp::{Contact, closure};

/// Which candidate each finger takes.
pub type Choice = ArrayVec<usize, MAX_FINGERS>;

/// Closure of every set of fingers over candidates, computed when first asked for.
#[derive(Debug)]
pub struct ClosureTable<'a> {
    model: &'a Model<'a>,
    options: &'a [Vec<Candidate>],
    n_options: usize,
    /// Margin of a triple of (finger, option), NaN where not asked for yet.
    margins: Vec<f64>,
}

impl<'a> ClosureTable<'a> {
    /// An empty table over `options[finger]`.
    pub fn new(model: &'a Model<'a>, options: &'a [Vec<Candidate>]) -> Self {
        let n_options = options.iter().map(Vec::len).max().unwrap_or(0);
        let n = options.len();
        let n_triples = n * n * n;
        ClosureTable { model, options, n_options, margins: vec![f64::NAN; n_triples * n_options.pow(3)] }
    }

    /// Margin of three fingers with their options.
    fn triple(&mut self, fingers: [usize; 3], choice: &Choice) -> f64 {
        let n = self.options.len();
        let [i, j, k] = fingers;
        let m = self.n_options;
        let index = (((i * n + j) * n + k) * m + choice[i]) * m * m + choice[j] * m + choice[k];
        if self.margins[index].is_nan() {
            let contacts = fingers.map(|f| self.options[f][choice[f]].contact);
            self.margins[index] = closure::three::prove(&contacts, &self.model.frame).map_or(0.0, |(margin, _)| margin);
        }
        self.margins[index]
    }

    /// Largest margin of three of the fingers whose bit is set in `holding`.
    pub fn margin(&mut self, choice: &Choice, holding: u32) -> f64 {
        let n = self.options.len();
        let holds = |f: usize| holding & (1 << f) != 0;
        let mut best = 0.0f64;
        for i in (0..n).filter(|&f| holds(f)) {
            for j in (i + 1..n).filter(|&f| holds(f)) {
                for k in (j + 1..n).filter(|&f| holds(f)) {
                    best = best.max(self.triple([i, j, k], choice));
                    if best >= self.model.settings.closure_margin {
                        return best;
                    }
                }
            }
        }
        best
    }

    /// True when the fingers of `holding` keep the required margin.
    pub fn is_closed(&mut self, choice: &Choice, holding: u32) -> bool {
        self.margin(choice, holding) >= self.model.settings.closure_margin
    }

    /// Number of fingers that the others would let go.
    pub fn n_releasable(&mut self, choice: &Choice) -> usize {
        let n = self.options.len();
        let all = (1u32 << n) - 1;
        (0..n).filter(|&finger| self.is_closed(choice, all & !(1 << finger))).count()
    }
}

/// Fingers that the others would let go with these contacts, as bits.
pub fn releasable(model: &Model, contacts: &[Contact]) -> u32 {
    let n = contacts.len();
    let mut bits = 0;
    for finger in 0..n {
        let others: ArrayVec<Contact, MAX_FINGERS> =
            (0..n).filter(|&other| other != finger).map(|other| contacts[other]).collect();
        if closure::closure_margin(&others, &model.frame) >= model.settings.closure_margin {
            bits |= 1 << finger;
        }
    }
    bits
}

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
struct ClashTable {
    n_fingers: usize,
    n_options: usize,
    known: Vec<Option<bool>>,
}

impl ClashTable {
    fn new(options: &[Vec<Candidate>]) -> Self {
        let n_options = options.iter().map(Vec::len).max().unwrap_or(0);
        let n_fingers = options.len();
        ClashTable { n_fingers, n_options, known: vec![None; (n_fingers * n_options).pow(2)] }
    }

    fn is_clear(&mut self, workspace: &mut Workspace, options: &[Vec<Candidate>], choice: &Choice) -> bool {
        (0..choice.len()).all(|f| (f + 1..choice.len()).all(|g| self.pair(workspace, options, f, g, choice)))
    }

    fn pair(
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

/// The best closed combinations of `options` that fit together, best first. With `least_follow`, option 0 of a finger is
/// where it is, others cost a relocation, and all must follow at least that share of the way.
pub fn rank(
    workspace: &mut Workspace,
    options: &[Vec<Candidate>],
    table: &mut ClosureTable,
    least_follow: Option<f64>,
    n_wanted: usize,
) -> Vec<Ranked> {
    let model = workspace.model;
    let keeps_first = least_follow.is_some();
    let least_follow = least_follow.unwrap_or(0.0);
    let mut clashes = ClashTable::new(options);
    let n = options.len();
    let all = (1u32 << n) - 1;
    let n_choices: usize = options.iter().map(Vec::len).product();
    let mut rough: Vec<Ranked> = Vec::with_capacity(n_choices);
    for code in 0..n_choices {
        let mut rest = code;
        let mut choice = Choice::new();
        for finger_options in options {
            choice.push(rest % finger_options.len());
            rest /= finger_options.len();
        }
        let n_moved = if keeps_first { choice.iter().filter(|&&option| option != 0).count() } else { 0 };
        if keeps_first && n_moved == 0 {
            continue;
        }
        let follow = (0..n).map(|f| options[f][choice[f]].follow).fold(1.0, f64::min);
        if follow < least_follow {
            continue;
        }
        rough.push(Ranked { choice, worth: follow - RELOCATION_FEE * n_moved as f64 });
    }
    rough.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    let mut ranked: Vec<Ranked> = Vec::new();
    for mut candidate in rough {
        // The bonus is at most RELEASE_BONUS: nothing later can overtake what is already there.
        if ranked.len() >= n_wanted && candidate.worth + RELEASE_BONUS < ranked[n_wanted - 1].worth {
            break;
        }
        if !table.is_closed(&candidate.choice, all) {
            continue;
        }
        let n_releasable = table.n_releasable(&candidate.choice);
        let rule = model.settings.release_rule;
        if n_releasable == 0 || (rule == ReleaseRule::EverywhereEveryFinger && n_releasable < n) {
            continue;
        }
        if !clashes.is_clear(workspace, options, &candidate.choice) {
            continue;
        }
        candidate.worth += RELEASE_BONUS * (n_releasable - 1) as f64 / (n - 1) as f64;
        let place = ranked.partition_point(|other| other.worth >= candidate.worth);
        ranked.insert(place, candidate);
        ranked.truncate(n_wanted);
    }
    ranked
}

/// Share of the way that a relocation must gain to be worth it. By hand.
const RELOCATION_FEE: f64 = 0.08;
/// Share of the way that a grasp with every finger releasable is worth over one with a single one. By hand.
const RELEASE_BONUS: f64 = 0.3;
