//! Benchmarks: what `docs/benchmarks.md` shows. One thread, so that times compare.

use crate::campaign::WIDE;
use crate::run::{Outcome, files, joined, models, number, out, package, regrasp, regrasp_with, run, words};
use std::fs;
use std::path::{Path, PathBuf};

const RESULTS: &str = "docs/benchmarks";
/// Sections of the page, in this order; those without a CSV file are left out.
const SECTIONS: [&str; 20] = [
    "rolling_wide",
    "rolling_allegro",
    "rolling_stretch",
    "rolling_shadow",
    "wide",
    "visibility",
    "classic",
    "improvement",
    "allegro_required",
    "allegro_stretch",
    "allegro_meshes",
    "dclaw",
    "trifinger",
    "shadow",
    "roadmap_sphere",
    "roadmap_box",
    "roadmap_rolling_sphere",
    "roadmap_rolling_box",
    "roadmap_rolling_allegro_sphere",
    "roadmap_rolling_allegro_cube",
];
const GROWTH: &str = "fingers triangles obstacles threads";
/// Raw rows above this size are kept compressed.
const LARGEST_CSV: u64 = 100_000;
/// Geometry alone, as in the papers: contacts stay where they are while the object moves, no friction is held back, no forces. Such
/// plans are judged for their geometry.
const PLAIN: &str = "--settings docs/benchmarks/plain.json --level geometry";
const REQUIRED: [&str; 10] = [
    "sphere32_x",
    "sphere32_z",
    "sphere32_180x",
    "cube57_x",
    "cube57_y",
    "cube57_z",
    "cube57_180z",
    "cylinder20_x",
    "cylinder20_y",
    "box_y",
];
const STRETCH: [&str; 4] = ["box_x", "box_z", "cube45_x", "cylinder20_z"];
const MESHES: [&str; 5] = ["rubiks_x", "rubiks_z", "apple_x", "apple_z", "can_y"];

fn allegro(names: &[&str]) -> String {
    names.iter().map(|name| format!("scenes/allegro/{name}.toml")).collect::<Vec<_>>().join(" ")
}

/// `bench` of `scenes` into a CSV file of the results.
fn bench(program: &Path, scenes: &str, options: &str, name: &str) -> Outcome {
    regrasp_with(program, &format!("bench {scenes} {options} --threads 1 --csv {RESULTS}/{name}.csv"))
}

/// Everything, then the page. Hours: suites and growth take the most.
pub fn all(_: &[String]) -> Outcome {
    let program = regrasp()?;
    unpack()?;
    let seeds = number("SEEDS", 200)?;
    let few = number("CLASSIC_SEEDS", 20)?;
    let tight = "scenes/tight_sphere_180z.toml";
    let boxes = "scenes/box_90x.toml scenes/box_180z.toml scenes/box_180x.toml";
    bench(&program, WIDE, &format!("--seeds {seeds} --time-limit 20"), "rolling_wide")?;
    let plain_scenes = format!("{WIDE} {tight} scenes/tight_box_90x.toml");
    bench(&program, &plain_scenes, &format!("{PLAIN} --seeds {seeds} --time-limit 20"), "wide")?;
    // The two methods of Saut 2011 draw poses uniformly, as that paper does.
    for method in ["visibility", "classic"] {
        let settings = "--settings docs/benchmarks/uniform_poses.json --level geometry";
        bench(&program, tight, &format!("--method {method} {settings} --seeds {few} --time-limit 60"), method)?;
    }
    let improvement_seeds = number("IMPROVEMENT_SEEDS", 100)?;
    bench(&program, boxes, &format!("{PLAIN} --improve 1 --seeds {improvement_seeds}"), "improvement")?;
    suites(&[])?;
    roadmaps(&[])?;
    growth(&[])?;
    if let Some(models) = models() {
        let packages = package(&models);
        let seeds = number("ALLEGRO_SEEDS", 20)?;
        let of = |limit: u32| format!("{packages} --time-limit {limit} --seeds {seeds}");
        let shadow = joined(&files("scenes/shadow", ".toml")?);
        bench(&program, &allegro(&REQUIRED), &of(20), "rolling_allegro")?;
        bench(&program, &allegro(&STRETCH), &of(20), "rolling_stretch")?;
        bench(&program, &shadow, &of(20), "rolling_shadow")?;
        bench(&program, &allegro(&REQUIRED), &format!("{PLAIN} {}", of(20)), "allegro_required")?;
        bench(&program, &allegro(&STRETCH), &format!("{PLAIN} {}", of(20)), "allegro_stretch")?;
        bench(&program, &allegro(&MESHES), &format!("{PLAIN} {}", of(20)), "allegro_meshes")?;
        for hand in ["dclaw", "trifinger"] {
            let all = files(&format!("scenes/{hand}"), ".toml")?;
            let is_soft =
                |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("soft_"));
            let soft: Vec<PathBuf> = all.into_iter().filter(is_soft).collect();
            bench(&program, &joined(&soft), &format!("{PLAIN} {}", of(6)), hand)?;
        }
        bench(&program, &shadow, &format!("{PLAIN} {}", of(20)), "shadow")?;
    }
    page(&[])
}

