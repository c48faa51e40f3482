//! Plans in stories as in plan files, so that a page can give the file back.

use regrasp_plan::{Plan, format};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use std::path::Path;

/// The content of the plan file, or null.
pub(super) fn serialize<S: Serializer>(plan: &Option<Plan>, serializer: S) -> Result<S::Ok, S::Error> {
    let content: Option<Value> =
        plan.as_ref().map(|plan| serde_json::from_str(&format::to_json(plan)).expect("a plan file is JSON"));
    content.serialize(serializer)
}

/// The plan in the content of a plan file; none for null.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Plan>, D::Error> {
    let read = |content: Value| format::from_json(Path::new("story"), content.to_string().as_bytes());
    Option::<Value>::deserialize(deserializer)?.map(read).transpose().map_err(D::Error::custom)
}
