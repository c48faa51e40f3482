//! Runs of the executor: the reader takes good files only, and pages say what the file says.

use crate::places::repository;
use crate::sample::Sample;
use regrasp_base::Rng;
use regrasp_robot::import::LoadOptions;
use regrasp_viewer::runs::format::{from_json, is_run, leg_path, to_json};
use regrasp_viewer::runs::{Answer, Doing, Event, Run, html};
use std::path::Path;

fn text() -> String {
    std::fs::read_to_string(repository().join("fuzz/seeds/run_json/run.json")).unwrap()
}

fn read(text: &str) -> Result<Run, String> {
    from_json(Path::new("run.json"), text.as_bytes()).map_err(|error| error.to_string())
}

fn run() -> Run {
    read(&text()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_run_is_read_and_written_and_read_again() {
    let run = run();
    assert_eq!((run.n_reached(), run.n_replans(), run.samples.len()), (1, 0, 4));
    assert_eq!(read(&to_json(&run)), Ok(run));
    assert!(is_run(text().as_bytes()) && !is_run(b"{\"format\": \"regrasp-plan\"}") && !is_run(b"[") && !is_run(b""));
    assert_eq!(leg_path(Path::new("out/run.json"), 0), Path::new("out/run.leg1.json"));
}

/// Every answer that the page of the format names can be read, and so can a clock that counts from 1970.
#[test]
fn answers_of_the_executor_and_times_of_a_wall_clock_are_read() {
    let page = std::fs::read_to_string(repository().join("docs/reference/run-format.md")).unwrap();
    let named = page.split_once("`answer` (`").and_then(|(_, rest)| rest.split_once("`)")).unwrap().0;
    let answers: Vec<&str> = named.split("`, `").collect();
    assert_eq!(answers.len(), 8, "{answers:?}");
    for answer in answers {
        let mut run = run();
        run.events[0].answer = serde_json::from_str(&format!("\"{answer}\"")).unwrap_or_else(|_| panic!("{answer}"));
        assert_eq!(read(&to_json(&run)), Ok(run));
    }
    let mut late = run();
    let epoch = 1.77e9;
    late.samples.iter_mut().for_each(|sample| sample.time += epoch);
    late.events.iter_mut().for_each(|event| event.time += epoch);
    late.goals.iter_mut().for_each(|goal| (goal.start_time, goal.time) = (goal.start_time + epoch, goal.time + epoch));
    late.legs.iter_mut().for_each(|leg| leg.start_time += epoch);
    assert_eq!(read(&to_json(&late)), Ok(late));
}

#[test]
fn what_makes_no_sense_is_refused_with_its_place() {
    let cases = [
        ("\"scene\": \"sphere_90x\",", "", "E801 run.json:", "missing field"),
        ("\"message\": \"\",", "\"message\": \"\", \"extra\": 1,", "E801 run.json:1:", "unknown field"),
        ("\"state\": \"blend\"", "\"state\": \"flies\"", "E801 run.json:4:", "unknown variant"),
        ("\"time\": 0.1,", "\"time\": 1e999,", "E801 run.json:4:", "out of range"),
        ("regrasp-run", "regrasp-ran", "E802 run.json:1:12", "expected \"regrasp-run\""),
        ("\"format_version\": 1", "\"format_version\": 2", "E803 run.json:1:", "expected 1"),
        ("\"duration\": 0.3", "\"duration\": -0.3", "E804 run.json:10:", "legs[0].duration"),
        ("\"time\": 0.2", "\"time\": 0.05", "E804 run.json:5:", "after 0.1"),
        ("\"time\": 0.25", "\"time\": 1e12", "E804 run.json:8:", "events[0].time"),
        ("\"leg\": 0, \"tick\": 10", "\"leg\": 1, \"tick\": 10", "E805 run.json:5:", "the index of one of 1 legs"),
        ("\"goal\": 0, \"leg\": -1", "\"goal\": 0, \"leg\": -2", "E805 run.json:9:", "events[1].leg"),
        ("\"goal\": 0, \"seed\"", "\"goal\": 7, \"seed\"", "E805 run.json:10:", "legs[0].goal"),
        ("[0.0, 0.0, 1.0, 0.0]", "[0.0, 0.0, 2.0, 0.0]", "E806 run.json:12:", "has length 2.000"),
        ("[0.4, 0.7]", "[0.4, 0.7, 0.1]", "E807 run.json:5:", "has 3 numbers"),
    ];
    for (from, to, code, words) in cases {
        let good = text();
        assert!(good.contains(from), "{from}");
        let error = read(&good.replacen(from, to, 1)).expect_err(to);
        assert!(error.starts_with(code) && error.contains(words), "{to}: {error}");
    }
}

#[test]
fn every_fault_is_reported_up_to_a_limit() {
    let line = text().lines().nth(4).unwrap().replace("\"leg\": 0", "\"leg\": 9").trim_end_matches(',').to_owned();
    let many = text().replace(text().lines().nth(4).unwrap(), &format!("{},", vec![line; 30].join(",\n")));
    let error = read(&many).unwrap_err();
    assert_eq!(error.matches("E805").count(), 20, "{error}");
    assert!(error.ends_with("and 10 more"), "{error}");
}

/// Files that are broken at random. `REGRASP_NOISE` says how many.
#[test]
fn broken_files_are_refused_or_read_and_drawn() {
    const PIECES: [&str; 12] = ["{", "}", "[", "]", ",", ":", "\"", "null", "1e300", "-1", "9999999999", "\\u0000"];
    let seed = text().into_bytes();
    let n_runs: u64 = std::env::var("REGRASP_NOISE").ok().and_then(|n| n.parse().ok()).unwrap_or(5_000);
    let mut n_read = 0;
    for number in 0..n_runs {
        let mut rng = Rng::keyed(1, "noise", number);
        let mut bytes = seed.clone();
        for _ in 0..1 + rng.below(3) {
            let at = rng.below(bytes.len());
            match rng.below(4) {
                0 => bytes[at] = rng.below(256) as u8,
                // A digit for a digit: files that are often read.
                1 => {
                    let digits: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at].is_ascii_digit()).collect();
                    if !digits.is_empty() {
                        bytes[digits[rng.below(digits.len())]] = b'0' + rng.below(10) as u8;
                    }
                }
                2 => drop(bytes.drain(at..(at + 1 + rng.below(12)).min(bytes.len()))),
                _ => drop(bytes.splice(at..at, PIECES[rng.below(PIECES.len())].bytes())),
            }
        }
        if let Ok(run) = from_json(Path::new("run.json"), &bytes) {
            n_read += 1;
            assert_eq!(read(&to_json(&run)).as_ref(), Ok(&run), "run {number}");
            let page = html(&run, &[], None);
            assert!(page.ends_with("</html>\n") && !page.contains("NaN") && !page.contains("inf\""), "run {number}");
        }
    }
    assert!(n_read > n_runs / 100, "{n_read} of {n_runs} were read");
}

