//! Links of README, the book and the other documents: every file and heading that they name exists. Pages of the book lead out of the
//! book by full addresses only, every page is in its table of contents, and tables are whole.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Where the repository's files are on the web.
const WEB: &str = "https://github.com/regrasp/regrasp/";

fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the crate lies in the repository").to_owned()
}

/// Markdown files that people read, relative to the repository, sorted.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    collect(&root(), Path::new(""), &mut found);
    found.sort();
    assert!(found.len() > 40 && found.contains(&PathBuf::from("README.md")), "{found:?}");
    found
}

fn collect(root: &Path, inside: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(root.join(inside)).expect("a folder of the repository").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = inside.join(&name);
        let is_ours = !["target", "node_modules", ".git", "out", "corpus", "artifacts"].contains(&name.as_str());
        if entry.path().is_dir() && is_ours {
            collect(root, &path, found);
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
}

/// Text outside of code blocks, with code spans left out.
fn prose(text: &str) -> String {
    let (mut out, mut is_code) = (String::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code && !line.starts_with("    ") {
            let outside: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
            out.push_str(&outside);
        }
        out.push('\n');
    }
    out
}

/// Targets of `[text](target)` and `![text](target)`, which may be broken over lines.
fn links(text: &str) -> Vec<String> {
    let text = prose(text);
    let begins = text.match_indices("](").map(|(at, _)| at + 2);
    begins.filter_map(|at| text[at..].find(')').map(|length| text[at..at + length].trim().to_owned())).collect()
}

/// Anchors of headings, as GitHub and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut found = BTreeSet::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        }
        let words = line.trim_start_matches('#');
        if !is_code && words.len() < line.len() && words.starts_with(' ') {
            let kept = words.trim().to_lowercase();
            let kept: String = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect();
            found.insert(kept.replace(' ', "-"));
        }
    }
    found
}

/// `a/b/../c` as `a/c`; none where it leads out of the repository.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                if !out.pop() {
                    return None;
                }
            }
            Component::CurDir => {}
            part => out.push(part),
        }
    }
    Some(out)
}

/// What is wrong with the link `target` of the document `from`, if anything.
fn fault(from: &Path, target: &str) -> Option<String> {
    let root = root();
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor)));
    let on_the_web = path.strip_prefix(WEB);
    let file = match on_the_web {
        Some(inside) => match inside.strip_prefix("blob/main/").or_else(|| inside.strip_prefix("tree/main/")) {
            Some(inside) => PathBuf::from(inside),
            // Issues, security advisories, the repository itself.
            None => return None,
        },
        None if path.contains("://") || path.starts_with("mailto:") => return None,
        None if path.is_empty() => from.to_owned(),
        None => match normal(&from.parent().unwrap_or(Path::new("")).join(path)) {
            Some(file) => file,
            None => return Some("leads out of the repository".to_owned()),
        },
    };
    if !root.join(&file).exists() {
        return Some(format!("{} does not exist", file.display()));
    }
    if on_the_web.is_none() && from.starts_with("docs") && !file.starts_with("docs") {
        return Some(format!("leads out of the book; write {WEB}blob/main/{}", file.display()));
    }
    let anchor = anchor?;
    let text = fs::read_to_string(root.join(&file)).unwrap_or_default();
    (!anchors(&text).contains(anchor)).then(|| format!("{} has no heading for #{anchor}", file.display()))
}

#[test]
fn every_link_leads_somewhere() {
    let (mut faults, mut n_links) = (Vec::new(), 0);
    for document in documents() {
        let text = fs::read_to_string(root().join(&document)).expect("a document");
        for target in links(&text) {
            n_links += 1;
            if let Some(fault) = fault(&document, &target) {
                faults.push(format!("{}: ({target}) {fault}", document.display()));
            }
        }
    }
    assert!(n_links > 150, "{n_links} links");
    assert!(faults.is_empty(), "dead links:\n{}", faults.join("\n"));
}

#[test]
fn dead_links_are_found() {
    let from = Path::new("docs/introduction.md");
    for target in [
        "no-such-page.md",
        "concepts/margin.md#no-such-heading",
        "../README.md",
        "../../elsewhere.md",
        "https://github.com/regrasp/regrasp/blob/main/no-such-file.md",
    ] {
        assert!(fault(from, target).is_some(), "{target} counts as alive");
    }
    assert_eq!(fault(from, "concepts/margin.md#what-regrasp-does"), None);
    assert_eq!(links("see [a](b.md) and ![c\nd](e.svg), not `[x](y)`"), ["b.md", "e.svg"]);
}

/// Lines of tables that have another number of cells than the line before, from 1.
fn uneven_rows(text: &str) -> Vec<usize> {
    let cells = |line: &str| line.starts_with('|').then(|| line.replace("\\|", "").matches('|').count());
    let counts: Vec<Option<usize>> = prose(text).lines().map(cells).collect();
    let is_uneven = |pair: &[Option<usize>]| pair[0].zip(pair[1]).is_some_and(|(before, here)| before != here);
    counts.windows(2).enumerate().filter(|(_, pair)| is_uneven(pair)).map(|(at, _)| at + 2).collect()
}

#[test]
fn rows_of_tables_have_as_many_cells_as_their_heads() {
    assert_eq!(uneven_rows("| a | b |\n|---|---|\n| `x|y` | 1 \\| 2 |\n\n| a |\n|---|\n| 1 | 2 |\n"), [7]);
    let uneven = |path: &PathBuf| {
        let rows = uneven_rows(&fs::read_to_string(root().join(path)).expect("a document"));
        (!rows.is_empty()).then(|| format!("{}: lines {rows:?}", path.display()))
    };
    let faults: Vec<String> = documents().iter().filter_map(uneven).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn every_page_is_in_the_table_of_contents() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("the table of contents");
    let listed: BTreeSet<PathBuf> = links(&summary).iter().map(|page| Path::new("docs").join(page)).collect();
    let pages: BTreeSet<PathBuf> =
        documents().into_iter().filter(|page| page.starts_with("docs") && !page.ends_with("SUMMARY.md")).collect();
    let left_out: Vec<_> = pages.difference(&listed).collect();
    assert!(left_out.is_empty(), "pages that docs/SUMMARY.md leaves out: {left_out:?}");
}

