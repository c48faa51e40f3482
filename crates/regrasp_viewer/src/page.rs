//! One self-contained HTML file: viewer, style and story in it, no request leaves it.
//!
//! Names from files reach the page only as JSON in an element that is not run, with every character escaped that could end
//! it; the page sets them as text. The content security policy lets run one script, ours, by its hash.

use crate::story::Story;
use crate::story::pack::base64;
use regrasp_base::diagnostic::printable;
use regrasp_base::files;

/// The viewer, built from `page/src` by `npm run build`.
const SCRIPT: &str = include_str!("../page/dist/viewer.js");
const STYLE: &str = include_str!("../page/dist/viewer.css");

/// The page of `story`; the same story gives the same bytes.
pub fn html(story: &Story) -> String {
    let script = embedded(SCRIPT, "script");
    let style = embedded(STYLE, "style");
    let policy = format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; img-src data: blob:; base-uri 'none'; form-action 'none'",
        hash(&script),
        hash(&style)
    );
    let title = escape_text(&story.title);
    let data = escape_json(&story.to_json());
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n<div id=\"app\"></div>\n\
         <noscript>This page draws a plan with JavaScript, which is switched off.</noscript>\n\
         <script type=\"application/json\" id=\"story\">{data}</script>\n<script>{script}</script>\n</body>\n</html>\n"
    )
}

/// Source expression of a content security policy for an inline element with this text.
pub(crate) fn hash(text: &str) -> String {
    format!("sha256-{}", base64(&files::sha256_bytes(text.as_bytes())))
}

/// Script or style as it can stand in an element called `tag`: nothing in it ends the element or opens a comment, and no
/// line end is one that HTML would rewrite. In strings, templates and regular expressions `\/` and `\!` are `/` and `!`.
pub(crate) fn embedded(text: &str, tag: &str) -> String {
    let text = text.replace("\r\n", "\n").replace('\r', "\n").replace("<!--", "<\\!--");
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some(at) = rest.find("</") {
        let after = &rest.as_bytes()[at + 2..];
        let is_end = after.get(..tag.len()).is_some_and(|name| name.eq_ignore_ascii_case(tag.as_bytes()));
        out.push_str(&rest[..at]);
        out.push_str(if is_end { "<\\/" } else { "</" });
        rest = &rest[at + 2..];
    }
    out + rest
}

/// `text` as text of an element or a quoted attribute; control characters replaced.
pub fn escape_text(text: &str) -> String {
    printable(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// `json` with every character written as an escape that means something to an HTML parser or ends a line of JavaScript.
/// The same value for every JSON parser: these characters stand in strings only.
pub fn escape_json(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for letter in json.chars() {
        match letter {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => out.push_str(&format!("\\u{:04x}", letter as u32)),
            other => out.push(other),
        }
    }
    out
}
