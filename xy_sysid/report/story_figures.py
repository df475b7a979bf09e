"""Every figure of a story: a story's JSON document in, a Plotly figure out. The page and the report draw only these.

    bode coherence poles_zeros                                        over frequency, and the linear part
    residual residual_speed residual_position residual_time           where the model fails, divided by the noise floor
    residual_correlation                                              correlation of the residual error with itself and the input
    zoom velocity position                                            measured and simulated, in time
    ladder before_after candidates                                    progress

All take ``(document, step=None, mode="light")``: step is an index into ``document["steps"]`` (None: the newest), mode is light or dark.
``ladder`` and ``candidates`` show the full story; ``before_after(document, first=0, last=None)`` shows two steps. A story without
steps gives a figure with a sentence. Colours are readable on both backgrounds, so a page may swap only the template (``theme.template``).
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
