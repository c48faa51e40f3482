//! XML elements and attributes with their places, and every problem gathered.

use super::other_form::{self, is_xacro_name};
use regrasp_base::diagnostic::{Diagnostics, Lines, bad_name};
use regrasp_base::markup::{Hostile, MAX_NODES, refuse_hostile};
use regrasp_base::{Diagnostic, InputError, Place};
use roxmltree::Node;
use std::path::Path;

/// Remarks about one file that are told one by one; the others are counted.
const MAX_NOTES: usize = 100;

/// The XML tree of `text`, the content of `file`.
///
/// Errors: not well formed (`U100`), a document type declaration (`U104`), too deep, too large, or too much of something (`U105`).
pub(crate) fn parse<'a>(file: &Path, text: &'a str) -> Result<roxmltree::Document<'a>, InputError> {
    if text.trim().is_empty() {
        return Err(Diagnostic::new("U100", Place::file(file), "is empty").into());
    }
    refuse_hostile(text).map_err(|hostile| match hostile {
        Hostile::Doctype { offset } => dtd(Place::at_offset(file, text, offset)),
        Hostile::Excess { offset, problem } => Diagnostic::new("U105", Place::at_offset(file, text, offset), problem),
    })?;
    let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..Default::default() };
    roxmltree::Document::parse_with_options(text, options).map_err(|error| {
        let at = error.pos();
        let place = Place { file: file.to_owned(), line: Some(at.row), column: Some(at.col) };
        match error {
            roxmltree::Error::DtdDetected => dtd(place),
            roxmltree::Error::NodesLimitReached => {
                Diagnostic::new("U105", place, format!("has more than {MAX_NODES} XML nodes"))
            }
            other => {
                // The library's text ends in " at ROW:COL", which the place says already.
                let message = other.to_string();
                let problem = message.rsplit_once(" at ").map_or(message.as_str(), |(problem, _)| problem);
                let is_xacro = is_xacro_name(file) || text.contains("<xacro:");
                let extension = file.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_lowercase();
                let fix = match extension.as_str() {
                    _ if is_xacro => other_form::xacro_command(file),
                    "obj" | "stl" | "ply" | "off" | "dae" | "glb" => {
                        "this looks like a mesh: give the URDF of a hand; objects come after it, as in regrasp place HAND OBJECT"
                            .to_owned()
                    }
                    _ => String::new(),
                };
                Diagnostic::new("U100", place, format!("is not well-formed XML: {problem}")).fix(fix)
            }
        }
        .into()
    })
}

fn dtd(place: Place) -> Diagnostic {
    Diagnostic::new("U104", place, "has a document type declaration (DTD)")
        .expected("plain XML without entities")
        .fix("remove the <!DOCTYPE ...> line")
}

/// A file under reading: its problems and remarks so far.
pub(crate) struct Reader<'a> {
    /// The file, as the user named it.
    pub file: &'a Path,
    /// Where its lines begin.
    pub lines: &'a Lines,
    /// Problems.
    pub found: Diagnostics,
    /// Remarks that do not stop the reading.
    notes: Vec<String>,
    n_more_notes: usize,
    /// Whether what cannot be used is dropped with a note where that is safe.
    pub lenient: bool,
}

/// What a message calls the thing it is about: `("joint", "j2")`.
pub(crate) type Named<'a> = (&'a str, &'a str);

impl<'a> Reader<'a> {
    pub fn new(file: &'a Path, lines: &'a Lines, lenient: bool) -> Self {
        Reader { file, lines, found: Diagnostics::default(), notes: Vec::new(), n_more_notes: 0, lenient }
    }

    /// `value` and the remarks, when there were no problems.
    pub fn finish<T>(mut self, value: T) -> Result<(T, Vec<String>), InputError> {
        if self.n_more_notes > 0 {
            self.notes.push(format!("{}: and {} more notes", Place::file(self.file), self.n_more_notes));
        }
        self.found.into_result((value, self.notes))
    }

    /// Err when the outermost element is not `<robot>` (`U106`, `U108`), or when xacro has not expanded the file (`U107`).
    pub fn refuse_other_root(&self, root: Node) -> Result<(), InputError> {
        if let Some(diagnostic) = other_form::recognised(self.file, self.lines, root) {
            return Err(diagnostic.into());
        }
        if root.has_tag_name("robot") {
            return Ok(());
        }
        let problem = format!("the outermost element is <{}>", root.tag_name().name());
        Err(Diagnostic::new("U106", self.place(root), problem).expected("<robot name=\"...\">").into())
    }

    /// Where `node` begins.
    pub fn place(&self, node: Node) -> Place {
        self.lines.place(self.file, node.range().start)
    }

    /// Where attribute `name` of `node` stands, else where the node begins.
    pub fn attribute_place(&self, node: Node, name: &str) -> Place {
        match node.attribute_node(name) {
            Some(attribute) => self.lines.place(self.file, attribute.range().start),
            None => self.place(node),
        }
    }

    /// A remark with its place.
    pub fn note(&mut self, node: Node, element: Named, remark: impl AsRef<str>) {
        if self.notes.len() < MAX_NOTES {
            let place = self.place(node);
            self.notes.push(format!("{place} {} \"{}\": {}", element.0, element.1, remark.as_ref()));
        } else {
            self.n_more_notes += 1;
        }
    }

