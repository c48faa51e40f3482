//! Reading Isaac grasp files (`format: isaac_grasp`, version 1.0): YAML.
//!
//! Aliases are refused: a few lines of them make a file of terabytes.

use super::foreign::{ForeignGrasp, ForeignGrasps};
use super::format::MAX_BYTES;
use crate::record::PoseData;
use regrasp_base::diagnostic::{GOOD_NAME, fault_of_name, shortened};
use regrasp_base::{Diagnostic, InputError, Place};
use saphyr_parser::{Event, Parser, Span};
use std::collections::BTreeMap;
use std::path::Path;

/// Deepest nesting of a file: a grasp file has five levels.
const MOST_LEVELS: usize = 12;
/// Most values of a file.
const MOST_VALUES: usize = 20_000_000;
/// Most grasps of a file.
const MOST_GRASPS: usize = 1_000_000;
/// Largest position, in metres or radians.
const FARTHEST: f64 = 1e6;
/// How far the length of a quaternion may be from one: other tools write few digits.
const UNIT_TOLERANCE: f64 = 1e-2;

/// A value with its place.
struct Node {
    what: What,
    line: u32,
    column: u32,
}

enum What {
    Text(String),
    List(Vec<Node>),
    Map(Vec<(String, Node)>),
}

/// Reads the grasps of `bytes`, which came from `path`.
///
/// Errors, with line and column: not YAML, too much of it (`G730`), an alias (`G731`), another format or version (`G732`), values that
/// make no sense (`G733`).
pub fn from_isaac(path: &Path, bytes: &[u8]) -> Result<ForeignGrasps, InputError> {
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("has {} bytes, more than the limit of {MAX_BYTES}", bytes.len());
        return Err(Diagnostic::new("G730", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    let root = Tree { path, parser: Parser::new_from_str(&text), n_values: 0 }.root()?;
    Ok(Reader { path }.file(&root)?)
}

/// Makes a tree of the events of a parser.
struct Tree<'p, 't> {
    path: &'p Path,
    parser: Parser<'t, saphyr_parser::StrInput<'t>>,
    n_values: usize,
}

impl<'t> Tree<'_, 't> {
    fn next(&mut self) -> Result<(Event<'t>, Span), Diagnostic> {
        match self.parser.next() {
            Some(Ok(event)) => Ok(event),
            Some(Err(error)) => {
                let place = place(self.path, error.marker().line(), error.marker().col());
                Err(Diagnostic::new("G730", place, shortened(error.info().to_owned(), 200)).expected("YAML"))
            }
            None => Err(Diagnostic::new("G730", Place::file(self.path), "ends too early").expected("YAML")),
        }
    }

    fn root(mut self) -> Result<Node, Diagnostic> {
        loop {
            match self.next()? {
                (Event::StreamStart | Event::DocumentStart(_) | Event::Nothing, _) => {}
                (Event::StreamEnd | Event::DocumentEnd, _) => {
                    return Err(Diagnostic::new("G730", Place::file(self.path), "is empty").expected(GOOD_FILE));
                }
                (event, span) => {
                    let root = self.node(event, span, 0)?;
                    while !matches!(self.next()?, (Event::StreamEnd, _)) {
                        if let Some(Ok((Event::DocumentStart(_), span))) = self.parser.peek() {
                            let place = place(self.path, span.start.line(), span.start.col());
                            let problem = "a second document begins";
                            return Err(Diagnostic::new("G730", place, problem).expected("one document"));
                        }
                    }
                    return Ok(root);
                }
            }
        }
    }

    fn node(&mut self, event: Event<'t>, span: Span, level: usize) -> Result<Node, Diagnostic> {
        let (line, column) = (span.start.line(), span.start.col());
        let fail = |code, problem: String, expected: &str| {
            Err(Diagnostic::new(code, place(self.path, line, column), problem).expected(expected))
        };
        self.n_values += 1;
        if self.n_values > MOST_VALUES || level > MOST_LEVELS {
            let problem = format!("has more than {MOST_LEVELS} levels or {MOST_VALUES} values");
            return fail("G730", problem, GOOD_FILE);
        }
        let what = match event {
            Event::Scalar(text, ..) => What::Text(text.into_owned()),
            Event::Alias(_) => return fail("G731", "an alias (`*name`)".into(), "every value written out"),
            Event::SequenceStart(..) => {
                let mut items = Vec::new();
                loop {
                    match self.next()? {
                        (Event::SequenceEnd, _) => break What::List(items),
                        (event, span) => items.push(self.node(event, span, level + 1)?),
                    }
                }
            }
            Event::MappingStart(..) => {
                let mut entries: Vec<(String, Node)> = Vec::new();
                loop {
                    let (event, span) = self.next()?;
                    if matches!(event, Event::MappingEnd) {
                        break What::Map(entries);
                    }
                    let key = self.node(event, span, level + 1)?;
                    let What::Text(name) = key.what else {
                        let at = place_of(self.path, &key);
                        return Err(Diagnostic::new("G733", at, "a key that is no text").expected(GOOD_FILE));
                    };
                    let (event, span) = self.next()?;
                    entries.push((name, self.node(event, span, level + 1)?));
                }
            }
            _ => return fail("G730", "ends too early".into(), "YAML"),
        };
        Ok(Node { what, line: line as u32, column: column as u32 + 1 })
    }
}

fn place(path: &Path, line: usize, column: usize) -> Place {
    Place { file: path.to_owned(), line: Some(line as u32), column: Some(column as u32 + 1) }
}

fn place_of(path: &Path, node: &Node) -> Place {
    Place { file: path.to_owned(), line: Some(node.line), column: Some(node.column) }
}

const GOOD_FILE: &str = "an Isaac grasp file: format: isaac_grasp, format_version: 1.0, gripper_frame_link, grasps";

/// Makes grasps of a tree.
struct Reader<'p> {
    path: &'p Path,
}

