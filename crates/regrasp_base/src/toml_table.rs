//! A strict reader of TOML tables: every key is asked for by name, every other key is an error, every error has its
//! line and column, and reading goes on after an error so that all causes are found in one run.
//!
//! Hand files and scene files are read by it; each has codes of its own (`toml_table::Codes`). V001: a number is not finite.

use crate::diagnostic::{Diagnostic, Diagnostics, Lines, Place, bad_name, did_you_mean, number, printable_line};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest value that a message quotes, in characters.
const QUOTE_LIMIT: usize = 60;
/// Faults of the syntax that are told one by one: one fault mostly draws others after it.
const MAX_SYNTAX_FAULTS: usize = 5;

/// For who gives a URDF where a file of ours is read.
const URDF_FIRST: &str =
    "where it is a URDF, `regrasp inspect` makes a hand file of it, and `regrasp place HAND OBJECT` a scene of that";

/// What to do with a file of the format `seen` where one of the format `wanted` is read; empty where nothing is known.
fn other_kind(seen: &str, wanted: &str) -> &'static str {
    match (seen, wanted) {
        ("regrasp-hand", "regrasp-scene") => "`regrasp place HAND OBJECT` makes a scene of a hand file",
        ("regrasp-scene", "regrasp-hand") => {
            "`regrasp inspect` on a URDF writes a hand file; a scene names its own in `hand.file`"
        }
        _ => "",
    }
}

/// The codes that a kind of file has for the faults found here.
#[derive(Debug, Clone, Copy)]
pub struct Codes {
    /// Not TOML, or empty.
    pub syntax: &'static str,
    /// A key that nobody asks for.
    pub unknown_key: &'static str,
    /// A key that must be there and is not.
    pub missing_key: &'static str,
    /// A value of another type.
    pub wrong_type: &'static str,
    /// A text that is none of the words allowed.
    pub unknown_word: &'static str,
    /// A file of another kind or version.
    pub other_format: &'static str,
    /// A number that makes no sense here.
    pub out_of_range: &'static str,
}

/// What was found out about a file while reading it.
#[derive(Debug)]
pub struct Found<'a> {
    path: &'a Path,
    text: &'a str,
    lines: Lines,
    codes: Codes,
    /// Errors.
    pub diagnostics: Diagnostics,
    /// Things that are worth knowing and no error.
    pub notes: Vec<String>,
}

/// Most brackets that are open at once. The parser calls itself for each, and takes broken files for deeper than they are.
const MAX_OPEN: usize = 128;

/// Where more than 128 brackets are open, those in strings and comments among them. Whoever gives a text to the parser by itself asks this
/// first: the parser's own limit does not hold for broken files, and an overflow of the stack ends the whole program.
pub fn too_deep(text: &str) -> Option<usize> {
    let mut n_open = 0usize;
    text.bytes().position(|byte| {
        match byte {
            b'[' | b'{' => n_open += 1,
            b']' | b'}' => n_open = n_open.saturating_sub(1),
            _ => {}
        }
        n_open > MAX_OPEN
    })
}

impl<'a> Found<'a> {
    /// Nothing found yet in `text`, the content of `path`.
    pub fn new(path: &'a Path, text: &'a str, codes: Codes) -> Self {
        Found { path, text, lines: Lines::of(text), codes, diagnostics: Diagnostics::default(), notes: Vec::new() }
    }

    /// The place of `span`.
    pub fn place(&self, span: &Range<usize>) -> Place {
        self.lines.place(self.path, span.start)
    }

    /// Adds a note that begins with its place.
    pub fn note(&mut self, span: &Range<usize>, text: impl AsRef<str>) {
        let note = format!("{}: {}", self.place(span), text.as_ref());
        self.notes.push(printable_line(&note));
    }

