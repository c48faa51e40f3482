//! Writes the bulb of `scenes/bulb.toml` to stdout: a surface of revolution as OBJ, in metres, axis z, origin at the
//! middle of the globe. `cargo run -p regrasp_scene --example bulb_mesh > assets/objects/bulb.obj`

use std::fmt::Write as _;
use std::io::Write as _;

/// Vertices around the axis.
const AROUND: usize = 24;
/// Radius of the globe, in metres.
const GLOBE: f64 = 0.024;
/// Radius of the screw, in metres.
const SCREW: f64 = 0.009;
/// Height above the middle of the globe at which the screw begins, in metres.
const SCREW_BEGINS: f64 = 0.030;
/// Height at which it ends, in metres.
const SCREW_ENDS: f64 = 0.050;
/// Height and radius of the contact at its end, in metres.
const CONTACT: (f64, f64) = (0.053, 0.004);

fn main() {
    std::io::stdout().write_all(obj().as_bytes()).expect("stdout takes text");
}

/// The outline from the bottom pole to the top one, as (height, radius); both poles are left out.
fn outline() -> Vec<(f64, f64)> {
    // Globe up to where its tangent meets the edge of the screw.
    let reach = SCREW_BEGINS.hypot(SCREW);
    let neck = SCREW.atan2(SCREW_BEGINS) + (GLOBE / reach).acos();
    let n_rings = 10;
    let mut outline: Vec<(f64, f64)> = (1..=n_rings)
        .map(|ring| {
            let from_bottom = (std::f64::consts::PI - neck) * ring as f64 / n_rings as f64;
            (-GLOBE * from_bottom.cos(), GLOBE * from_bottom.sin())
        })
        .collect();
    outline.extend([(SCREW_BEGINS, SCREW), (SCREW_ENDS, SCREW), CONTACT]);
    outline
}

/// The mesh as text: triangles wound so that normals point outwards.
pub fn obj() -> String {
    let outline = outline();
    let mut text = String::from("# Written by crates/regrasp_scene/examples/bulb_mesh.rs\n");
    let mut vertex = |x: f64, y: f64, z: f64| {
        let _ = writeln!(text, "v {x:.7} {y:.7} {z:.7}");
    };
    vertex(0.0, 0.0, -GLOBE);
    for &(height, radius) in &outline {
        for k in 0..AROUND {
            let angle = std::f64::consts::TAU * k as f64 / AROUND as f64;
            vertex(radius * angle.cos(), radius * angle.sin(), height);
        }
    }
    vertex(0.0, 0.0, CONTACT.0);
    // OBJ counts from 1: the bottom pole, rings upwards, the top pole.
    let at = |ring: usize, k: usize| 2 + ring * AROUND + k % AROUND;
    let (bottom, top) = (1, 2 + outline.len() * AROUND);
    for k in 0..AROUND {
        let _ = writeln!(text, "f {bottom} {} {}", at(0, k + 1), at(0, k));
        for ring in 0..outline.len() - 1 {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            let _ = writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}");
        }
        let _ = writeln!(text, "f {top} {} {}", at(outline.len() - 1, k), at(outline.len() - 1, k + 1));
    }
    text
}
