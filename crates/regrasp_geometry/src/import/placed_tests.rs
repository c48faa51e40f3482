//! PLY, COLLADA and binary glTF: every dialect of one tetrahedron, each kind of bad file, and random bytes.

use super::*;
use proptest::prelude::*;

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn read(name: &str, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    read_mesh(Path::new(name), bytes)
}

/// Code and line of each fault.
fn faults(result: Result<TriangleMesh, InputError>) -> Vec<(&'static str, Option<u32>)> {
    result.expect_err("a fault").diagnostics.iter().map(|d| (d.code, d.place.line)).collect()
}

fn is_the_tetrahedron(name: &str, bytes: &[u8], scale: f64) {
    let mesh = read(name, bytes).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (4, 4));
    assert!(mesh.statistics().is_watertight());
    let volume = scale.powi(3) / 6.0;
    assert!((mesh.signed_volume() - volume).abs() < 1e-7 * volume, "{} {volume}", mesh.signed_volume());
}

/// A PLY file with colours and an element that nobody needs, its numbers written by `put`.
fn ply(format: &str, text: bool, put: impl Fn(&mut Vec<u8>, &str, f64)) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment by hand\nobj_info none\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty double y\nproperty float32 z\n\
         property list uchar short tags\nelement edge 1\nproperty int vertex1\nproperty uint vertex2\nelement face 4\nproperty list uchar int vertex_indices\n\
         property int8 group\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    let end_line = |bytes: &mut Vec<u8>| {
        if text {
            bytes.push(b'\n')
        }
    };
    for [x, y, z] in CORNERS {
        for (kind, value) in
            [("u8", 255.0), ("f32", x.into()), ("f64", y.into()), ("f32", z.into()), ("u8", 1.0), ("i16", -7.0)]
        {
            put(&mut bytes, kind, value);
        }
        end_line(&mut bytes);
    }
    put(&mut bytes, "i32", 0.0);
    put(&mut bytes, "u32", 1.0);
    end_line(&mut bytes);
    for [a, b, c] in FACES {
        for (kind, value) in [("u8", 3.0), ("i32", a.into()), ("i32", b.into()), ("i32", c.into()), ("i8", -1.0)] {
            put(&mut bytes, kind, value);
        }
        end_line(&mut bytes);
    }
    bytes
}

fn text_ply() -> String {
    let put = |bytes: &mut Vec<u8>, _: &str, value: f64| bytes.extend(format!("{value} ").bytes());
    String::from_utf8(ply("ascii", true, put)).unwrap()
}

fn binary_ply(is_big: bool) -> Vec<u8> {
    let put = |bytes: &mut Vec<u8>, kind: &str, value: f64| {
        macro_rules! put {
            ($number:ty) => {
                if is_big {
                    bytes.extend((value as $number).to_be_bytes())
                } else {
                    bytes.extend((value as $number).to_le_bytes())
                }
            };
        }
        match kind {
            "u8" => put!(u8),
            "i8" => put!(i8),
            "i16" => put!(i16),
            "i32" => put!(i32),
            "u32" => put!(u32),
            "f32" => put!(f32),
            _ => put!(f64),
        }
    };
    ply(if is_big { "binary_big_endian" } else { "binary_little_endian" }, false, put)
}

