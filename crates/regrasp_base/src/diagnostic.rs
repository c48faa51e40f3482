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
        write!(f, "{}", printable_line(&self.file.to_string_lossy()))?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
        }
        Ok(())
    }
}

/// Where the lines of a text begin: made once, it finds the place of any byte without counting lines again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lines {
    /// Byte offsets at which lines begin; the first is 0.
    starts: Vec<usize>,
}

impl Lines {
    /// The lines of `text`, which line feeds end.
    pub fn of(text: &str) -> Self {
        let after_line_feed = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(at, _)| at + 1);
        Lines { starts: std::iter::once(0).chain(after_line_feed).collect() }
    }

    /// The place of byte `offset` in `file`, the same as [`Place::at_offset`] gives for the text.
    pub fn place(&self, file: impl AsRef<Path>, offset: usize) -> Place {
        let line = self.starts.partition_point(|&start| start <= offset).max(1);
        let column = offset - self.starts[line - 1] + 1;
        Place { file: file.as_ref().to_owned(), line: Some(line as u32), column: Some(column as u32) }
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
    /// A diagnostic with its code, place and problem; the rest is added with the methods below. Texts that are too long to
    /// read lose their middle.
    pub fn new(code: &'static str, place: Place, problem: impl Into<String>) -> Self {
        Diagnostic {
            code,
            place,
            element: String::new(),
            problem: shortened(problem.into(), MAX_TEXT),
            expected: String::new(),
            fix: String::new(),
        }
    }

    /// Names the element, such as `joint "j2"`.
    #[must_use]
    pub fn element(mut self, kind: &str, name: &str) -> Self {
        self.element = format!("{kind} \"{}\"", shortened(name.to_owned(), MAX_SHOWN_NAME));
        self
    }

    /// Says what would have been right.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = shortened(expected.into(), MAX_TEXT);
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn fix(mut self, fix: impl Into<String>) -> Self {
        self.fix = shortened(fix.into(), MAX_TEXT);
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.code, self.place)?;
        if !self.element.is_empty() {
            write!(f, " {}", printable_line(&self.element))?;
        }
        write!(f, ": {}", printable_line(&self.problem))?;
        if !self.expected.is_empty() {
            write!(f, "; expected {}", printable_line(&self.expected))?;
        }
        if !self.fix.is_empty() {
            write!(f, "\n  fix: {}", printable_line(&self.fix))?;
        }
        Ok(())
    }
}

/// Diagnostics that one run lists; the others are counted.
pub const MAX_DIAGNOSTICS: usize = 20;
/// Longest text of a diagnostic, in characters.
const MAX_TEXT: usize = 2_000;
/// Longest name that a diagnostic shows whole, in characters.
const MAX_SHOWN_NAME: usize = 120;

/// Input that cannot be used: at least one diagnostic.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct InputError {
    /// The causes in the order found, at most [`MAX_DIAGNOSTICS`]; never empty.
    pub diagnostics: Vec<Diagnostic>,
    /// How many more causes were found.
    pub n_more: usize,
}

impl From<Diagnostic> for InputError {
    fn from(diagnostic: Diagnostic) -> Self {
        InputError { diagnostics: vec![diagnostic], n_more: 0 }
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
        if self.n_more > 0 {
            write!(f, "\nand {} more", with_commas(self.n_more))?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}

/// Gathers diagnostics so that all causes are reported in one run: the first [`MAX_DIAGNOSTICS`] in full, the others by
/// their number.
#[derive(Debug, Default)]
pub struct Diagnostics {
    found: Vec<Diagnostic>,
    n_more: usize,
}

impl Diagnostics {
    /// Adds one.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        if !self.counted_only() {
            self.found.push(diagnostic);
        }
    }

    /// True when the list is full; one more is counted then. Asked before a text that costs much to make, such as the
    /// search for a similar name: a hostile file asks for it a hundred thousand times.
    pub fn counted_only(&mut self) -> bool {
        let is_full = self.is_full();
        self.n_more += usize::from(is_full);
        is_full
    }

    /// True when what is added is counted only.
    pub fn is_full(&self) -> bool {
        self.found.len() >= MAX_DIAGNOSTICS
    }

    /// Adds all of an error.
    pub fn extend(&mut self, error: InputError) {
        error.diagnostics.into_iter().for_each(|diagnostic| self.push(diagnostic));
        self.n_more += error.n_more;
    }

    /// True when nothing was found.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// `Ok(value)` when nothing was found, else every diagnostic.
    pub fn into_result<T>(self, value: T) -> Result<T, InputError> {
        if self.found.is_empty() {
            return Ok(value);
        }
        Err(InputError { diagnostics: self.found, n_more: self.n_more })
    }
}

/// True for characters that can drive a terminal or turn the order of letters around: control characters, line and
/// paragraph separators, and the marks, embeddings, overrides and isolates of the Unicode bidirectional algorithm.
fn is_hostile(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// `text`, which has line feeds of our own, with every other hostile character replaced, so that names in files cannot drive a
/// terminal.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if is_hostile(c) && c != '\n' { '\u{fffd}' } else { c }).collect()
}

