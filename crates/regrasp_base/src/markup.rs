//! XML that would cost its parser far more than its bytes, told before a parser sees it; and names that parsers refuse without need.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

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
    let mut markup = Markup::default();
    for piece in (Pieces { text, at: 0 }) {
        let (open, end) = (piece.open, piece.end.unwrap_or(text.len()));
        match piece.kind {
            Kind::Doctype => return Err(Hostile::Doctype { offset: open }),
            Kind::Closing => markup.depth = markup.depth.saturating_sub(1),
            Kind::Opening => {
                let tag = text.as_bytes().get(open..end).unwrap_or_default();
                markup.depth += usize::from(piece.end.is_some() && !tag.ends_with(b"/>"));
                if let Some(problem) = markup.excess(tag) {
                    return Err(Hostile::Excess { offset: open, problem });
                }
            }
            Kind::Other => {}
        }
    }
    Ok(())
}

/// `text`, with a dot for the colon in names whose prefix is declared nowhere: `<drake.member` for `<drake:member`. Parsers that know
/// name spaces refuse such names, others read them, and files are written that have them. Every byte keeps its place.
pub fn without_undeclared_prefixes(text: &str) -> Cow<'_, str> {
    let tags = Pieces { text, at: 0 }.filter(|piece| matches!(piece.kind, Kind::Opening | Kind::Closing));
    let mut declared: BTreeSet<&str> = ["xml", "xmlns"].into();
    let mut prefixed = Vec::new();
    for tag in tags {
        let Some(end) = tag.end else { break };
        for name in names(text, tag.open, end) {
            let Some((prefix, local)) = text[name.clone()].split_once(':') else { continue };
            if prefix == "xmlns" {
                declared.insert(local);
            } else if !prefix.is_empty() && !local.is_empty() {
                prefixed.push(name.start..name.start + prefix.len());
            }
        }
    }
    prefixed.retain(|prefix| !declared.contains(&text[prefix.clone()]));
    if prefixed.is_empty() {
        return Cow::Borrowed(text);
    }
    let (mut plain, mut at) = (String::with_capacity(text.len()), 0);
    for prefix in prefixed {
        plain += &text[at..prefix.end];
        plain.push('.');
        at = prefix.end + 1;
    }
    Cow::Owned(plain + &text[at..])
}

/// Where the names of the tag between `open` and `end` are: its own and those of its attributes.
fn names(text: &str, open: usize, end: usize) -> Vec<Range<usize>> {
    let (mut found, mut quote, mut start) = (Vec::new(), None, None);
    for (k, &byte) in text.as_bytes()[..end].iter().enumerate().skip(open + 1) {
        match quote {
            Some(q) => quote = (q != byte).then_some(q),
            None if matches!(byte, b'"' | b'\'') => quote = Some(byte),
            None if byte.is_ascii_whitespace() || matches!(byte, b'=' | b'/' | b'>' | b'<') => {
                found.extend(start.take().map(|start| start..k));
            }
            None => start = start.or(Some(k)),
        }
    }
    found
}

/// What a piece of markup is.
enum Kind {
    Opening,
    Closing,
    Doctype,
    /// Comments, character data and processing instructions.
    Other,
}

/// A piece of markup: where it begins, and the index after its end; none where it has no end.
struct Piece {
    kind: Kind,
    open: usize,
    end: Option<usize>,
}

/// The pieces of markup from `at` on. After one without an end there is none.
struct Pieces<'a> {
    text: &'a str,
    at: usize,
}

impl Iterator for Pieces<'_> {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        let after = |from: usize, end: &str| self.text.get(from..)?.find(end).map(|k| from + k + end.len());
        let open = after(self.at, "<")? - 1;
        let rest = &self.text[open..];
        // Quotes mean nothing in comments, character data and processing instructions, nor in closing tags.
        let (kind, end) = if rest.starts_with("<!--") {
            (Kind::Other, after(open + 4, "-->"))
        } else if rest.starts_with("<![CDATA[") {
            (Kind::Other, after(open + 9, "]]>"))
        } else if rest.starts_with("<?") {
            (Kind::Other, after(open + 2, "?>"))
        } else if rest.starts_with("<!DOCTYPE") {
            (Kind::Doctype, None)
        } else if rest.starts_with("<!") {
            (Kind::Other, None)
        } else if rest.starts_with("</") {
            (Kind::Closing, after(open + 2, ">"))
        } else {
            (Kind::Opening, end_of_tag(self.text.as_bytes(), open))
        };
        self.at = end.unwrap_or(self.text.len());
        Some(Piece { kind, open, end })
    }
}

/// Index after the `>` that ends the tag which opens at `open`; quoted values may contain `>`. None where there is no end.
fn end_of_tag(bytes: &[u8], open: usize) -> Option<usize> {
    let mut quote = None;
    for (k, &byte) in bytes.iter().enumerate().skip(open + 1) {
        match (quote, byte) {
            (None, b'>') => return Some(k + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            // What follows is another tag, and this one is broken.
            (None, b'<') => return None,
            (Some(q), _) if q == byte => quote = None,
            _ => {}
        }
    }
    None
}

/// What the markup of a file has been found to hold so far.
#[derive(Default)]
struct Markup {
    depth: usize,
    n_namespaces: usize,
}

impl Markup {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Names whose prefix nobody declares lose it; nothing else changes, and no byte moves.
    #[test]
    fn undeclared_prefixes_become_plain_names() {
        let text = r#"<?xml version="1.0"?><a xmlns:k="u" k:x='1' d:y="d:z"><!-- d:no --><d:b k:q="<d:c>"/><k:c>d:t</k:c></d:e><![CDATA[<d:f>]]></a>"#;
        let plain = without_undeclared_prefixes(text);
        let wanted = text.replace(" d:y", " d.y").replace("<d:b", "<d.b").replace("</d:e", "</d.e");
        assert_eq!((plain.as_ref(), plain.len()), (wanted.as_str(), text.len()));
        for same in
            ["", "<a", "<a b", "<:a b:='1'/>", "<a xmlns:x='u'><x:b/></a>", "<a xml:lang='en'/>", "no markup: none"]
        {
            assert!(matches!(without_undeclared_prefixes(same), Cow::Borrowed(_)), "{same}");
        }
        assert_eq!(without_undeclared_prefixes("<é:ü ö:ß='>'/><a:"), "<é.ü ö.ß='>'/><a:");
    }
}
