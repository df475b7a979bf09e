"""One HTML page that opens offline: headings, figures with captions, tables, and provenance.

``study_page`` (the paper's study) and ``report_page`` (the full report) choose its content.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from xy_sysid.report.cover import Cover, css_string
from xy_sysid.report.tables import Table
from xy_sysid.report.theme import template

KEPT = ("svg", "png", "csv")  # file types for saving a figure; PDF by printing, or ``xy-sysid figures``
SENTENCE = 42  # characters; a longer cell is treated as a sentence


@dataclass(frozen=True, slots=True)
class Drawing:
    """One Plotly figure of the page: its element's id, the figure, its description in words, and its title."""

    name: str
    figure: go.Figure
    alt: str
    title: str = ""


def whole(cover: Cover, head: str, parts: Iterable[str], drawings: Iterable[Drawing]) -> str:
    """The page. cover: window title and page footer; head: HTML above all sections; parts: the sections."""
    plots = {drawing.name: json.loads(drawing.figure.to_json()) for drawing in drawings}
    for plot in plots.values():
        plot["layout"].pop("template", None)
    templates = {mode: template(mode) for mode in ("light", "dark")}
    assets = files("xy_sysid.report")
    style = (assets / "page.css").read_text(encoding="utf-8")
    script = (assets / "page.js").read_text(encoding="utf-8")
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            f'<meta name="author" content="{escape(cover.author)}">' if cover.author else "",
            f"<title>{escape(cover.title)}</title><style>:root {{ --running: {css_string(cover.foot)}; }}\n{style}</style></head><body><main>",
            f"<header>{head}</header>",
            "<noscript><p>The figures need JavaScript; tables and remarks do not.</p></noscript>",
            *parts,
            f'</main><script type="application/json" id="plots">{_safe({"plots": plots, "templates": templates})}</script>',
            f"<script>{get_plotlyjs()}</script>",
            f"<script>{script}</script></body></html>",
            "",
        ]
    )


def paragraph(text: str) -> str:
    """Plain words as a paragraph."""
    return f"<p>{escape(text)}</p>"


def listing(texts: Iterable[str]) -> str:
    """Plain words as a list."""
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def section(name: str, title: str, drawings: Sequence[Drawing], caption: str, extra: str = "") -> str:
    """Figures side by side under a heading, with a caption below them and HTML after it."""
    figure = pictures(drawings, caption, f"{name}-title")
    return f'<section id="{name}"><h2 id="{name}-title">{escape(title)}</h2>{figure}{extra}</section>'


def pictures(drawings: Sequence[Drawing], caption: str, labelled_by: str = "") -> str:
    """Figures side by side with one caption."""
    wide = {1: "", 3: " threes"}.get(len(drawings), " pairs")
    label = f' aria-labelledby="{labelled_by}"' if labelled_by else ""
    return (
        f'<figure{label}><div class="plots{wide}">{"".join(_plot(one) for one in drawings)}</div><figcaption>{escape(caption)}</figcaption></figure>'
    )


def chosen(name: str, title: str, what: str, groups: Mapping[str, Sequence[Drawing]], caption: str) -> str:
    """Figures under a heading, of which a menu shows one group at a time. what: the label of the menu; groups: by the words of its entries."""
    entries = "".join(f"<option>{escape(entry)}</option>" for entry in groups)
    menu = f'<p><label>{escape(what)} <select data-choice="{name}" autocomplete="off">{entries}</select></label></p>'
    shown = "".join(f"<div{' hidden' if place else ''}>{pictures(made, '')}</div>" for place, made in enumerate(groups.values()))
    return f'<section><h2>{escape(title)}</h2>{menu}<div id="{name}">{shown}</div>{paragraph(caption)}</section>'


def block(name: str, title: str, words: str, content: str) -> str:
    """Text and HTML under a heading."""
    return f'<section id="{name}"><h2>{escape(title)}</h2><p>{escape(words)}</p>{content}</section>'


def table_html(table: Table) -> str:
    """A table that scrolls by itself where the paper is narrow."""
    told = [any(len(line[place]) > SENTENCE for line in table.rows) for place in range(len(table.heads))]
    heads = "".join(
        f'<th scope="col"{_long(long)}>{escape(text)}</th>' if text else "<td></td>" for text, long in zip(table.heads, told, strict=True)
    )
    rows = "".join(
        f'<tr><th scope="row">{escape(first).replace("_", "_<wbr>")}</th>'
        f"{''.join(f'<td{_long(long)}>{escape(text)}</td>' for text, long in zip(rest, told[1:], strict=True))}</tr>"
        for first, *rest in table.rows
    )
    caption = escape(table.caption)
    return (
        f'<div class="scroll" role="region" tabindex="0" aria-label="{caption}"><table><caption><span>{caption}</span></caption>'
        f"<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def provenance_html(origins: Mapping[str, Mapping[str, Any]]) -> str:
    """The last section: the source data and software version behind the numbers."""
    made = []
    for label, origin in origins.items():
        rows = "".join(f"<dt>{escape(str(key))}</dt><dd>{escape(_flat(value))}</dd>" for key, value in origin.items() if value not in ([], (), ""))
        made.append(f"<h3>{escape(label)}</h3><dl>{rows}</dl>")
    return f'<section id="provenance"><h2>Provenance</h2>{"".join(made)}</section>'


def _long(sentences: bool) -> str:
    """CSS for long cells: sentences wrap, numbers do not."""
    return ' class="long"' if sentences else ""


def _safe(document: object) -> str:
    """JSON that cannot close the script element around it."""
    return json.dumps(document, separators=(",", ":")).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _plot(drawing: Drawing) -> str:
    height, title = int(drawing.figure.layout.height), f"<h3>{escape(drawing.title)}</h3>" if drawing.title else ""
    alt = escape(drawing.alt)
    name = drawing.name
    keep = "".join(
        f'<button type="button" data-keep="{kind}" data-of="{name}" aria-label="save {name} as {kind}">{kind.upper()}</button>' for kind in KEPT
    )
    plot = f'<div class="plot" id="{name}" role="img" aria-label="{alt}" style="height:{height}px"></div>'
    return f'<div>{title}{plot}<div class="keep">{keep}</div></div>'


def _flat(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {item}" for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return " ".join(str(item) for item in value)
    return str(value)