#[test]
fn every_dialect_of_ply_gives_the_tetrahedron() {
    let text = text_ply();
    is_the_tetrahedron("a.ply", text.as_bytes(), 1.0);
    is_the_tetrahedron("a.PLY", text.replace('\n', "\r\n").as_bytes(), 1.0);
    is_the_tetrahedron("a.ply", text.replace("vertex_indices", "vertex_index").as_bytes(), 1.0);
    for is_big in [false, true] {
        is_the_tetrahedron("a.ply", &binary_ply(is_big), 1.0);
    }
    is_the_tetrahedron("a.ply", format!("\u{feff}{text}").as_bytes(), 1.0);
    is_the_tetrahedron("a.ply", text.replace("float x", "float X").as_bytes(), 1.0);
    // What is not needed may be anything, and so may vertices that no face names.
    is_the_tetrahedron("a.ply", text.replacen("255 1 0 0 1 -7", "-nan(ind) 1 0 0 1 ?", 1).as_bytes(), 1.0);
    let more = text.replace("vertex 4", "vertex 5").replacen("\n0 1 \n", "\n255 nan inf 0 0 \n0 1 \n", 1);
    is_the_tetrahedron("a.ply", more.as_bytes(), 1.0);
    // Carriage returns alone, and a body that begins with the byte of a line feed.
    let mut returns = binary_ply(false);
    let body = returns.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    returns[..body].iter_mut().filter(|byte| **byte == b'\n').for_each(|byte| *byte = b'\r');
    returns[body] = b'\n';
    is_the_tetrahedron("a.ply", &returns, 1.0);
    // Faces of four corners and more are cut.
    let pyramid = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 5\n\
        property list uchar uint vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n.5 .5 1\n4 0 3 2 1\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
    let mesh = read("a.ply", pyramid.as_bytes()).unwrap();
    assert_eq!((mesh.triangles().len(), mesh.statistics().is_watertight()), (6, true));
    assert!((mesh.signed_volume() - 1.0 / 3.0).abs() < 1e-12);
}

#[test]
fn faulty_ply_is_refused_with_its_place() {
    let text = text_ply();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        faults(read("a.ply", text.replacen(from, to, 1).as_bytes()))
    };
    assert_eq!(faults(read("a.ply", b"")), [("M202", None)]);
    assert_eq!(faults(read("a.ply", b"solid x")), [("M250", Some(1))]);
    assert_eq!(with("format ascii", "format utf8"), [("M250", Some(2))]);
    assert_eq!(with("format ascii 1.0\n", ""), [("M250", Some(16))]);
    assert_eq!(with("property float x", "property real x"), [("M250", Some(7))]);
    assert_eq!(with("property float x", "property float s"), [("M250", Some(5))]);
    assert_eq!(with("element vertex 4", "element vertex four"), [("M250", Some(5))]);
    assert_eq!(with("element face 4", "element face 4000000000"), [("M250", Some(14))]);
    assert_eq!(with("property list uchar int vertex_indices", "property int vertex_indices"), [("M250", Some(14))]);
    assert_eq!(with("end_header", "end"), [("M250", Some(17))]);
    assert_eq!(with("comment", "commend"), [("M250", Some(3))]);
    assert_eq!(with("255 1 0 0 1", "255 1 0,5 0 1"), [("M250", Some(19))]);
    assert_eq!(with("255 1 0 0 1", "255 nan 0 0 1"), [("M203", None)]);
    assert_eq!(with("3 0 2 1 ", "3 0 2 4 "), [("M241", Some(23))]);
    assert_eq!(with("3 0 2 1 ", "3 0 2 -1 "), [("M241", Some(23))]);
    assert_eq!(with("3 0 2 1 -1", "2 0 2 -1"), [("M250", Some(23))]);
    assert_eq!(faults(read("a.ply", &text.as_bytes()[..text.len() - 12])), [("M250", Some(26))]);
    let binary = binary_ply(false);
    assert_eq!(faults(read("a.ply", &binary[..binary.len() - 1])), [("M250", None)]);
    assert_eq!(with("element face 4", "element tristrips 4"), [("M250", Some(14))]);
    let (vertex, face) = (text.find("element vertex").unwrap(), text.find("element face").unwrap());
    let end = text.find("end_header").unwrap();
    let turned = [&text[..vertex], &text[face..end], &text[vertex..face], &text[end..]].concat();
    assert_eq!(faults(read("a.ply", turned.as_bytes())), [("M250", Some(5))]);
    // Polygons that cross themselves are cut for a while, and then refused.
    let n = 2_000;
    let star: String = (0..n)
        .map(|k| {
            (1.0 + 0.3 * (f64::from(k) * 12.9898).sin(), (std::f64::consts::TAU * f64::from(k * 999) / f64::from(n)))
        })
        .map(|(radius, angle)| format!("{} {} 0\n", radius * angle.cos(), radius * angle.sin()))
        .collect();
    let corners: String = (0..n).map(|k| format!(" {k}")).collect();
    let face = format!("{n}{corners}\n").repeat(30);
    let stars = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\nelement face 30\n\
         property list ushort ushort vertex_indices\nend_header\n{star}{face}"
    );
    let found = faults(read("a.ply", stars.as_bytes()));
    assert!(found.iter().all(|(code, _)| *code == "M250") && !found.is_empty(), "{found:?}");
    let no_faces =
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert_eq!(faults(read("a.ply", no_faces.as_bytes())), [("M202", None)]);
    let many = format!("element vertex {}", 3 * MAX_TRIANGLES + 1);
    let long = text.replacen("element vertex 4", &many, 1) + &" ".repeat(3 * MAX_TRIANGLES);
    assert_eq!(faults(read("a.ply", long.as_bytes())), [("M220", None)]);
}

