//! Charts over the time of a run.

use super::{Doing, Run, Sample, gait};
use crate::charts::svg::{Anchor, GRID, INK, SHADE, SOFT, Scale, Svg, cut, fixed};
use crate::palette;
use crate::timeline::Doing as Holding;
use regrasp_plan::Plan;

/// Edges of the panels, and the width of a sheet.
const LEFT: f64 = 90.0;
const RIGHT: f64 = 1080.0;
const SHEET: f64 = 1096.0;
/// Room for the name, height of a panel of curves, room for the times.
const TOP: f64 = 28.0;
const PANEL: f64 = 130.0;
const AXIS: f64 = 26.0;
/// Height of a finger's row, and free room over and under its bar.
const ROW: f64 = 20.0;
const GAP: f64 = 4.0;
/// Columns of a curve: of more samples the highest in each is drawn.
const COLUMNS: usize = 1_000;
/// Colour of goals that were reached.
const REACHED: &str = "#00703c";

/// What a curve shows of a sample.
type CurveValue<'a> = Box<dyn Fn(&Sample) -> Option<f64> + 'a>;

/// A curve: its name, its colour, its values.
pub(super) struct Curve<'a> {
    pub name: String,
    pub color: &'static str,
    pub value: CurveValue<'a>,
}

/// The time axis of a run.
pub(super) fn time_scale(run: &Run) -> Scale {
    let (first, last) = run.span();
    Scale::new(first, last, LEFT, RIGHT)
}

/// Curves over time: grey while a leg moves the object, lines for events, marks for goals that were reached.
pub(super) fn curves(run: &Run, title: &str, curves: &[Curve]) -> String {
    let time = time_scale(run);
    let bottom = TOP + PANEL;
    let drawn: Vec<Vec<Option<[f64; 2]>>> = curves.iter().map(|curve| columns(run, &time, &curve.value)).collect();
    let most = drawn.iter().flatten().flatten().map(|point| point[1]).fold(0.0, f64::max);
    let values = Scale::new(0.0, if most > 0.0 { most } else { 1.0 }, bottom, TOP).rounded(4);
    let mut svg = Svg::new(SHEET, bottom + AXIS);
    heading(&mut svg, title);
    shade(&mut svg, run, &time, bottom);
    let (ticks, decimals) = values.ticks(4);
    for tick in ticks {
        let y = values.at(tick);
        svg.line([LEFT, y], [RIGHT, y], GRID, 1.0, "");
        svg.text(&fixed(tick, decimals), [LEFT - 6.0, y + 4.0], Anchor::End, SOFT, "font-size=\"11\"");
    }
    events(&mut svg, run, &time, bottom);
    let mut x = RIGHT;
    for (curve, points) in curves.iter().zip(&drawn).rev() {
        let points: Vec<Option<[f64; 2]>> =
            points.iter().map(|point| point.map(|[x, value]| [x, values.at(value)])).collect();
        svg.path(&points, curve.color, 1.2, "");
        if curves.len() > 1 {
            svg.text(&curve.name, [x, 18.0], Anchor::End, curve.color, "");
            x -= 14.0 + 6.5 * curve.name.chars().count() as f64;
        }
    }
    finish(svg, run, &time, bottom, title)
}

