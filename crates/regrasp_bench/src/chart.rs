//! A figure as SVG: curves, a panel per curve with its own scale.

use std::fmt::Write;

/// One panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Heading.
    pub title: String,
    /// Points: x, and y or none where nothing was solved.
    pub points: Vec<(f64, Option<f64>)>,
}

/// An axis of all panels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis<'a> {
    /// What it shows, with its unit.
    pub label: &'a str,
    /// How.
    pub scale: Scale,
}

/// Where values stand on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// From 0 to 1.
    Unit,
    /// From 0 to a round number not below any value.
    FromZero,
    /// Whole numbers from the smallest value to the largest.
    Whole,
    /// Powers of ten that enclose all values; these are above 0.
    Log,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 52.0;

/// The panels side by side. The same panels give the same bytes.
pub fn svg(panels: &[Panel], x: &Axis, y: &Axis) -> String {
    let (width, height) = (WIDTH * panels.len() as f64, HEIGHT);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (index, panel) in panels.iter().enumerate() {
        let _ = writeln!(out, "<g transform=\"translate({},0)\">", WIDTH * index as f64);
        draw(panel, x, y, &mut out);
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    out
}

fn draw(panel: &Panel, x: &Axis, y: &Axis, out: &mut String) {
    let x_ruler = Ruler::new(x.scale, panel.points.iter().map(|&(x, _)| x));
    let y_ruler = Ruler::new(y.scale, panel.points.iter().filter_map(|&(_, y)| y));
    let (plot_width, plot_height) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    let x_at = |x: f64| LEFT + plot_width * x_ruler.share(x);
    let y_at = |y: f64| TOP + plot_height * (1.0 - y_ruler.share(y));
    let middle = LEFT + 0.5 * plot_width;
    let _ = writeln!(
        out,
        "<text x=\"{middle:.1}\" y=\"24\" text-anchor=\"middle\" font-size=\"14\">{}</text>",
        escaped(&panel.title)
    );
    for &value in &y_ruler.ticks {
        let y = y_at(value);
        let _ = writeln!(
            out,
            "<line x1=\"{LEFT}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            y + 4.0,
            number(value)
        );
    }
    for &value in &x_ruler.ticks {
        let x = x_at(value);
        let _ = writeln!(
            out,
            "<line x1=\"{x:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{:.1}\" stroke=\"black\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            HEIGHT - BOTTOM,
            HEIGHT - BOTTOM + 4.0,
            HEIGHT - BOTTOM + 18.0,
            number(value)
        );
    }
    let _ = writeln!(
        out,
        "<path d=\"M{LEFT} {TOP}V{:.1}H{:.1}\" fill=\"none\" stroke=\"black\"/>\
         <text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(14,{:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        HEIGHT - BOTTOM,
        WIDTH - RIGHT,
        HEIGHT - 14.0,
        escaped(x.label),
        TOP + 0.5 * plot_height,
        escaped(y.label)
    );
    let mut path = String::new();
    let mut is_down = false;
    for &(x, y) in &panel.points {
        let Some(y) = y else {
            is_down = false;
            continue;
        };
        let _ = write!(path, "{}{:.1} {:.1}", if is_down { 'L' } else { 'M' }, x_at(x), y_at(y));
        is_down = true;
        let _ = writeln!(out, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"#06c\"/>", x_at(x), y_at(y));
    }
    let _ = writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"#06c\" stroke-width=\"1.5\"/>");
}

/// A scale for given values.
struct Ruler {
    low: f64,
    high: f64,
    is_log: bool,
    ticks: Vec<f64>,
}