    /// A remark about another file, told once.
    pub fn note_once(&mut self, remark: String) {
        if self.notes.contains(&remark) {
            return;
        }
        if self.notes.len() < MAX_NOTES {
            self.notes.push(remark);
        } else {
            self.n_more_notes += 1;
        }
    }

    /// The name in attribute `name`, which must be there and be fit to be shown (`U112`, `V004`).
    pub fn required_name<'n>(&mut self, node: Node<'n, '_>, name: &str, kind: &str) -> Option<&'n str> {
        let value = self.required(node, name, (kind, ""))?;
        let bad = bad_name(|| self.attribute_place(node, name), kind, value);
        let is_good = bad.is_none();
        bad.into_iter().for_each(|diagnostic| self.found.push(diagnostic));
        is_good.then_some(value)
    }

    /// The value of attribute `name`, which must be there and not be blank (`U112`).
    pub fn required<'n>(&mut self, node: Node<'n, '_>, name: &str, element: Named) -> Option<&'n str> {
        let tag = node.tag_name().name();
        let problem = match node.attribute(name) {
            Some(value) if !value.trim().is_empty() => return Some(value),
            Some(_) => format!("<{tag}> has an empty attribute {name}"),
            None => format!("<{tag}> has no attribute {name}"),
        };
        let place = self.place(node);
        let diagnostic = Diagnostic::new("U112", place, problem).expected(format!("<{tag} {name}=\"...\">"));
        self.found.push(named(diagnostic, element));
        None
    }

    /// The number in attribute `name`; none where the attribute is missing or the number is bad.
    pub fn number(&mut self, node: Node, name: &str, element: Named) -> Option<f64> {
        let text = node.attribute(name)?;
        let place = self.attribute_place(node, name);
        self.read_number(text, name, place, element)
    }

    /// The `N` numbers in attribute `name`, or `default` where the attribute is missing; none where one is bad.
    pub fn numbers<const N: usize>(
        &mut self,
        node: Node,
        name: &str,
        default: Option<[f64; N]>,
        element: Named,
    ) -> Option<[f64; N]> {
        let Some(text) = node.attribute(name) else {
            if default.is_none() {
                self.required(node, name, element);
            }
            return default;
        };
        let place = self.attribute_place(node, name);
        let words: Vec<&str> = if N == 1 { vec![text] } else { text.split_ascii_whitespace().collect() };
        if words.len() != N {
            let tag = node.tag_name().name();
            self.found.push(
                Diagnostic::new("U111", place, format!("{name} of <{tag}> has {} numbers: \"{text}\"", words.len()))
                    .element(element.0, element.1)
                    .expected(format!("{N} numbers separated by spaces"))
                    .fix(if text.contains(',') { "separate numbers by spaces, not by commas" } else { "" }),
            );
            return None;
        }
        let values: Vec<f64> =
            words.iter().filter_map(|word| self.read_number(word, name, place.clone(), element)).collect();
        values.try_into().ok()
    }

    /// A finite number. `U110`: not a number, or too large for one; `V001`: NaN or infinite.
    fn read_number(&mut self, text: &str, name: &str, place: Place, element: Named) -> Option<f64> {
        let trimmed = text.trim();
        let looks_decimal =
            trimmed.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E'));
        let diagnostic = match trimmed.parse::<f64>() {
            Ok(value) if value.is_finite() => return Some(value),
            Ok(_) if looks_decimal => {
                Diagnostic::new("U110", place, format!("{name} \"{trimmed}\" is too large for a number"))
            }
            Ok(value) => {
                let seen = if value.is_nan() { "NaN" } else { "infinite" };
                Diagnostic::new("V001", place, format!("{name} is {seen}")).expected("a finite number")
            }
            Err(_) => {
                let with_point = trimmed.replace(',', ".");
                let meant = (trimmed.matches(',').count() == 1 && with_point.parse::<f64>().is_ok())
                    .then(|| format!("write {with_point}"));
                Diagnostic::new("U110", place, format!("cannot read {name} \"{trimmed}\" as a number"))
                    .expected("a decimal number such as 0.05")
                    .fix(meant.unwrap_or_default())
            }
        };
        self.found.push(diagnostic.element(element.0, element.1));
        None
    }

    /// Remarks on children of `node` that are a slip of the keyboard away from one of `known`.
    pub fn note_misspelt_children(&mut self, node: Node, known: &[&str], element: Named) {
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            if known.contains(&tag) || child.tag_name().namespace().is_some() {
                continue;
            }
            if let Some(meant) = regrasp_base::diagnostic::did_you_mean(tag, known.iter().copied()) {
                self.note(child, element, format!("<{tag}> is not known and not read; did you mean <{meant}>?"));
            }
        }
    }
}

/// `diagnostic` about `element`, where that has a name.
fn named(diagnostic: Diagnostic, element: Named) -> Diagnostic {
    if element.1.is_empty() { diagnostic } else { diagnostic.element(element.0, element.1) }
}

/// The child elements of `node` called `tag`.
pub(crate) fn children<'a, 'input: 'a>(
    node: Node<'a, 'input>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |child| child.has_tag_name(tag))
}

/// The first child element of `node` called `tag`.
pub(crate) fn child<'a, 'input: 'a>(node: Node<'a, 'input>, tag: &'static str) -> Option<Node<'a, 'input>> {
    children(node, tag).next()
}
