//! XML that would cost its parser far more than its bytes, told before a parser sees it.

/// Most XML nodes in a file; a limit for the parser.
pub const MAX_NODES: u32 = 1_000_000;
/// Deepest nesting of elements; URDF and SRDF need 6, COLLADA some more for each node inside another.
const MAX_DEPTH: usize = 64;
/// Most attributes of an element; URDF and COLLADA need 4. Parsers compare each with all others.
const MAX_ATTRIBUTES: usize = 256;
/// Most declarations of name spaces in a file; parsers compare each with all others.
const MAX_NAMESPACES: usize = 1_000;

/// Markup that no parser should see.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hostile {
    /// A document type declaration at this byte: entities may be declared there.
    Doctype {
        /// Where it begins.
        offset: usize,
    },
    /// Too much of something.
    Excess {
        /// Byte at which the element begins.
        offset: usize,
        /// What there is too much of: "has more than ...".
        problem: String,
    },
}

/// Walks over the markup of `text` without a tree, so that nothing that costs a parser more than its bytes reaches it: deep nesting,
/// elements of thousands of attributes, thousands of name spaces. Where the markup is broken it stops; the parser says why.
///
/// Errors: the first such markup.
pub fn refuse_hostile(text: &str) -> Result<(), Hostile> {
    let after = |from: usize, end: &str| text.get(from..)?.find(end).map(|k| from + k + end.len());
    let mut markup = Markup::default();
    let mut at = 0;
    while let Some(open) = after(at, "<").map(|end| end - 1) {
        let rest = &text[open..];
        // Quotes mean nothing in comments, character data and processing instructions, nor in closing tags.
        let end = if rest.starts_with("<!--") {
            after(open + 4, "-->")
        } else if rest.starts_with("<![CDATA[") {
            after(open + 9, "]]>")
        } else if rest.starts_with("<?") {
            after(open + 2, "?>")
        } else if rest.starts_with("<!DOCTYPE") {
            return Err(Hostile::Doctype { offset: open });
        } else if rest.starts_with("<!") {
            None
        } else if rest.starts_with("</") {
            markup.depth = markup.depth.saturating_sub(1);
            after(open + 2, ">")
        } else {
            let end = markup.open_tag(text.as_bytes(), open);
            if let Some(problem) =
                markup.excess(text.as_bytes().get(open..end.unwrap_or(text.len())).unwrap_or_default())
            {
                return Err(Hostile::Excess { offset: open, problem });
            }
            end
        };
        let Some(end) = end else { return Ok(()) };
        at = end;
    }
    Ok(())
}

/// What the markup of a file has been found to hold so far.
#[derive(Default)]
struct Markup {
    depth: usize,
    n_namespaces: usize,
}

impl Markup {
    /// Index after the `>` that ends the tag which opens at `open`; quoted values may contain `>`. None where there is no end.
    fn open_tag(&mut self, bytes: &[u8], open: usize) -> Option<usize> {
        let mut quote = None;
        let mut end = None;
        for (k, &byte) in bytes.iter().enumerate().skip(open + 1) {
            match (quote, byte) {
                (None, b'>') => {
                    end = Some(k + 1);
                    break;
                }
                (None, b'"' | b'\'') => quote = Some(byte),
                // What follows is another tag, and this one is broken.
                (None, b'<') => return None,
                (Some(q), _) if q == byte => quote = None,
                _ => {}
            }
        }
        let end = end?;
        self.depth += usize::from(bytes[end - 2] != b'/');
        Some(end)
    }

    /// What `tag` has too much of, after it was opened.
    fn excess(&mut self, tag: &[u8]) -> Option<String> {
        let (mut quote, mut n_attributes) = (None, 0);
        for (k, &byte) in tag.iter().enumerate() {
            match (quote, byte) {
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'=') => n_attributes += 1,
                (None, b'x') if tag[k..].starts_with(b"xmlns") && tag[k - 1].is_ascii_whitespace() => {
                    self.n_namespaces += 1;
                }
                (Some(q), _) if q == byte => quote = None,
                _ => {}
            }
        }
        let counts = [
            (self.depth, MAX_DEPTH, "elements inside each other"),
            (n_attributes, MAX_ATTRIBUTES, "attributes in one element"),
            (self.n_namespaces, MAX_NAMESPACES, "declarations of name spaces"),
        ];
        let (_, limit, what) = counts.into_iter().find(|(count, limit, _)| count > limit)?;
        Some(format!("has more than {limit} {what}"))
    }
}
