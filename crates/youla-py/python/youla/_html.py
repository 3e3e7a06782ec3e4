"""What a notebook shows of a run: the verdict, the fits, a Bode magnitude as SVG. No matplotlib is needed."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ._result import Run

_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 560, 240, 48, 28


def page(run: Run) -> str:
    """Return the HTML of a run."""
    lines = "".join(f"<li>{escape(line)}</li>" for line in (*run.verdict.lines, *run.verdict.defects))
    parts = [f"<h4>{escape(run.name)}</h4><ul>{lines}</ul>", _fits(run), _bode(run)]
    return f"<div class='youla-run'>{''.join(parts)}</div>"


def _fits(run: Run) -> str:
    rows = []
    for model, records in run.fits.items():
        for record, fits in records.items():
            cells = ", ".join("none" if f is None else f"{f:.1f}" for f in fits)
            rows.append(f"<tr><td>{escape(model)}</td><td>{escape(record)}</td><td>{cells}</td></tr>")
    if not rows:
        return "<p>No verification record: no fit.</p>"
    return f"<table><tr><th>model</th><th>record</th><th>fit, %</th></tr>{''.join(rows)}</table>"


def _bode(run: Run) -> str:
    """Magnitude of the first output to the first input, with its band."""
    names = [key for key in ("likelihood", "nominal") if key in run.models]
    responses = [run.frequency_response(model=key) for key in names]
    if not responses:
        return ""
    db = [20 * np.log10(np.maximum(r.magnitude[:, 0, 0], 1e-300)) for r in responses]
    low, high = (np.floor(min(d.min() for d in db) / 10) * 10, np.ceil(max(d.max() for d in db) / 10) * 10)
    f = np.log10(responses[0].hz)
    span = (f[-1] - f[0]) or 1.0

    def at(x: float, y: float) -> str:
        px = _LEFT + (_WIDTH - _LEFT - 8) * (x - f[0]) / span
        py = 8 + (_HEIGHT - _BOTTOM - 8) * (high - min(max(y, low), high)) / max(high - low, 1.0)
        return f"{px:.1f},{py:.1f}"

    marks = []
    for response, color in zip(responses, ("#1f77b4", "#888888"), strict=False):
        x = np.log10(response.hz)
        curve = 20 * np.log10(np.maximum(response.magnitude[:, 0, 0], 1e-300))
        if response.low is not None and response.high is not None:
            bounds = [20 * np.log10(np.maximum(b[:, 0, 0], 1e-300)) for b in (response.low, response.high)]
            there, back = zip(x, bounds[1], strict=True), zip(x[::-1], bounds[0][::-1], strict=True)
            outline = " ".join(at(*p) for p in [*there, *back])
            marks.append(f"<polygon points='{outline}' fill='{color}' fill-opacity='0.25'/>")
        points = " ".join(at(*p) for p in zip(x, curve, strict=True))
        marks.append(f"<polyline points='{points}' fill='none' stroke='{color}'><title>{response.name}</title></polyline>")
    for decade in range(int(np.ceil(f[0])), int(np.floor(f[-1])) + 1):
        x_mark, _ = at(decade, low).split(",")
        marks.append(f"<text x='{x_mark}' y='{_HEIGHT - 12}' text-anchor='middle'>{10.0**decade:g}</text>")
    for level in (low, high):
        _, y_mark = at(f[0], level).split(",")
        marks.append(f"<text x='{_LEFT - 4}' y='{y_mark}' text-anchor='end'>{level:g}</text>")
    marks.append(f"<text x='{_WIDTH / 2}' y='{_HEIGHT - 1}' text-anchor='middle'>Hz, magnitude in dB: recommended blue</text>")
    frame = f"<rect x='{_LEFT}' y='8' width='{_WIDTH - _LEFT - 8}' height='{_HEIGHT - _BOTTOM - 8}' fill='none' stroke='#ccc'/>"
    style = f"width='{_WIDTH}' height='{_HEIGHT}' font-size='10' font-family='sans-serif'"
    return f"<svg xmlns='http://www.w3.org/2000/svg' {style}>{frame}{''.join(marks)}</svg>"
