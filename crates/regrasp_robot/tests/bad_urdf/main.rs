//! Every bad robot file is refused with its message: code, line, element, value, what was expected, the fix.

use regrasp_robot::{LoadOptions, load_robot};
use std::fs;

/// A tetrahedron.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// The messages for `text` as `hand.urdf`, with the folder left out.
fn messages(text: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join("box.obj"), OBJ).unwrap();
    let error = load_robot(&path, &LoadOptions::default()).expect_err("the file is bad");
    let prefix = format!("{}/", folder.path().display());
    error
        .diagnostics
        .iter()
        .map(|d| d.to_string().replace(&prefix, "").replace(prefix.trim_end_matches('/'), "."))
        .collect()
}

macro_rules! refused {
    ($name:ident, $text:expr, [$($message:expr),* $(,)?]) => {
        #[test]
        fn $name() {
            let expected: Vec<&str> = vec![$($message),*];
            assert_eq!(messages($text), expected);
        }
    };
}

mod joints;
mod tree;
mod values;
mod whole_files;
