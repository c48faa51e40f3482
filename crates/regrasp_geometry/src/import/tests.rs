//! Readers on good files, on each kind of bad file, and on random bytes.

use super::*;
use crate::Vector;
use proptest::prelude::*;

const TETRAHEDRON: [[[f32; 3]; 3]; 4] = [
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
];

fn binary(header: &str, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..header.len()].copy_from_slice(header.as_bytes());
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        // Normals are NaN on purpose: they are not used.
        bytes.extend([f32::NAN; 3].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn ascii() -> String {
    let mut text = String::from("solid two words facet\n");
    for corners in TETRAHEDRON {
        text += "  facet normal nan 0 0\n    outer loop\n";
        for [x, y, z] in corners {
            text += &format!("      vertex {x} {y:e} {z}\n");
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid two words\n"
}

const OBJ: &str = "# a tetrahedron\nmtllib ../../missing.mtl\no t\nv 0 0 0\nv 1 0 0 # one\nv 0 1 0\nv 0 0 1 1.0\n\
    vt 0 0\nvn 0 0 1\ng a\nusemtl x\ns off\nf 1/1/1 3//1 2\nf 1 2 \\\n 4\nf -4 -1 -2\nf 2/1 3/1 4/1\nl 1 2\n";

fn stl(bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    read_mesh(Path::new("a.StL"), bytes)
}

fn obj(text: &str) -> Result<TriangleMesh, InputError> {
    read_mesh(Path::new("a.OBJ"), text.as_bytes())
}

/// Code and line of each fault.
fn faults(result: Result<TriangleMesh, InputError>) -> Vec<(&'static str, Option<u32>)> {
    result.expect_err("a fault").diagnostics.iter().map(|d| (d.code, d.place.line)).collect()
}

#[test]
fn every_dialect_gives_the_tetrahedron() {
    let upper = ascii().to_uppercase().replace("NAN", "NaN").replace('\n', "\r\n");
    let one_line = ascii().replacen('\n', "#", 1).replace('\n', " ").replace('#', "\n");
    let mut trailing = binary("solid", &TETRAHEDRON);
    trailing.extend([7; 20]);
    let meshes = [
        stl(&binary("made by hand", &TETRAHEDRON)),
        stl(&binary("solid but binary", &TETRAHEDRON)),
        stl(&trailing),
        stl(ascii().as_bytes()),
        stl(upper.as_bytes()),
        stl(one_line.as_bytes()),
        stl(format!("\u{feff}{}", ascii()).as_bytes()),
        obj(OBJ),
        obj(&OBJ.replace('\n', "\r\n")),
        obj(&OBJ.replace('\n', "\r")),
        stl(ascii().replace('\n', "\r").as_bytes()),
        obj(&format!("\u{feff}{OBJ}")),
    ];
    for (i, mesh) in meshes.into_iter().enumerate() {
        let mesh = mesh.unwrap_or_else(|error| panic!("dialect {i}: {error}"));
        assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (4, 4), "dialect {i}");
        assert!(mesh.statistics().is_watertight());
        assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-12, "dialect {i}: {}", mesh.signed_volume());
    }
}

#[test]
fn faulty_stl_is_refused_with_its_place() {
    let whole = binary("x", &TETRAHEDRON);
    assert_eq!(faults(stl(b"")), [("M202", None)]);
    assert_eq!(faults(stl(b"PK\x03\x04")), [("M230", None)]);
    assert_eq!(faults(stl(&whole[..whole.len() - 1])), [("M230", None)]);
    assert_eq!(faults(stl(&[whole.clone(), vec![0; 50]].concat())), [("M230", None)]);
    assert_eq!(faults(stl(&binary("x", &[]))), [("M202", None)]);
    let mut claims = whole.clone();
    claims[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let message = stl(&claims).unwrap_err().to_string();
    assert!(message.contains("header says 4294967295 triangles, file has room for 4"), "{message}");
    let mut bad = TETRAHEDRON;
    bad[2][1][0] = f32::NAN;
    let message = stl(&binary("x", &bad)).unwrap_err().to_string();
    assert!(message.starts_with("M203") && message.contains("triangle 3 (byte 184)"), "{message}");

    assert_eq!(faults(stl(ascii().replacen("vertex 0 0e0 0", "vertex 0 0,5 0", 1).as_bytes())), [("M231", Some(4))]);
    assert_eq!(faults(stl(ascii().replacen("vertex 0 0e0 0", "vertex 0 inf 0", 1).as_bytes())), [("M203", Some(4))]);
    assert_eq!(faults(stl(ascii().replacen("vertex 0 0e0 0\n", "\n", 1).as_bytes())), [("M231", Some(7))]);
    assert_eq!(faults(stl(ascii().replacen("endloop", "vertex 1 1 1\nendloop", 1).as_bytes())), [("M231", Some(7))]);
    assert_eq!(faults(stl(ascii().replacen("outer loop", "inner loop", 1).as_bytes())), [("M231", Some(3))]);
    let text = ascii();
    assert_eq!(faults(stl(&text.as_bytes()[..text.len() - 25])).len(), 1);
    assert_eq!(faults(stl(b"solid nothing\nendsolid\n")), [("M202", None)]);
    assert_eq!(faults(stl(b"\xff\xfes\0o\0l\0i\0d\0")), [("M204", None)]);
    assert_eq!(faults(read_mesh(Path::new("a.3ds"), b"<x/>")), [("M200", None)]);
}

#[test]
fn lines_are_counted_whatever_ends_them() {
    for end in ["\n", "\r", "\r\n"] {
        let text = ["v 0 0 0", "", "v 1 0 0", "v 0 1 0", "f 1 2 9"].join(end);
        assert_eq!(faults(obj(&text)), [("M241", Some(5))], "{end:?}");
    }
}

#[test]
fn numbers_in_messages_are_as_written() {
    for seen in ["1e309", "-1e999", "inf"] {
        let message = obj(&format!("v {seen} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).unwrap_err().to_string();
        assert!(message.contains(&format!("the coordinate {seen};")) && message.len() < 100, "{message}");
    }
}

#[test]
fn meshes_of_too_many_triangles_are_refused_before_they_are_read() {
    let mut bytes = vec![0; 84 + 50 * (MAX_TRIANGLES + 1)];
    bytes[80..84].copy_from_slice(&(MAX_TRIANGLES as u32 + 1).to_le_bytes());
    assert_eq!(faults(stl(&bytes)), [("M220", None)]);
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(MAX_TRIANGLES + 1));
    assert_eq!(faults(obj(&text)), [("M220", None)]);
    assert_eq!(MAX_TRIANGLES, 1_500_000, "docs/reference/scene-format.md says so");
}

#[test]
fn faulty_obj_is_refused_with_its_place_and_all_faults_at_once() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\nf 1 2 4\nf -1 -2 -4\nf 1 two 3\nv 1 0,5 0\nv 1 2\nv nan 0 0\nf 1 2 \\\n9\n";
    let mut found = faults(obj(text));
    found.sort_unstable_by_key(|fault| fault.1);
    assert_eq!(
        found,
        [
            ("M241", Some(4)),
            ("M241", Some(6)),
            ("M240", Some(7)),
            ("M240", Some(8)),
            ("M240", Some(9)),
            ("M203", Some(10)),
            ("M241", Some(11))
        ]
    );
    assert_eq!(faults(obj("v 0 0 0\nv 1 0 0\nf 1 2\n")), [("M240", Some(3)), ("M202", None)][..1]);
    assert_eq!(faults(obj("v 0 0 0\n")), [("M202", None)]);
    assert_eq!(faults(obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")), [("M202", None)]);
    assert_eq!(faults(obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n")), [("M240", Some(4))]);
    let many = format!("v 0 0 0\n{}", "f 0 0 0\n".repeat(100));
    let found = faults(obj(&many));
    assert_eq!(found.len(), regrasp_base::diagnostic::MAX_DIAGNOSTICS);
}

#[test]
fn polygons_keep_their_area() {
    let mut rng = regrasp_base::Rng::keyed(1, "polygon", 0);
    for n in [4, 5, 8, 40, 300] {
        for round in 0..20 {
            // A star-shaped polygon (concave unless `round` is 0), in a plane of its own.
            let pose =
                crate::Pose::new(Vector::new(0.1, 0.2, 0.3), Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
            let mut text = String::new();
            let mut area = 0.0;
            let radii: Vec<f64> = (0..n).map(|_| if round == 0 { 1.0 } else { rng.uniform(0.2, 1.0) }).collect();
            for i in 0..n {
                let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
                let p = pose * Point::new(radii[i] * angle(i).cos(), radii[i] * angle(i).sin(), 0.0);
                text += &format!("v {} {} {}\n", p.x, p.y, p.z);
                area += 0.5 * radii[i] * radii[(i + 1) % n] * angle(1).sin();
            }
            text += "f";
            (1..=n).for_each(|i| text += &format!(" {i}"));
            let mesh = obj(&text).unwrap();
            let normal = pose * Vector::z();
            let mut sum = 0.0;
            for i in 0..mesh.triangles().len() {
                let [a, b, c] = mesh.corners(i);
                let piece = 0.5 * (b - a).cross(&(c - a)).dot(&normal);
                assert!(piece > -1e-12, "wound the wrong way");
                sum += piece;
            }
            assert!((sum - area).abs() < 1e-9, "{n} corners: {sum} {area}");
        }
    }
}

#[test]
fn too_many_triangles_are_refused_before_they_are_stored() {
    let corners = " 1 2 3".repeat(MAX_TRIANGLES / 3 + 2);
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{corners}\n");
    assert_eq!(faults(obj(&text)), [("M220", None)]);
    let concave = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.1 0.1 0\nf{}\n", " 1 2 4 3".repeat(5_000));
    assert_eq!(faults(obj(&concave)), [("M240", Some(5))]);
}

/// `bytes` with a few bytes overwritten, a piece cut out and a piece doubled.
fn mutated(bytes: Vec<u8>, edits: Vec<(usize, u8)>, cut: (usize, usize), double: (usize, usize)) -> Vec<u8> {
    let mut bytes = bytes;
    for (at, value) in edits {
        let n = bytes.len();
        bytes[at % n] = value;
    }
    let range = |(from, length): (usize, usize), n: usize| from % n..(from % n + length % 60).min(n);
    let doubled = bytes[range(double, bytes.len())].to_vec();
    bytes.extend(doubled);
    let cut = range(cut, bytes.len());
    bytes.drain(cut);
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_stl(Path::new("x.stl"), &bytes);
        let _ = read_obj(Path::new("x.obj"), &bytes);
    }

    #[test]
    fn mutated_files_never_panic(
        kind in 0..3usize,
        edits in proptest::collection::vec((any::<usize>(), prop_oneof![any::<u8>(), Just(b' '), Just(b'-'), Just(b'\\'), Just(b'9'), Just(b'\n')]), 0..6),
        cut in (any::<usize>(), any::<usize>()),
        double in (any::<usize>(), any::<usize>()),
    ) {
        let original = [binary("solid x", &TETRAHEDRON), ascii().into_bytes(), OBJ.as_bytes().to_vec()][kind].clone();
        let bytes = mutated(original, edits, cut, double);
        let _ = read_stl(Path::new("x.stl"), &bytes);
        let _ = read_obj(Path::new("x.obj"), &bytes);
    }
}
