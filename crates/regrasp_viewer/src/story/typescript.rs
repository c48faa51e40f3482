#[path = "../../../../tests/support/typescript.rs"]
mod declarations;

use super::Story;
use crate::robots::RobotReplay;
use declarations::{Declarations, assert_written};
use std::path::Path;

const HEADING: &str = "\
// What `regrasp view` writes into its page. Generated from `regrasp_viewer::story`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_viewer --lib writes it anew.

import type { FilePlan, Level, PoseData } from \"../../../../schema/plan\";
";

#[test]
fn the_pages_types_are_those_of_the_story() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("page/src/story_file.ts");
    assert_written(&path, &Declarations::new().with::<Story>().text(HEADING));
}

const ROBOT_HEADING: &str = "\
// What `regrasp view` writes into the page of a robot. Generated from `regrasp_viewer::robots`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_viewer --lib writes it anew.

import type { PoseData } from \"../../../../schema/plan\";
";

#[test]
fn the_pages_types_are_those_of_the_replay() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("page/src/robot_file.ts");
    assert_written(&path, &Declarations::new().with::<RobotReplay>().text(ROBOT_HEADING));
}
