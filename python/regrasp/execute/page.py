"""The page of a run: deviation over time, events, replans, goals. One HTML file that fetches nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from .log import RunLog, Sample

#: Size of a chart, in pixels.
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 1100, 170, 60, 24, 10
#: Points of a curve at most: more are not seen.
POINTS = 1500
#: One colour for each of the fingers, as pages of plans have them.
FINGERS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
ANSWERS = {"replan": "#d55e00", "hold": "#e69f00", "give_up": "#c00000", "ignore": "#888888", "none": "#888888"}

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:1.5rem auto;max-width:1160px;padding:0 1rem;color:#222;background:#fff}
h1{font-size:1.4rem;margin:0}h2{font-size:1.1rem;margin:1.6rem 0 .3rem}
svg{display:block;width:100%;height:auto}svg text{font:11px system-ui,sans-serif;fill:#555}
table{border-collapse:collapse;width:100%;font-size:13px}th,td{text-align:left;padding:.15rem .6rem .15rem 0;border-bottom:1px solid #ddd}
td.n{text-align:right;font-variant-numeric:tabular-nums}.no{color:#c00000}.yes{color:#00703c}
p.lead{font-size:1.05rem;margin:.3rem 0 1rem}
@media (prefers-color-scheme:dark){body{color:#ddd;background:#181818}svg text{fill:#aaa}th,td{border-color:#444}}
"""


def page(log: RunLog, title: str | None = None) -> str:
    """The page of ``log``."""
    name = title or f"Run of {log.scene}"
    end = max((sample.time for sample in log.samples), default=1.0)
    reached = f"{log.n_reached} of {len(log.goals)} goals reached"
    ended = f"{log.status}{': ' + log.message if log.message else ''}"
    charts = [
        _chart(
            log,
            end,
            "Distance from the plan, in millimetres",
            [
                ("estimated", "#0072b2", lambda sample: 1e3 * sample.distance),
                ("real", "#d55e00", lambda sample: None if sample.true_distance is None else 1e3 * sample.true_distance),
            ],
        ),
        _chart(
            log,
            end,
            "Angle from the plan, in degrees",
            [
                ("estimated", "#0072b2", lambda sample: float(np.degrees(sample.angle))),
                ("real", "#d55e00", lambda sample: None if sample.true_angle is None else float(np.degrees(sample.true_angle))),
            ],
        ),
        _chart(log, end, "Slip of the fingertip that slipped farthest, in millimetres", [("slip", "#cc79a7", lambda s: 1e3 * s.slip)]),
    ]
    n_fingers = max((len(sample.forces) for sample in log.samples if sample.forces), default=0)
    if n_fingers:
        curves: list[tuple[str, str, Callable[[Sample], float | None]]] = [
            (f"finger {f + 1}", FINGERS[f % len(FINGERS)], lambda sample, f=f: None if sample.forces is None else sample.forces[f])
            for f in range(n_fingers)
        ]
        charts.append(_chart(log, end, "Normal force of every fingertip, in newtons", curves))
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(name)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head><body>'
        f'<h1>{escape(name)}</h1><p class="lead">{reached}, {log.n_replans} replans, {end:.1f} s; {escape(ended)}.</p>'
        "<p>Grey bands are legs: white where the hand holds. Vertical lines are events, coloured by what was done: "
        '<span style="color:#d55e00">replan</span>, <span style="color:#e69f00">hold</span>, '
        '<span style="color:#c00000">give up</span>. Green ticks are goals reached.</p>'
        + "".join(charts)
        + _goals(log)
        + _events(log)
        + _legs(log)
        + "</body></html>\n"
    )


Curve = tuple[str, str, Callable[[Sample], float | None]]


