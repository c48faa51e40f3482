//! SVG text: elements, escaping, numbers, axes.

use std::fmt::Write;

/// Colours of what is no data.
pub const INK: &str = "#222222";
/// Axes and their numbers.
pub const SOFT: &str = "#555555";
/// Lines of the grid.
pub const GRID: &str = "#e2e2e2";
/// What must not be passed.
pub const LIMIT: &str = "#c1121f";
/// Background of stretches in which the object moves.
pub const SHADE: &str = "#efefef";

/// An SVG picture that is being written. Lengths are in its own units, at 96 per inch.
#[derive(Debug, Clone)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

/// Where a text stands relative to its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        }
    }
}

/// A number with at most two decimals, as short as it can be.
pub fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// `text` with what means something in XML escaped, and control characters replaced.
pub fn escaped(text: &str) -> String {
    regrasp_base::diagnostic::printable(text)
        // No characters in XML 1.0.
        .replace(['\u{fffe}', '\u{ffff}'], "\u{fffd}")
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// `text`, cut after `most` characters and ended with an ellipsis where it is longer.
pub fn cut(text: &str, most: usize) -> String {
    match text.chars().count() > most {
        true => text.chars().take(most.saturating_sub(1)).chain(['\u{2026}']).collect(),
        false => text.to_owned(),
    }
}

impl Svg {
    /// A white sheet.
    pub fn new(width: f64, height: f64) -> Self {
        Svg { width, height, body: String::new() }
    }

    /// Adds markup as it is.
    fn push(&mut self, element: String) {
        self.body.push_str(&element);
        self.body.push('\n');
    }

    /// A rectangle; `more` are further attributes.
    pub fn rect(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str, more: &str) {
        let [x, y, width, height] = [x, y, width.max(0.0), height.max(0.0)].map(short);
        self.push(format!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\"{}/>",
            spaced(more)
        ));
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: &str, width: f64, more: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(short);
        let width = short(width);
        self.push(format!(
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{stroke}\" stroke-width=\"{width}\"{}/>",
            spaced(more)
        ));
    }

    /// A straight line that says what it is where a pointer rests on it.
    pub fn titled_line(&mut self, from: [f64; 2], to: [f64; 2], stroke: &str, width: f64, title: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(short);
        let (width, title) = (short(width), escaped(title));
        self.push(format!(
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{stroke}\" stroke-width=\"{width}\"><title>{title}</title></line>"
        ));
    }

    /// Lines through points, one for each run without a gap; a run of one point becomes a dot.
    pub fn path(&mut self, points: &[Option<[f64; 2]>], stroke: &str, width: f64, more: &str) {
        let mut data = String::new();
        for run in points.split(Option::is_none) {
            let run: Vec<[f64; 2]> = run.iter().flatten().copied().collect();
            for (k, [x, y]) in run.iter().enumerate() {
                let _ = write!(data, "{}{} {}", if k == 0 { "M" } else { "L" }, short(*x), short(*y));
            }
            if let [[x, y]] = run[..] {
                let _ = write!(data, "L{} {}", short(x), short(y));
            }
        }
        if !data.is_empty() {
            let width = short(width);
            self.push(format!(
                "<path d=\"{data}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" stroke-linejoin=\"round\" \
                 stroke-linecap=\"round\"{}/>",
                spaced(more)
            ));
        }
    }

    /// A filled polygon.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str, more: &str) {
        let list: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", short(*x), short(*y))).collect();
        self.push(format!("<polygon points=\"{}\" fill=\"{fill}\"{}/>", list.join(" "), spaced(more)));
    }

    /// A disc.
    pub fn disc(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str, more: &str) {
        let [x, y, radius] = [x, y, radius].map(short);
        self.push(format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{fill}\"{}/>", spaced(more)));
    }

    /// A text, escaped; `more` are further attributes.
    pub fn text(&mut self, text: &str, [x, y]: [f64; 2], anchor: Anchor, fill: &str, more: &str) {
        let [x, y] = [x, y].map(short);
        self.push(format!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{}\" fill=\"{fill}\"{}>{}</text>",
            anchor.name(),
            spaced(more),
            escaped(text)
        ));
    }

    /// A text with a white rim, legible on lines; `more` are further attributes.
    pub fn text_on_lines(&mut self, text: &str, at: [f64; 2], anchor: Anchor, fill: &str, more: &str) {
        // Twice, because not every program knows `paint-order`.
        let rim = format!(
            "stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\"{} aria-hidden=\"true\"",
            spaced(more)
        );
        self.text(text, at, anchor, "#ffffff", &rim);
        self.text(text, at, anchor, fill, more);
    }

    /// The stripes of fingers that roll; `number` tells the stripes of one colour from those of others.
    pub fn stripes(&mut self, number: usize, color: &str) -> String {
        self.push(format!(
            "<defs><pattern id=\"roll{number}\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" \
             patternTransform=\"rotate(45)\"><rect width=\"6\" height=\"6\" fill=\"{color}\"/>\
             <rect width=\"2\" height=\"6\" fill=\"#ffffff\" fill-opacity=\"0.75\"/></pattern></defs>"
        ));
        format!("url(#roll{number})")
    }

    /// The lines of fingers that slide; `number` as in [`Svg::stripes`].
    pub fn lines(&mut self, number: usize, color: &str) -> String {
        self.push(format!(
            "<defs><pattern id=\"slide{number}\" width=\"4\" height=\"4\" patternUnits=\"userSpaceOnUse\">\
             <rect width=\"4\" height=\"4\" fill=\"{color}\" fill-opacity=\"0.3\"/>\
             <rect width=\"4\" height=\"1.5\" fill=\"{color}\"/></pattern></defs>"
        ));
        format!("url(#slide{number})")
    }

    /// The picture, its title as its name for readers that speak.
    pub fn finish(self, title: &str) -> String {
        let [width, height] = [self.width, self.height].map(short);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\" font-size=\"12\" role=\"img\">\n\
             <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{}</svg>\n",
            escaped(title),
            self.body
        )
    }
}

