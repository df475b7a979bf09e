"""The study as one HTML page that opens offline: figures, tables, remarks, and where it all comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from xy_sysid.report import captions, figures
from xy_sysid.report.remarks import NOT_A_CONFIDENCE, PAPER_VALUES, PRINTED, axis_remarks
from xy_sysid.report.study import AxisStudy
from xy_sysid.report.tables import Table, change_table, coefficient_table, result_table
from xy_sysid.report.theme import template


@dataclass(frozen=True, slots=True)
class Drawing:
    """One Plotly figure of the page: its element's id, the figure, what it shows in words, and its title."""

    name: str
    figure: go.Figure
    alt: str
    title: str = ""


def study_page(
    title: str,
    studies: Mapping[str, AxisStudy],
    units: tuple[str, str],
    least_coherence: float,
    origins: Mapping[str, Mapping[str, Any]],
    notes: tuple[str, ...] = (),
) -> str:
    """The whole page.

    title: name of the recording; studies: by axis; units: of input and output; least_coherence: limit of a trusted line
    origins: label -> provenance of each recording; notes: what was odd while reading
    """
    input_unit, output_unit = units
    responses = {axis: one.frf for axis, one in studies.items() if one.frf is not None}
    fitted = {axis: one for axis, one in studies.items() if one.fits}
    drawings: list[Drawing] = []
    parts: list[str] = []

    def section(number: int, title: str, made: list[Drawing], caption: str, extra: str = "") -> None:
        drawings.extend(made)
        parts.append(_section(f"fig-{number}", f"Figure {number}: {title}", made, caption, extra))

    inputs = {axis: one.excitation for axis, one in studies.items()}
    caption = captions.excitation(inputs, input_unit)
    section(2, "excitation", [Drawing("plot-2", figures.excitation_figure(inputs, input_unit), caption)], caption)
    outputs = {axis: one.motion for axis, one in studies.items()}
    caption = captions.position(outputs, output_unit)
    section(3, "measured position", [Drawing("plot-3", figures.position_figure(outputs, output_unit), caption)], caption)
    if responses:
        caption = captions.response(responses)
        section(4, "frequency response", [Drawing("plot-4", figures.response_figure(responses), caption)], caption)
        caption = captions.coherence(responses, least_coherence)
        section(5, "coherence", [Drawing("plot-5", figures.coherence_figure(responses, least_coherence), caption)], caption)
    made: list[Drawing] = []
    for axis, one in fitted.items():
        frf = responses[axis]
        made.append(Drawing(f"plot-6-{len(made)}", figures.fit_figure(frf, one.fits), captions.fit(axis, one.fits), f"Axis {axis}"))
    section(6, "fits over the measurement", made, captions.FITS if made else captions.NO_FIT)
    made = []
    for axis, one in fitted.items():
        if one.change is not None and (one.change.before or one.change.after):
            made.append(Drawing(f"plot-7-{len(made)}", figures.pair_figure(one.change), captions.change(axis, one.change), f"Axis {axis}"))
    changed = change_table(studies)
    section(7, captions.pair_title(studies), made, captions.pair(studies), _table(changed) if changed else "")
    coefficients = "".join(_table(coefficient_table(axis, one.fits)) for axis, one in fitted.items())
    results = "".join(_table(result_table(one)) for one in fitted.values())
    parts.append(_block("table-1", "Table 1: coefficients of the transfer functions", captions.COEFFICIENTS, coefficients))
    parts.append(_block("table-2", "Table 2: error, “confidence” and physical values", f"{NOT_A_CONFIDENCE} {PAPER_VALUES}", results))
    remarks = [PRINTED, *notes, *(text for one in studies.values() for text in axis_remarks(one))]
    listed = "".join(f"<li>{escape(text)}</li>" for text in remarks)
    parts.append(f'<section id="remarks"><h2>Remarks</h2><ul>{listed}</ul></section>')
    parts.append(_origins(origins))
    return _whole(title, studies, parts, drawings)


def _whole(title: str, studies: Mapping[str, AxisStudy], parts: list[str], drawings: list[Drawing]) -> str:
    plots = {drawing.name: json.loads(drawing.figure.to_json()) for drawing in drawings}
    for plot in plots.values():
        plot["layout"].pop("template", None)
    templates = {mode: template(mode) for mode in ("light", "dark")}
    assets = files("xy_sysid.report")
    style = (assets / "page.css").read_text(encoding="utf-8")
    script = (assets / "page.js").read_text(encoding="utf-8")
    summary = "".join(f"<li>{escape(captions.summary(one))}</li>" for one in studies.values())
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            f"<title>Study of {escape(title)}</title><style>{style}</style></head><body><main>",
            f"<header><h1>Study of {escape(title)}</h1><p>{escape(captions.INTRODUCTION)}</p><ul>{summary}</ul></header>",
            "<noscript><p>The figures need JavaScript; tables and remarks do not.</p></noscript>",
            *parts,
            f'</main><script type="application/json" id="plots">{_safe({"plots": plots, "templates": templates})}</script>',
            f"<script>{get_plotlyjs()}</script>",
            f"<script>{script}</script></body></html>",
            "",
        ]
    )


def _safe(document: object) -> str:
    """JSON that cannot end the script element it stands in."""
    return json.dumps(document, separators=(",", ":")).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _section(name: str, title: str, drawings: list[Drawing], caption: str, extra: str) -> str:
    plots = "".join(_plot(drawing) for drawing in drawings)
    wide = " pairs" if len(drawings) > 1 else ""
    figure = f'<figure aria-labelledby="{name}-title"><div class="plots{wide}">{plots}</div><figcaption>{escape(caption)}</figcaption></figure>'
    return f'<section id="{name}"><h2 id="{name}-title">{escape(title)}</h2>{figure}{extra}</section>'


def _plot(drawing: Drawing) -> str:
    height, title = int(drawing.figure.layout.height), f"<h3>{escape(drawing.title)}</h3>" if drawing.title else ""
    alt = escape(drawing.alt)
    return f'<div>{title}<div class="plot" id="{drawing.name}" role="img" aria-label="{alt}" style="height:{height}px"></div></div>'


def _block(name: str, title: str, words: str, content: str) -> str:
    return f'<section id="{name}"><h2>{escape(title)}</h2><p>{escape(words)}</p>{content}</section>'


def _table(table: Table) -> str:
    heads = "".join(f'<th scope="col">{escape(text)}</th>' if text else "<td></td>" for text in table.heads)
    rows = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{"".join(f"<td>{escape(text)}</td>" for text in rest)}</tr>' for first, *rest in table.rows
    )
    caption = escape(table.caption)
    return (
        f'<div class="scroll" role="region" tabindex="0" aria-label="{caption}"><table><caption><span>{caption}</span></caption>'
        f"<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _origins(origins: Mapping[str, Mapping[str, Any]]) -> str:
    made = []
    for label, origin in origins.items():
        rows = "".join(f"<dt>{escape(str(key))}</dt><dd>{escape(_flat(value))}</dd>" for key, value in origin.items() if value not in ([], (), ""))
        made.append(f"<h3>{escape(label)}</h3><dl>{rows}</dl>")
    return f'<section id="provenance"><h2>Provenance</h2>{"".join(made)}</section>'


def _flat(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {item}" for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return " ".join(str(item) for item in value)
    return str(value)
