//! `cargo xtask bench-matrix`: every object of the models in three hands, placed by `regrasp place`.

use crate::run::{Outcome, models, number, out, output, package, regrasp, words};
use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// Where the rows are, and the page that is made of them.
const ROWS: &str = "docs/benchmarks/matrix.csv";
const PAGE: &str = "docs/benchmarks/matrix.md";
const HEADER: &str = "hand,object,axis,friction,seed,status,plan_cpu_s,accepted,relocations,place_s,commit,cause";

const HANDS: [&str; 3] = ["allegro", "leap", "shadow"];
const AXES: [&str; 2] = ["z", "x"];
const FRICTIONS: [&str; 2] = ["1.5", "0.8"];

/// Objects: name, file, and whether the middle extent is fitted to 60 mm because it is larger.
const OBJECTS: [(&str, &str, bool); 21] = [
    ("apple", "ycb_013_apple/mesh.obj", true),
    ("banana", "ycb_011_banana/mesh.obj", true),
    ("bottle", "robosuite_small/bottle.stl", false),
    ("bread", "robosuite_small/bread.stl", false),
    ("bull", "gso_Schleich_Hereford_Bull/mesh.obj", true),
    ("can", "robosuite_small/can.stl", false),
    ("cereal", "robosuite_small/cereal.stl", true),
    ("cracker_box", "ycb_003_cracker_box/mesh.obj", true),
    ("cube", "trifinger_cube/mesh.obj", true),
    ("drill", "ycb_035_power_drill/mesh.obj", true),
    ("gso_mug", "gso_Room_Essentials_Mug_White_Yellow/mesh.obj", true),
    ("gso_screwdriver", "gso_Craftsman_Grip_Screwdriver_Phillips_Cushion/mesh.obj", false),
    ("horse", "gso_Breyer_Horse_Of_The_Year_2015/mesh.obj", true),
    ("lemon", "robosuite_small/lemon.stl", false),
    ("marker", "ycb_040_large_marker/mesh.obj", false),
    ("milk", "robosuite_small/milk.stl", false),
    ("mustard", "ycb_006_mustard_bottle/mesh.obj", true),
    ("rubiks_cube", "ycb_077_rubiks_cube/mesh.obj", true),
    ("spot", "spot/mesh.obj", true),
    ("ycb_mug", "ycb_025_mug/mesh.obj", true),
    ("ycb_screwdriver", "ycb_043_phillips_screwdriver/mesh.obj", true),
];

/// The file of an object, and whether its middle extent is fitted to 60 mm.
pub fn object(name: &str) -> Result<(&'static str, bool), String> {
    let found = OBJECTS.iter().find(|(own, ..)| *own == name);
    found.map(|(_, file, is_fitted)| (*file, *is_fitted)).ok_or_else(|| format!("no object {name:?}"))
}

/// A hand, an object, a turn, a friction.
type Cell = [&'static str; 4];

/// What every cell is measured with.
struct Campaign {
    program: PathBuf,
    models: PathBuf,
    folder: PathBuf,
    commit: String,
    seeds: u64,
}

/// Measures the cells that have no rows yet, `CELLS` at most, and writes the page; with the argument `page` only the page. One cell at
/// a time, or `AT_ONCE`: `place` searches on all cores and stops by the clock, so that two at once get worse poses (LEAP with a mug:
/// none of 5 plans in place of 4). Other arguments are the hands to measure; none are all.
pub fn task(arguments: &[String]) -> Outcome {
    let known = read_rows()?;
    if arguments.first().is_none_or(|word| word != "page") {
        let Some(models) = models() else { return Ok(()) };
        let commit = output("git", &words("rev-parse --short=8 HEAD"))?.trim().to_owned();
        let campaign =
            Campaign { program: regrasp()?, models, folder: out("matrix")?, commit, seeds: number("SEEDS", 5)? };
        let (at_once, most) = (number("AT_ONCE", 1)?, number("CELLS", u64::MAX)?);
        if let Some(unknown) = arguments.iter().find(|word| !HANDS.contains(&word.as_str())) {
            return Err(format!(
                "{unknown:?} is no hand of the matrix; expected `page` or some of {}",
                HANDS.join(", ")
            ));
        }
        let is_asked = |hand: &str| arguments.is_empty() || arguments.iter().any(|word| word == hand);
        let is_missing = |cell: &Cell| is_asked(cell[0]) && !known.contains_key(cell.map(str::to_owned).as_slice());
        let missing = cells().into_iter().filter(is_missing);
        measure(&campaign, missing.take(most.try_into().unwrap_or(usize::MAX)).collect(), at_once)?;
    }
    let text = page(&read_rows()?);
    fs::write(PAGE, text).map_err(|error| format!("{PAGE} cannot be written: {error}"))
}

/// All cells; those with the most friction first.
fn cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for friction in FRICTIONS {
        for hand in HANDS {
            for axis in AXES {
                cells.extend(OBJECTS.iter().map(|(object, ..)| [hand, *object, axis, friction]));
            }
        }
    }
    cells
}

