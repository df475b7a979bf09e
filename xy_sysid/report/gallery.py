"""Every picture of a story by name, for a folder of figures."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial

import plotly.graph_objects as go

from xy_sysid.report import story_figures as draw
from xy_sysid.report.figure_data import table
from xy_sysid.report.story_failure import By, failure
from xy_sysid.report.story_parts import Document
from xy_sysid.report.vector import vectors

FAILS: tuple[By, ...] = ("frequency", "speed", "position", "time")
OF_A_STEP = (
    "bode", "coherence", "residual", "residual_speed", "residual_position", "residual_time", "residual_correlation", "zoom", "velocity",
    "position", "poles_zeros",
)  # fmt: skip


def drawings(document: Document) -> dict[str, Callable[[], go.Figure]]:
    """How to draw every picture of a story, by name: of the rigid model where it fails, of the newest model, and of the way between them."""
    made: dict[str, Callable[[], go.Figure]] = {f"rigid_fails_by_{by}": partial(failure, document, by, 0) for by in FAILS}
    if len(document["steps"]) > 1:
        made |= {f"fails_by_{by}": partial(failure, document, by) for by in FAILS}
    made |= {name: partial(getattr(draw, name), document) for name in (*OF_A_STEP, "ladder")}
    if document["candidates"]:
        made["candidates"] = partial(draw.candidates, document)
    if len(document["steps"]) > 1:
        made["before_after"] = partial(draw.before_after, document)
    return made


def gallery(document: Document) -> dict[str, go.Figure]:
    """Every picture of a story by name."""
    return {name: drawn() for name, drawn in drawings(document).items()}


def written(document: Document, kinds: Sequence[str], names: Sequence[str]) -> dict[str, dict[str, bytes]]:
    """Some pictures of a story, by name and kind: svg, pdf, or csv with the numbers that are drawn."""
    found = {}
    for name in names:
        figure = drawings(document)[name]()
        found[name] = vectors(figure, [kind for kind in kinds if kind != "csv"])
        if "csv" in kinds:
            found[name]["csv"] = table(json.loads(figure.to_json())).encode()
    return found
