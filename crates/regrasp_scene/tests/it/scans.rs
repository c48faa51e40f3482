//! Meshes as they come: their unit, their size, their creases, their holes.

use crate::support::{Folder, GOOD, cube, shared_models, with_models};
use regrasp_base::Rng;
use regrasp_scene::load_scene;

const SPHERE: &str = "sphere = { radius = 0.032 }";

fn with(mesh: &str) -> String {
    assert!(GOOD.contains(SPHERE));
    GOOD.replace(SPHERE, mesh)
}

/// A closed ball of 30 mm in 24 x 48 quads whose vertices go in and out by `depth`.
fn rough_ball(depth: f64) -> String {
    let (rows, around) = (24, 48);
    let mut text = String::new();
    let mut rng = Rng::keyed(1, "rough", 0);
    for i in 0..=rows {
        for k in 0..around {
            let polar = f64::from(i) / f64::from(rows) * std::f64::consts::PI;
            let (sin, cos) = (f64::from(k) / f64::from(around) * std::f64::consts::TAU).sin_cos();
            let is_pole = i == 0 || i == rows;
            let radius = 0.03 + if is_pole { 0.0 } else { depth * rng.unit() };
            let flat = if is_pole { 0.0 } else { radius * polar.sin() };
            text += &format!("v {} {} {}\n", flat * cos, flat * sin, radius * polar.cos());
        }
    }
    let at = |i: i32, k: i32| 1 + i * around + k % around;
    for i in 0..rows {
        for k in 0..around {
            let (a, b, c, d) = (at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1));
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    text
}

#[test]
fn edges_of_scans_may_be_touched_and_edges_of_boxes_not() {
    let folder = Folder::new();
    folder.write("rough.obj", &rough_ball(0.003));
    folder.write("smooth.obj", &rough_ball(0.0));
    let distance = |mesh: &str| {
        let loaded = folder.load(&with(mesh)).unwrap();
        let is_told = loaded.notes.iter().any(|note| note.contains("edge_distance = 0.004 keeps contacts off edges"));
        (loaded.scene.objects[0].edge_distance, is_told)
    };
    assert_eq!(distance("mesh = { file = \"rough.obj\" }"), (0.0, true));
    assert_eq!(distance("mesh = { file = \"rough.obj\" }\nedge_distance = 0.003"), (0.003, false));
    assert_eq!(distance("mesh = { file = \"smooth.obj\" }"), (0.004, false));
    assert_eq!(distance("mesh = { file = \"cube.obj\" }"), (0.004, false));
    assert_eq!(distance("box = { size = [0.05, 0.05, 0.05] }"), (0.004, false));
}

/// A tip that is a point has no normal of its own on an edge.
#[test]
fn sharp_tips_keep_off_the_edges_of_scans() {
    let folder = Folder::new();
    folder.write("rough.obj", &rough_ball(0.003));
    let sharp = with("mesh = { file = \"rough.obj\" }");
    let hand = sharp.lines().find(|line| line.starts_with("file = ")).unwrap().split('"').nth(1).unwrap().to_owned();
    folder.edit(&hand, |text| {
        text.replace("shape = \"sphere\", radius = 0.005, ", "shape = \"point\", ")
            .replace("center = [0, 0, 0]", "position = [0, 0, 0]")
    });
    let loaded = folder.load(&sharp).unwrap();
    assert!(loaded.scene.hands[0].hand.fingers.iter().any(|finger| finger.tip.radius() == 0.0));
    assert_eq!(loaded.scene.objects[0].edge_distance, 0.004);
}

#[test]
fn a_mesh_is_fitted_by_its_middle_extent() {
    let folder = Folder::new();
    folder.write("brick.obj", &stretched(&cube(10.0, 12), [1.0, 3.0, 2.0]));
    let loaded = folder.load(&with("mesh = { file = \"brick.obj\", scale = \"fit:0.05\" }")).unwrap();
    let (low, high) = loaded.scene.objects[0].shape.bounds();
    assert!((high - low - nalgebra::Vector3::new(0.025, 0.075, 0.05)).norm() < 1e-12);
    assert!(loaded.notes.iter().any(|note| note.contains("fitted by the factor 0.00125")), "{:?}", loaded.notes);
    for bad in ["fit:", "fit:-1", "fit:50", "fill:0.06", "fit:nan"] {
        let messages = folder.messages(&with(&format!("mesh = {{ file = \"brick.obj\", scale = \"{bad}\" }}")));
        assert!(messages.contains("S104") && messages.contains("\"fit:0.06\""), "{messages}");
    }
}

fn stretched(obj: &str, factors: [f64; 3]) -> String {
    let vertex = |line: &str| {
        let numbers = line.split(' ').skip(1).zip(factors).map(|(x, factor)| x.parse::<f64>().unwrap() * factor);
        format!("v {}\n", numbers.map(|x| x.to_string()).collect::<Vec<_>>().join(" "))
    };
    obj.lines().map(|line| if line.starts_with("v ") { vertex(line) } else { format!("{line}\n") }).collect()
}

/// A brick of 30 x 60 x 90 mm in other units: the message has the unit, and the line to paste mends it.
#[test]
fn the_unit_of_a_mesh_is_named_with_the_line_that_mends_it() {
    let folder = Folder::new();
    for (unit, per_metre) in
        [("millimetres", 1000.0), ("centimetres", 100.0), ("inches", 1.0 / 0.0254), ("decimetres", 10.0)]
    {
        folder.write("brick.obj", &stretched(&cube(0.015 * per_metre, 12), [1.0, 2.0, 3.0]));
        let text = with("mesh = { file = \"brick.obj\", origin = \"center\" }");
        let said = match folder.load(&text) {
            Ok(loaded) => loaded.notes.join("\n"),
            Err(_) => folder.messages(&text),
        };
        assert!(said.contains(&format!("probably in {unit}")), "{unit}: {said}");
        let line = said.split("mesh = {").nth(1).unwrap().split('}').next().unwrap();
        let mended = folder.load(&with(&format!("mesh = {{{line}}}"))).unwrap();
        let (low, high) = mended.scene.objects[0].shape.bounds();
        assert!((high - low - nalgebra::Vector3::new(0.03, 0.06, 0.09)).norm() < 1e-6, "{unit}: {line}");
        assert!(!mended.notes.iter().any(|note| note.contains("probably")), "{:?}", mended.notes);
    }
}

/// Scans load as they are: with four triangles at an edge, and with a hole.
#[test]
fn shared_scans_are_solids() {
    let Some(models) = shared_models() else { return };
    let folder = Folder::new();
    for (file, edge_distance) in [
        ("ycb_025_mug/mesh.obj", 0.0),
        ("ycb_035_power_drill/mesh.obj", 0.0),
        ("ycb_006_mustard_bottle/mesh.obj", 0.0),
        ("gso_Breyer_Horse_Of_The_Year_2015/mesh.obj", 0.0),
        ("robosuite_small/bottle.stl", 0.004),
    ] {
        let mesh = format!(
            "mesh = {{ file = \"package://models/objects/{file}\", scale = \"fit:0.06\", origin = \"center\" }}"
        );
        folder.write("scene.toml", &with(&mesh));
        let loaded = load_scene(&folder.path("scene.toml"), &with_models(&models)).unwrap();
        assert_eq!(loaded.scene.objects[0].edge_distance, edge_distance, "{file}");
        assert!(!loaded.notes.iter().any(|note| note.contains("probably")), "{:?}", loaded.notes);
    }
}