type Read<T> = Result<T, Diagnostic>;

impl Reader<'_> {
    fn wrong<T>(&self, node: &Node, problem: impl Into<String>, expected: impl Into<String>) -> Read<T> {
        Err(Diagnostic::new("G733", place_of(self.path, node), problem).expected(expected))
    }

    fn map<'n>(&self, node: &'n Node) -> Read<&'n [(String, Node)]> {
        let What::Map(entries) = &node.what else { return self.wrong(node, "is no mapping", GOOD_FILE) };
        let mut names: Vec<&str> = entries.iter().map(|(name, _)| name.as_str()).collect();
        names.sort_unstable();
        match names.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => self.wrong(node, format!("has key \"{}\" twice", shortened(pair[0].into(), 80)), "each once"),
            None => Ok(entries),
        }
    }

    fn required<'n>(&self, node: &'n Node, key: &str) -> Read<&'n Node> {
        match self.map(node)?.iter().find(|(name, _)| name == key) {
            Some((_, value)) => Ok(value),
            None => self.wrong(node, format!("has no \"{key}\""), GOOD_FILE),
        }
    }

    fn text<'n>(&self, node: &'n Node) -> Read<&'n str> {
        match &node.what {
            What::Text(text) => Ok(text),
            _ => self.wrong(node, "is no text", "a text"),
        }
    }

    fn name(&self, node: &Node) -> Read<String> {
        let text = self.text(node)?;
        match fault_of_name(text) {
            Some(fault) => self.wrong(node, fault, GOOD_NAME),
            None => Ok(text.to_owned()),
        }
    }

    fn number(&self, node: &Node) -> Read<f64> {
        let text = self.text(node)?;
        match text.parse::<f64>() {
            Ok(value) if value.abs() <= FARTHEST => Ok(value),
            _ => self.wrong(node, format!("is \"{}\"", shortened(text.into(), 80)), "a number in metres or radians"),
        }
    }

    fn three(&self, node: &Node) -> Read<[f64; 3]> {
        match &node.what {
            What::List(items) if items.len() == 3 => {
                Ok([self.number(&items[0])?, self.number(&items[1])?, self.number(&items[2])?])
            }
            _ => self.wrong(node, "is no list of three numbers", "[x, y, z]"),
        }
    }

    fn file(&self, root: &Node) -> Read<ForeignGrasps> {
        let other = |node: &Node, problem: String| {
            let fix = "convert the file; `regrasp export LIST --isaac F` writes one";
            Err(Diagnostic::new("G732", place_of(self.path, node), problem).expected(GOOD_FILE).fix(fix))
        };
        let Some((_, format)) = self.map(root)?.iter().find(|(name, _)| name == "format") else {
            return other(root, "has no \"format\"".into());
        };
        if self.text(format)? != "isaac_grasp" {
            return other(format, format!("is \"{}\"", shortened(self.text(format)?.into(), 80)));
        }
        let version = self.required(root, "format_version")?;
        if self.number(version)? != 1.0 {
            return other(version, format!("is {}", shortened(self.text(version)?.into(), 80)));
        }
        let frame = self.required(root, "gripper_frame_link")?;
        let grasps = self.map(self.required(root, "grasps")?)?;
        if grasps.len() > MOST_GRASPS {
            return self.wrong(root, format!("has {} grasps", grasps.len()), format!("at most {MOST_GRASPS}"));
        }
        let grasps: Read<Vec<ForeignGrasp>> = grasps.iter().map(|(name, node)| self.grasp(name, node)).collect();
        Ok(ForeignGrasps { hand_link: self.name(frame)?, grasps: grasps? })
    }

    fn grasp(&self, name: &str, node: &Node) -> Read<ForeignGrasp> {
        if let Some(fault) = fault_of_name(name) {
            return self.wrong(node, fault, GOOD_NAME);
        }
        let position = self.three(self.required(node, "position")?)?;
        let orientation = self.required(node, "orientation")?;
        let w = self.number(self.required(orientation, "w")?)?;
        let [x, y, z] = self.three(self.required(orientation, "xyz")?)?;
        let length = (w * w + x * x + y * y + z * z).sqrt();
        if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
            return self.wrong(orientation, format!("has length {length:.6}"), "a quaternion of length 1");
        }
        let sign = if w < 0.0 { -1.0 / length } else { 1.0 / length };
        let quat_xyzw = [x, y, z, w].map(|part| part * sign);
        let optional =
            |key: &str| self.map(node).map(|all| all.iter().find(|(name, _)| name == key).map(|(_, value)| value));
        let open = optional("pregrasp_cspace_position")?.map(|node| self.joints(node)).transpose()?;
        Ok(ForeignGrasp {
            name: name.to_owned(),
            object_from_link: PoseData { position, quat_xyzw },
            confidence: optional("confidence")?.map(|node| self.number(node)).transpose()?,
            joints: self.joints(self.required(node, "cspace_position")?)?,
            open_joints: open,
        })
    }

    fn joints(&self, node: &Node) -> Read<BTreeMap<String, f64>> {
        self.map(node)?.iter().map(|(name, value)| Ok((name.clone(), self.number(value)?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "format: isaac_grasp\nformat_version: 1.0\nobject_frame_link: mug\ngripper_frame_link: palm\ngrasps:\n  \
                        g_0:\n    confidence: 0.5\n    position: [0.1, 0, -2e-1]\n    orientation: {w: -1.0, xyz: [0, 0, 0]}\n    \
                        cspace_position: {a: 0.25, b: 1}\n    pregrasp_cspace_position:\n      a: 0\n      b: 0.5\n";

    fn read(text: &str) -> Result<ForeignGrasps, String> {
        from_isaac(Path::new("g.yaml"), text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_good_file_is_read() {
        let read = read(GOOD).unwrap();
        assert_eq!(read.hand_link, "palm");
        let grasp = &read.grasps[0];
        assert_eq!((grasp.name.as_str(), grasp.confidence), ("g_0", Some(0.5)));
        assert_eq!(grasp.object_from_link.position, [0.1, 0.0, -0.2]);
        assert_eq!(grasp.object_from_link.quat_xyzw[3], 1.0);
        assert_eq!(grasp.joints["a"], 0.25);
        assert_eq!(grasp.open_joints.as_ref().unwrap()["b"], 0.5);
    }

    #[test]
    fn bad_files_are_refused_where_they_are_bad() {
        for (change, to, code, at) in [
            ("isaac_grasp", "other", "G732", "g.yaml:1:9"),
            ("1.0\nobject", "2.0\nobject", "G732", "g.yaml:2:17"),
            ("[0.1, 0, -2e-1]", "[0.1, 0]", "G733", "g.yaml:8:15"),
            ("[0.1, 0, -2e-1]", "[0.1, .nan, 0]", "G733", "g.yaml:8:21"),
            ("[0.1, 0, -2e-1]", "&p [0.1, 0, 0]\n    more: *p", "G731", "g.yaml:9:11"),
            ("w: -1.0", "w: -1.5", "G733", "g.yaml:9:"),
            ("b: 1}", "a: 1}", "G733", "twice"),
            ("cspace_position: {a", "cspace: {a", "G733", "cspace_position"),
            ("grasps:", "grasps: [", "G730", "g.yaml:"),
        ] {
            assert!(GOOD.contains(change), "{change}");
            let error = read(&GOOD.replacen(change, to, 1)).expect_err(to);
            assert!(error.contains(code) && error.contains(at), "{to}: {error}");
        }
        assert!(read("").unwrap_err().contains("G730"));
        assert!(read(&"[".repeat(5000)).unwrap_err().contains("G730"));
        assert!(read(&format!("{GOOD}---\na: 1\n")).unwrap_err().contains("G730"));
    }
}