    /// Parses the text. Errors (`syntax`): empty, XML, or not TOML; then up to five faults and a count of the others.
    pub fn parse(&mut self) -> Option<Spanned<DeTable<'a>>> {
        let start = self.text.trim_start();
        if start.is_empty() || start.starts_with('<') {
            let (problem, fix) = match start.is_empty() {
                true => ("is empty", ""),
                false => ("looks like XML", URDF_FIRST),
            };
            let diagnostic =
                Diagnostic::new(self.codes.syntax, Place::file(self.path), problem).expected("a TOML file");
            self.diagnostics.push(diagnostic.fix(fix));
            return None;
        }
        if let Some(at) = too_deep(self.text) {
            let problem = format!("opens more than {MAX_OPEN} brackets that are not closed");
            let diagnostic = Diagnostic::new(self.codes.syntax, self.place(&(at..at)), problem);
            self.diagnostics.push(diagnostic.fix("close every [ and { where its list or table ends"));
            return None;
        }
        let (table, errors) = DeTable::parse_recoverable(self.text);
        let n_errors = errors.len();
        for error in errors.into_iter().take(MAX_SYNTAX_FAULTS) {
            let span = error.span().unwrap_or(0..0);
            let problem = error.message().trim().replace('\n', "; ");
            let mut diagnostic = Diagnostic::new(self.codes.syntax, self.place(&span), problem);
            if let Some(number) = self.decimal_comma(&span) {
                diagnostic = diagnostic.fix(format!("write {number} with a point, not a comma"));
            }
            self.diagnostics.push(diagnostic);
        }
        if n_errors > MAX_SYNTAX_FAULTS {
            let problem = format!("has {} more faults of syntax", n_errors - MAX_SYNTAX_FAULTS);
            self.diagnostics.push(Diagnostic::new(self.codes.syntax, Place::file(self.path), problem));
        }
        (n_errors == 0).then_some(table)
    }

    /// The number with a point for its comma, when the line of `span` is `key = 1,5`.
    fn decimal_comma(&self, span: &Range<usize>) -> Option<String> {
        let before = self.text.get(..span.start)?;
        let start = before.rfind('\n').map_or(0, |i| i + 1);
        let line = self.text.get(start..)?.lines().next()?;
        let value = line.split_once('=')?.1.trim();
        let (whole, fraction) = value.split_once(',')?;
        let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        (is_number(whole.trim_start_matches(['-', '+'])) && is_number(fraction)).then(|| format!("{whole}.{fraction}"))
    }
}

/// A value and the dotted name of its key.
#[derive(Debug, Clone)]
pub struct Entry<'a> {
    /// Such as `object.friction`.
    pub name: String,
    /// Where the value stands.
    pub span: Range<usize>,
    value: &'a DeValue<'a>,
}

impl<'a> Entry<'a> {
    /// An error about this entry.
    pub fn error(&self, code: &'static str, found: &Found, problem: impl Into<String>) -> Diagnostic {
        Diagnostic::new(code, found.place(&self.span), problem).element("key", &self.name)
    }

    /// The value as it stands in the file, cut to a readable length.
    fn quote(&self, found: &Found) -> String {
        let text = found.text.get(self.span.clone()).unwrap_or_default();
        let mut quoted: String = text.chars().take(QUOTE_LIMIT).map(|c| if c == '\n' { ' ' } else { c }).collect();
        if quoted.len() < text.len() {
            quoted.push_str(" ...");
        }
        quoted
    }

    fn wrong_type(&self, found: &mut Found, expected: &str) {
        let kind = self.value.type_str();
        let article = if kind.starts_with(['a', 'i']) { "an" } else { "a" };
        let problem = format!("is {}, {article} {kind}", self.quote(found));
        let diagnostic = self.error(found.codes.wrong_type, found, problem).expected(expected);
        found.diagnostics.push(diagnostic);
    }

