//! A figure as SVG: mean time against alpha, a panel per curve with its own scale (paper 000, figure 10).

use std::fmt::Write;

/// One panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Heading.
    pub title: String,
    /// Points: x, and y or none where nothing was solved.
    pub points: Vec<(f64, Option<f64>)>,
}

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 52.0;

/// The panels side by side; x runs from 0 to 1, y from 0. The same panels give the same bytes.
pub fn svg(panels: &[Panel], x_label: &str, y_label: &str) -> String {
    let (width, height) = (WIDTH * panels.len() as f64, HEIGHT);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (index, panel) in panels.iter().enumerate() {
        let _ = writeln!(out, "<g transform=\"translate({},0)\">", WIDTH * index as f64);
        draw(panel, x_label, y_label, &mut out);
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    out
}

fn draw(panel: &Panel, x_label: &str, y_label: &str, out: &mut String) {
    let largest = panel.points.iter().filter_map(|(_, y)| *y).fold(0.0, f64::max);
    let step = tick_step(largest);
    let n_ticks = (largest / step).ceil().max(1.0);
    let (plot_width, plot_height) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    let x_at = |x: f64| LEFT + plot_width * x;
    let y_at = |y: f64| TOP + plot_height * (1.0 - y / (step * n_ticks));
    let middle = LEFT + 0.5 * plot_width;
    let _ = writeln!(
        out,
        "<text x=\"{middle:.1}\" y=\"24\" text-anchor=\"middle\" font-size=\"14\">{}</text>",
        escaped(&panel.title)
    );
    for tick in 0..=n_ticks as u32 {
        let value = step * f64::from(tick);
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
    for tick in 0..=5 {
        let value = 0.2 * f64::from(tick);
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
        escaped(x_label),
        TOP + 0.5 * plot_height,
        escaped(y_label)
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

/// A round step that divides up to `largest` into at most six.
fn tick_step(largest: f64) -> f64 {
    if !(largest > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf((largest / 6.0).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| largest / step <= 6.0).unwrap_or(power)
}

/// Up to four significant digits, without rounding noise.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    rounded.to_string()
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
        assert_eq!(number(0.1 + 0.2), "0.3");
    }

    #[test]
    fn points_stand_where_their_values_say_and_gaps_stay_gaps() {
        let points = vec![(0.0, Some(0.0)), (0.5, None), (0.75, Some(6.0)), (1.0, Some(3.0))];
        let text = svg(&[Panel { title: "a<b".into(), points }], "alpha", "s");
        // Zero at the lower left, the largest at the top, half of it halfway up.
        for corner in ["cx=\"62.0\" cy=\"268.0\"", "cx=\"317.0\" cy=\"40.0\"", "cx=\"402.0\" cy=\"154.0\""] {
            assert!(text.contains(corner), "{corner} in {text}");
        }
        assert!(text.contains("d=\"M62.0 268.0M317.0 40.0L402.0 154.0\""));
        assert!(text.contains("a&lt;b") && !text.contains("NaN"));
    }
}
