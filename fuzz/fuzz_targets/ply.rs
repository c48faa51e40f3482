//! PLY meshes: read, and everything that is asked of a mesh afterwards.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| regrasp_fuzz::ask_mesh("mesh.ply", bytes));
