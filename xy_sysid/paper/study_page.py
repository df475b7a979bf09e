"""The study as one HTML page that opens offline: figures, tables, remarks, and provenance."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from xy_sysid.paper.pair import change_table, figure_caption, pair_caption, pair_figure, pair_title, study_remarks
from xy_sysid.paper.study import AxisStudy
from xy_sysid.report import captions, figures
from xy_sysid.report.cover import Cover
from xy_sysid.report.remarks import NOT_A_CONFIDENCE
from xy_sysid.report.sheet import Drawing, block, listing, paragraph, provenance_html, section, table_html, whole
from xy_sysid.report.tables import coefficient_table, result_table

INTRODUCTION = (
    "Figures 2 to 7 and tables 1 and 2 of the frequency-domain study of a ball-screw XY table, for this recording: excitation, "
    "motion, frequency response, and transfer functions with their uncertainty."
)
PRINTED = (
    "The NLLS denominators printed in the paper have negative coefficients. Taken literally they are unstable, with a pole far "
    "above the measured band. They describe the response in the band, not the machine."
)
PAPER_VALUES = "For comparison, the paper reports errors of 39 % (LLS) and 11 % (NLLS), and delays of 1.29 ms (x) and 1.38 ms (y)."
PAPER_VALUES = "For comparison, the paper reports errors of 39 % (LLS) and 11 % (NLLS), and delays of 1.29 ms (x) and 1.38 ms (y)."


def study_page(
    title: str,
    studies: Mapping[str, AxisStudy],
    units: tuple[str, str],
    least_coherence: float,
    origins: Mapping[str, Mapping[str, Any]],
    notes: tuple[str, ...] = (),
) -> str:
    """The HTML page.

    title: name of the recording; studies: by axis; units: of input and output; least_coherence: limit of a trusted line
    origins: label -> provenance of each recording; notes: anomalies found while reading
    """
    input_unit, output_unit = units
    responses = {axis: one.frf for axis, one in studies.items() if one.frf is not None}
    fitted = {axis: one for axis, one in studies.items() if one.fits}
    drawings: list[Drawing] = []
    parts: list[str] = []

    def figure(number: int, title: str, made: list[Drawing], caption: str, extra: str = "") -> None:
        drawings.extend(made)
        parts.append(section(f"fig-{number}", f"Figure {number}: {title}", made, caption, extra))

    inputs = {axis: one.excitation for axis, one in studies.items()}
    caption = captions.excitation(inputs, input_unit)
    figure(2, "excitation", [Drawing("plot-2", figures.excitation_figure(inputs, input_unit), caption)], caption)
    outputs = {axis: one.motion for axis, one in studies.items()}
    caption = captions.position(outputs, output_unit)
    figure(3, "measured position", [Drawing("plot-3", figures.position_figure(outputs, output_unit), caption)], caption)
    if responses:
        caption = captions.response(responses)
        figure(4, "frequency response", [Drawing("plot-4", figures.response_figure(responses), caption)], caption)
        caption = captions.coherence(responses, least_coherence)
        figure(5, "coherence", [Drawing("plot-5", figures.coherence_figure(responses, least_coherence), caption)], caption)
    made: list[Drawing] = []
    for axis, one in fitted.items():
        frf = responses[axis]
        made.append(Drawing(f"plot-6-{len(made)}", figures.fit_figure(frf, one.fits), captions.fit(axis, one.fits), f"Axis {axis}"))
    figure(6, "fits over the measurement", made, captions.FITS if made else captions.NO_FIT)
    made = []
    for axis, one in fitted.items():
        if one.change is not None and (one.change.before or one.change.after):
            made.append(Drawing(f"plot-7-{len(made)}", pair_figure(one.change), pair_caption(axis, one.change), f"Axis {axis}"))
    changed = change_table(studies)
    figure(7, pair_title(studies), made, figure_caption(studies), table_html(changed) if changed else "")
    coefficients = "".join(table_html(coefficient_table(axis, one.fits)) for axis, one in fitted.items())
    results = "".join(table_html(result_table(one)) for one in fitted.values())
    parts.append(block("table-1", "Table 1: coefficients of the transfer functions", captions.COEFFICIENTS, coefficients))
    parts.append(block("table-2", "Table 2: error, “confidence” and physical values", f"{NOT_A_CONFIDENCE} {PAPER_VALUES}", results))
    remarks = [PRINTED, *notes, *(text for one in studies.values() for text in study_remarks(one))]
    parts.append(f'<section id="remarks"><h2>Remarks</h2>{listing(remarks)}</section>')
    parts.append(provenance_html(origins))
    head = f"<h1>Study of {escape(title)}</h1>{listing(captions.summary(one) for one in studies.values())}{paragraph(INTRODUCTION)}"
    return whole(Cover(f"Study of {title}"), head, parts, drawings)