#[test]
fn the_page_says_what_the_file_says_and_runs_nothing() {
    let page = html(&run(), &[], None);
    assert_eq!(page, html(&run(), &[], None), "the same bytes");
    assert!(page.contains("1 of 2 goals reached, 0 replans"));
    assert!(page.contains("no plan: &lt;none&gt;") && page.contains("has slipped by 3.1 mm"));
    assert!(page.contains("default-src 'none'") && !page.contains("<script"));
    assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http:") && !page.contains("https:"));
    assert!(page.contains("Plans of 0 of 1 legs were found"));
    // A name from a file ends no element.
    let hostile = Run { scene: "</title><script>alert(1)</script>".into(), ..run() };
    assert!(!html(&hostile, &[], None).contains("<script"));
    // Nothing happened yet.
    let empty = Run { samples: vec![], events: vec![], legs: vec![], goals: vec![], ..run() };
    assert!(html(&empty, &[], Some("Nothing")).contains("<h1>Nothing</h1>"));
}

#[test]
fn peaks_between_the_columns_of_a_curve_are_drawn() {
    let mut run = run();
    let template = run.samples[1].clone();
    run.samples = (0..50_000u32)
        .map(|k| {
            let distance = if k == 31_234 { 0.0095 } else { 0.0001 };
            let tick = u64::from(k);
            regrasp_viewer::runs::Sample { time: 0.002 * f64::from(k), tick, distance, ..template.clone() }
        })
        .collect();
    let page = html(&run, &[], None);
    let chart = page.split("<svg").find(|part| part.contains("distance from the plan")).unwrap();
    // The axis ends at the peak, rounded up: 10 mm.
    assert!(chart.contains(">10<"), "{}", &chart[..2_000]);
    assert!(page.len() < 400_000, "{} bytes", page.len());
}

#[test]
fn the_plans_of_the_legs_stand_beside_what_happened() {
    let sample = Sample::new("scenes/box_90x.toml", LoadOptions::default());
    let plan = sample.plan;
    let duration = plan.segments.last().unwrap().waypoints.last().unwrap().time;
    let mut run = run();
    let template = run.samples[1].clone();
    let tick = 0.002;
    let begins = 1.0;
    // Half of the leg ran, with a hold of two seconds after a quarter.
    let n_ticks = (duration / tick) as u64;
    run.samples = (0..=n_ticks / 2)
        .step_by(5)
        .map(|k| {
            let held = if k > n_ticks / 4 { 2.0 } else { 0.0 };
            let time = begins + tick * k as f64 + held;
            regrasp_viewer::runs::Sample { time, tick: k, state: Doing::Run, forces: None, ..template.clone() }
        })
        .collect();
    run.legs[0].duration = duration;
    run.events =
        vec![Event { time: begins, kind: "slip".into(), message: "x".into(), answer: Answer::Replan, goal: 0, leg: 0 }];
    let page = html(&run, &[Some(plan.clone())], None);
    let chart = page.split("<svg").find(|part| part.contains("which finger holds when")).expect("a chart of the plans");
    for finger in &plan.fingers {
        assert!(chart.contains(&format!(">{finger}<")), "no row of {finger}");
    }
    assert!(!page.contains("were found beside the run"));
    assert!(page.contains(&format!("<td>{}</td>", plan.n_relocations())));
    // A run that lasts so long, and no bar beyond it.
    let places = chart.split("<rect ").filter_map(|rect| {
        let number = |key: &str| rect.split(&format!("{key}=\"")).nth(1)?.split('"').next()?.parse::<f64>().ok();
        Some(number(" x").or_else(|| number("x"))? + number("width")?)
    });
    assert!(places.fold(0.0, f64::max) <= 1080.5);
}
