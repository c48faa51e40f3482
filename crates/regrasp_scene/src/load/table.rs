//! A strict reader of TOML tables: every key is asked for by name, every other key is an error, every error has its
//! line and column, and reading goes on after an error so that all causes are found in one run.

use regrasp_base::diagnostic::{Diagnostics, did_you_mean, printable};
use regrasp_base::{Diagnostic, Place};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest value that a message quotes, in characters.
const QUOTE_LIMIT: usize = 60;

/// What was found out about a file while reading it.
pub(super) struct Found<'a> {
    path: &'a Path,
    text: &'a str,
    /// Errors.
    pub diagnostics: Diagnostics,
    /// Things that are worth knowing and no error.
    pub notes: Vec<String>,
}

impl<'a> Found<'a> {
    /// Nothing found yet in `text`, the content of `path`.
    pub fn new(path: &'a Path, text: &'a str) -> Self {
        Found { path, text, diagnostics: Diagnostics::default(), notes: Vec::new() }
    }

    /// The place of `span`.
    pub fn place(&self, span: &Range<usize>) -> Place {
        Place::at_offset(self.path, self.text, span.start)
    }

    /// Adds a note that begins with its place.
    pub fn note(&mut self, span: &Range<usize>, text: impl AsRef<str>) {
        let note = format!("{}: {}", self.place(span), text.as_ref());
        self.notes.push(printable(&note));
    }

    /// Parses the text. Errors: not TOML (`S100`), one per fault of the syntax.
    pub fn parse(&mut self) -> Option<Spanned<DeTable<'a>>> {
        let (table, errors) = DeTable::parse_recoverable(self.text);
        let is_good = errors.is_empty();
        for error in errors {
            let span = error.span().unwrap_or(0..0);
            let mut diagnostic = Diagnostic::new("S100", self.place(&span), error.message().trim().replace('\n', "; "));
            if let Some(number) = self.decimal_comma(&span) {
                diagnostic = diagnostic.fix(format!("write {number} with a point, not a comma"));
            }
            self.diagnostics.push(diagnostic);
        }
        is_good.then_some(table)
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
#[derive(Clone)]
pub(super) struct Entry<'a> {
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
        let problem = format!("is {}, a {}", self.quote(found), self.value.type_str());
        let diagnostic = self.error("S103", found, problem).expected(expected);
        found.diagnostics.push(diagnostic);
    }

    /// A finite number. Errors: another type (`S103`), NaN, infinite or too large (`V001`).
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

    /// A number that `accepts` takes; `expected` says which those are. Errors: as [`Entry::number`], and `S107`.
    pub fn number_that(&self, found: &mut Found, expected: &str, accepts: impl Fn(f64) -> bool) -> Option<f64> {
        let number = self.number(found)?;
        if accepts(number) {
            return Some(number);
        }
        let diagnostic = self.error("S107", found, format!("is {number}")).expected(expected);
        found.diagnostics.push(diagnostic);
        None
    }

    /// A length above zero, in metres.
    pub fn length(&self, found: &mut Found) -> Option<f64> {
        self.number_that(found, "a length above 0, in metres", |x| x > 0.0)
    }

    /// `N` finite numbers. Errors: another type or count (`S103`), and as [`Entry::number`] for each.
    pub fn numbers<const N: usize>(&self, found: &mut Found) -> Option<[f64; N]> {
        let entries = self.entries(found, &format!("an array of {N} numbers"))?;
        if entries.len() != N {
            let diagnostic = self
                .error("S103", found, format!("has {} values", entries.len()))
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
        let DeValue::Array(array) = self.value else {
            self.wrong_type(found, expected);
            return None;
        };
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

    /// True if the value is a number.
    pub fn is_number(&self) -> bool {
        matches!(self.value, DeValue::Integer(_) | DeValue::Float(_))
    }

    /// One of the `choices`. Errors: another type (`S103`) or text (`S104`).
    pub fn choice(&self, found: &mut Found, choices: &[&'static str]) -> Option<&'static str> {
        let text = self.text(found)?;
        if let Some(choice) = choices.iter().find(|choice| **choice == text) {
            return Some(choice);
        }
        let diagnostic = self
            .error("S104", found, format!("is {}{}", self.quote(found), suggestion(text, choices.iter().copied())))
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
pub(super) struct Table<'a> {
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

    /// The value of `key`. Errors: missing (`S102`), with `fix`.
    pub fn required(&mut self, found: &mut Found, key: &'static str, fix: &str) -> Option<Entry<'a>> {
        let entry = self.optional(key);
        if entry.is_none() {
            let diagnostic = self.error("S102", found, format!("has no `{key}`")).fix(fix);
            found.diagnostics.push(diagnostic);
        }
        entry
    }

    /// Those of `keys` that are there.
    pub fn present(&mut self, keys: &[&'static str]) -> Vec<Entry<'a>> {
        keys.iter().filter_map(|key| self.optional(key)).collect()
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

    /// Reports every key that was never asked for (`S101`).
    pub fn finish(self, found: &mut Found) {
        let mut unknown: Vec<_> = self
            .table
            .iter()
            .map(|(key, _)| (key.get_ref().as_ref() as &str, key.span()))
            .filter(|(key, _)| !self.known.iter().any(|known| known == key))
            .collect();
        unknown.sort_by_key(|(_, span)| span.start);
        for (key, span) in unknown {
            let mut diagnostic = Diagnostic::new("S101", found.place(&span), "is not a key that exists here")
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
pub(super) fn suggestion<'n>(word: &str, candidates: impl IntoIterator<Item = &'n str>) -> String {
    did_you_mean(word, candidates).map(|near| format!(" (did you mean \"{near}\"?)")).unwrap_or_default()
}

/// `a, b or c`.
pub(super) fn one_of(names: &[impl AsRef<str>]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => "nothing".to_owned(),
    }
}