impl Ruler {
    fn new(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let bounds = values.fold(None, |bounds: Option<(f64, f64)>, value| {
            Some(bounds.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        });
        // Without values, some axis.
        let (least, largest) = bounds.unwrap_or((1.0, 1.0));
        match scale {
            Scale::Unit => Ruler::linear(0.0, 1.0, (0..=5).map(|tick| 0.2 * f64::from(tick))),
            Scale::FromZero => {
                let step = tick_step(bounds.map_or(0.0, |(_, high)| high));
                let n_ticks = if bounds.is_some() { (largest / step).ceil().max(1.0) } else { 1.0 };
                Ruler::linear(0.0, step * n_ticks, (0..=n_ticks as u32).map(|tick| step * f64::from(tick)))
            }
            Scale::Whole => {
                let (low, high) = (least.floor(), largest.ceil());
                let ticks = (0..=(high - low) as u32).map(|tick| low + f64::from(tick));
                Ruler::linear(low - 0.25, high + 0.25, ticks)
            }
            Scale::Log => {
                let low = least.log10().floor() as i32;
                let high = (largest.log10().ceil() as i32).max(low + 1);
                let ticks = (low..=high).map(|power| 10f64.powi(power)).collect();
                Ruler { low: 10f64.powi(low), high: 10f64.powi(high), is_log: true, ticks }
            }
        }
    }

    fn linear(low: f64, high: f64, ticks: impl Iterator<Item = f64>) -> Self {
        Ruler { low, high, is_log: false, ticks: ticks.collect() }
    }

    /// 0 at the low end, 1 at the high one.
    fn share(&self, value: f64) -> f64 {
        if self.is_log {
            (value / self.low).log10() / (self.high / self.low).log10()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }
}

/// A round step that divides up to `largest` into at most six.
fn tick_step(largest: f64) -> f64 {
    if !(largest > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf((largest / 6.0).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| largest / step <= 6.0).unwrap_or(power)
}

/// Up to four significant digits, without rounding noise; short enough for its place.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded >= 1e5 { format!("{rounded:e}") } else { rounded.to_string() }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for (largest, step) in [(0.0, 1.0), (6.0, 1.0), (6.1, 2.0), (0.45, 0.1), (1234.0, 500.0), (0.0031, 0.001)] {
            assert!((tick_step(largest) - step).abs() < 1e-12, "{largest}: {}", tick_step(largest));
        }
        assert_eq!([0.1 + 0.2, 1e4, 1e6].map(number), ["0.3", "10000", "1e6"]);
    }

    #[test]
    fn points_stand_where_their_values_say_and_gaps_stay_gaps() {
        let points = vec![(0.0, Some(0.0)), (0.5, None), (0.75, Some(6.0)), (1.0, Some(3.0))];
        let (x, y) = (Axis { label: "alpha", scale: Scale::Unit }, Axis { label: "s", scale: Scale::FromZero });
        let text = svg(&[Panel { title: "a<b".into(), points }], &x, &y);
        // Zero at the lower left, the largest at the top, half of it halfway up.
        for corner in ["cx=\"62.0\" cy=\"268.0\"", "cx=\"317.0\" cy=\"40.0\"", "cx=\"402.0\" cy=\"154.0\""] {
            assert!(text.contains(corner), "{corner} in {text}");
        }
        assert!(text.contains("d=\"M62.0 268.0M317.0 40.0L402.0 154.0\""));
        assert!(text.contains("a&lt;b") && !text.contains("NaN"));
    }

    #[test]
    fn a_scale_encloses_its_values_and_has_ticks_where_they_stand() {
        let ruler = |scale, values: &[f64]| Ruler::new(scale, values.iter().copied());
        let log = ruler(Scale::Log, &[300.0, 100.0, 1e6]);
        assert_eq!(log.ticks, [1e2, 1e3, 1e4, 1e5, 1e6]);
        assert!([(1e2, 0.0), (1e4, 0.5), (1e6, 1.0)].iter().all(|&(x, share)| (log.share(x) - share).abs() < 1e-12));
        assert_eq!(ruler(Scale::Log, &[10.0]).ticks, [10.0, 100.0], "a single power has room too");
        assert_eq!(ruler(Scale::Log, &[0.02, 0.05]).ticks, [0.01, 0.1]);
        let whole = ruler(Scale::Whole, &[3.0, 6.0]);
        assert_eq!(whole.ticks, [3.0, 4.0, 5.0, 6.0]);
        assert!(whole.share(3.0) > 0.0 && whole.share(6.0) < 1.0 && (whole.share(4.5) - 0.5).abs() < 1e-12);
        for scale in [Scale::Unit, Scale::FromZero, Scale::Whole, Scale::Log] {
            assert!(ruler(scale, &[]).share(0.5).is_finite());
        }
    }
}
