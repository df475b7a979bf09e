"""Every picture of a story: a story's JSON document in, a Plotly figure out. The page and the report draw these and no others.

    bode coherence poles_zeros                                        over frequency, and the linear part
    residual residual_speed residual_position residual_time           where the model fails, over the noise floor
    residual_correlation                                              whether what is left goes with itself and with the input
    zoom velocity position                                            measured and simulated, in time
    ladder before_after candidates                                    progress

All take ``(document, step=None, mode="light")``: step is a place in ``document["steps"]`` (None: the newest), mode light or dark;
``ladder`` and ``candidates`` are of the whole story, and ``before_after(document, first=0, last=None)`` is of two steps. A story without
steps gives a figure with its sentence. Colours read on both papers, so a page may swap the template alone (``theme.template``).
"""

from __future__ import annotations

from xy_sysid.report.story_curves import bode, coherence, poles_zeros
from xy_sysid.report.story_errors import residual, residual_correlation, residual_position, residual_speed, residual_time
from xy_sysid.report.story_progress import before_after, candidates, ladder
from xy_sysid.report.story_signals import position, velocity, zoom

__all__ = [
    "before_after",
    "bode",
    "candidates",
    "coherence",
    "ladder",
    "poles_zeros",
    "position",
    "residual",
    "residual_correlation",
    "residual_position",
    "residual_speed",
    "residual_time",
    "velocity",
    "zoom",
]
