//! Texts and numbers as YAML.

use std::fmt::Write;

/// A flow sequence of numbers.
pub(crate) fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|&value| number(value)).collect();
    format!("[{}]", values.join(", "))
}

/// The shortest decimal that reads back to the same double, in a form that YAML 1.1 takes for a number: with a point, and a
/// sign in the exponent.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e15).contains(&value.abs()) {
        return format!("{value:?}");
    }
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// A double-quoted YAML scalar: escapes are those of JSON.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if (c as u32) < 0x20
                || ('\u{7f}'..='\u{a0}').contains(&c)
                || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}') =>
            {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_numbers_in_yaml_too() {
        let shown = [0.0, -0.0, 1.0, 0.25, -1.5e-7, 1e-5, 1e16, 123456.789].map(number);
        assert_eq!(shown, ["0.0", "-0.0", "1.0", "0.25", "-1.5e-7", "1.0e-5", "1.0e+16", "123456.789"]);
    }

    #[test]
    fn names_cannot_break_out_of_their_quotes() {
        assert_eq!(quoted("a\"\\\n\u{85}b"), r#""a\"\\\u000a\u0085b""#);
    }
}
