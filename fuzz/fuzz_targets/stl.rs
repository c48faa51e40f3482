//! STL meshes: read, and everything that is asked of a mesh afterwards.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::geometry::import::read_mesh;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = read_mesh(Path::new("mesh.stl"), bytes) {
        assert!(mesh.vertices().iter().all(|vertex| vertex.coords.iter().all(|x| x.is_finite())));
        let _ = (mesh.bounds(), mesh.signed_volume(), mesh.statistics().is_watertight());
    }
});