/// Which finger was to hold when, by the plans of the legs; `None` where no plan is there.
pub(super) fn holding(run: &Run, plans: &[Option<Plan>]) -> Option<String> {
    let names = plans.iter().flatten().next()?.fingers.clone();
    let time = time_scale(run);
    let bottom = TOP + ROW * names.len() as f64;
    let title = "Plans: which finger holds when";
    let mut svg = Svg::new(SHEET, bottom + AXIS);
    heading(&mut svg, title);
    shade(&mut svg, run, &time, bottom);
    for (finger, name) in names.iter().enumerate() {
        let top = TOP + ROW * finger as f64;
        let color = palette::color(finger);
        let stripes = svg.stripes(finger, color);
        svg.text(&cut(name, 12), [LEFT - 6.0, top + ROW / 2.0 + 4.0], Anchor::End, INK, "font-size=\"11\"");
        for (leg, plan) in plans.iter().enumerate() {
            let Some(plan) = plan.as_ref().filter(|plan| plan.fingers == names) else { continue };
            for stretch in gait::stretches(run, leg, plan, finger) {
                let (x, end, middle) = (time.at(stretch.from), time.at(stretch.until), top + ROW / 2.0);
                let (place, size) = ([x, top + GAP], [end - x, ROW - 2.0 * GAP]);
                match stretch.doing {
                    Holding::Holds | Holding::Slides => svg.rect(place, size, color, ""),
                    Holding::Rolls => svg.rect(place, size, &stripes, ""),
                    Holding::Moves => svg.line([x, middle], [end, middle], color, 2.0, ""),
                    Holding::Waits => svg.line([x, middle], [end, middle], color, 1.0, "stroke-dasharray=\"1 4\""),
                }
            }
        }
    }
    events(&mut svg, run, &time, bottom);
    Some(finish(svg, run, &time, bottom, title))
}

/// The highest value in each column: its place, and the value.
fn columns(run: &Run, time: &Scale, value: &dyn Fn(&Sample) -> Option<f64>) -> Vec<Option<[f64; 2]>> {
    let width = (RIGHT - LEFT) / COLUMNS as f64;
    let mut points: Vec<Option<[f64; 2]>> = Vec::new();
    let mut column = None;
    for sample in &run.samples {
        let x = time.at(sample.time);
        let Some(value) = value(sample) else {
            if points.last().is_some_and(Option::is_some) {
                points.push(None);
            }
            continue;
        };
        let own = ((x - LEFT) / width).floor();
        match points.last_mut() {
            Some(Some(last)) if column == Some(own) => last[1] = last[1].max(value),
            _ => points.push(Some([x, value])),
        }
        column = Some(own);
    }
    points
}

fn heading(svg: &mut Svg, title: &str) {
    svg.text(title, [LEFT, 18.0], Anchor::Start, INK, "font-weight=\"bold\"");
}

/// Grey while a leg moves the object.
fn shade(svg: &mut Svg, run: &Run, time: &Scale, bottom: f64) {
    let mut from: Option<f64> = None;
    let mut last = 0.0;
    let mut rect = |from: f64, until: f64| {
        let (x, end) = (time.at(from), time.at(until));
        svg.rect([x, TOP], [(end - x).max(0.5), bottom - TOP], SHADE, "");
    };
    for sample in &run.samples {
        match (sample.state == Doing::Run, from) {
            (true, None) => from = Some(sample.time),
            (false, Some(begun)) => {
                rect(begun, last);
                from = None;
            }
            _ => {}
        }
        last = sample.time;
    }
    if let Some(begun) = from {
        rect(begun, last);
    }
}

fn events(svg: &mut Svg, run: &Run, time: &Scale, bottom: f64) {
    for event in &run.events {
        let x = time.at(event.time);
        svg.titled_line(
            [x, TOP],
            [x, bottom],
            event.answer.color(),
            1.5,
            &format!("{:.2} s, {}: {}", event.time, event.kind, event.message),
        );
    }
}

/// Frame, times, marks for goals that were reached.
fn finish(mut svg: Svg, run: &Run, time: &Scale, bottom: f64, title: &str) -> String {
    for goal in run.goals.iter().filter(|goal| goal.reached) {
        let x = time.at(goal.time);
        svg.line([x, bottom], [x, bottom + 7.0], REACHED, 3.0, "");
    }
    svg.rect([LEFT, TOP], [RIGHT - LEFT, bottom - TOP], "none", "stroke=\"#9a9a9a\" stroke-width=\"1\"");
    let (ticks, decimals) = time.ticks(10);
    for tick in ticks {
        let label = format!("{} s", fixed(tick, decimals));
        svg.text(&label, [time.at(tick), bottom + 19.0], Anchor::Middle, SOFT, "font-size=\"11\"");
    }
    svg.finish(title)
}
