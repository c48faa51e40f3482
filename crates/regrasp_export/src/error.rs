//! Why a plan cannot be written in a format.

/// Characters that one array of texts may take: its longest text times their number. Far more than the names of any robot.
pub const MOST_CHARACTERS: usize = 1 << 20;

/// Latest time of a trajectory, in seconds: what the 32 bits of a ROS 2 `Duration` hold.
pub const LATEST_TIME: f64 = i32::MAX as f64;

/// Why a plan cannot be written in a format.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A format gives every text of an array the width of the longest.
    #[error(
        "{what} need {characters} characters, the longest ({longest}) for each of them; at most {MOST_CHARACTERS} are written"
    )]
    TextTooLong {
        /// Which texts.
        what: &'static str,
        /// Characters that the array would have.
        characters: usize,
        /// Characters of the longest text.
        longest: usize,
    },
    /// Controllers demand times that increase, and a point that is left out is a motion that is left out.
    #[error(
        "segment {segment}, waypoint {waypoint} is at {time:?} s, {}",
        before.map_or("which no trajectory holds".to_owned(), |before| format!("after a waypoint at {before:?} s"))
    )]
    WrongTime {
        /// Index of the segment.
        segment: usize,
        /// Index of the waypoint in it.
        waypoint: usize,
        /// Its time, in seconds.
        time: f64,
        /// Time of the waypoint before, where the two do not increase.
        before: Option<f64>,
    },
}

impl ExportError {
    /// The code of the error.
    pub fn code(&self) -> &'static str {
        match self {
            ExportError::WrongTime { .. } => "C421",
            ExportError::TextTooLong { .. } => "C422",
        }
    }

    /// What is wanted instead, and what to do.
    pub fn expected_and_fix(&self) -> (&'static str, &'static str) {
        match self {
            ExportError::WrongTime { before: None, .. } => {
                ("a time from 0 to 2147483647 s", "plan again, or correct the times")
            }
            ExportError::WrongTime { .. } => (
                "times that increase within a segment by 1 ns or more, and never decrease",
                "plan again, or correct the times",
            ),
            ExportError::TextTooLong { .. } => {
                ("names of ordinary length", "shorten the names in the robot file and plan again")
            }
        }
    }
}
