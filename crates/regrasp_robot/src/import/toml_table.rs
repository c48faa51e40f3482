//! TOML tables with the places of their keys and values, and every problem gathered.

use regrasp_base::diagnostic::{Diagnostics, did_you_mean};
use regrasp_base::{Diagnostic, Place};
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A file under reading.
pub(crate) struct TomlReader<'a> {
    /// The file, as the user named it.
    pub file: &'a Path,
    /// Its text.
    pub text: &'a str,
    /// Problems so far.
    pub found: Diagnostics,
}

/// A table, with what messages call it and where it stands.
#[derive(Clone, Copy)]
pub(crate) struct Table<'t> {
    /// The entries.
    pub entries: &'t DeTable<'t>,
    /// Where it begins, in bytes from the start of the file.
    pub offset: usize,
}

impl<'t> Table<'t> {
    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.entries.iter().find(|(name, _)| name.get_ref().as_ref() == key).map(|(_, value)| value)
    }
}

impl TomlReader<'_> {
    /// The place of byte `offset`.
    pub fn place(&self, offset: usize) -> Place {
        Place::at_offset(self.file, self.text, offset)
    }

    /// Reports keys that are not in `known` (`U201`).
    pub fn refuse_unknown(&mut self, table: Table, known: &[&str]) {
        for (key, _) in table.entries {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                let meant = did_you_mean(name, known.iter().copied());
                self.found.push(
                    Diagnostic::new("U201", self.place(key.span().start), "is not a key of this table")
                        .element("key", name)
                        .expected(format!("one of {}", known.join(", ")))
                        .fix(meant.map_or(String::new(), |meant| format!("did you mean {meant}?"))),
                );
            }
        }
    }

    /// Reports that `key` is missing (`U202`).
    pub fn missing(&mut self, table: Table, key: &str, expected: &str) {
        self.found.push(
            Diagnostic::new("U202", self.place(table.offset), "is missing").element("key", key).expected(expected),
        );
    }

    /// Reports that `key` has a value of the wrong type (`U203`).
    pub fn wrong_type(&mut self, value: &Spanned<DeValue>, key: &str, expected: &str) {
        let seen = match value.get_ref() {
            DeValue::Array(items) => format!("is a list of {}", items.len()),
            other => format!("is a {}", other.type_str()).replace("a integer", "an integer"),
        };
        self.found
            .push(Diagnostic::new("U203", self.place(value.span().start), seen).element("key", key).expected(expected));
    }

    /// The text of `key` and its offset; reports another type, and absence when `required`.
    pub fn text<'t>(&mut self, table: Table<'t>, key: &str, required: Need) -> Option<(&'t str, usize)> {
        let Some(value) = table.get(key) else {
            if required == Need::Required {
                self.missing(table, key, &format!("{key} = \"...\""));
            }
            return None;
        };
        let text = value.get_ref().as_str();
        if text.is_none() {
            self.wrong_type(value, key, "a text in quotes");
        }
        text.map(|text| (text, value.span().start))
    }

    /// A finite number; reports other types (`U203`) and NaN and infinity (`V001`).
    pub fn finite(&mut self, value: &Spanned<DeValue>, key: &str) -> Option<f64> {
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            _ => None,
        };
        let Some(number) = number else {
            self.wrong_type(value, key, "a number");
            return None;
        };
        if !number.is_finite() {
            let seen = if number.is_nan() { "NaN" } else { "infinite" };
            self.found.push(
                Diagnostic::new("V001", self.place(value.span().start), format!("is {seen}"))
                    .element("key", key)
                    .expected("a finite number"),
            );
            return None;
        }
        Some(number)
    }

    /// Three finite numbers of `key`; none where missing or bad.
    pub fn vector(&mut self, table: Table, key: &str) -> Option<[f64; 3]> {
        let value = table.get(key)?;
        let items = value.get_ref().as_array().filter(|items| items.len() == 3);
        let Some(items) = items else {
            self.wrong_type(value, key, "three numbers: [x, y, z]");
            return None;
        };
        let numbers: Vec<f64> = items.iter().filter_map(|item| self.finite(item, key)).collect();
        numbers.try_into().ok()
    }
}

/// Whether the absence of a key is a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    Required,
    Optional,
}