/// `text` on one line: as [`printable`], and without line feeds, so that no name can start a line of its own.
pub fn printable_line(text: &str) -> String {
    text.chars().map(|c| if is_hostile(c) { '\u{fffd}' } else { c }).collect()
}

/// Longest name of a link, joint, finger, object or obstacle, in characters.
pub const MAX_NAME: usize = 256;

/// What is wrong with a name that a file gives to something: it is too long, or has a character that no terminal should see.
pub fn fault_of_name(name: &str) -> Option<String> {
    if name.len() > MAX_NAME && name.chars().count() > MAX_NAME {
        return Some(format!("the name has {} characters", with_commas(name.chars().count())));
    }
    let hostile = name.chars().find(|&c| is_hostile(c))?;
    Some(format!("the name has the character U+{:04X}", u32::from(hostile)))
}

/// What [`fault_of_name`] asks of a name.
pub const GOOD_NAME: &str = "at most 256 characters, without control characters and direction marks";

/// A name that cannot be used, at `place`; None for a good one. Error: `V004`.
pub fn bad_name(place: impl FnOnce() -> Place, kind: &str, name: &str) -> Option<Diagnostic> {
    let fault = fault_of_name(name)?;
    Some(Diagnostic::new("V004", place(), fault).element(kind, name).expected(GOOD_NAME))
}

/// `text` without its middle where it has more than `limit` characters.
pub fn shortened(text: String, limit: usize) -> String {
    // A character has at least one byte.
    if text.len() <= limit {
        return text;
    }
    let n = text.chars().count();
    if n <= limit {
        return text;
    }
    let (first, last) = (limit * 3 / 4, limit / 4);
    let at = |index: usize| text.char_indices().nth(index).map_or(text.len(), |(at, _)| at);
    let left_out = with_commas(n - first - last);
    format!("{} [... {left_out} characters ...] {}", &text[..at(first)], &text[at(n - last)..])
}

/// `n` with commas between thousands.
fn with_commas(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
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
    fn no_name_starts_a_line_of_its_own_or_turns_letters_around() {
        let hostile = "a\ncheck ACCEPTED\u{200f}\u{61c}\u{2028}";
        assert_eq!(printable_line(hostile), "a\u{fffd}check ACCEPTED\u{fffd}\u{fffd}\u{fffd}");
        assert_eq!(printable(hostile).lines().count(), 2);
        let place = Place::line("a\nb", 1);
        let diagnostic =
            Diagnostic::new("U120", place, hostile).element("joint", hostile).expected(hostile).fix(hostile);
        let text = diagnostic.to_string();
        assert_eq!(text.lines().count(), 2, "the diagnostic and its fix: {text}");
        assert!(fault_of_name(hostile).is_some_and(|fault| fault.contains("U+000A")));
        assert!(fault_of_name("\u{202e}").is_some_and(|fault| fault.contains("U+202E")));
        assert_eq!(fault_of_name("Daumen (größer) 拇指"), None);
        assert_eq!(fault_of_name(&"ü".repeat(MAX_NAME)), None);
        assert!(fault_of_name(&"ü".repeat(MAX_NAME + 1)).is_some_and(|fault| fault.contains("257")));
        assert!(GOOD_NAME.contains(&MAX_NAME.to_string()));
    }

    #[test]
    fn long_texts_lose_their_middle() {
        assert_eq!(shortened("ab".repeat(4), 8), "abababab");
        assert_eq!(shortened("äb".repeat(600), 8), "äbäbäb [... 1,192 characters ...] äb");
        let place = Place::line("a", 1);
        let name = "n".repeat(1_000_000);
        let problem = format!("link \"{name}\" does not exist");
        let text = Diagnostic::new("U132", place, problem).element("joint", &name).expected(&name).to_string();
        assert!(text.len() < 6_000 && text.contains("does not exist"), "{}", text.len());
    }

    #[test]
    fn the_first_causes_are_listed_and_the_others_counted() {
        let one = |line| Diagnostic::new("S101", Place::line("a", line), "is unknown");
        let mut found = Diagnostics::default();
        (1..=20_000).for_each(|line| found.push(one(line)));
        let mut all = Diagnostics::default();
        all.push(one(0));
        assert!(!all.counted_only());
        all.extend(found.into_result(()).unwrap_err());
        assert!(all.is_full() && all.counted_only());
        let error = all.into_result(()).unwrap_err();
        assert_eq!((error.diagnostics.len(), error.n_more), (MAX_DIAGNOSTICS, 19_982));
        assert!(error.to_string().ends_with("\nand 19,982 more"), "{error}");
    }

    #[test]
    fn lines_are_those_of_places() {
        let text = "a\n\nbü\n c";
        let lines = Lines::of(text);
        for offset in 0..=text.len() {
            assert_eq!(lines.place("f", offset), Place::at_offset("f", text, offset), "{offset}");
        }
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
