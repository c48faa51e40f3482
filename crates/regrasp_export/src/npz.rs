//! Arrays for numpy: a ZIP archive of `.npy` files (NEP 1), stored, with one fixed date. No array holds objects, so that
//! `numpy.load` reads it with `allow_pickle=False`.

use crate::arrays::{CONTACT_MODES, Numbers, NumericArray, PlanArrays, kind_name};
use crate::error::{ExportError, MOST_CHARACTERS};
use regrasp_plan::Plan;
use std::io::{Cursor, Write};
use zip::write::{SimpleFileOptions, ZipWriter};
use zip::{CompressionMethod, DateTime};

/// The bytes of an `.npz` file with the arrays of `plan`, names as in [`PlanArrays`].
///
/// Errors: a name so long that an array of names would be huge.
pub fn to_npz(plan: &Plan) -> Result<Vec<u8>, ExportError> {
    for (what, texts) in [
        ("the joint names", plan.joint_names.as_slice()),
        ("the names of joints that stand still", &plan.held_joints.keys().cloned().collect::<Vec<String>>()),
        ("the finger names", &plan.fingers),
        ("the hand's name", std::slice::from_ref(&plan.hand)),
        ("the object's name", std::slice::from_ref(&plan.object)),
        ("the tool's name", std::slice::from_ref(&plan.tool)),
        ("the method's name", std::slice::from_ref(&plan.method)),
        ("the task's kind", std::slice::from_ref(&plan.task)),
        ("the task's name", std::slice::from_ref(&plan.query)),
    ] {
        refuse_too_long(what, texts)?;
    }
    let arrays = PlanArrays::new(plan);
    refuse_too_long("the names of holders", &arrays.holders)?;
    let mut file = Npz::new();
    file.add("format", &texts(&[], &["regrasp-arrays"]));
    file.add("format_version", &integers(&[], &[1]));
    file.add("tool", &texts(&[], &[&plan.tool]));
    file.add("method", &texts(&[], &[&plan.method]));
    file.add("seed", &npy("<u8", &[], plan.seed.to_le_bytes().into()));
    file.add("task", &texts(&[], &[&plan.task]));
    file.add("query", &texts(&[], &[&plan.query]));
    file.add("hands", &names(&arrays.hands));
    file.add("objects", &names(&arrays.objects));
    file.add("holders", &names(&arrays.holders));
    file.add("joint_names", &names(&arrays.joint_names));
    file.add("held_joint_names", &names(&arrays.held_joint_names));
    let held = Numbers::Floats(&arrays.held_joints);
    file.add("held_joints", &npy(held.numpy_type(), &[arrays.held_joints.len()], held.to_bytes()));
    file.add("fingers", &names(&arrays.fingers));
    file.add("hand_of_joint", &integers(&[arrays.joint_names.len()], &arrays.hand_of_joint));
    file.add("hand_of_finger", &integers(&[arrays.fingers.len()], &arrays.hand_of_finger));
    file.add("contact_mode_names", &texts(&[CONTACT_MODES.len()], &CONTACT_MODES));
    for NumericArray { name, shape, data } in arrays.numeric() {
        file.add(name, &npy(data.numpy_type(), &shape, data.to_bytes()));
    }
    let kinds: Vec<&str> = arrays.segment_kinds.iter().map(|&kind| kind_name(kind)).collect();
    file.add("segment_kinds", &texts(&[kinds.len()], &kinds));
    file.add("segment_moving_fingers", &integers(&[kinds.len()], &arrays.segment_moving_fingers));
    file.add("segment_moves", &integers(&[kinds.len(), arrays.fingers.len()], &arrays.segment_moves));
    file.add("segment_rolling_fingers", &integers(&[kinds.len()], &arrays.segment_rolling_fingers));
    let shape = [kinds.len(), arrays.objects.len(), arrays.holders.len()];
    file.add("segment_held_by", &integers(&shape, &arrays.segment_held_by));
    file.add("segment_starts", &integers(&[kinds.len() + 1], &arrays.segment_starts));
    Ok(file.finish())
}

/// Refuses texts whose array would have more characters than [`MOST_CHARACTERS`].
pub(crate) fn refuse_too_long(what: &'static str, texts: &[String]) -> Result<(), ExportError> {
    let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0);
    match longest.saturating_mul(texts.len()) {
        characters if characters > MOST_CHARACTERS => Err(ExportError::TextTooLong { what, characters, longest }),
        _ => Ok(()),
    }
}

/// An archive being written to memory.
pub(crate) struct Npz(ZipWriter<Cursor<Vec<u8>>>);

/// What memory cannot refuse.
const IN_MEMORY: &str = "writing an archive to memory does not fail";

impl Npz {
    pub(crate) fn new() -> Self {
        Npz(ZipWriter::new(Cursor::new(Vec::new())))
    }

    pub(crate) fn add(&mut self, name: &str, npy: &[u8]) {
        // The date is that of the ZIP epoch: bytes must not depend on the clock.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644);
        self.0.start_file(format!("{name}.npy"), options).expect(IN_MEMORY);
        self.0.write_all(npy).expect(IN_MEMORY);
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.0.finish().expect(IN_MEMORY).into_inner()
    }
}

pub(crate) fn names(names: &[String]) -> Vec<u8> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    texts(&[names.len()], &names)
}

pub(crate) fn integers(shape: &[usize], values: &[i64]) -> Vec<u8> {
    let values = Numbers::Integers(values);
    npy(values.numpy_type(), shape, values.to_bytes())
}

/// Text of one width, in UTF-32, filled up with zeros.
pub(crate) fn texts(shape: &[usize], values: &[&str]) -> Vec<u8> {
    let width = values.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let padded = |text: &&str| -> Vec<char> { text.chars().chain(std::iter::repeat('\0')).take(width).collect() };
    let data = values.iter().flat_map(padded).flat_map(|c| u32::from(c).to_le_bytes()).collect();
    npy(&format!("<U{width}"), shape, data)
}

/// A file of version 1.0 of the NPY format: magic word, header padded to a multiple of 64 bytes, data in C order.
pub(crate) fn npy(descr: &str, shape: &[usize], data: Vec<u8>) -> Vec<u8> {
    const BEFORE_HEADER: usize = 10;
    let lengths: String = shape.iter().map(|length| format!("{length},")).collect();
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({lengths}), }}");
    let end = (BEFORE_HEADER + header.len() + 1).next_multiple_of(64);
    header.push_str(&" ".repeat(end - BEFORE_HEADER - header.len() - 1));
    header.push('\n');
    let length = u16::try_from(header.len()).expect("a header of a few dimensions is short");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}
