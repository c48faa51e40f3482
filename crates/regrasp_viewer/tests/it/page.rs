use crate::sample::{Sample, options_with_models};
use regrasp_base::{Rng, files};
use regrasp_viewer::page::{escape_json, escape_text, html};
use regrasp_viewer::story::Story;
use regrasp_viewer::story::pack::base64;

const PIECES: [&str; 24] = [
    "</script><script>alert(1)</script>",
    "</ScRiPt >",
    "<!--",
    "-->",
    "<img src=x onerror=alert(1)>",
    "]]>",
    "<![CDATA[",
    "\u{202e}gnirts",
    "\u{2066}\u{2069}\u{200f}",
    "\u{2028}",
    "\u{2029}",
    "\u{0}",
    "\u{1}\u{7f}\u{9f}",
    "\r\n\t",
    "\\ud800",
    "\\\"",
    "\"'`${1}",
    "&amp;&lt;&#60;",
    "\u{fffe}\u{feff}\u{10ffff}",
    "javascript:alert(1)",
    "<svg/onload=alert(1)>",
    "</title></style></textarea>",
    "{{constructor}}",
    "finger \u{e9}\u{1f590}",
];

/// A name that somebody might want to break a page with.
fn hostile(rng: &mut Rng) -> String {
    let mut name = String::new();
    for _ in 0..1 + rng.below(5) {
        match rng.chance(0.7) {
            true => name.push_str(PIECES[rng.below(PIECES.len())]),
            false => name.extend(char::from_u32(rng.below(0x11_0000) as u32)),
        }
    }
    name
}

/// The text between the first `open` and the next `close`.
fn between<'a>(text: &'a str, open: &str, close: &str) -> &'a str {
    let from = text.find(open).expect("an opening") + open.len();
    &text[from..from + text[from..].find(close).expect("a closing")]
}

#[test]
fn ten_thousand_hostile_names_stay_names() {
    let mut rng = Rng::keyed(11, "names", 0);
    for _ in 0..10_000 {
        let name = hostile(&mut rng);
        let json = escape_json(&serde_json::to_string(&name).unwrap());
        assert!(!json.contains(['<', '>', '&', '\u{2028}', '\u{2029}', '\r', '\n', '\u{0}']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), name);
        let text = escape_text(&name);
        assert!(!text.contains(['<', '>', '"', '\'', '\u{0}', '\r']), "{text}");
    }
}

#[test]
fn a_page_of_hostile_names_has_one_script_and_gives_the_names_back() {
    let mut story = Sample::sphere().story();
    let mut rng = Rng::keyed(12, "names", 0);
    for _ in 0..20 {
        story.title = hostile(&mut rng);
        for hand in &mut story.scene.hands {
            hand.name = hostile(&mut rng);
            hand.links.iter_mut().for_each(|link| link.name = hostile(&mut rng));
            hand.joints.iter_mut().for_each(|joint| joint.name = hostile(&mut rng));
        }
        story.scene.objects.iter_mut().for_each(|object| object.name = hostile(&mut rng));
        story.facts.push((hostile(&mut rng), hostile(&mut rng)));
        let page = html(&story);
        let data = between(&page, "<script type=\"application/json\" id=\"story\">", "</script>");
        assert_eq!(serde_json::from_str::<Story>(data).unwrap(), story);
        let (before, after) = page.split_once(data).unwrap();
        assert_eq!(before.matches("<script").count(), 1);
        // What follows is the end of the data, and the viewer.
        assert!(after.starts_with("</script>\n<script>"));
        assert_eq!(before.matches("<title>").count(), 1);
        let title = between(before, "<title>", "</title>");
        assert!(!title.contains(['<', '>']), "{title}");
    }
}

#[test]
fn the_policy_lets_run_what_is_in_the_page_and_nothing_else() {
    let page = html(&Sample::sphere().story());
    let policy = between(&page, "<meta http-equiv=\"Content-Security-Policy\" content=\"", "\">");
    let hash = |text: &str| format!("'sha256-{}'", base64(&files::sha256_bytes(text.as_bytes())));
    let style = between(&page, "<style>", "</style>");
    let script = between(&page, "</script>\n<script>", "</script>");
    assert!(policy.starts_with("default-src 'none'; "), "{policy}");
    for (source, text) in [("script-src", script), ("style-src", style)] {
        assert!(policy.contains(&format!("{source} {};", hash(text))), "{source} of {policy}");
    }
    for word in ["unsafe", "http:", "https:", "*", "'self'", "eval"] {
        assert!(!policy.contains(word), "{policy}");
    }
    assert!(!script.contains('\r') && !script.contains("<!--"));
    assert_eq!(page.matches("<noscript>").count(), 1);
}

#[test]
fn the_same_story_is_the_same_page_and_pages_are_small() {
    let sphere = Sample::sphere().story();
    let page = html(&sphere);
    assert_eq!(page, html(&sphere));
    assert!(page.len() < 4_000_000, "{}", page.len());
    let Some(options) = options_with_models() else { return };
    // A scanned apple of some 16,000 triangles.
    let page = html(&Sample::new("scenes/allegro/apple_z.toml", options).story());
    assert!(page.len() < 8_000_000, "{}", page.len());
}
