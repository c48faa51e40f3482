//! The gallery of a grasp list: one small picture for each grasp, all contacts on the surface, and why frames gave no grasp. One
//! HTML file that opens from disk.

/// The pictures.
mod picture;
/// Grasps in one picture.
mod sheet;

pub use sheet::{SheetSettings, png};

use crate::charts::svg::escaped;
use crate::page::{embedded, escape_text, hash};
use picture::View;
use regrasp_plan::check::GraspReport;
use regrasp_plan::grasps::GraspList;
use regrasp_scene::GraspScene;
use std::fmt::Write;

/// Most grasps that are drawn one by one: those with the best scores.
const MOST_DRAWN: usize = 1_000;

const STYLE: &str = "body{font:15px/1.4 system-ui,sans-serif;margin:1.5rem;max-width:75rem}\
h1{font-size:1.3rem}h2{font-size:1.1rem;margin-top:1.5rem}figure{display:inline-block;margin:.2rem;width:11.5rem;\
border:1px solid #8886;border-radius:4px;vertical-align:top}figcaption{padding:.2rem .4rem;font-size:.8rem}\
figure.bad{border-color:#d55e00;border-width:2px}table{border-collapse:collapse}td,th{padding:.15rem .6rem;text-align:left}\
td.n{text-align:right}.bar{background:#0072b2;height:.7rem}svg{background:#fff;border-radius:4px 4px 0 0;display:block}";

const SCRIPT: &str = "const box=document.getElementById('grasps');\
for(const b of document.querySelectorAll('button[data-key]'))b.addEventListener('click',()=>{\
const f=[...box.children];f.sort((x,y)=>y.dataset[b.dataset.key]-x.dataset[b.dataset.key]||x.dataset.index-y.dataset.index);\
box.replaceChildren(...f)});";

/// The page of `list`, which `report` judges; the same list gives the same bytes.
pub fn html(scene: &GraspScene, list: &GraspList, report: &GraspReport) -> String {
    let (script, style) = (embedded(SCRIPT, "script"), embedded(STYLE, "style"));
    let policy = format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; base-uri 'none'; form-action 'none'",
        hash(&script),
        hash(&style)
    );
    let title = format!("Grasps of {} by {}", list.object.name, list.hand.name);
    let view = View::new(scene);
    let mut body = format!("<h1>{}</h1>\n", escape_text(&title));
    add_facts(list, report, &mut body);
    let _ = writeln!(body, "<h2>All contacts</h2>\n{}", view.all_contacts(list));
    let _ = writeln!(
        body,
        "<h2>Grasps</h2>\n<p>Sort by <button data-key=\"score\">score</button> <button data-key=\"margin\">margin</button> \
         <button data-key=\"fingers\">fingers</button></p>\n<div id=\"grasps\">"
    );
    for (index, grasp) in list.grasps.iter().enumerate().take(MOST_DRAWN) {
        let is_bad = report.rejected.binary_search(&index).is_ok();
        let _ = writeln!(
            body,
            "<figure{} data-index=\"{index}\" data-score=\"{}\" data-margin=\"{}\" data-fingers=\"{}\">{}<figcaption>{index}: \
             score {:.3}, margin {:.4}{}<br>{} fingers, stands in {} poses</figcaption></figure>",
            if is_bad { " class=\"bad\"" } else { "" },
            grasp.score,
            grasp.margin,
            grasp.contacts.len(),
            view.grasp(grasp, list),
            grasp.score,
            grasp.margin,
            if is_bad { ", REJECTED" } else { "" },
            grasp.contacts.len(),
            grasp.stable_poses.len(),
        );
    }
    body.push_str("</div>\n");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{style}</style>\n</head>\n<body>\n{}{body}<script>{script}</script>\n</body>\n</html>\n",
        escape_text(&title),
        view.symbols(),
    )
}

/// Counts, the verdict, and why frames gave no grasp.
fn add_facts(list: &GraspList, report: &GraspReport, body: &mut String) {
    let statistics = &list.statistics;
    let verdict = if report.accepted() {
        "accepts the list".to_owned()
    } else {
        format!("rejects {} grasps", report.rejected.len())
    };
    let _ = writeln!(
        body,
        "<p>{} grasps of {} found in {} of {} frames{}. The checker {verdict}. Friction {:.3} over a margin of {}, mass {} kg, {} \
         stable poses.</p>",
        list.grasps.len(),
        statistics.found,
        statistics.frames_tried,
        statistics.frames,
        if statistics.cut_by_time { ", cut short" } else { "" },
        list.object.friction,
        list.promises.friction_margin,
        list.object.mass,
        list.stable_poses.len(),
    );
    let mut reasons: Vec<(&String, &u64)> = statistics.rejected.iter().collect();
    reasons.sort_by(|a, b| b.1.cmp(a.1).then(a.0.cmp(b.0)));
    if reasons.is_empty() {
        return;
    }
    let most = *reasons[0].1 as f64;
    body.push_str("<h2>Frames without a grasp</h2>\n<table>\n");
    for (reason, count) in reasons {
        let width = 200.0 * *count as f64 / most.max(1.0);
        let _ = writeln!(
            body,
            "<tr><td>{}</td><td class=\"n\">{count}</td><td><svg width=\"200\" height=\"11\"><rect width=\"{width:.0}\" height=\"11\" \
             fill=\"#0072b2\"/></svg></td></tr>",
            escaped(reason)
        );
    }
    body.push_str("</table>\n");
}
