//! Text for pages.

/// `text` as a cell of a table: one line, without marks of its own.
pub(crate) fn escaped(text: &str) -> String {
    regrasp_base::diagnostic::printable(text).replace('|', "\\|").replace('<', "&lt;").replace('\n', " ")
}