/// Paths such as `docs/reference/plan-format.md` in code, messages and scenes.
#[test]
fn pages_that_code_names_exist() {
    let mut faults = Vec::new();
    let mut n_named = 0;
    for folder in ["crates", "python", "scenes", "suites", "assets", "tests", "xtask", "fuzz/src", "fuzz/fuzz_targets"]
    {
        let mut files = Vec::new();
        collect_sources(&root(), Path::new(folder), &mut files);
        for file in files {
            let Ok(text) = fs::read_to_string(root().join(&file)) else { continue };
            for (at, _) in text.match_indices("docs/") {
                let is_whole_path = !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '/' || c == '.');
                let named: String =
                    text[at..].chars().take_while(|c| c.is_alphanumeric() || "/-_.".contains(*c)).collect();
                if is_whole_path && named.ends_with(".md") {
                    n_named += 1;
                    if !root().join(&named).is_file() {
                        faults.push(format!("{}: {named}", file.display()));
                    }
                }
            }
        }
    }
    assert!(n_named > 20, "{n_named} pages named");
    assert!(faults.is_empty(), "pages that do not exist:\n{}", faults.join("\n"));
}

fn collect_sources(root: &Path, inside: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(root.join(inside)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = inside.join(&name);
        if entry.path().is_dir() && name != "node_modules" && name != "dist" {
            collect_sources(root, &path, found);
        } else if [".rs", ".py", ".pyi", ".toml", ".ts", ".urdf", ".json"].iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
}

/// Papers are cited by author and year, as `docs/references.md` lists them; nothing cites a text that is not in the repository.
#[test]
fn papers_are_cited_by_author_and_year() {
    let mut files = documents();
    for folder in ["crates", "python", "scenes", "suites", "assets", "tests", "xtask/src", "examples", "schema"] {
        collect_sources(&root(), Path::new(folder), &mut files);
    }
    let numbers = ["000", "001", "003", "004"].map(|number| format!("paper {number}"));
    let notes = ["in-hand", "real-hands", "physics", "bodies", "hard-turns"].map(|topic| format!("{topic}-notes"));
    let mut faults = Vec::new();
    for file in files {
        let text = fs::read_to_string(root().join(&file)).unwrap_or_default().to_lowercase();
        for words in numbers.iter().chain(&notes).filter(|words| text.contains(*words)) {
            faults.push(format!("{}: {words}", file.display()));
        }
    }
    assert!(faults.is_empty(), "write author, year and section (docs/references.md):\n{}", faults.join("\n"));
}

/// What a row of the table of algorithms names: pairs of a file and what it defines there.
fn named_code(row: &str) -> Vec<(String, String)> {
    let spans: Vec<&str> = row.split('`').skip(1).step_by(2).collect();
    let files = spans.windows(2).filter(|pair| pair[0].ends_with(".rs"));
    files.map(|pair| (pair[0].to_owned(), pair[1].to_owned())).collect()
}

/// True where `text` defines a function, type or constant called `name`.
fn defines(text: &str, name: &str) -> bool {
    ["fn", "struct", "enum", "trait", "type", "const"].iter().any(|kind| {
        let whole = format!("{kind} {name}");
        text.match_indices(&whole).any(|(at, _)| {
            let next = text[at + whole.len()..].chars().next();
            next.is_none_or(|c| !(c.is_alphanumeric() || c == '_'))
        })
    })
}

#[test]
fn algorithms_of_the_papers_are_where_the_references_say() {
    let page = fs::read_to_string(root().join("docs/references.md")).expect("the page of references");
    let section = page.split("## Where algorithms").nth(1).and_then(|rest| rest.split("\n## ").next());
    let rows: Vec<&str> = section.expect("the table").lines().filter(|line| line.starts_with("| ")).collect();
    let (mut faults, mut n_named) = (Vec::new(), 0);
    for row in &rows {
        for (file, name) in named_code(row) {
            n_named += 1;
            match fs::read_to_string(root().join("crates").join(&file)) {
                Ok(text) if defines(&text, &name) => {}
                Ok(_) => faults.push(format!("{file} defines no {name}")),
                Err(error) => faults.push(format!("{file}: {error}")),
            }
        }
        for file in row.split('`').filter(|span| span.starts_with("suites/") || span.starts_with("assets/")) {
            if !root().join(file).is_file() {
                faults.push(format!("{file} does not exist"));
            }
        }
    }
    assert!(rows.len() > 35 && n_named > 30, "{} rows, {n_named} names", rows.len());
    assert!(faults.is_empty(), "the table of references names what is not there:\n{}", faults.join("\n"));
    for paper in ["Saut 2011", "Sahbani 2007", "Cherif 1999"] {
        assert!(rows.iter().filter(|row| row.contains(paper)).count() > 8, "{paper}");
    }
}

#[test]
fn what_is_not_defined_is_found() {
    let text = "pub fn explore(x: u8) {}\nconst MOST: usize = 1;";
    assert!(defines(text, "explore") && defines(text, "MOST"));
    assert!(!defines(text, "explor") && !defines(text, "build"));
    assert_eq!(named_code("| a | `x/y.rs` `go` | `z` |"), [("x/y.rs".to_owned(), "go".to_owned())]);
}
