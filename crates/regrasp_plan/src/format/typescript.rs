#[path = "../../../../tests/support/typescript.rs"]
mod declarations;

use super::file::FilePlan;
use crate::check::Level;
use crate::robot_plan::RobotPlan;
use declarations::{Declarations, assert_written};
use std::path::Path;

const HEADING: &str = "\
// Types of a plan file (docs/reference/plan-format.md). Generated from `regrasp_plan::format`: do not edit.
// REGRASP_WRITE_SCHEMA=1 cargo test -p regrasp_plan --lib writes it anew.

import type { PlanInput, PoseData } from \"./record\";

export type { PlanInput, PoseData };
";

#[test]
fn the_types_in_the_repository_are_those_of_the_format() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schema/plan.d.ts");
    assert_written(&path, &Declarations::new().with::<FilePlan>().with::<RobotPlan>().with::<Level>().text(HEADING));
}