    /// A finite number. Errors: another type (`wrong_type`), NaN, infinite or too large (`V001`).
    pub fn number(&self, found: &mut Found) -> Option<f64> {
        let number = match self.value {
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            DeValue::Float(float) => float.as_str().parse().ok(),
            _ => {
                self.wrong_type(found, "a number");
                return None;
            }
        };
        match number {
            Some(number) if number.is_finite() => Some(number),
            _ => {
                let diagnostic =
                    self.error("V001", found, format!("is {}", self.quote(found))).expected("a finite number");
                found.diagnostics.push(diagnostic);
                None
            }
        }
    }

    /// A number that `accepts` takes; `expected` says which those are. Errors: as [`Entry::number`], and `out_of_range`.
    pub fn number_that(&self, found: &mut Found, expected: &str, accepts: impl Fn(f64) -> bool) -> Option<f64> {
        let value = self.number(found)?;
        if accepts(value) {
            return Some(value);
        }
        let diagnostic =
            self.error(found.codes.out_of_range, found, format!("is {}", number(value))).expected(expected);
        found.diagnostics.push(diagnostic);
        None
    }

    /// A length above zero, in metres.
    pub fn length(&self, found: &mut Found) -> Option<f64> {
        self.number_that(found, "a length above 0, in metres", |x| x > 0.0)
    }

    /// `N` finite numbers. Errors: another type or count (`wrong_type`), and as [`Entry::number`] for each.
    pub fn numbers<const N: usize>(&self, found: &mut Found) -> Option<[f64; N]> {
        let entries = self.entries(found, &format!("an array of {N} numbers"))?;
        if entries.len() != N {
            let diagnostic = self
                .error(found.codes.wrong_type, found, format!("has {} values", entries.len()))
                .expected(format!("an array of {N} numbers"));
            found.diagnostics.push(diagnostic);
            return None;
        }
        let mut numbers = [0.0; N];
        let mut is_good = true;
        for (target, entry) in numbers.iter_mut().zip(&entries) {
            match entry.number(found) {
                Some(number) => *target = number,
                None => is_good = false,
            }
        }
        is_good.then_some(numbers)
    }

    /// The entries of an array.
    pub fn entries(&self, found: &mut Found, expected: &str) -> Option<Vec<Entry<'a>>> {
        let entries = self.as_list();
        if entries.is_none() {
            self.wrong_type(found, expected);
        }
        entries
    }

    /// The entries, if the value is an array.
    pub fn as_list(&self) -> Option<Vec<Entry<'a>>> {
        let DeValue::Array(array) = self.value else { return None };
        let entry = |(i, value): (usize, &'a Spanned<DeValue<'a>>)| Entry {
            name: format!("{}[{i}]", self.name),
            span: value.span(),
            value: value.get_ref(),
        };
        Some(array.iter().enumerate().map(entry).collect())
    }

    /// A text.
    pub fn text(&self, found: &mut Found) -> Option<&'a str> {
        match self.as_text() {
            Some(text) => Some(text),
            None => {
                self.wrong_type(found, "a string");
                None
            }
        }
    }

    /// The text, if the value is one.
    pub fn as_text(&self) -> Option<&'a str> {
        match self.value {
            DeValue::String(text) => Some(text),
            _ => None,
        }
    }

    /// The text of `key` inside, if the value is a table that has one.
    pub fn text_inside(&self, key: &str) -> Option<&'a str> {
        let DeValue::Table(table) = self.value else { return None };
        let (_, value) = table.iter().find(|(name, _)| name.get_ref() == key)?;
        value.get_ref().as_str()
    }

    /// True if the value is a list of nothing.
    pub fn is_empty_list(&self) -> bool {
        matches!(self.value, DeValue::Array(items) if items.is_empty())
    }

    /// True if the value is a number.
    pub fn is_number(&self) -> bool {
        matches!(self.value, DeValue::Integer(_) | DeValue::Float(_))
    }

    /// One of the `choices`. Errors: another type (`wrong_type`) or text (`unknown_word`).
    pub fn choice(&self, found: &mut Found, choices: &[&'static str]) -> Option<&'static str> {
        let text = self.text(found)?;
        if let Some(choice) = choices.iter().find(|choice| **choice == text) {
            return Some(choice);
        }
        if found.diagnostics.counted_only() {
            return None;
        }
        let diagnostic = self
            .error(
                found.codes.unknown_word,
                found,
                format!("is {}{}", self.quote(found), suggestion(text, choices.iter().copied())),
            )
            .expected(one_of(choices));
        found.diagnostics.push(diagnostic);
        None
    }

    /// A truth value.
    pub fn boolean(&self, found: &mut Found) -> Option<bool> {
        match self.value {
            DeValue::Boolean(value) => Some(*value),
            _ => {
                self.wrong_type(found, "true or false");
                None
            }
        }
    }

    /// A text that is the name of something. Errors: another type (`wrong_type`), a name that no terminal should see or that is
    /// too long (`V004`).
    pub fn name(&self, found: &mut Found) -> Option<&'a str> {
        let text = self.text(found)?;
        match bad_name(|| found.place(&self.span), "key", text) {
            None => Some(text),
            Some(mut diagnostic) => {
                diagnostic.element = format!("key \"{}\"", self.name);
                found.diagnostics.push(diagnostic);
                None
            }
        }
    }

    /// A table.
    pub fn table(&self, found: &mut Found) -> Option<Table<'a>> {
        match self.value {
            DeValue::Table(table) => {
                Some(Table { name: self.name.clone(), span: self.span.clone(), table, known: Vec::new() })
            }
            _ => {
                self.wrong_type(found, "a table");
                None
            }
        }
    }
}