/// Measures `missing`; what is done is written at once, so that a campaign that is stopped goes on where it was.
fn measure(campaign: &Campaign, missing: VecDeque<Cell>, at_once: u64) -> Outcome {
    if !Path::new(ROWS).exists() {
        fs::write(ROWS, format!("{HEADER}\n")).map_err(|error| format!("{ROWS} cannot be written: {error}"))?;
    }
    let waiting = Mutex::new(missing);
    // Opened for every cell: git may have put another file there since.
    let rows_file = || OpenOptions::new().append(true).open(ROWS).map_err(|error| format!("{ROWS}: {error}"));
    let writing = Mutex::new(());
    let work = || -> Outcome {
        loop {
            let Some(cell) = waiting.lock().unwrap_or_else(|held| held.into_inner()).pop_front() else { return Ok(()) };
            let rows = measured(campaign, &cell)?;
            eprint!("{rows}");
            let _one_at_a_time = writing.lock().unwrap_or_else(|held| held.into_inner());
            rows_file()?.write_all(rows.as_bytes()).map_err(|error| format!("{ROWS}: {error}"))?;
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..at_once.max(1)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().map_err(|_| "a worker panicked".to_owned())?)
    })
}

/// The rows of a cell: a pose from `regrasp place`, then as many plans as there are seeds.
fn measured(campaign: &Campaign, cell: &Cell) -> Result<String, String> {
    let [hand, object, axis, friction] = cell;
    let (file, is_fitted) = self::object(object)?;
    let hand_file = hand_file(campaign, hand)?;
    let name = format!("{hand}_{object}_{axis}_{friction}");
    let scene = campaign.folder.join(format!("{name}.toml"));
    let scale = if is_fitted { "--scale fit:0.06" } else { "" };
    let package = package(&campaign.models);
    let line = format!(
        "place {} package://models/objects/{file} {scale} --turn {axis}:90 --friction {friction} {package} -o {}",
        hand_file.display(),
        scene.display(),
    );
    let started = std::time::Instant::now();
    let placed = Command::new(&campaign.program).args(words(&line)).output();
    let placed = placed.map_err(|error| format!("{line}: {error}"))?;
    let place_s = started.elapsed().as_secs_f64();
    let row = |seed: u64, [status, cpu, accepted, relocations]: [&str; 4], cause: &str| {
        format!(
            "{hand},{object},{axis},{friction},{seed},{status},{cpu},{accepted},{relocations},{place_s:.1},{},{}\n",
            campaign.commit,
            cause.replace(['\n', '\r'], " "),
        )
    };
    if !placed.status.success() {
        let said = String::from_utf8_lossy(&placed.stderr).into_owned();
        let cause = said.lines().skip_while(|line| !line.starts_with("NO PLAN")).nth(1).map(str::trim);
        let Some(cause) = cause else { return Err(format!("{line} failed:\n{said}")) };
        return Ok((0..campaign.seeds).map(|seed| row(seed, ["no_place", "", "", ""], cause)).collect());
    }
    let rows = campaign.folder.join(format!("{name}.csv"));
    let limits = format!("--seeds {} --threads 1 --time-limit 20", campaign.seeds);
    let line = format!("bench {} {limits} {package} --csv {}", scene.display(), rows.display());
    output(&campaign.program, &words(&line))?;
    let text = fs::read_to_string(&rows).map_err(|error| format!("{}: {error}", rows.display()))?;
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let mut answer = String::new();
    for line in lines {
        // The cause comes last; no other column has commas.
        let values: Vec<&str> = line.splitn(columns.len(), ',').collect();
        let value = |name: &str| {
            let index = columns.iter().position(|column| *column == name);
            index.and_then(|index| values.get(index)).copied().ok_or_else(|| format!("no column {name} in {line:?}"))
        };
        let seed = value("seed")?.parse().map_err(|_| format!("no seed in {line:?}"))?;
        let told = [value("status")?, value("plan_cpu_s")?, value("accepted")?, value("relocations")?];
        answer += &row(seed, told, &value("cause")?.trim_matches('"').replace("\"\"", "\""));
    }
    Ok(answer)
}

