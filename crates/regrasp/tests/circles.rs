//! No import circle is larger than a module and its own children.
//!
//! The graph of a crate has one node per source file and one edge per path that begins with `crate`, `self` or `super`, or with the
//! name of a child. A path leads to the deepest module that it names. Edges between a module and its own child do not count, nor
//! do those from and to the root of the crate, and tests are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module by the names that lead to it from the crate's root.
type Module = Vec<String>;

#[test]
fn no_circle_is_larger_than_a_module_and_its_children() {
    let mut problems = Vec::new();
    for source in crate_sources() {
        let name = crate_name(&source);
        let circles = circles(&imports_of(&modules(&source)));
        for circle in &circles {
            let names: Vec<String> = circle.iter().map(|module| module.join("::")).collect();
            problems.push(format!("{name}: {} import each other in a circle", names.join(", ")));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// The two planners are neighbours that do not see each other; what both need stands below them, in `regrasp_manipulation`.
#[test]
fn the_planners_do_not_see_each_other() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../regrasp_planners/src");
    let imports = imports_of(&modules(&source));
    let sees = |from: &str, to: &str| {
        let of = |module: &Module, name: &str| module.first().is_some_and(|first| first == name);
        let edges = imports.iter().filter(|(module, _)| of(module, from)).flat_map(|(_, targets)| targets);
        edges.filter(|target| of(target, to)).count()
    };
    for (from, to) in
        [("in_hand", "tracking"), ("tracking", "in_hand"), ("settings", "in_hand"), ("settings", "tracking")]
    {
        assert_eq!(sees(from, to), 0, "{from} imports from {to}");
    }
    assert!(sees("in_hand", "settings") > 0, "no import was read");
}

/// Rooms of the in-hand planner, each with those that it may import from: what comes first knows nothing of what comes later.
#[test]
fn rooms_of_the_in_hand_planner_stand_in_order() {
    let rooms =
        ["attempt", "moving", "grasps", "regrasping", "searching", "recording", "improving", "roadmap", "placing"];
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../regrasp_planners/src");
    let room_of = |module: &Module| match module.as_slice() {
        [first, room, ..] if first == "in_hand" => rooms.iter().position(|name| name == room),
        _ => None,
    };
    let mut seen = BTreeSet::new();
    for (module, targets) in imports_of(&modules(&source)) {
        let Some(from) = room_of(&module) else { continue };
        seen.insert(from);
        for target in targets {
            let is_later = room_of(&target).is_some_and(|to| to > from);
            assert!(!is_later, "{} imports from {}, a later room", module.join("::"), target.join("::"));
        }
    }
    assert_eq!(seen.len(), rooms.len(), "a room was renamed: change this test and ARCHITECTURE.md");
}

/// The finder finds what it is there for.
#[test]
fn circles_are_found_and_kinship_is_none() {
    let tree = |files: &[(&str, &str)]| -> BTreeMap<Module, String> {
        let module = |path: &str| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect();
        files.iter().map(|(path, text)| (module(path), (*text).to_owned())).collect()
    };
    let found = |files: &[(&str, &str)]| circles(&imports_of(&tree(files)));
    let joined = |circles: Vec<BTreeSet<Module>>| -> Vec<String> {
        circles.iter().map(|circle| circle.iter().map(|m| m.join("::")).collect::<Vec<_>>().join(" ")).collect()
    };
    // Through a list of a list, over two lines.
    let two = [("", "mod a; mod b;"), ("a", "use crate::{b::{f,\n g}, c};"), ("b", "use super::a::h;"), ("c", "")];
    assert_eq!(joined(found(&two)), ["a b"]);
    // Without `use`.
    let inline = [("a", "fn f() { crate::b::g() }"), ("b", "fn g() { super::a::f() }")];
    assert_eq!(joined(found(&inline)), ["a b"]);
    // Through siblings of a child.
    let deep = [("a", "use child::f;"), ("a::child", "use crate::b::g;"), ("b", "use crate::a::child::h;")];
    assert_eq!(joined(found(&deep)), ["a::child b"]);
    // A parent and its children, comments and tests are no circle.
    let kin = [("a", "mod child; use child::f;"), ("a::child", "use super::G;")];
    assert!(found(&kin).is_empty());
    let comment = [("a", "// use crate::b::f;\nuse crate::b::g;"), ("b", "/* crate::a */\n/// crate::a::f\nstruct S;")];
    assert!(found(&comment).is_empty());
    let tests = [("a", "use crate::b::g;"), ("b", "#[cfg(test)]\nmod tests {\n    use crate::a::f;\n}\n")];
    assert!(found(&tests).is_empty());
}

/// The source folder of every crate.
fn crate_sources() -> Vec<PathBuf> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = std::fs::read_dir(&crates).expect("the folder of crates is readable");
    let sources = folders.map(|entry| entry.expect("an entry is readable").path().join("src"));
    let mut found: Vec<PathBuf> = sources.filter(|source| source.is_dir()).collect();
    found.sort();
    assert!(found.len() > 10, "only {} crates", found.len());
    found
}

fn crate_name(source: &Path) -> String {
    let folder = source.parent().and_then(Path::file_name).expect("a crate's folder has a name");
    folder.to_string_lossy().into_owned()
}

/// The text of every module below `source`.
fn modules(source: &Path) -> BTreeMap<Module, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![(source.to_owned(), Module::new())];
    while let Some((folder, at)) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a source folder is readable") {
            let path = entry.expect("an entry is readable").path();
            let stem = path.file_stem().expect("a source has a name").to_string_lossy().into_owned();
            let mut module = at.clone();
            if path.is_dir() {
                module.push(stem);
                folders.push((path, module));
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                if !["lib", "main", "mod"].contains(&stem.as_str()) {
                    module.push(stem);
                }
                let is_for_tests = module.iter().any(|name| name == "tests" || name.ends_with("_tests"));
                if !is_for_tests {
                    found.insert(module, std::fs::read_to_string(&path).expect("a source file is readable"));
                }
            }
        }
    }
    found
}