fn spaced(more: &str) -> String {
    if more.is_empty() { String::new() } else { format!(" {more}") }
}

/// A scale from values to places: `lower` is at `from`, `upper` at `to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Lowest value.
    pub lower: f64,
    /// Highest value.
    pub upper: f64,
    /// Place of the lowest.
    pub from: f64,
    /// Place of the highest.
    pub to: f64,
}

impl Scale {
    /// A scale; one of no width is widened.
    pub fn new(lower: f64, upper: f64, from: f64, to: f64) -> Self {
        let upper = if upper > lower { upper } else { lower + lower.abs().max(1e-9) };
        Scale { lower, upper, from, to }
    }

    /// Place of a value.
    pub fn at(&self, value: f64) -> f64 {
        self.from + (value - self.lower) / (self.upper - self.lower) * (self.to - self.from)
    }

    /// About `n` round values (1, 2 or 5 times a power of ten apart) in the range, and how many decimals they need.
    pub fn ticks(&self, n: usize) -> (Vec<f64>, usize) {
        let raw = (self.upper - self.lower) / n.max(1) as f64;
        let power = libm::pow(10.0, libm::floor(libm::log10(raw)));
        let step =
            [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= raw * 0.999).unwrap_or(10.0 * power);
        let first = (self.lower / step - 1e-9).ceil() as i64;
        let last = (self.upper / step + 1e-9).floor() as i64;
        let decimals = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
        // A limit: a scale that spans nothing must not fill memory.
        let ticks = (first..=last).take(200).map(|k| k as f64 * step).collect();
        (ticks, decimals)
    }

    /// The same scale with round ends that hold its range.
    #[must_use]
    pub fn rounded(self, n: usize) -> Self {
        let (ticks, _) = self.ticks(n);
        let step = match ticks[..] {
            [first, second, ..] => second - first,
            _ => return self,
        };
        let down = (self.lower / step + 1e-9).floor() * step;
        let up = (self.upper / step - 1e-9).ceil() * step;
        Scale { lower: down, upper: up, ..self }
    }
}

/// A number with so many decimals, without the sign of a zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}