/// The suites named, or all, then the page: one command makes all tables and figures of the papers again. A suite that was cut off goes
/// on where it was. `SUITE_SEEDS`: at most so many trials per row; `AT_ONCE`: trials at a time, each on one
/// thread (default: 2, where the machine has two cores).
pub fn suites(names: &[String]) -> Outcome {
    let program = regrasp()?;
    unpack()?;
    let all = words("saut2011 sahbani2007 cherif1999");
    let limit = match number("SUITE_SEEDS", 0)? {
        0 => String::new(),
        seeds => format!("--seeds {seeds}"),
    };
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let at_once = number("AT_ONCE", cores.min(2))?;
    for name in if names.is_empty() { &all } else { names } {
        regrasp_with(&program, &format!("bench suites/{name}.toml --at-once {at_once} {limit}"))?;
    }
    page(&[])
}

/// Graphs with the defaults: name, scene, packages and what else the build is told. The Allegro hand covers its cube only near the
/// scene's start, so that graph is of a smaller region.
pub fn rolling_graphs(
    packages: Option<&str>,
) -> impl Iterator<Item = (&'static str, &'static str, &str, &'static str)> {
    let near = "--places 200 --within 0.004 --angle 45";
    let own = [("roadmap_rolling_sphere", "sphere_90x"), ("roadmap_rolling_box", "box_90x")]
        .map(|(name, scene)| (name, scene, "", ""));
    let allegro = packages.into_iter().flat_map(move |packages| {
        [
            ("roadmap_rolling_allegro_sphere", "allegro/sphere32_x", packages, ""),
            ("roadmap_rolling_allegro_cube", "allegro/cube57_x", packages, near),
        ]
    });
    own.into_iter().chain(allegro)
}

/// Those of `all` that have one of `names`, or all of them where there are no `names`. A name that none of them has is an error.
pub fn named<T>(all: Vec<T>, names: &[String], name_of: impl Fn(&T) -> &str) -> Result<Vec<T>, String> {
    let known: Vec<&str> = all.iter().map(&name_of).collect();
    if let Some(unknown) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(format!("there is no {unknown:?}; there are {}", known.join(", ")));
    }
    let is_asked = |one: &T| names.is_empty() || names.iter().any(|name| name == name_of(one));
    Ok(all.into_iter().filter(is_asked).collect())
}

/// Random queries on the saved graphs of these names, or all, and the same queries without them; `out/roadmaps` keeps the graphs.
pub fn roadmaps(names: &[String]) -> Outcome {
    let program = regrasp()?;
    unpack()?;
    let folder = out("roadmaps")?;
    let queries = number("QUERIES", 1000)?;
    let plain = "--settings docs/benchmarks/plain.json";
    // Defaults: fingertips roll. Few single queries, which take far longer.
    let packages = models().map(|models| package(&models));
    let mut runs = vec![
        ("roadmap_sphere", "sphere_90x", "", plain, "", queries),
        ("roadmap_box", "box_90x", "", plain, "", queries),
        ("roadmap_million", "box_90x", "", plain, "--places 1700", 0),
    ];
    let rolling = rolling_graphs(packages.as_deref());
    runs.extend(rolling.map(|(name, scene, packages, build)| (name, scene, packages, "", build, queries / 10)));
    for (name, scene, packages, settings, build, single) in named(runs, names, |run| run.0)? {
        let graph = folder.join(format!("{name}.roadmap"));
        let graph = graph.display();
        regrasp_with(&program, &format!("roadmap build scenes/{scene}.toml {packages} {settings} -o {graph} {build}"))?;
        let level = if settings.is_empty() { "motion" } else { "geometry" };
        regrasp_with(
            &program,
            &format!(
                "roadmap bench {graph} scenes/{scene}.toml {packages} --single {single} --level {level} --queries {queries} \
                 --csv {RESULTS}/{name}.csv --graph {RESULTS}/{name}.json"
            ),
        )?;
    }
    pack()
}