/// A COLLADA file: `faces` of the tetrahedron's geometry, `nodes` of its scene.
fn dae(unit: &str, faces: &str, nodes: &str) -> String {
    let corners: Vec<String> = CORNERS.iter().map(|[x, y, z]| format!("{x} {y} {z} 9")).collect();
    format!(
        r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{unit}<up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="t"><mesh>
<source id="p"><float_array id="pa" count="17">8 {}</float_array><technique_common><accessor source="#pa" count="4" offset="1" stride="4"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{faces}
</mesh></geometry></library_geometries>
<library_nodes><node id="shared"><instance_geometry url="#t"/></node></library_nodes>
<library_visual_scenes><visual_scene id="other"><node><instance_geometry url="#none"/></node></visual_scene>
<visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"##,
        corners.join(" ")
    )
}

const INPUT: &str =
    r##"<input semantic="NORMAL" source="#n" offset="0"/><input semantic="VERTEX" source="#v" offset="1"/>"##;
const NODE: &str = r##"<node><instance_geometry url="#t"/></node>"##;

/// `FACES` with an index of a normal before each corner.
fn indexed(face: &[u32]) -> String {
    face.iter().map(|corner| format!("0 {corner} ")).collect()
}

fn triangles() -> String {
    format!(
        "<triangles count=\"4\">{INPUT}<p>{}</p></triangles>",
        FACES.iter().map(|face| indexed(face)).collect::<String>()
    )
}

