"""Every figure of a story by name, for a folder of figures."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial

import plotly.graph_objects as go

from xy_sysid.report import story_figures as draw
from xy_sysid.report.figure_data import table
from xy_sysid.report.story_failure import By, failure
from xy_sysid.report.story_parts import Document, legend_name, pictured, words
from xy_sysid.report.vector import vectors

FAILS: tuple[By, ...] = ("frequency", "speed", "position", "time")
OF_A_STEP = {  # file name -> function that draws the figure of a step
    "frequency_response": draw.bode,
    "coherence": draw.coherence,
    "error_by_frequency": draw.residual,
    "error_by_speed": draw.residual_speed,
    "error_by_position": draw.residual_position,
    "error_by_time": draw.residual_time,
    "error_correlation": draw.residual_correlation,
    "velocity_at_largest_error": draw.zoom,
    "velocity": draw.velocity,
    "position": draw.position,
    "poles_and_zeros": draw.poles_zeros,
}


def drawings(document: Document) -> dict[str, Callable[[], go.Figure]]:
    """Functions that draw every figure of a story, by name: where the rigid model fails, the newest model, and the progress between them."""
    made: dict[str, Callable[[], go.Figure]] = {f"rigid_model_fails_by_{by}": partial(_fails, document, by, 0) for by in FAILS}
    if len(document["steps"]) > 1:
        made |= {f"last_model_fails_by_{by}": partial(_fails, document, by) for by in FAILS}
    made |= {name: partial(drawn, document) for name, drawn in OF_A_STEP.items()}
    made["error_ladder"] = partial(draw.ladder, document)
    if document["candidates"]:
        made["candidate_effects"] = partial(draw.candidates, document)
    if len(document["steps"]) > 1:
        made["before_and_after"] = partial(draw.before_after, document)
    return made


def _fails(document: Document, by: By, step: int | None = None) -> go.Figure:
    """Where a step fails, as the page shows it, with the model's name in the legend because a folder has no captions."""
    figure, shown = failure(document, by, step), pictured(document, step)
    if figure.data and shown is not None:
        figure.data[-1].name = legend_name("model", shown) if shown["effects"] else words(str(shown["label"]))
        figure.update_layout(showlegend=True)
    return figure


def gallery(document: Document) -> dict[str, go.Figure]:
    """Every figure of a story by name."""
    return {name: drawn() for name, drawn in drawings(document).items()}


def written(document: Document, kinds: Sequence[str], columns: int, names: Sequence[str]) -> dict[str, dict[str, bytes]]:
    """Some figures of a story, by name and kind: svg, pdf, or csv with the plotted numbers. columns: of a journal, 1 or 2."""
    found = {}
    for name in names:
        figure = drawings(document)[name]()
        found[name] = vectors(figure, [kind for kind in kinds if kind != "csv"], columns)
        if "csv" in kinds:
            found[name]["csv"] = table(json.loads(figure.to_json()), f"axis {document['axis']}, ").encode()
    return found