/// How loading and planning grow with fingers, triangles, obstacles and threads; minutes. `out/growth` keeps the scenes.
pub fn growth(curves: &[String]) -> Outcome {
    let program = regrasp()?;
    unpack()?;
    let curves = if curves.is_empty() { GROWTH.to_owned() } else { curves.join(" ") };
    let trials = number("GROWTH_TRIALS", 20)?;
    let folder = out("growth")?;
    regrasp_with(
        &program,
        &format!("growth {curves} --trials {trials} -o {} --results {RESULTS}/growth", folder.display()),
    )?;
    pack()
}

/// The page of all tables.
const PAGE: &str = "docs/benchmarks.md";

/// The page again, from what was measured. With `--check` nothing is written: it fails where the page, or the results of a suite, are not
/// what the rows say.
pub fn page(arguments: &[String]) -> Outcome {
    let program = regrasp()?;
    unpack()?;
    if !arguments.iter().any(|argument| argument == "--check") {
        write_page(&program, PAGE)?;
        return pack();
    }
    // Beside the page, so that its links are the same.
    let again = Path::new("docs").join(".benchmarks-again.md");
    let written = write_page(&program, &again.to_string_lossy()).and_then(|()| pack());
    let text = fs::read_to_string(&again).map_err(|error| format!("{}: {error}", again.display()));
    let _ = fs::remove_file(&again);
    written?;
    compare(&text?)
}

/// Fails where the page is not `again`, or where the results of a suite are not in it.
fn compare(again: &str) -> Outcome {
    let read = |path: &Path| fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()));
    if read(Path::new(PAGE))? != again {
        return Err(format!("{PAGE} is not what the rows say; run `cargo xtask benchmark-page`"));
    }
    for suite in files("suites", ".toml")? {
        let name = suite.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let path = Path::new(RESULTS).join(&name).join("results.md");
        if !is_section(&read(&path)?, again, &name) {
            return Err(format!("{} is not what its rows say; run `cargo xtask bench-suite {name}`", path.display()));
        }
    }
    Ok(())
}

/// True where the results of a suite stand in the page as well, but for where their pictures are.
fn is_section(results: &str, page: &str, suite: &str) -> bool {
    let section = results.trim_start_matches("# Results").trim();
    page.contains(&section.replace("](figure", &format!("](benchmarks/{suite}/figure")))
}

fn write_page(program: &Path, page: &str) -> Outcome {
    let mut inputs: Vec<String> =
        SECTIONS.iter().chain(&["roadmap_million"]).map(|name| format!("{name}.csv")).collect();
    let graphs = SECTIONS.iter().filter(|name| name.starts_with("roadmap_")).chain(&["roadmap_million"]);
    inputs.extend(graphs.map(|name| format!("{name}.json")));
    inputs.extend(words(GROWTH).iter().map(|name| format!("growth/{name}.csv")));
    let found: Vec<PathBuf> =
        inputs.iter().map(|name| Path::new(RESULTS).join(name)).filter(|path| path.is_file()).collect();
    regrasp_with(
        program,
        &format!(
            "bench --page {page} --limits {RESULTS}/limits.json {} {}",
            joined(&found),
            joined(&files("suites", ".toml")?)
        ),
    )
}

/// Unpacks the compressed rows beside their archives. Rows that were measured after their archive was made stay.
fn unpack() -> Outcome {
    compressed()?
        .iter()
        .filter(|archive| is_newest(archive))
        .try_for_each(|archive| run("gzip", &words(&format!("-dkf {}", archive.display()))))
}

/// True where the rows beside an archive are not newer than it, or are not there.
fn is_newest(archive: &Path) -> bool {
    let modified = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    modified(archive) >= modified(&archive.with_extension(""))
}

/// Compresses rows above [`LARGEST_CSV`] and leaves the archives alone. The same rows give the same bytes.
pub fn pack() -> Outcome {
    for folder in folders()? {
        for file in files(&folder, ".csv")? {
            let size = fs::metadata(&file).map_err(|error| format!("{}: {error}", file.display()))?.len();
            let archive = file.with_extension("csv.gz");
            if size > LARGEST_CSV {
                run("gzip", &words(&format!("-9nf {}", file.display())))?;
            } else if archive.is_file() {
                // Of rows that were more.
                fs::remove_file(&archive).map_err(|error| format!("{}: {error}", archive.display()))?;
            }
        }
    }
    Ok(())
}

