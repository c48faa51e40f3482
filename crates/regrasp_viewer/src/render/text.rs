//! Letters and lines on a picture.

use super::shade::Picture;
use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Stroke, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// The letters are Ubuntu Light, which the crate carries along (Ubuntu Font Licence 1.0).
const FONT: &[u8] = epaint_default_fonts::UBUNTU_LIGHT;
/// Strokes are widened by this share of the letters' height: light letters are thin in print.
const WEIGHT: f64 = 0.028;

/// Where a text stands relative to the place given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
}

/// A white sheet to draw on.
pub struct Sheet {
    pixmap: Pixmap,
    face: Face<'static>,
}

impl Sheet {
    /// A white sheet; none if it would have no pixel, or more than memory can hold.
    pub fn new(width: usize, height: usize) -> Option<Self> {
        let mut pixmap = Pixmap::new(u32::try_from(width).ok()?, u32::try_from(height).ok()?)?;
        pixmap.fill(Color::WHITE);
        let face = Face::parse(FONT, 0).expect("the bundled font is one");
        Some(Sheet { pixmap, face })
    }

    /// Lays a picture on the sheet with its upper left corner at `x`, `y`; what does not fit is cut.
    pub fn lay(&mut self, picture: &Picture, x: usize, y: usize) {
        let (width, height) = (self.pixmap.width() as usize, self.pixmap.height() as usize);
        let pixels = self.pixmap.pixels_mut();
        for row in 0..picture.height.min(height.saturating_sub(y)) {
            for column in 0..picture.width.min(width.saturating_sub(x)) {
                let from = 3 * (row * picture.width + column);
                let [r, g, b] = [0, 1, 2].map(|k| picture.rgb[from + k]);
                if let Some(color) = PremultipliedColorU8::from_rgba(r, g, b, 255) {
                    pixels[(y + row) * width + x + column] = color;
                }
            }
        }
    }

    /// Width of a text of this size, in pixels.
    pub fn text_width(&self, text: &str, size: f64) -> f64 {
        let scale = size / f64::from(self.face.units_per_em());
        text.chars().map(|c| self.advance(c) * scale).sum()
    }

    fn advance(&self, c: char) -> f64 {
        let glyph = self.face.glyph_index(c).unwrap_or_default();
        f64::from(self.face.glyph_hor_advance(glyph).unwrap_or(0))
    }

    /// `text`, cut and ended with an ellipsis where it is wider than `width`.
    pub fn fitted(&self, text: &str, size: f64, width: f64) -> String {
        if self.text_width(text, size) <= width {
            return text.to_owned();
        }
        let mut kept: Vec<char> = text.chars().collect();
        while kept.pop().is_some() {
            let short = kept.iter().collect::<String>().trim_end().to_owned() + "\u{2026}";
            if self.text_width(&short, size) <= width {
                return short;
            }
        }
        String::new()
    }

    /// Writes `text`, its base line at `y`; `color` is `#rrggbb`. Returns where it ends.
    pub fn write(&mut self, text: &str, x: f64, y: f64, size: f64, color: &str, anchor: Anchor) -> f64 {
        let scale = size / f64::from(self.face.units_per_em());
        let mut pen = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - self.text_width(text, size) / 2.0,
        };
        let mut outline = Outline { path: PathBuilder::new(), x: pen, y, scale };
        for c in text.chars() {
            outline.x = pen;
            let glyph = self.face.glyph_index(c).unwrap_or_default();
            self.face.outline_glyph(glyph, &mut outline);
            pen += self.advance(c) * scale;
        }
        if let Some(path) = outline.path.finish() {
            let paint = paint_of(color);
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
            let stroke = Stroke { width: (WEIGHT * size) as f32, ..Stroke::default() };
            self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
        pen
    }

    /// Draws a line through `points`.
    pub fn line(&mut self, points: &[[f64; 2]], width: f64, color: &str) {
        if let Some(path) = path_through(points) {
            let cap = tiny_skia::LineCap::Round;
            let stroke = Stroke { width: width as f32, line_cap: cap, ..Stroke::default() };
            self.pixmap.stroke_path(&path, &paint_of(color), &stroke, Transform::identity(), None);
        }
    }

    /// Fills a disc.
    pub fn disc(&mut self, center: [f64; 2], radius: f64, color: &str) {
        if let Some(path) = PathBuilder::from_circle(center[0] as f32, center[1] as f32, radius as f32) {
            self.pixmap.fill_path(&path, &paint_of(color), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// What is on the sheet.
    pub fn picture(&self) -> Picture {
        let rgb = self.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        Picture { width: self.pixmap.width() as usize, height: self.pixmap.height() as usize, rgb }
    }
}

fn path_through(points: &[[f64; 2]]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (k, [x, y]) in points.iter().enumerate() {
        if k == 0 { path.move_to(*x as f32, *y as f32) } else { path.line_to(*x as f32, *y as f32) }
    }
    path.finish()
}

fn paint_of(color: &str) -> Paint<'static> {
    let [r, g, b] = crate::palette::bytes(color);
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint.anti_alias = true;
    paint
}

/// Takes a glyph's outline, whose y grows upward, to the sheet.
struct Outline {
    path: PathBuilder,
    x: f64,
    y: f64,
    scale: f64,
}

impl Outline {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        ((self.x + self.scale * f64::from(x)) as f32, (self.y - self.scale * f64::from(y)) as f32)
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
