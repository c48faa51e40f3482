//! TypeScript of Rust types, by `ts-rs`, and the test that a file in the repository has it. Test binaries of several crates include
//! this file by its path.

use std::collections::BTreeMap;
use std::path::Path;
use ts_rs::{Config, TS, TypeVisitor};

/// Declarations by name.
pub struct Declarations {
    config: Config,
    found: BTreeMap<String, String>,
}

impl TypeVisitor for Declarations {
    fn visit<T: TS + 'static + ?Sized>(&mut self) {
        // Numbers, texts and lists have no declaration.
        if T::output_path().is_none() || self.found.contains_key(&T::ident(&self.config)) {
            return;
        }
        let text = format!("{}export {}", T::docs().unwrap_or_default(), T::decl(&self.config));
        self.found.insert(T::ident(&self.config), laid_out(&text));
        T::visit_dependencies(self);
    }
}

impl Declarations {
    /// None yet. Numbers of 64 bits are as in JSON.
    pub fn new() -> Self {
        Declarations { config: Config::new().with_large_int("number"), found: BTreeMap::new() }
    }

    /// With `T` and all types in it.
    pub fn with<T: TS + 'static>(mut self) -> Self {
        self.visit::<T>();
        self
    }

    /// The declarations in the order of their names, after `heading`.
    pub fn text(self, heading: &str) -> String {
        let declarations: Vec<String> = self.found.into_values().collect();
        format!("{heading}\n{}", declarations.join("\n"))
    }
}

/// A declaration with its fields indented, and remarks of one line in one line.
fn laid_out(declaration: &str) -> String {
    let text = declaration.replace(", };", ",\n};");
    let mut lines: Vec<String> = Vec::new();
    let mut is_inside = false;
    for line in text.lines().map(str::trim_end) {
        is_inside &= line != "};";
        let indent = if is_inside && !line.is_empty() { "  " } else { "" };
        lines.push(format!("{indent}{line}"));
        is_inside |= line.ends_with(" = {");
    }
    let mut text = String::new();
    let mut rest = lines.as_slice();
    while let [line, after @ ..] = rest {
        rest = after;
        text.push_str(line);
        if let ("/**", [remark, end, after @ ..]) = (line.trim(), after)
            && end.trim() == "*/"
        {
            text.push_str(&format!(" {} */", remark.trim().trim_start_matches("* ")));
            rest = after;
        }
        text.push('\n');
    }
    text
}

/// Asserts that the file at `path` has this text; writes it first where `REGRASP_WRITE_SCHEMA` is set.
pub fn assert_written(path: &Path, text: &str) {
    let written = std::fs::read_to_string(path).unwrap_or_default();
    if written != text && std::env::var_os("REGRASP_WRITE_SCHEMA").is_some() {
        std::fs::write(path, text).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == text, "{} is out of date: run this test with REGRASP_WRITE_SCHEMA=1", path.display());
}
