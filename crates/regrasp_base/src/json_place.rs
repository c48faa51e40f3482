//! Where a value stands in a JSON text.

use crate::{Diagnostic, Place};
use std::path::Path;

/// A step into a JSON document.
#[derive(Debug, Clone, Copy)]
pub enum PathStep<'a> {
    /// The value of this key of an object.
    Key(&'a str),
    /// The element of this index of an array.
    Index(usize),
}

/// A diagnostic about the value that `steps` lead to in the JSON `text` of the file at `path`.
pub fn diagnostic(path: &Path, text: &str, code: &'static str, steps: &[PathStep], problem: String) -> Diagnostic {
    let offset = locate(text, steps).unwrap_or(0);
    let name: String = steps
        .iter()
        .map(|step| match step {
            PathStep::Key(key) => format!(".{key}"),
            PathStep::Index(index) => format!("[{index}]"),
        })
        .collect();
    Diagnostic::new(code, Place::at_offset(path, text, offset), problem).element("key", name.trim_start_matches('.'))
}

/// Byte offset of the value that `steps` lead to. `text` is valid JSON, or nothing is found.
pub fn locate(text: &str, steps: &[PathStep]) -> Option<usize> {
    let mut cursor = Cursor { bytes: text.as_bytes(), at: 0 };
    cursor.skip_space();
    for step in steps {
        match step {
            PathStep::Key(wanted) => {
                cursor.expect(b'{')?;
                loop {
                    cursor.skip_space();
                    let key = cursor.string()?;
                    cursor.skip_space();
                    cursor.expect(b':')?;
                    cursor.skip_space();
                    if key == wanted.as_bytes() {
                        break;
                    }
                    cursor.skip_value()?;
                    cursor.skip_space();
                    cursor.expect(b',')?;
                }
            }
            PathStep::Index(wanted) => {
                cursor.expect(b'[')?;
                for _ in 0..*wanted {
                    cursor.skip_space();
                    cursor.skip_value()?;
                    cursor.skip_space();
                    cursor.expect(b',')?;
                }
                cursor.skip_space();
            }
        }
    }
    Some(cursor.at)
}

/// Walks over JSON text that a real parser has already accepted.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    fn expect(&mut self, byte: u8) -> Option<()> {
        (self.peek()? == byte).then(|| self.at += 1)
    }

    fn string(&mut self) -> Option<&'a [u8]> {
        self.expect(b'"')?;
        let from = self.at;
        while self.peek()? != b'"' {
            self.at += if self.peek()? == b'\\' { 2 } else { 1 };
        }
        self.at += 1;
        self.bytes.get(from..self.at - 1)
    }

    fn skip_value(&mut self) -> Option<()> {
        let mut depth = 0usize;
        loop {
            match self.peek()? {
                b'"' => {
                    self.string()?;
                }
                b'{' | b'[' => {
                    depth += 1;
                    self.at += 1;
                }
                b'}' | b']' if depth == 0 => return Some(()),
                b'}' | b']' => {
                    depth -= 1;
                    self.at += 1;
                }
                b',' if depth == 0 => return Some(()),
                _ => self.at += 1,
            }
            if depth == 0 && matches!(self.peek()?, b',' | b'}' | b']') {
                return Some(());
            }
        }
    }
}