fn compressed() -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    for folder in folders()? {
        found.extend(files(&folder, ".csv.gz")?);
    }
    Ok(found)
}

/// The folder of results, and the folders in it.
fn folders() -> Result<Vec<String>, String> {
    let mut found = vec![RESULTS.to_owned()];
    let inside = files(RESULTS, "")?;
    found.extend(inside.iter().filter(|path| path.is_dir()).map(|path| path.to_string_lossy().into_owned()));
    Ok(found)
}

/// Motions of whole robots: problems of MotionBenchMaker, and super graphs of the robot with two arms. `SEEDS`: trials per problem.
pub fn arms(_: &[String]) -> Outcome {
    let example = |arguments: &str| {
        let build = "run --profile dist -q -p regrasp_arms --example bench --";
        run("cargo", &words(&format!("{build} {arguments}")))
    };
    let Some(models) = models() else {
        return example("--roadmap assets/robots/upper_body/robot.toml");
    };
    let packages = package(&models);
    let seeds = number("SEEDS", 3)?;
    let rows = [
        ("panda", "mbm_panda", "sampled_32"),
        ("panda", "mbm_panda", "certified"),
        ("baxter", "mbm_baxter_both_arms", "sampled_64"),
        ("baxter", "mbm_baxter_both_arms", "in_turn_64"),
        ("baxter", "mbm_baxter_both_arms", "certified"),
        ("baxter_exact", "mbm_baxter_both_arms", "certified"),
    ];
    for (robot, problems, settings) in rows {
        let folder = out("arms")?.join(robot);
        let import = "import sys, regrasp; regrasp.import_mbm(sys.argv[1], sys.argv[2], output=sys.argv[3])";
        let from = models.join("benchmarks").join(problems);
        let robot_file = format!("suites/arms/{robot}.toml");
        let told = [import.to_owned(), from.display().to_string(), robot_file, folder.display().to_string()];
        let told: Vec<String> = std::iter::once("-c".to_owned()).chain(told).collect();
        run("python3", &told)?;
        let mut scenes = Vec::new();
        let families = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let mut families: Vec<PathBuf> = families.filter_map(|entry| Some(entry.ok()?.path())).collect();
        families.sort();
        for family in families {
            scenes.extend(files(&family.display().to_string(), ".toml")?);
        }
        println!("{robot}, {settings}:");
        let options = format!("--settings suites/arms/{settings}.json --seeds {seeds}");
        example(&format!("{packages} {options} --csv {RESULTS}/arms_{robot}_{settings}.csv {}", joined(&scenes)))?;
    }
    println!("super graphs of the robot with two arms:");
    example("--roadmap assets/robots/upper_body/robot.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_newer_than_their_archive_are_not_unpacked_over() {
        let folder = std::env::temp_dir().join(format!("regrasp-xtask-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (rows, archive) = (folder.join("rows.csv"), folder.join("rows.csv.gz"));
        fs::write(&archive, "old").unwrap();
        assert!(is_newest(&archive), "no rows are there");
        fs::write(&rows, "new").unwrap();
        let later = fs::metadata(&archive).unwrap().modified().unwrap() + std::time::Duration::from_secs(1);
        fs::File::options().write(true).open(&rows).unwrap().set_modified(later).unwrap();
        assert!(!is_newest(&archive));
        fs::File::options().write(true).open(&archive).unwrap().set_modified(later).unwrap();
        assert!(is_newest(&archive), "as old as the rows that it was unpacked to");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn names_choose_and_unknown_ones_are_refused() {
        let asked = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            named(vec![("a", 1), ("b", 2), ("c", 3)], &names, |one| one.0)
        };
        assert_eq!(asked(&[]).unwrap(), [("a", 1), ("b", 2), ("c", 3)]);
        assert_eq!(asked(&["c", "a"]).unwrap(), [("a", 1), ("c", 3)]);
        assert_eq!(asked(&["a", "d"]).unwrap_err(), "there is no \"d\"; there are a, b, c");
    }

    #[test]
    fn results_that_are_older_than_the_page_are_found() {
        let page = "# Benchmarks\n\n## T\n\n| a | 2/2 |\n\n![F](benchmarks/saut2011/figure_10.svg)\n\n## U\n";
        let results = "# Results\n\n## T\n\n| a | 2/2 |\n\n![F](figure_10.svg)\n";
        assert!(is_section(results, page, "saut2011"));
        assert!(!is_section(&results.replace("2/2", "1/2"), page, "saut2011"));
        assert!(!is_section(results, page, "another"));
    }
}
