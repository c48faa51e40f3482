//! Fingertips that `inspect` writes for the shared hands, and what is said of tips that their links stand out of.

#[path = "../../../tests/support/places.rs"]
mod places;

use places::shared_models;
use regrasp_base::Rng;
use regrasp_robot::inspect::{InspectSettings, hand_file_text, inspect, tip_report};
use regrasp_robot::tip::{LARGEST_MISFIT, TipShape};
use regrasp_robot::{Hand, LoadOptions, load_hand};
use std::fs;
use std::path::Path;

/// The file that `inspect` writes for a URDF, with absolute paths.
fn written(urdf: &Path) -> String {
    let settings = InspectSettings { n_postures: 20 };
    let found = inspect(urdf, &LoadOptions::default(), &settings, &mut Rng::keyed(0, "inspect", 0)).unwrap();
    let (hand, table) = found.hand.unwrap();
    hand_file_text(&hand, &urdf.to_string_lossy(), &table.pairs.always_ids)
}

fn loaded(text: &str) -> Hand {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.toml");
    fs::write(&path, text).unwrap();
    load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}\n{text}")).hand
}

#[test]
fn every_tip_that_inspect_writes_is_the_geometry_of_its_link() {
    let Some(models) = shared_models() else { return };
    for (urdf, shape) in [
        ("allegro/allegro_right", "ball"),
        ("barrett/barrett", "smooth hull"),
        ("dclaw/dclaw", "ball"),
        ("leap/leap_left", "smooth hull"),
        ("leap/leap_right", "smooth hull"),
        ("shadow/shadow_right", "smooth hull"),
        ("trifingeredu/trifingeredu", "smooth hull"),
        ("trifingerpro/trifingerpro", "ball"),
    ] {
        let hand = loaded(&written(&models.join(format!("hands/{urdf}.urdf"))));
        for finger in &hand.fingers {
            let report = tip_report(&hand, finger);
            assert_eq!(report.surface, shape, "{urdf} {}", finger.name);
            assert!(report.error.is_some_and(|error| error <= LARGEST_MISFIT), "{urdf} {}: {report:?}", finger.name);
            assert!(report.stands_out.is_empty(), "{urdf} {}: {report:?}", finger.name);
        }
    }
}

#[test]
fn what_stands_out_of_a_ball_is_told_with_faces_and_distance() {
    let Some(models) = shared_models() else { return };
    let text = written(&models.join("hands/leap/leap_right.urdf"));
    let with_ball = |radius: f64| {
        let ball = format!("tip = {{ shape = \"sphere\", radius = {radius:?}, center = [-0.0008, -0.0365, 0.0145] }}");
        let lines: Vec<&str> = text.lines().map(|line| if line.starts_with("tip = ") { &ball } else { line }).collect();
        let hand = loaded(&lines.join("\n"));
        tip_report(&hand, &hand.fingers[0])
    };
    // The bar's corners are 17 mm from there; a ball of 30 mm holds the link.
    let small = with_ball(0.0135);
    assert!(small.error.is_some_and(|error| error > 1e-3));
    let worst = small.stands_out.iter().find(|one| one.element == 3).unwrap();
    assert!(worst.by > 1e-3 && worst.by < 6e-3 && worst.n_faces > 100, "{worst:?}");
    assert!(with_ball(0.03).stands_out.is_empty());
}

#[test]
fn a_tip_may_be_one_collision_element_of_its_link() {
    let Some(models) = shared_models() else { return };
    let text = written(&models.join("hands/leap/leap_right.urdf"));
    let hand = loaded(&text);
    let shapes = |hand: &Hand| {
        let finger = &hand.fingers[0];
        let of_link = finger.shapes.iter().filter(|shape| shape.link == finger.tip.link);
        of_link.map(|shape| shape.is_tip).collect::<Vec<bool>>()
    };
    assert_eq!(shapes(&hand), [false, false, false, true]);
    let all = loaded(&text.replace(", collision = [3]", ""));
    assert_eq!(shapes(&all), [true; 4]);
    let (TipShape::Hull { hull: one, .. }, TipShape::Hull { hull: whole, .. }) =
        (&hand.fingers[0].tip.shape, &all.fingers[0].tip.shape)
    else {
        panic!("hulls")
    };
    assert_ne!(one.vertices().len(), whole.vertices().len());
}
