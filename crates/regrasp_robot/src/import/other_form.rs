//! Files of other forms where a URDF is expected: xacro, and models of MuJoCo.

use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::Lines;
use roxmltree::Node;
use std::path::Path;

/// Words in the address of xacro's name space; it has had several addresses.
const XACRO: &str = "xacro";
/// How names of it begin where it is not declared, once read.
const UNDECLARED: &str = "xacro.";

/// What is wrong with the file around `root`, where that is no URDF but a form that another tool turns into one.
///
/// `U107`: a xacro file that was not expanded. `U108`: a model of MuJoCo (MJCF).
pub(super) fn recognised(file: &Path, lines: &Lines, root: Node) -> Option<Diagnostic> {
    let place = |node: Node| lines.place(file, node.range().start);
    if root.has_tag_name("mujoco") || root.has_tag_name("mujocoinclude") {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let fix = format!("python -m regrasp.from_mjcf {} -o {}", shell_word(file), shell_word(Path::new(&*stem)));
        return Some(
            Diagnostic::new("U108", place(root), "is a model of MuJoCo (MJCF)")
                .expected("a URDF")
                .fix(format!("{fix}    # writes hand.toml into that folder")),
        );
    }
    let unexpanded = root.descendants().filter(Node::is_element).find(|node| is_xacro(node) || has_expression(node))?;
    let tag = unexpanded.tag_name().name();
    let tag = tag.strip_prefix(UNDECLARED).unwrap_or(tag);
    let seen = match is_xacro(&unexpanded) {
        true => format!("it has <xacro:{tag}>"),
        false => format!("<{tag}> has an expression in ${{}} or $()"),
    };
    Some(
        Diagnostic::new("U107", place(unexpanded), format!("is a xacro file that was not expanded: {seen}"))
            .expected("plain XML")
            .fix(format!("run xacro first: {}", xacro_command(file))),
    )
}

/// The command that turns the xacro file at `path` into a URDF beside it.
pub(super) fn xacro_command(path: &Path) -> String {
    // hand.urdf.xacro becomes hand.urdf, hand.xacro as well.
    let name = path.with_extension("");
    let out = match is_xacro_name(path) {
        true if name.extension().is_some() => name,
        true => path.with_extension("urdf"),
        false => path.with_extension("expanded.urdf"),
    };
    format!("xacro {} -o {}", shell_word(path), shell_word(&out))
}

/// Whether `path` ends in `.xacro`.
pub(super) fn is_xacro_name(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xacro"))
}

fn is_xacro(node: &Node) -> bool {
    let tag = node.tag_name();
    tag.namespace().is_some_and(|address| address.contains(XACRO)) || tag.name().starts_with(UNDECLARED)
}

/// `${...}` and `$(...)`, which mean nothing in a URDF.
fn has_expression(node: &Node) -> bool {
    node.attributes().any(|attribute| attribute.value().contains("${") || attribute.value().contains("$("))
        // What simulators read is theirs.
        && !node.ancestors().any(|above| above.has_tag_name("gazebo"))
}

/// `path` as a shell takes it.
pub(super) fn shell_word(path: &Path) -> String {
    let text = path.to_string_lossy();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+:,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.into_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
