//! One colour per finger, the same in every picture.

/// Colours that people with any kind of colour vision tell apart, and that differ in lightness (Okabe and Ito 2008); the last
/// two stand in for their yellow and black, which are lost on white and among lines.
pub const FINGERS: [&str; 8] = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999933", "#882255"];

/// Colour of the finger or the component with this number, as `#rrggbb`.
pub fn color(number: usize) -> &'static str {
    FINGERS[number % FINGERS.len()]
}

/// Red, green and blue of `#rrggbb`, each in 0..=255; black for anything else.
pub fn bytes(color: &str) -> [u8; 3] {
    let part = |k: usize| color.get(1 + 2 * k..3 + 2 * k).and_then(|digits| u8::from_str_radix(digits, 16).ok());
    [0, 1, 2].map(|k| part(k).unwrap_or(0))
}
