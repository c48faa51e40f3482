//! Whatever the file contains, reading it ends with a scene or with diagnostics, never with a panic.

use crate::support::{Folder, GOOD};
use proptest::prelude::*;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::new);

const EXTRA: &str = r#"
[[obstacles]]
name = "wall"
cylinder = { radius = 0.1, length = 0.01 }
position = [0, 0, 0.5]
quat_wxyz = [1, 0, 0, 0]
"#;

/// Values that a key may be given by mistake.
fn value() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        Just("\"automatic\""),
        Just("\"x\""),
        Just("\"hull\""),
        Just("\"hand.toml\""),
        Just("\"cube.obj\""),
        Just("\"../\""),
        Just("nan"),
        Just("-inf"),
        Just("1e999"),
        Just("0"),
        Just("-0.0"),
        Just("1e-300"),
        Just("true"),
        Just("1979-05-27"),
        Just("0xffffffffffffffffffff"),
        Just("{}"),
        Just("[]"),
        Just("[[]]"),
        Just("{ radius = 0.01, length = 1e308 }"),
        Just("{ file = \"cube.obj\", scale = 1e-200 }"),
        Just("{ file = \"open.obj\", origin = [1e300, 0, 0] }"),
        Just("{ contacts = { east = [0, 0, 0] } }"),
        Just("{ joints = { east_abduction = 1 } }"),
        Just("[0, 0, 0, 1]"),
    ]
    .prop_map(str::to_owned);
    let number = any::<f64>().prop_map(|number| format!("{number:?}"));
    let triple = any::<[f64; 3]>().prop_map(|numbers| format!("{numbers:?}"));
    prop_oneof![word, number, triple]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn text_of_any_kind(text in "\\PC*") {
        let _ = FOLDER.load(&text);
    }

    #[test]
    fn a_good_scene_with_values_exchanged(changes in prop::collection::vec((any::<prop::sample::Index>(), value()), 1..4)) {
        let mut lines: Vec<String> = format!("{GOOD}{EXTRA}").lines().map(str::to_owned).collect();
        for (index, value) in changes {
            let line = index.get_mut(&mut lines);
            if let Some((key, _)) = line.clone().split_once('=') {
                *line = format!("{key}= {value}");
            }
        }
        if let Err(error) = FOLDER.load(&lines.join("\n")) {
            prop_assert!(!error.diagnostics.is_empty());
        }
    }

    #[test]
    fn a_good_scene_with_keys_exchanged(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..4)) {
        let good = format!("{GOOD}{EXTRA}");
        let keys: Vec<&str> = good.lines().filter_map(|line| line.split_once('=')).map(|(key, _)| key.trim()).collect();
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        for (index, key) in changes {
            let line = index.get_mut(&mut lines);
            if let Some((_, value)) = line.clone().split_once('=') {
                *line = format!("{} ={value}", key.get(&keys));
            }
        }
        let _ = FOLDER.load(&lines.join("\n"));
    }

    #[test]
    fn a_good_scene_with_bytes_exchanged(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = format!("{GOOD}{EXTRA}").into_bytes();
        for (index, byte) in changes {
            *index.get_mut(&mut bytes) = byte;
        }
        let _ = FOLDER.load(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn contacts_anywhere(point in any::<[f64; 3]>(), shape in prop::sample::select(vec![
        "sphere = { radius = 0.03 }", "box = { size = [0.05, 0.04, 0.03] }", "cylinder = { radius = 0.02, length = 0.1 }",
        "capsule = { radius = 0.02, length = 0.1 }", "ellipsoid = { radii = [0.02, 0.03, 0.04] }", "mesh = { file = \"cube.obj\" }",
    ])) {
        let at = format!("{point:?}");
        let grasp = format!("0.078]\ngrasp = {{ contacts = {{ east = {at}, north = {at}, west = {at}, south = {at} }} }}");
        let text = GOOD.replace("sphere = { radius = 0.032 }", shape).replace("0.078]", &grasp);
        let _ = FOLDER.load(&text);
    }
}