/// A table whose keys are asked for one by one.
#[derive(Debug)]
pub struct Table<'a> {
    /// Dotted name; empty for the whole file.
    pub name: String,
    /// Where it stands.
    pub span: Range<usize>,
    table: &'a DeTable<'a>,
    known: Vec<&'static str>,
}

impl<'a> Table<'a> {
    /// The table that is the whole file.
    pub fn root(document: &'a Spanned<DeTable<'a>>) -> Self {
        Table { name: String::new(), span: 0..0, table: document.get_ref(), known: Vec::new() }
    }

    /// The dotted name of `key` in this table.
    pub fn name_of(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// An error about this table.
    pub fn error(&self, code: &'static str, found: &Found, problem: impl Into<String>) -> Diagnostic {
        let diagnostic = Diagnostic::new(code, found.place(&self.span), problem);
        if self.name.is_empty() { diagnostic } else { diagnostic.element("table", &self.name) }
    }

    /// The value of `key`, if it is there.
    pub fn optional(&mut self, key: &'static str) -> Option<Entry<'a>> {
        if !self.known.contains(&key) {
            self.known.push(key);
        }
        let (_, value) = self.table.iter().find(|(name, _)| name.get_ref() == key)?;
        Some(Entry { name: self.name_of(key), span: value.span(), value: value.get_ref() })
    }

    /// The value of `key`. Errors: missing (`missing_key`), with `fix`.
    pub fn required(&mut self, found: &mut Found, key: &'static str, fix: &str) -> Option<Entry<'a>> {
        self.required_or(found, key, || fix.to_owned())
    }

    /// The same with a fix that takes time to find, and is sought only where the key is missing.
    pub fn required_or(
        &mut self,
        found: &mut Found,
        key: &'static str,
        fix: impl FnOnce() -> String,
    ) -> Option<Entry<'a>> {
        let entry = self.optional(key);
        if entry.is_none() {
            let diagnostic = self.error(found.codes.missing_key, found, format!("has no `{key}`")).fix(fix());
            found.diagnostics.push(diagnostic);
        }
        entry
    }

    /// Those of `keys` that are there.
    pub fn present(&mut self, keys: &[&'static str]) -> Vec<Entry<'a>> {
        keys.iter().filter_map(|key| self.optional(key)).collect()
    }

    /// True if `format` and `format_version`, which every file of ours begins with, say that it is of this kind; the rest
    /// of another file would only be noise. Errors: missing (`missing_key`), another format or version (`other_format`).
    pub fn is_of_format(&mut self, found: &mut Found, format: &str, version: f64) -> bool {
        self.version_of_format(found, format, &[version]).is_some()
    }

    /// As [`Table::is_of_format`] for a format with several versions: the one that the file has, among `versions`.
    pub fn version_of_format(&mut self, found: &mut Found, format: &str, versions: &[f64]) -> Option<f64> {
        let fix = format!("add format = \"{format}\" as the first line");
        let newest = versions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let format_entry = self.required(found, "format", &fix);
        let version_entry = self.required(found, "format_version", &format!("add format_version = {newest}"));
        if let Some(entry) = &format_entry
            && let Some(text) = entry.text(found)
            && text != format
        {
            let diagnostic = entry
                .error(found.codes.other_format, found, format!("is \"{text}\""))
                .expected(format!("\"{format}\""))
                .fix(other_kind(text, format));
            found.diagnostics.push(diagnostic);
            return None;
        }
        let seen = version_entry.as_ref().and_then(|entry| entry.number(found));
        if let (Some(entry), Some(seen)) = (&version_entry, seen)
            && !versions.contains(&seen)
        {
            let known = versions.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
            let expected = match versions {
                [_] => format!("{known}, the version that this program reads"),
                _ => format!("{known}, the versions that this program reads"),
            };
            let diagnostic = entry.error(found.codes.other_format, found, format!("is {}", number(seen)));
            found.diagnostics.push(diagnostic.expected(expected));
            return None;
        }
        // What is missing has been reported. Files that say no version are mostly of the first.
        Some(seen.unwrap_or(versions.first().copied().unwrap_or(newest)))
    }

    /// Every key with its value, for tables whose keys are names that the user chose.
    pub fn all(&self) -> Vec<(&'a str, Entry<'a>)> {
        let entry = |(key, value): (&'a Spanned<_>, &'a Spanned<DeValue<'a>>)| {
            let key: &'a str = AsRef::<str>::as_ref(key.get_ref() as &std::borrow::Cow<'a, str>);
            (key, Entry { name: self.name_of(key), span: value.span(), value: value.get_ref() })
        };
        let mut entries: Vec<_> = self.table.iter().map(entry).collect();
        entries.sort_by_key(|(_, entry)| entry.span.start);
        entries
    }

    /// Reports every key that was never asked for (`unknown_key`).
    pub fn finish(self, found: &mut Found) {
        let mut unknown: Vec<_> = self
            .table
            .iter()
            .map(|(key, _)| (key.get_ref().as_ref() as &str, key.span()))
            .filter(|(key, _)| !self.known.iter().any(|known| known == key))
            .collect();
        unknown.sort_by_key(|(_, span)| span.start);
        for (key, span) in unknown {
            if found.diagnostics.counted_only() {
                continue;
            }
            let mut diagnostic =
                Diagnostic::new(found.codes.unknown_key, found.place(&span), "is not a key that exists here")
                    .element("key", &self.name_of(key))
                    .expected(one_of(&self.known));
            if key == "quat" || key == "quaternion" || key == "orientation" {
                diagnostic = diagnostic.fix("write quat_xyzw = [x, y, z, w] or quat_wxyz = [w, x, y, z]");
            } else if let Some(near) = did_you_mean(key, self.known.iter().copied()) {
                diagnostic = diagnostic.fix(format!("did you mean {near}?"));
            }
            found.diagnostics.push(diagnostic);
        }
    }
}

/// ` (did you mean "x"?)`, or nothing.
pub fn suggestion<'n>(word: &str, candidates: impl IntoIterator<Item = &'n str>) -> String {
    did_you_mean(word, candidates).map(|near| format!(" (did you mean \"{near}\"?)")).unwrap_or_default()
}

/// `a, b or c`.
pub fn one_of(names: &[impl AsRef<str>]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => "nothing".to_owned(),
    }
}
