//! Just enough XML: nested elements with attributes, numbers as the shortest decimals that read back to the same double.

use std::fmt::Write;

/// An XML document in the making.
#[derive(Debug, Default)]
pub(super) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

/// Attributes of one element, in order.
pub(super) type Attributes<'a> = &'a [(&'static str, String)];

impl Xml {
    /// Opens an element; [`Xml::close`] ends it.
    pub fn open(&mut self, name: &'static str, attributes: Attributes) {
        self.start(name, attributes, ">");
        self.open.push(name);
    }

    /// Ends the element opened last.
    ///
    /// Panics when none is open.
    pub fn close(&mut self) {
        let name = self.open.pop().expect("an open element");
        self.indent();
        writeln!(self.text, "</{name}>").expect("a String takes all text");
    }

    /// An element without content.
    pub fn leaf(&mut self, name: &'static str, attributes: Attributes) {
        self.start(name, attributes, "/>");
    }

    /// The text.
    ///
    /// Panics while an element is open.
    pub fn finish(self) -> String {
        assert!(self.open.is_empty(), "{:?} not closed", self.open);
        self.text
    }

    fn start(&mut self, name: &'static str, attributes: Attributes, end: &str) {
        self.indent();
        write!(self.text, "<{name}").expect("a String takes all text");
        for (key, value) in attributes {
            write!(self.text, " {key}=\"{}\"", escaped(value)).expect("a String takes all text");
        }
        writeln!(self.text, "{end}").expect("a String takes all text");
    }

    fn indent(&mut self) {
        self.text.extend(std::iter::repeat_n("  ", self.open.len()));
    }
}

/// Numbers with a space between.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let mut text = String::new();
    for value in values {
        if !text.is_empty() {
            text.push(' ');
        }
        write!(text, "{value}").expect("a String takes all text");
    }
    text
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => {
                write!(out, "&#{};", u32::from(c)).expect("a String takes all text");
            }
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_survive() {
        let mut xml = Xml::default();
        xml.open("a", &[("name", "x \"<&>\"".into())]);
        xml.leaf("b", &[("pos", numbers([0.1, -2.0, 1e-7]))]);
        xml.close();
        let text = xml.finish();
        assert_eq!(text, "<a name=\"x &quot;&lt;&amp;&gt;&quot;\">\n  <b pos=\"0.1 -2 0.0000001\"/>\n</a>\n");
    }
}