#[test]
fn every_dialect_of_collada_gives_the_tetrahedron() {
    let all: String = FACES.iter().map(|face| indexed(face)).collect();
    let each = |tag: &str| {
        let lists: String = FACES.iter().map(|face| format!("<p>{}</p>", indexed(face))).collect();
        format!("<{tag}>{INPUT}{lists}</{tag}>")
    };
    let strip = format!("<tristrips>{INPUT}<p>{}</p></tristrips>", indexed(&[1, 0, 2, 3, 1, 0]));
    for faces in [
        triangles(),
        format!("<lines>{INPUT}<p>0 0 0 1</p></lines><polylist>{INPUT}<vcount>3 3 3 3</vcount><p>{all}</p></polylist>"),
        each("polygons"),
        each("trifans"),
        each("tristrips"),
        strip,
    ] {
        is_the_tetrahedron("a.dae", dae("", &faces, NODE).as_bytes(), 1.0);
    }
    // Materials without faces, an element of another kind with the same id, a camera with a matrix that is not read.
    let more = format!("<triangles count=\"0\"/>{}<polylist count=\"0\">{INPUT}</polylist>", triangles());
    let nodes = format!(
        "<node id=\"t\"><node id=\"s\"/><node><lookat>0</lookat><instance_camera url=\"#c\"/></node></node>{NODE}"
    );
    is_the_tetrahedron("a.dae", dae("", &more, &nodes).as_bytes(), 1.0);
    let plain = dae("", &triangles(), NODE);
    is_the_tetrahedron("a.DAE", format!("\u{feff}{plain}").as_bytes(), 1.0);
    is_the_tetrahedron(
        "a.dae",
        plain.replace(" xmlns=\"http://www.collada.org/2005/11/COLLADASchema\"", "").as_bytes(),
        1.0,
    );
    is_the_tetrahedron("a.dae", dae(r#"<unit name="inch" meter="0.0254"/>"#, &triangles(), NODE).as_bytes(), 0.0254);
    // A file of geometry without a scene.
    let bare = plain.replace(&plain[plain.find("<library_nodes>").unwrap()..plain.find("</COLLADA>").unwrap()], "");
    is_the_tetrahedron("a.dae", bare.as_bytes(), 1.0);
}

/// Files that were put together have the same ids in several meshes: each reads its own.
#[test]
fn meshes_with_the_same_ids_read_their_own() {
    let plain = dae("", &triangles(), NODE);
    let bare = plain.replace(&plain[plain.find("<library_nodes>").unwrap()..plain.find("</COLLADA>").unwrap()], "");
    let listed = |factor: f32| {
        let corners: Vec<String> =
            CORNERS.iter().map(|corner| corner.map(|x| (x * factor).to_string()).join(" ") + " 9").collect();
        corners.join(" ")
    };
    let larger = bare.replace(&listed(1.0), &listed(3.0));
    assert_ne!(larger, bare);
    let geometry = &larger[larger.find("<geometry").unwrap()..larger.find("</library_geometries>").unwrap()];
    let both = bare.replace("</library_geometries>", &format!("{geometry}</library_geometries>"));
    let read_corners = |text: &str| corners(&read("a.dae", text.as_bytes()).unwrap());
    let mut expected = [read_corners(&bare), read_corners(&larger)].concat();
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let mut seen = read_corners(&both);
    expected.dedup();
    seen.dedup();
    assert_eq!(seen, expected);
}

/// Where the corners of a mesh are, sorted.
fn corners(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    let mut corners: Vec<[f64; 3]> =
        mesh.vertices().iter().map(|p| [p.x, p.y, p.z].map(|x| (x * 1e6).round() / 1e6 + 0.0)).collect();
    corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
    corners
}

/// Turn by 90 degrees about z, twice as large, 10 along x; mirrored, a second one at z = 5.
#[test]
fn nodes_place_what_they_hold() {
    let nodes = r##"<node><translate>10 0 0</translate><node><rotate>0 0 1 90</rotate><scale>2 2 2</scale><instance_geometry url="#t"/></node></node>
        <node><matrix>-1 0 0 0  0 1 0 0  0 0 1 5  0 0 0 1</matrix><instance_node url="#shared"/></node>"##;
    let scene = read("a.dae", dae(r#"<unit meter="0.001"/>"#, &triangles(), nodes).as_bytes()).unwrap();
    let expected = [
        [-0.001, 0.0, 0.005],
        [0.0, 0.0, 0.005],
        [0.0, 0.0, 0.006],
        [0.0, 0.001, 0.005],
        [0.008, 0.0, 0.0],
        [0.01, 0.0, 0.0],
        [0.01, 0.0, 0.002],
        [0.01, 0.002, 0.0],
    ];
    assert_eq!(corners(&scene), expected);
    assert!((scene.signed_volume() - 9e-9 / 6.0).abs() < 1e-15, "mirrored parts stay outside out");

    let half = std::f64::consts::FRAC_1_SQRT_2 * 1e-3;
    let nodes = format!(
        r#"{{"translation": [0.01, 0, 0], "children": [2]}}, {{"matrix": [-0.001,0,0,0, 0,0.001,0,0, 0,0,0.001,0, 0,0,0.005,1], "mesh": 0}},
            {{"rotation": [0, 0, {half}, {half}], "scale": [0.002, 0.002, 0.002], "mesh": 0}}"#
    );
    let scene = read("a.glb", &glb(&nodes, "0, 1", 5123)).unwrap();
    assert_eq!(corners(&scene), expected);
    assert!((scene.signed_volume() - 9e-9 / 6.0).abs() < 1e-15, "mirrored parts stay outside out");
}

#[test]
fn faulty_collada_is_refused_with_its_place() {
    let good = dae("", &triangles(), NODE);
    let with = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        faults(read("a.dae", good.replacen(from, to, 1).as_bytes()))
    };
    assert_eq!(faults(read("a.dae", b"")), [("M202", None)]);
    assert_eq!(faults(read("a.dae", b"\x00\xff")), [("M204", None)]);
    assert_eq!(faults(read("a.dae", b"<x/>")), [("M260", Some(1))]);
    assert_eq!(with("</asset>", "</asse>"), [("M260", Some(3))]);
    assert_eq!(with("<?xml version=\"1.0\"?>", "<!DOCTYPE x>"), [("M260", Some(1))]);
    assert_eq!(with("<asset>", "<asset><unit meter=\"-1\"/>"), [("M260", Some(3))]);
    assert_eq!(with("url=\"#s\"", "url=\"#r\""), [("M260", Some(12))]);
    assert_eq!(with("source=\"#v\"", "source=\"#w\""), [("M260", Some(7))]);
    assert_eq!(with("semantic=\"VERTEX\"", "semantic=\"VERTICES\""), [("M260", Some(7))]);
    assert_eq!(with("offset=\"1\"/>", "offset=\"-1\"/>"), [("M260", Some(7))]);
    assert_eq!(with("stride=\"4\"", "stride=\"2\""), [("M260", Some(5))]);
    assert_eq!(with("0 0 0 9", "0 0,5 0 9"), [("M260", Some(5))]);
    assert_eq!(with("0 0 0 9", "0 inf 0 9"), [("M203", Some(5))]);
    assert_eq!(with("<p>0 0 0 2", "<p>0 0 0 4"), [("M241", Some(7))]);
    assert_eq!(with("<p>0 0 0 2", "<p>0 0 0 x"), [("M260", Some(7))]);
    assert_eq!(with("<triangles count=\"4\">", "<polylist>").len(), 1);
    let nodes = |nodes: &str| faults(read("a.dae", dae("", &triangles(), nodes).as_bytes()));
    let inside = |transform: &str| nodes(&NODE.replace("<node>", &format!("<node>{transform}")));
    assert_eq!(inside("<skew>1</skew>"), [("M260", Some(11))]);
    assert_eq!(inside("<matrix>1 0 0</matrix>"), [("M260", Some(11))]);
    assert_eq!(with("<triangles count=\"4\">", "<triangles count=\"5\">"), [("M260", Some(7))]);
    assert_eq!(with("<p>0 0 0 2", "<p>0 0 0 0 2"), [("M260", Some(7))]);
    assert_eq!(with("<geometry id=\"t\">", "<geometry id=\"t\"><convex_mesh/>"), [("M260", Some(4))]);
    assert_eq!(with("<vertices id=\"v\">", "<source id=\"v\"/><vertices id=\"w\">"), [("M260", Some(7))]);
    assert_eq!(nodes("<node><instance_controller url=\"#c\"/></node>"), [("M260", Some(11))]);
    assert_eq!(nodes("<node/>"), [("M202", None)]);
    // A node that stands for itself, and nodes of which each stands for the next ten times.
    assert_eq!(nodes(r##"<node id="n"><instance_node url="#n"/></node>"##), [("M260", Some(11))]);
    let ten = |k: usize| {
        format!(r##"<node id="n{k}">{}</node>"##, format!(r##"<instance_node url="#n{}"/>"##, k + 1).repeat(10))
    };
    let wide = r##"<node id="n"><scale>1 1 1</scale><instance_geometry url="#e"/></node>"##.to_owned()
        + &format!("<node>{}</node>", r##"<instance_node url="#n"/>"##.repeat(60_000));
    let empty = "</mesh></geometry><geometry id=\"e\"><mesh>";
    assert_eq!(faults(read("a.dae", dae("", &(triangles() + empty), &wide).as_bytes())), [("M260", Some(11))]);
    let bomb: String =
        (0..12).map(ten).collect::<String>() + r##"<node id="n12"><instance_geometry url="#t"/></node>"##;
    assert_eq!(nodes(&bomb), [("M260", Some(11))]);
    let holes = format!("<polygons>{INPUT}<ph><p>0 0 0 1 0 2</p></ph></polygons>");
    assert_eq!(faults(read("a.dae", dae("", &holes, NODE).as_bytes())), [("M260", Some(7))]);
    let few = format!("<polylist>{INPUT}<vcount>3 2</vcount><p>0 0 0 1 0 2 0 0 0 1</p></polylist>");
    assert_eq!(faults(read("a.dae", dae("", &few, NODE).as_bytes())), [("M260", Some(7))]);
}

/// A binary glTF file of the tetrahedron, its indices of this type; `nodes` are JSON, `roots` those of the scene.
fn glb(nodes: &str, roots: &str, index_type: u32) -> Vec<u8> {
    // Positions begin at byte 4, one every 16 bytes.
    let mut numbers = vec![7; 4];
    for corner in CORNERS {
        numbers.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
        numbers.extend([9; 4]);
    }
    for index in FACES.as_flattened() {
        let bytes = index.to_le_bytes();
        numbers.extend(
            &bytes[..match index_type {
                5121 => 1,
                5123 => 2,
                _ => 4,
            }],
        );
    }
    let length = numbers.len() - 68;
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [{roots}]}}], "nodes": [{nodes}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 99}}, "indices": 1, "mode": 4}}, {{"attributes": {{}}, "mode": 1}}]}}],
        "accessors": [{{"bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": {index_type}, "count": 12, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 68, "byteStride": 16}}, {{"buffer": 0, "byteOffset": 68, "byteLength": {length}}}],
        "buffers": [{{"byteLength": {}}}]}}"#,
        numbers.len()
    );
    packed(&json, &numbers)
}