/// The file of a hand: ours, or for LEAP what `inspect` writes.
fn hand_file(campaign: &Campaign, hand: &str) -> Result<PathBuf, String> {
    if hand != "leap" {
        return Ok(PathBuf::from(format!("assets/hands/{hand}_right/hand.toml")));
    }
    let path = campaign.folder.join("leap_right.toml");
    if !path.exists() {
        let urdf = campaign.models.join("hands/leap/leap_right.urdf");
        // Another worker may do the same: who renames last is as good as who renames first.
        let own = path.with_extension(format!("{:?}.toml", std::thread::current().id()).replace(['(', ')'], ""));
        let line = format!("inspect {} -o {} {}", urdf.display(), own.display(), package(&campaign.models));
        output(&campaign.program, &words(&line))?;
        fs::rename(&own, &path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(path)
}

/// A trial.
#[derive(Debug, Clone)]
struct Row {
    status: String,
    cpu_s: f64,
    accepted: bool,
    cause: String,
    commit: String,
}

impl Row {
    /// A plan was found, and the checker accepts it.
    fn is_good(&self) -> bool {
        self.status == "solved" && self.accepted
    }
}

/// Rows by cell.
fn read_rows() -> Result<BTreeMap<Vec<String>, Vec<Row>>, String> {
    let mut rows: BTreeMap<Vec<String>, Vec<Row>> = BTreeMap::new();
    let Ok(text) = fs::read_to_string(ROWS) else { return Ok(rows) };
    for line in text.lines().skip(1) {
        let values: Vec<&str> = line.splitn(HEADER.split(',').count(), ',').collect();
        let [hand, object, axis, friction, _, status, cpu, accepted, _, _, commit, cause] = values[..] else {
            return Err(format!("{ROWS}: {line:?} has {} values", values.len()));
        };
        let cell = [hand, object, axis, friction].map(str::to_owned).to_vec();
        rows.entry(cell).or_default().push(Row {
            status: status.to_owned(),
            cpu_s: cpu.parse().unwrap_or(0.0),
            accepted: accepted == "true",
            cause: cause.to_owned(),
            commit: commit.to_owned(),
        });
    }
    Ok(rows)
}

/// The page of the book.
fn page(rows: &BTreeMap<Vec<String>, Vec<Row>>) -> String {
    let mut text = String::from(
        "# Every object in three hands\n\n\
         Made by `cargo xtask bench-matrix` from `matrix.csv`; do not edit.\n\n\
         Each cell: `regrasp place` chooses a pose, then five seeds search for at most 20 s on one thread, with default settings. The table has \
         the accepted plans of all trials, and their mean processor time; a dash where nothing was measured yet. The limit is that of a \
         clock: on a busy machine a trial has less processor time, which the rows say (`plan_cpu_s`). Meshes whose middle extent is above \
         60 mm are fitted to it. Mass 0.1 kg. The hand file of LEAP is as `regrasp inspect` writes it.\n",
    );
    for friction in FRICTIONS {
        let _ = write!(text, "\n## Friction {friction}\n\n| object |");
        for hand in HANDS {
            AXES.iter().for_each(|axis| {
                let _ = write!(text, " {hand} {axis} 90 |");
            });
        }
        let _ = write!(text, "\n|---|{}\n", "---|".repeat(HANDS.len() * AXES.len()));
        for (object, ..) in OBJECTS {
            let _ = write!(text, "| {object} |");
            for hand in HANDS {
                for axis in AXES {
                    let cell = [hand, object, axis, friction].map(str::to_owned);
                    let _ = write!(text, " {} |", rows.get(cell.as_slice()).map_or("-".to_owned(), |rows| told(rows)));
                }
            }
            text.push('\n');
        }
        text.push('\n');
        for axis in ["z", "x", ""] {
            let of_turn = rows.iter().filter(|(cell, _)| cell[3] == friction && (axis.is_empty() || cell[2] == axis));
            let all: Vec<&Row> = of_turn.flat_map(|(_, rows)| rows).collect();
            if all.is_empty() {
                continue;
            }
            let n_solved = all.iter().filter(|row| row.status == "solved").count();
            let n_good = all.iter().filter(|row| row.is_good()).count();
            let what = if axis.is_empty() { "both turns".to_owned() } else { format!("{axis} 90") };
            let share = 100.0 * n_solved as f64 / all.len() as f64;
            let _ = writeln!(text, "- {what}: {n_solved} of {} solved ({share:.0} %), {n_good} accepted.", all.len());
        }
    }
    text += "\n## Causes\n\nCommonest cause in cells with misses; of rejected plans, what the checker said.\n\n| hand | object | turn | friction | accepted | cause |\n|---|---|---|---|---|---|\n";
    for (cell, rows) in rows {
        let n_good = rows.iter().filter(|row| row.is_good()).count();
        let mut causes: BTreeMap<&str, usize> = BTreeMap::new();
        rows.iter().filter(|row| !row.is_good()).for_each(|row| *causes.entry(&row.cause).or_default() += 1);
        if let Some((cause, _)) = causes.iter().max_by_key(|(_, count)| **count) {
            let [hand, object, axis, friction] = &cell[..] else { continue };
            let cause = cause.replace('|', "/");
            let _ =
                writeln!(text, "| {hand} | {object} | {axis} 90 | {friction} | {n_good} of {} | {cause} |", rows.len());
        }
    }
    let commits: std::collections::BTreeSet<&str> = rows.values().flatten().map(|row| row.commit.as_str()).collect();
    let _ = write!(
        text,
        "\nMeasured at {}: {} of {} cells.\n",
        commits.into_iter().collect::<Vec<_>>().join(", "),
        rows.len(),
        cells().len()
    );
    text
}

/// `4/5 (1.2 s)`
fn told(rows: &[Row]) -> String {
    let good: Vec<&Row> = rows.iter().filter(|row| row.is_good()).collect();
    let mean = good.iter().map(|row| row.cpu_s).sum::<f64>() / good.len().max(1) as f64;
    match good.len() {
        0 => format!("0/{}", rows.len()),
        n => format!("{n}/{} ({mean:.1} s)", rows.len()),
    }
}