/// The other modules that each module names, but for its parent, its children and the root.
fn imports_of(modules: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    let is_kin = |a: &Module, b: &Module| a.split_last().is_some_and(|(_, parent)| parent == b.as_slice());
    let of = |(module, text): (&Module, &String)| {
        let targets = paths_in(text).into_iter().filter_map(|path| target(&path, module, modules));
        let counts = |to: &Module| {
            let is_root = to.is_empty() || module.is_empty();
            !is_root && to != module && !is_kin(to, module) && !is_kin(module, to)
        };
        (module.clone(), targets.filter(counts).collect())
    };
    modules.iter().map(of).collect()
}

/// The module that `path`, read in `module`, leads to.
fn target(path: &[String], module: &Module, modules: &BTreeMap<Module, String>) -> Option<Module> {
    let mut names = path.iter().peekable();
    let mut full = Module::new();
    match names.peek().map(|name| name.as_str()) {
        Some("crate") => drop(names.next()),
        Some("self" | "super") => {
            full.clone_from(module);
            while let Some(name) = names.next_if(|name| ["self", "super"].contains(&name.as_str())) {
                if name == "super" {
                    full.pop();
                }
            }
        }
        // The name of a child, or of another crate.
        Some(child) => {
            full.clone_from(module);
            full.push(child.to_owned());
            if !modules.contains_key(&full) {
                return None;
            }
            full.pop();
        }
        None => return None,
    }
    let base = full.len();
    full.extend(names.cloned());
    while full.len() > base && !modules.contains_key(&full) {
        full.pop();
    }
    modules.contains_key(&full).then_some(full)
}

