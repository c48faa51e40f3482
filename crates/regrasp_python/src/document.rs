//! TOML documents as JSON with the line of every key, for readers that are written in Python.

use crate::error;
use crate::guard::guarded;
use pyo3::prelude::*;
use regrasp::base::toml_table::{Codes, Found};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The document `text` of the file `path` as JSON: `value`, and in `lines` the line of every key, by its dotted path.
///
/// Errors: not TOML (`code`).
#[pyfunction]
pub fn parse_toml(py: Python<'_>, text: &str, path: PathBuf, code: &str) -> PyResult<String> {
    guarded(py, || {
        // Codes of errors are constants of the program.
        let syntax = if code == "D100" { "D100" } else { "S100" };
        let codes = Codes {
            syntax,
            unknown_key: syntax,
            missing_key: syntax,
            wrong_type: syntax,
            unknown_word: syntax,
            other_format: syntax,
            out_of_range: syntax,
        };
        let mut found = Found::new(&path, text, codes);
        let document = found.parse();
        let mut lines = Map::new();
        let value = document.as_ref().map(|document| table(document.get_ref(), "", &found, &mut lines));
        let value = found.diagnostics.into_result(value).map_err(|error| error::input(py, &error))?;
        Ok(json!({ "value": value, "lines": lines }).to_string())
    })
}

fn table(table: &DeTable<'_>, path: &str, found: &Found<'_>, lines: &mut Map<String, Value>) -> Value {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let fields = entries.into_iter().map(|(key, entry)| {
        let name = key.get_ref().to_string();
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        lines.insert(path.clone(), json!(found.place(&key.span()).line));
        (name, value(entry, &path, found, lines))
    });
    Value::Object(fields.collect())
}

fn value(entry: &Spanned<DeValue<'_>>, path: &str, found: &Found<'_>, lines: &mut Map<String, Value>) -> Value {
    match entry.get_ref() {
        DeValue::String(text) => json!(text),
        DeValue::Boolean(flag) => json!(flag),
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).map_or_else(|_| json!(number.as_str()), |n| json!(n))
        }
        DeValue::Float(number) => number.as_str().parse::<f64>().map_or_else(|_| json!(number.as_str()), |n| json!(n)),
        DeValue::Datetime(date) => json!(date.to_string()),
        DeValue::Array(items) => Value::Array(
            items
                .iter()
                .enumerate()
                .map(|(k, item)| {
                    let path = format!("{path}[{k}]");
                    lines.insert(path.clone(), json!(found.place(&item.span()).line));
                    value(item, &path, found, lines)
                })
                .collect(),
        ),
        DeValue::Table(inner) => table(inner, path, found, lines),
    }
}