fn packed(json: &str, numbers: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + numbers.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", numbers)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

#[test]
fn every_dialect_of_binary_gltf_gives_the_tetrahedron() {
    for index_type in [5121, 5123, 5125] {
        is_the_tetrahedron("a.glb", &glb(r#"{"mesh": 0}"#, "0", index_type), 1.0);
    }
    let text = |bytes: &[u8]| String::from_utf8_lossy(&bytes[20..]).into_owned();
    let good = glb(r#"{"mesh": 0}"#, "0", 5125);
    let (json, numbers) = (text(&good), good[good.len() - 116..].to_vec());
    let json = &json[..json.rfind("}]}").unwrap() + 3];
    is_the_tetrahedron("a.glb", &packed(json, &numbers), 1.0);
    for name in ["EXT_texture_webp", "KHR_materials_transmission", "KHR_lights_punctual"] {
        let more = format!(r#""extensionsRequired": ["{name}"], "asset""#);
        is_the_tetrahedron("a.glb", &packed(&json.replace(r#""asset""#, &more), &numbers), 1.0);
    }
    // Words that are filled with zeros, or not at all.
    is_the_tetrahedron("a.glb", &packed(&format!("{json}\0\0"), &numbers), 1.0);
    let mut short = packed(json, &numbers);
    let length = short.len() - numbers.len() - 8;
    short[length..length + 4].copy_from_slice(&(numbers.len() as u32 + 2).to_le_bytes());
    is_the_tetrahedron("a.glb", &short, 1.0);
    // Without a scene all meshes are there; without indices positions follow each other.
    is_the_tetrahedron(
        "a.glb",
        &packed(&json.replace(r#""scene": 0, "scenes": [{"nodes": [0]}], "#, ""), &numbers),
        1.0,
    );
    let plain: Vec<u8> =
        FACES.as_flattened().iter().flat_map(|&i| CORNERS[i as usize]).flat_map(f32::to_le_bytes).collect();
    let bare = json
        .replace(r#", "indices": 1"#, "")
        .replace(r#""byteOffset": 4, "componentType": 5126, "count": 4"#, r#""componentType": 5126, "count": 12"#)
        .replace(r#""byteLength": 68, "byteStride": 16"#, r#""byteLength": 144"#);
    is_the_tetrahedron("a.glb", &packed(&bare, &plain), 1.0);

    let with = |from: &str, to: &str| {
        assert!(json.contains(from), "{from}");
        faults(read("a.glb", &packed(&json.replacen(from, to, 1), &numbers)))
    };
    let refused = [("M270", None)];
    assert_eq!(with(r#""mesh": 0"#, r#""mesh": 1"#), refused);
    assert_eq!(with(r#""nodes": [0]"#, r#""nodes": [1]"#), refused);
    assert_eq!(with(r#""scene": 0"#, r#""scene": 1"#), refused);
    assert_eq!(with(r#""mesh": 0"#, r#""children": [0]"#), refused);
    assert_eq!(with(r#""mesh": 0"#, r#""mesh": 0, "rotation": [0, 0, 0, 0]"#), refused);
    assert_eq!(with(r#""count": 12"#, r#""count": 13"#), refused);
    assert_eq!(with(r#""count": 12"#, r#""count": 18446744073709551615"#), [("M220", None)]);
    assert_eq!(with(r#""mesh": 0"#, r#""mesh": 0, "skin": 0"#), refused);
    assert_eq!(with(r#""mesh": 0"#, r#""mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}"#), refused);
    assert_eq!(with(r#""primitives""#, r#""weights": [0.5], "primitives""#), refused);
    assert_eq!(with(r#""mesh": 0"#, r#""mesh": 0, "weights": [0.5]"#), refused);
    assert_eq!(with(r#""byteStride": 16"#, r#""byteStride": 8"#), refused);
    assert_eq!(with(r#""byteOffset": 68"#, r#""byteOffset": 18446744073709551615"#), refused);
    assert_eq!(with(r#""type": "SCALAR""#, r#""type": "VEC2""#), refused);
    assert_eq!(with(r#""componentType": 5126"#, r#""componentType": 5122"#), refused);
    assert_eq!(with(r#""bufferView": 1"#, r#""sparse": {}, "bufferView": 1"#), refused);
    assert_eq!(with(r#""buffers": [{"#, r#""buffers": [{"uri": "a.bin", "#), refused);
    assert_eq!(with(r#""asset""#, r#""extensionsRequired": ["KHR_draco_mesh_compression"], "asset""#), refused);
    assert_eq!(with(r#""mode": 4"#, r#""mode": 9"#), refused);
    assert_eq!(with(r#""mode": 4"#, r#""mode": 0"#), [("M202", None)]);
    let mut far = numbers.clone();
    far[68] = 9;
    assert_eq!(faults(read("a.glb", &packed(json, &far))), [("M241", None)]);
    let mut infinite = numbers.clone();
    infinite[4..8].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert_eq!(faults(read("a.glb", &packed(json, &infinite))), [("M203", None)]);
    assert_eq!(faults(read("a.glb", b"")), [("M202", None)]);
    assert_eq!(faults(read("a.glb", b"glTF\x01\0\0\0")), refused);
    for cut in [10, 30, good.len() - 1] {
        assert_eq!(faults(read("a.glb", &good[..cut])), refused, "{cut}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        for name in ["x.ply", "x.dae", "x.glb"] {
            let _ = read(name, &bytes);
        }
    }

    #[test]
    fn mutated_files_never_panic(
        kind in 0..5usize,
        edits in proptest::collection::vec((any::<usize>(), prop_oneof![any::<u8>(), Just(b' '), Just(b'-'), Just(b'9'), Just(b'0'), Just(b'\n')]), 0..6),
        cut in (any::<usize>(), 0..40usize),
    ) {
        let (name, original) = [
            ("x.ply", text_ply().into_bytes()),
            ("x.ply", binary_ply(false)),
            ("x.ply", binary_ply(true)),
            ("x.dae", dae("", &triangles(), NODE).into_bytes()),
            ("x.glb", glb(r#"{"mesh": 0}"#, "0", 5123)),
        ][kind].clone();
        let mut bytes = original;
        for (at, value) in edits {
            let n = bytes.len();
            bytes[at % n] = value;
        }
        let start = cut.0 % bytes.len();
        let end = (start + cut.1).min(bytes.len());
        bytes.drain(start..end);
        let _ = read(name, &bytes);
    }
}
