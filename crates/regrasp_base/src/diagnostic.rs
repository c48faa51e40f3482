//! Errors in input files. One [`Diagnostic`] per cause, all causes of a run together in an [`InputError`].

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a file something stands. Lines and columns count from 1.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize)]
pub struct Place {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// Line, where known.
    pub line: Option<u32>,
    /// Column, where known.
    pub column: Option<u32>,
}

impl Place {
    /// A whole file.
    pub fn file(file: impl AsRef<Path>) -> Self {
        Place { file: file.as_ref().to_owned(), line: None, column: None }
    }

    /// A line of a file.
    pub fn line(file: impl AsRef<Path>, line: u32) -> Self {
        Place { file: file.as_ref().to_owned(), line: Some(line), column: None }
    }

    /// The place of byte `offset` of `text`, which is the content of `file`.
    pub fn at_offset(file: impl AsRef<Path>, text: &str, offset: usize) -> Self {
        let before = &text.as_bytes()[..offset.min(text.len())];
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        let column = before.iter().rev().take_while(|&&byte| byte != b'\n').count() + 1;
        Place { file: file.as_ref().to_owned(), line: Some(line as u32), column: Some(column as u32) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", printable(&self.file.to_string_lossy()))?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
        }
        Ok(())
    }
}

/// One thing that is wrong with an input: code, place, element, what was seen, what was expected, the fix.
///
/// Codes: U1xx robot files, U2xx hand files, M2xx meshes, S1xx scene files, P3xx start, goal and grasp, V0xx numbers,
/// C4xx plan files. A code never changes its meaning.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Diagnostic {
    /// Stable code, such as `U120`.
    pub code: &'static str,
    /// Where it stands.
    pub place: Place,
    /// The element: `joint "j2"`, `link "tip"`, `key "friction"`; empty when the whole file is meant.
    pub element: String,
    /// What is wrong, with the value seen.
    pub problem: String,
    /// What would have been right; may be empty when the problem says it.
    pub expected: String,
    /// What to do, a command or an edit; may be empty.
    pub fix: String,
}

impl Diagnostic {
    /// A diagnostic with its code, place and problem; the rest is added with the methods below.
    pub fn new(code: &'static str, place: Place, problem: impl Into<String>) -> Self {
        Diagnostic {
            code,
            place,
            element: String::new(),
            problem: problem.into(),
            expected: String::new(),
            fix: String::new(),
        }
    }

    /// Names the element, such as `joint "j2"`.
    #[must_use]
    pub fn element(mut self, kind: &str, name: &str) -> Self {
        self.element = format!("{kind} \"{name}\"");
        self
    }

    /// Says what would have been right.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = expected.into();
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn fix(mut self, fix: impl Into<String>) -> Self {
        self.fix = fix.into();
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.code, self.place)?;
        if !self.element.is_empty() {
            write!(f, " {}", printable(&self.element))?;
        }
        write!(f, ": {}", printable(&self.problem))?;
        if !self.expected.is_empty() {
            write!(f, "; expected {}", printable(&self.expected))?;
        }
        if !self.fix.is_empty() {
            write!(f, "\n  fix: {}", printable(&self.fix))?;
        }
        Ok(())
    }
}

/// Input that cannot be used: at least one diagnostic.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct InputError {
    /// Every cause found, in the order found; never empty.
    pub diagnostics: Vec<Diagnostic>,
}

impl From<Diagnostic> for InputError {
    fn from(diagnostic: Diagnostic) -> Self {
        InputError { diagnostics: vec![diagnostic] }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.diagnostics.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{diagnostic}")?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}

/// Gathers diagnostics so that all causes are reported in one run.
#[derive(Debug, Default)]
pub struct Diagnostics {
    found: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Adds one.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic);
    }

    /// Adds all of an error.
    pub fn extend(&mut self, error: InputError) {
        self.found.extend(error.diagnostics);
    }

    /// True when nothing was found.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// `Ok(value)` when nothing was found, else every diagnostic.
    pub fn into_result<T>(self, value: T) -> Result<T, InputError> {
        if self.found.is_empty() { Ok(value) } else { Err(InputError { diagnostics: self.found }) }
    }
}

/// `text` without control characters and without direction marks, so that names in files cannot drive a terminal.
pub fn printable(text: &str) -> String {
    text.chars()
        .map(|c| {
            let hostile =
                (c.is_control() && c != '\n') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
            if hostile { '\u{fffd}' } else { c }
        })
        .collect()
}

/// `x` with all its digits, as people write it: very large and very small numbers with an exponent.
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e10).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

/// The candidate nearest to `word` by edit distance, when it is near enough to be a slip of the keyboard.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (word.chars().count() / 3).max(1) + 1;
    candidates
        .into_iter()
        .map(|candidate| (edit_distance(word, candidate), candidate))
        .filter(|&(distance, _)| distance <= limit)
        .min()
        .map(|(_, candidate)| candidate)
}

/// Levenshtein distance in characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().take(120).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().take(120).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_all_its_parts_on_one_line_and_the_fix_below() {
        let text = "<robot>\n  <joint name=\"j2\"/>\n";
        let place = Place::at_offset("hand.urdf", text, text.find("<joint").unwrap());
        let diagnostic = Diagnostic::new("U120", place, "is revolute but has no <limit>")
            .element("joint", "j2")
            .expected("<limit lower=... upper=...>")
            .fix("add the limit");
        assert_eq!(
            diagnostic.to_string(),
            "U120 hand.urdf:2:3 joint \"j2\": is revolute but has no <limit>; expected <limit lower=... upper=...>\n  fix: add the limit"
        );
    }

    #[test]
    fn names_cannot_drive_a_terminal() {
        assert_eq!(printable("a\u{1b}[2Jb\u{202e}c"), "a\u{fffd}[2Jb\u{fffd}c");
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, -0.8, 0.078, 1e300, -2.5e-7, f64::INFINITY].map(number);
        assert_eq!(shown, ["0", "-0.8", "0.078", "1e300", "-2.5e-7", "inf"]);
    }

    #[test]
    fn near_names_are_suggested_and_far_ones_are_not() {
        assert_eq!(did_you_mean("fricton", ["friction", "mass"]), Some("friction"));
        assert_eq!(did_you_mean("colour", ["friction", "mass"]), None);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
