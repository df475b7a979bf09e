"""Figures for a notebook, drawn by the report's functions: each takes results and returns a Plotly figure (``.show()``)."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from xy_sysid.comparison.of_run import held
from xy_sysid.comparison.where_it_fails import Comparison, compare_velocity
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.as_json import rung_document
from xy_sysid.errors import BadInput
from xy_sysid.fitting.check_on_data import through_window
from xy_sysid.fitting.of_run import LinearModel
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.report import story_progress
from xy_sysid.report.coupling import coupling_figure
from xy_sysid.report.figures import coherence_figure, response_figure
from xy_sysid.report.offline import picture
from xy_sysid.report.parts import aligned, decibel, phase_of, plain
from xy_sysid.report.story_parts import drawing
from xy_sysid.report.theme import FLOOR
from xy_sysid.response.coupling import Coupling
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.recording import Recording, Run, one_run
from xy_sysid.settings import LEAST_COHERENCE

COLOURS = ("#d1495b", "#2e8b57", "#7b5ea7", "#c77d0a", "#00798c")
DASHES = ("dash", "solid", "dot", "dashdot", "longdash")


def bode(frf: FrequencyResponse, *others: FrequencyResponse | AnyModel) -> go.Figure:
    """Magnitude and phase of a measured response with its 95 % band, and of models (for physical models, the linear part).

    Each model is drawn as this measurement would see it: with hold, sampling and the window's smoothing. Other responses are drawn
    in the same figure. Noise and nonlinear distortion are drawn where they are known.
    """
    measured = {frf.origin.axis or "measured": frf}
    for number, other in enumerate((item for item in others if isinstance(item, FrequencyResponse)), 2):
        name = other.origin.axis or "measured"
        measured[f"{name} ({number})" if name in measured else name] = other
    models = [item for item in others if not isinstance(item, FrequencyResponse)]
    figure = response_figure(measured)
    lines = frf.select(frf.trusted) if bool(np.any(frf.trusted)) else frf
    reference = phase_of(lines.response)
    for number, model in enumerate(models):
        response = through_window(model.tf, lines, model.hold if isinstance(model, LinearModel) else "zoh")
        phase = aligned(phase_of(response), reference)
        name = plain(model.label)
        line = {"color": COLOURS[number % len(COLOURS)], "width": 1.8, "dash": DASHES[number % len(DASHES)]}
        for row, values in ((1, decibel(response, frf.output_unit)), (2, phase)):
            figure.add_scatter(
                x=lines.frequency, y=values, mode="lines", line=line, name=name, legendgroup=f"{number}", showlegend=row == 1, row=row, col=1
            )
    return picture(figure)


def coherence(frf: FrequencyResponse) -> go.Figure:
    """Coherence of every line; lines that no fit uses are small crosses."""
    return picture(coherence_figure({frf.origin.axis or "measured": frf}, LEAST_COHERENCE))


def coupling(found: Coupling) -> go.Figure:
    """Coupling of two axes in each band, with its 95 % limit, in per cent of the axis's own motion."""
    return picture(coupling_figure(found))


def ladder(found: Answer) -> go.Figure:
    """Training error, held-out error and noise floor of each step of ``diagnose`` or ``refine``, as a falling staircase."""
    units = {"input": found.units.input, "output": found.units.output, "judged": found.units.judged}
    return picture(story_progress.ladder({"ladder": [rung_document(rung) for rung in found.rungs], "sentence": found.sentence, "units": units}))


def residual(data: Run | Recording | Comparison, *models: AnyModel) -> go.Figure:
    """The error divided by the noise floor, by frequency: of one comparison, or of models on a run."""
    figure = drawing([1.0], 320, "light")
    if isinstance(data, Comparison):
        shown = [("error", data)]
    else:
        run = one_run(data)
        if not models:
            raise BadInput("models", "none", "one or more", "Give a model from fit, refine or load_model.")
        shown = []
        for model in models:
            first = held(run) if run.digest in model.data else 0
            velocity = model.velocity(run.sampling_rate, run.voltage, run.position)[first:]
            shown.append((model.label, compare_velocity(velocity, run.voltage[first:], run.position[first:], run.sampling_rate, run.units)))
    for number, (name, item) in enumerate(shown):
        known = np.isfinite(item.error_over_floor)
        line = {"color": COLOURS[number % len(COLOURS)], "width": 1.8, "dash": DASHES[number % len(DASHES)]}
        figure.add_scatter(x=item.frequency[known], y=item.error_over_floor[known], mode="lines", line=line, name=plain(name), row=1, col=1)
    figure.add_hline(y=1.0, line={"color": FLOOR, "width": 2, "dash": "dot"}, row=1, col=1)
    figure.update_xaxes(title_text="frequency (Hz)", type="log", row=1, col=1)
    figure.update_yaxes(title_text="error over the noise floor", type="log", row=1, col=1)
    return picture(figure)
