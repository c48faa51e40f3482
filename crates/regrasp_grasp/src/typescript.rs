#[path = "../../../tests/support/typescript.rs"]
mod declarations;

use crate::record::{PlanInput, PoseData};
use declarations::{Declarations, assert_written};
use std::path::Path;

const HEADING: &str = "\
// Types that plan files and grasp lists share. Generated from `regrasp_grasp::record`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_grasp --lib writes it anew.
";

#[test]
fn the_types_in_the_repository_are_those_of_records() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schema/record.d.ts");
    assert_written(&path, &Declarations::new().with::<PoseData>().with::<PlanInput>().text(HEADING));
}
