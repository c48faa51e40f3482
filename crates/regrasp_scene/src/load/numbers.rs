//! Numbers in messages.

use regrasp_base::diagnostic::number;

/// A vector as a list of a scene file.
pub(super) fn list(v: regrasp_geometry::Vector) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

/// A size with so many decimals; a far too large one by its power of ten.
pub(super) fn shown(size: f64, decimals: usize) -> String {
    if size.abs() < 1e6 { format!("{size:.decimals$}") } else { format!("{size:.1e}") }
}
