"""Every picture of a story by name, for a folder of figures."""

from __future__ import annotations

import plotly.graph_objects as go

from xy_sysid.report import story_figures as draw
from xy_sysid.report.story_failure import By, failure
from xy_sysid.report.story_parts import Document

FAILS: tuple[By, ...] = ("frequency", "speed", "position", "time")
OF_A_STEP = (
    "bode", "coherence", "residual", "residual_speed", "residual_position", "residual_time", "residual_correlation", "zoom", "velocity",
    "position", "poles_zeros",
)  # fmt: skip


def gallery(document: Document) -> dict[str, go.Figure]:
    """Every picture of a story by name: of the rigid model where it fails, of the newest model, and of the way between them."""
    made = {f"rigid_fails_by_{by}": failure(document, by, 0) for by in FAILS}
    if len(document["steps"]) > 1:
        made |= {f"fails_by_{by}": failure(document, by) for by in FAILS}
    made |= {name: getattr(draw, name)(document) for name in OF_A_STEP}
    made["ladder"] = draw.ladder(document)
    if document["candidates"]:
        made["candidates"] = draw.candidates(document)
    if len(document["steps"]) > 1:
        made["before_after"] = draw.before_after(document)
    return made
