//! Why no plan was found.

use super::svg::{Anchor, INK, SOFT, Svg, cut};
use crate::story::FailureStory;

const WIDTH: f64 = 836.0;
const LEFT: f64 = 452.0;
const RIGHT: f64 = 730.0;
const ROW: f64 = 24.0;
const TOP: f64 = 44.0;
/// Most causes that are shown one by one.
const MOST: usize = 14;

/// Causes of a failure as bars, the commonest first; none when no cause was counted.
pub fn causes(failure: &FailureStory) -> Option<String> {
    let shown = &failure.causes[..failure.causes.len().min(MOST)];
    let largest = shown.iter().map(|cause| cause.share).fold(0.0, f64::max);
    if !(largest > 0.0) {
        return None;
    }
    let rest = failure.causes.len() - shown.len();
    let height = TOP + ROW * shown.len() as f64 + if rest > 0 { 28.0 } else { 12.0 };
    let mut svg = Svg::new(WIDTH, height);
    svg.text("Why no plan was found", [16.0, 19.0], Anchor::Start, INK, "font-weight=\"bold\"");
    svg.text(&cut(&failure.message, 140), [16.0, 35.0], Anchor::Start, SOFT, "font-size=\"11\"");
    for (row, cause) in shown.iter().enumerate() {
        let y = TOP + ROW * row as f64;
        let width = (RIGHT - LEFT) * cause.share / largest;
        svg.text(&cut(&cause.reason, 74), [LEFT - 8.0, y + 16.0], Anchor::End, INK, "");
        svg.rect([LEFT, y + 4.0], [width, ROW - 8.0], "#0072b2", "");
        let label = format!("{} % ({})", super::margin::significant(100.0 * cause.share), cause.count);
        svg.text(&label, [LEFT + width + 8.0, y + 16.0], Anchor::Start, SOFT, "font-size=\"11\"");
    }
    if rest > 0 {
        let y = TOP + ROW * shown.len() as f64 + 14.0;
        svg.text(&format!("and {rest} more"), [LEFT - 8.0, y], Anchor::End, SOFT, "font-size=\"11\"");
    }
    svg.line([LEFT, TOP], [LEFT, TOP + ROW * shown.len() as f64], SOFT, 1.0, "");
    Some(svg.finish("Why no plan was found"))
}