def _chart(log: RunLog, end: float, title: str, curves: Sequence[Curve]) -> str:
    stride = max(1, len(log.samples) // POINTS)
    samples = log.samples[::stride]
    values = [[curve[2](sample) for sample in samples] for curve in curves]
    most = max((value for row in values for value in row if value is not None), default=1.0)
    top = _round_up(most)

    def x(time: float) -> float:
        return LEFT + (WIDTH - LEFT - 10) * time / end

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - min(value, top) / top)

    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title)}">']
    for first, last in _running(log):
        parts.append(
            f'<rect x="{x(first):.1f}" y="{TOP}" width="{max(x(last) - x(first), 0.5):.1f}" height="{HEIGHT - TOP - BOTTOM}" '
            'fill="#8882" stroke="none"/>'
        )
    for step in range(3):
        level = top * step / 2
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - 10}" y1="{y(level):.1f}" y2="{y(level):.1f}" stroke="#8886" stroke-width="0.7"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y(level) + 4:.1f}" text-anchor="end">{level:g}</text>')
    for event in log.events:
        colour = ANSWERS.get(event.answer, "#888888")
        label = escape(f"{event.time:.2f} s {event.kind}: {event.message}")
        parts.append(
            f'<line x1="{x(event.time):.1f}" x2="{x(event.time):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="{colour}" '
            f'stroke-width="1.5"><title>{label}</title></line>'
        )
    for (_, colour, _), row in zip(curves, values):
        points = [f"{x(sample.time):.1f},{y(value):.1f}" for sample, value in zip(samples, row) if value is not None]
        parts.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}" stroke-width="1.1"/>')
    for goal in log.goals:
        if goal.reached:
            parts.append(f'<line x1="{x(goal.time):.1f}" x2="{x(goal.time):.1f}" y1="{HEIGHT - BOTTOM}" y2="{HEIGHT - BOTTOM + 7}" stroke="#00703c" stroke-width="3"/>')
    for share in range(0, 11, 2):
        time = end * share / 10
        parts.append(f'<text x="{x(time):.1f}" y="{HEIGHT - 4}" text-anchor="middle">{time:.0f} s</text>')
    parts.append("</svg>")
    legend = ", ".join(f'<span style="color:{colour}">{escape(label)}</span>' for label, colour, _ in curves)
    return f"<h2>{escape(title)}</h2><p style='margin:0;font-size:13px'>{legend}</p>" + "".join(parts)


def _running(log: RunLog) -> list[tuple[float, float]]:
    spans: list[tuple[float, float]] = []
    begun: float | None = None
    last = 0.0
    for sample in log.samples:
        runs = sample.state == "run"
        if runs and begun is None:
            begun = sample.time
        if not runs and begun is not None:
            spans.append((begun, last))
            begun = None
        last = sample.time
    if begun is not None:
        spans.append((begun, last))
    return spans


def _round_up(value: float) -> float:
    """The least of 1, 2, 5 times a power of ten that is not below ``value``."""
    if not value > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value))


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    if not rows:
        return f"<h2>{escape(title)}</h2><p>None.</p>"
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<h2>{escape(title)}</h2><table><tr>{head}</tr>{body}</table>"


def _millimetres(value: float | None) -> str:
    return "" if value is None else f"{1e3 * value:.2f}"


def _degrees(value: float | None) -> str:
    return "" if value is None else f"{np.degrees(value):.2f}"


def _goals(log: RunLog) -> str:
    heads = ("goal", "reached", "turn, deg", "legs", "time, s", "motion, s", "off, mm", "off, deg", "really, mm", "really, deg", "why not")
    rows = [
        (
            str(number),
            '<span class="yes">yes</span>' if goal.reached else '<span class="no">no</span>',
            f"{np.degrees(goal.turn):.0f}",
            str(goal.legs),
            f"{goal.time - goal.start_time:.1f}",
            f"{goal.motion_time:.1f}",
            _millimetres(goal.distance),
            _degrees(goal.angle),
            _millimetres(goal.true_distance),
            _degrees(goal.true_angle),
            escape(goal.why_not),
        )
        for number, goal in enumerate(log.goals, start=1)
    ]
    return _table("Goals", heads, rows)


def _events(log: RunLog) -> str:
    rows = [
        (f"{event.time:.2f}", escape(event.kind), escape(event.message), escape(event.answer), str(event.goal + 1), str(event.leg + 1))
        for event in log.events
    ]
    return _table("Events", ("time, s", "event", "what", "answer", "goal", "leg"), rows)


def _legs(log: RunLog) -> str:
    rows = [
        (
            str(number),
            str(leg.goal + 1),
            f"{leg.start_time:.2f}",
            f"{leg.duration:.2f}",
            f"{1e3 * leg.search_seconds:.0f}",
            f"{1e3 * leg.check_seconds:.0f}",
            "while the leg before ran" if leg.prepared else "at rest",
            _millimetres(leg.moved.get("object")),
            _degrees(leg.moved.get("object_turn")),
            escape(", ".join(leg.free)),
        )
        for number, leg in enumerate(log.legs, start=1)
    ]
    heads = ("leg", "goal", "begins, s", "motion, s", "search, ms", "check, ms", "planned", "start moved, mm", "by, deg", "free fingers")
    return _table("Legs", heads, rows)
