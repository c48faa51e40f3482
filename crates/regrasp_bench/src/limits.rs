//! Times within which scenes should be solved: a JSON file, `{ "scene": seconds, ... }`.

use regrasp_base::{Diagnostic, InputError, Place};
use std::collections::BTreeMap;
use std::path::Path;

/// Seconds by scene; scenes that are not named have no limit.
pub type Limits = BTreeMap<String, f64>;

/// Reads a file of limits. Errors: unreadable (`F00x`), not such an object (`V022`), a limit that is not above zero (`V023`).
pub fn read(path: &Path) -> Result<Limits, InputError> {
    let text = regrasp_base::files::read_text(path)?;
    let limits: Limits = serde_json::from_str(&text).map_err(|error| {
        let place = Place {
            file: path.to_owned(),
            line: Some(error.line() as u32),
            column: Some(error.column().max(1) as u32),
        };
        let message = error.to_string();
        // serde_json repeats the place at the end of its message.
        let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem);
        Diagnostic::new("V022", place, problem).expected("an object of seconds by scene: { \"sphere32_x\": 1 }")
    })?;
    match limits.iter().find(|(_, limit)| !(**limit > 0.0)) {
        None => Ok(limits),
        Some((scene, limit)) => Err(Diagnostic::new("V023", Place::file(path), format!("is {limit}"))
            .element("scene", scene)
            .expected("seconds above 0")
            .into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_and_nonsense_is_refused_with_its_place() {
        let path = std::env::temp_dir().join(format!("regrasp_limits_{}.json", std::process::id()));
        let of = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read(&path).map_err(|error| error.diagnostics[0].clone())
        };
        assert_eq!(of("{ \"a\": 1, \"b\": 0.5 }").unwrap(), Limits::from([("a".into(), 1.0), ("b".into(), 0.5)]));
        let wrong = of("{ \"a\": 1,\n \"b\": \"2 s\" }").unwrap_err();
        assert_eq!((wrong.code, wrong.place.line), ("V022", Some(2)), "{wrong}");
        let zero = of("{ \"a\": 0 }").unwrap_err();
        assert_eq!((zero.code, zero.element.as_str()), ("V023", "scene \"a\""), "{zero}");
        std::fs::remove_file(&path).unwrap();
    }
}
