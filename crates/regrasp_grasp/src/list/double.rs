//! Double grasps: two hands that hold one object at once, as when one gives it to the other (Saut 2010, sec. IV-B).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Value of [`DoubleGraspList::format`].
pub const FORMAT: &str = "regrasp-double-grasps";
/// Value of [`DoubleGraspList::format_version`].
pub const FORMAT_VERSION: u32 = 1;

/// A grasp of each list that go together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DoubleGrasp {
    /// Index in the first list.
    pub first: usize,
    /// Index in the second list.
    pub second: usize,
    /// Sum of `quality` and `robot`, each normalised over all pairs of the file to 0..1. Larger is better.
    pub score: f64,
    /// The smaller score of the two grasps.
    pub quality: f64,
    /// The smaller robot-configuration score of the two grasps: cosine of the angle between the direction in which the hand comes and
    /// the direction from the robot's base to the object. 0 without a robot's base.
    pub robot: f64,
}

/// What became of the grasps of one list.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DoubleGraspSide {
    /// Name of the file of the list.
    pub list: String,
    /// Its SHA-256.
    pub sha256: String,
    /// Grasps in it.
    pub grasps: usize,
    /// Grasps in which the hand, also on its way, hits nothing of the surroundings.
    pub clear: usize,
}

/// The double grasps of two lists.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DoubleGraspList {
    /// Always `regrasp-double-grasps`.
    pub format: String,
    /// Version of the format.
    pub format_version: u32,
    /// Tool and version that wrote it.
    pub tool: String,
    /// The hand that holds the object first.
    pub first: DoubleGraspSide,
    /// The hand that takes it.
    pub second: DoubleGraspSide,
    /// Pairs of clear grasps of which the hands hit each other, in the grasps or on the way of one of them.
    pub hands_touch: usize,
    /// The pairs, best score first.
    pub pairs: Vec<DoubleGrasp>,
}

impl DoubleGraspList {
    /// The bytes of a file: one pair a line.
    ///
    /// Panics if a number is not finite.
    pub fn to_json(&self) -> String {
        fn compact<T: Serialize>(value: &T) -> String {
            serde_json::to_string(value).expect("types of double grasps always serialise")
        }
        let pairs: Vec<String> = self.pairs.iter().map(|pair| format!("    {}", compact(pair))).collect();
        let pairs = if pairs.is_empty() { "[]".into() } else { format!("[\n{}\n  ]", pairs.join(",\n")) };
        format!(
            "{{\n  \"format\": {},\n  \"format_version\": {},\n  \"tool\": {},\n  \"first\": {},\n  \"second\": {},\n  \"hands_touch\": {},\n  \
             \"pairs\": {pairs}\n}}\n",
            compact(&self.format),
            self.format_version,
            compact(&self.tool),
            compact(&self.first),
            compact(&self.second),
            self.hands_touch,
        )
    }
}

/// The JSON Schema of double grasps, as pretty JSON: the content of `schema/double-grasps.schema.json`.
pub fn schema() -> String {
    let mut text =
        serde_json::to_string_pretty(&schemars::schema_for!(DoubleGraspList)).expect("a schema always serialises");
    text.push('\n');
    text
}
