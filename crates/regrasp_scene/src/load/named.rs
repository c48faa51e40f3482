//! What is named among several.

use regrasp_base::toml_table::{Entry, Found, Table, suggestion};

/// The one of `names` that `key` says; where there is only one it may be left out. Errors: unknown (`S120`), missing (`S102`).
pub(super) fn which(table: &mut Table, key: &'static str, names: &[&str], found: &mut Found) -> Option<usize> {
    let entry: Entry = match names {
        [_] => match table.optional(key) {
            Some(entry) => entry,
            None => return Some(0),
        },
        _ => table.required(found, key, &format!("add {key} = \"{}\"", names[0]))?,
    };
    let name = entry.text(found)?;
    let known = names.iter().position(|known| *known == name);
    if known.is_none() {
        let problem =
            format!("is \"{name}\", which the scene does not have{}", suggestion(name, names.iter().copied()));
        found.diagnostics.push(entry.error("S120", found, problem).expected(names.join(", ")));
    }
    known
}