/// All paths of `text` with more than one name, lists expanded; comments, strings and test modules left out.
fn paths_in(text: &str) -> Vec<Vec<String>> {
    let tokens = tokens(&without_tests(text));
    let mut paths = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let before = paths.len();
        let is_name = tokens[at].starts_with(|c: char| c.is_alphabetic() || c == '_');
        let begins = at == 0 || tokens[at - 1] != "::";
        let next = if is_name && begins { read_path(&tokens, at, &[], &mut paths) } else { at + 1 };
        at = next.max(at + 1);
        paths[before..].iter_mut().for_each(|path| path.retain(|name| name != "*"));
    }
    paths.retain(|path| path.len() > 1);
    paths
}

/// Reads the path that begins at `tokens[at]`, after the names of `head`; where it ends.
fn read_path(tokens: &[String], mut at: usize, head: &[String], paths: &mut Vec<Vec<String>>) -> usize {
    let mut path = head.to_vec();
    while let Some(token) = tokens.get(at) {
        if token == "{" && !path.is_empty() && tokens[at - 1] == "::" {
            at += 1;
            while tokens.get(at).is_some_and(|token| token != "}") {
                at = if tokens[at] == "," { at + 1 } else { read_path(tokens, at, &path, paths).max(at + 1) };
            }
            return at + 1;
        }
        // `self` at the end of a list is the module itself, at the beginning of a path it counts.
        if token != "self" || path.is_empty() {
            path.push(token.clone());
        }
        at += 1;
        if tokens.get(at).is_none_or(|token| token != "::") {
            break;
        }
        at += 1;
    }
    paths.push(path);
    at
}

/// `text` without comments and its modules of tests.
fn without_tests(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..at]);
        let after = &rest[at..];
        // The item ends with the first `;`, or with the brace at the beginning of a line.
        let ends = [after.find(";\n").map(|end| end + 1), after.find("\n}\n").map(|end| end + 2)];
        let has_body = after.find('{').is_some_and(|brace| after.find(";\n").is_none_or(|end| brace < end));
        let end = if has_body { ends[1] } else { ends[0] };
        rest = end.map_or("", |end| &after[end..]);
    }
    out.push_str(rest);
    out
}

/// Names, `::`, and single signs; comments, strings and characters are skipped.
fn tokens(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = text;
    let after =
        |rest: &str, what: &str, from: usize| rest[from..].find(what).map_or(rest.len(), |at| from + at + what.len());
    while let Some(first) = rest.chars().next() {
        let n = if rest.starts_with("//") {
            after(rest, "\n", 0)
        } else if rest.starts_with("/*") {
            after(rest, "*/", 2)
        } else if first == '"' {
            let bytes = rest.as_bytes();
            let mut end = 1;
            while end < bytes.len() && bytes[end] != b'"' {
                end += 1 + usize::from(bytes[end] == b'\\');
            }
            (end + 1).min(rest.len())
        } else if rest.starts_with("r#\"") {
            after(rest, "\"#", 3)
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\") {
            after(rest, "'", 2)
        } else if first.is_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            found.push(rest[..end].to_owned());
            end
        } else if rest.starts_with("::") {
            found.push("::".into());
            2
        } else {
            if !first.is_whitespace() {
                found.push(first.into());
            }
            first.len_utf8()
        };
        rest = &rest[n..];
    }
    found
}

/// Groups of modules that reach each other, largest first.
fn circles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<BTreeSet<Module>> {
    let reach = |from: &Module| -> BTreeSet<Module> {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            for next in imports.get(module).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    open.push(next);
                }
            }
        }
        seen
    };
    let reached: BTreeMap<&Module, BTreeSet<Module>> = imports.keys().map(|module| (module, reach(module))).collect();
    let mut circles: Vec<BTreeSet<Module>> = Vec::new();
    for (module, seen) in &reached {
        let is_new = seen.contains(*module) && !circles.iter().any(|circle| circle.contains(*module));
        if is_new {
            circles.push(seen.iter().filter(|other| reached[*other].contains(*module)).cloned().collect());
        }
    }
    circles.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    circles
}
