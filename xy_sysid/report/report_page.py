"""The report: one page with a summary, followed by all evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.report import captions, figures, story_figures, story_words
from xy_sysid.report.axis_report import AxisReport
from xy_sysid.report.coupling import CAPTION as COUPLED
from xy_sysid.report.coupling import coupling_figure
from xy_sysid.report.cover import Cover
from xy_sysid.report.headline import headline
from xy_sysid.report.remarks import NOT_A_CONFIDENCE, axis_remarks
from xy_sysid.report.sheet import Drawing, block, listing, paragraph, pictures, provenance_html, section, table_html, whole
from xy_sysid.report.story_failure import failure, failure_words
from xy_sysid.report.story_parts import words
from xy_sysid.report.story_words import spoken
from xy_sysid.report.tables import Table, coefficient_table, order_table, result_table
from xy_sysid.report.words import quantity
from xy_sysid.response.coupling import Coupling
from xy_sysid.units import listed

ABOUT = (
    "Recording, response and model of each axis, the places where the model fails, the missing effects, and the uncertainty of "
    "each number. Every fit used two thirds of the recording. The rest tests it: the last third for transfer functions, parts "
    "spread over the recording for the diagnosis."
)
FAILS = "Left: error over the noise floor by frequency on held-out data; grey: rigid model, solid: last model. Right:"
SUMMARY_HEIGHT = 270  # px of the two pictures of an axis in the summary
MARKS = {"explained": "good", "partly explained": "fair", "not explained": "bad", "nothing can be said": "none"}


class _Page:
    """Sections in order, and the drawings in them."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.drawings: list[Drawing] = []
        self.links: list[tuple[str, str]] = []

    def draw(self, name: str, figure: Any, alt: str, title: str = "") -> Drawing:
        self.drawings.append(Drawing(name, figure, alt, title))
        return self.drawings[-1]

    def add(self, name: str, title: str, html: str) -> None:
        self.links.append((name, title))
        self.parts.append(html)


@dataclass(frozen=True, slots=True)
class Recorded:
    """Information about the recording itself.

    cover: title, machine, author, date; units: of input and output; facts: (what, value) of the experiment
    origins: label -> provenance; notes: anomalies found while reading
    coupling: how two axes that were driven at the same time affect each other; None for one axis, or if the notes give a reason
    """

    cover: Cover
    units: tuple[str, str]
    facts: tuple[tuple[str, str], ...]
    origins: Mapping[str, Mapping[str, Any]]
    notes: tuple[str, ...] = ()
    coupling: Coupling | None = None


def report_page(recorded: Recorded, axes: Mapping[str, AxisReport], least_coherence: float, library: Library = STANDARD) -> str:
    """The whole page. axes: by name; least_coherence: limit of a trusted line."""
    page = _Page()
    _summary(page, axes, library)
    _experiment(page, axes, recorded.units, recorded.facts)
    _response(page, axes, least_coherence)
    _fits(page, axes)
    for number_, one in enumerate(axes.values()):
        if one.story is not None and one.story["ladder"]:
            _axis(page, number_, one, one.story, library)
    if recorded.coupling is not None:
        found = recorded.coupling
        drawn = [page.draw("coupling-bands", coupling_figure(found), f"{found.sentence} {COUPLED}")]
        page.add("coupling", "Two axes at once", section("coupling", "Two axes at once", drawn, f"{found.sentence} {COUPLED}"))
    remarks = [*recorded.notes]
    for one in axes.values():
        remarks += [f"Axis {one.axis}: {one.note}"] if one.note else []
        remarks += axis_remarks(one.study)
    if remarks:
        page.add("remarks", "Remarks", f'<section id="remarks"><h2>Remarks</h2>{listing(remarks)}</section>')
    page.add("provenance", "Provenance", provenance_html(recorded.origins))
    links = "".join(f'<li><a href="#{name}">{escape(text)}</a></li>' for name, text in page.links)
    stands = "".join(f'<p class="stand"><strong>Axis {escape(axis)}</strong>: {escape(_stands(one, library))}</p>' for axis, one in axes.items())
    title = f"<h1>{escape(recorded.cover.title)}</h1>{recorded.cover.html}"
    head = f'{title}{stands}{paragraph(ABOUT)}<nav aria-label="sections"><ul>{links}</ul></nav>'
    return whole(recorded.cover, head, page.parts, page.drawings)


def _summary(page: _Page, axes: Mapping[str, AxisReport], library: Library) -> None:
    cards = []
    for place, one in enumerate(axes.values()):
        kind = story_words.status(one.story)
        title = f'<h3>Axis {escape(one.axis)} <span class="mark {MARKS[kind]}">{kind}</span></h3>'
        texts = list(_told(one, library))
        picture = ""
        if one.story is not None and one.story["ladder"]:
            alt = f"Axis {one.axis}: the error falls from step to step towards the noise floor."
            fails = failure(one.story, "frequency")
            fails.update_layout(height=SUMMARY_HEIGHT)
            ladder = story_figures.ladder(one.story)
            ladder.update_layout(height=SUMMARY_HEIGHT)
            drawn = [page.draw(f"fails-{place}", fails, failure_words(one.story, "frequency")), page.draw(f"ladder-{place}", ladder, alt)]
            picture = pictures(drawn, f"{FAILS} {story_words.LADDER}" if place == 0 else "")
        cards.append(f'<article class="card"><div>{title}{"".join(paragraph(text) for text in texts)}</div>{picture}</article>')
    table = table_html(_key_figures(axes)) if len(axes) > 1 else ""
    page.add("summary", "Summary", f'<section id="summary"><h2>Summary</h2>{table}{"".join(cards)}</section>')


def _stands(one: AxisReport, library: Library) -> str:
    """State of an axis, and the effects in its model."""
    if one.story is None:
        return one.problem
    effects = one.story["ladder"][-1]["effects"] if one.story["ladder"] else []
    return spoken(headline(one.story) + (f", with {listed(effects)}" if effects else ""), library)


def _told(one: AxisReport, library: Library) -> tuple[str, ...]:
    """The paragraphs about one axis."""
    made = []
    story = one.story
    if story is None:
        made.append(one.problem)
    elif not story["ladder"]:
        made.append(str(story["sentence"]))
    else:
        made += [story_words.verdict(story, library), story_words.size(story, one.speed)]
        made += [story_words.confidence(story), story_words.runner_up(story)]
    effects = story["ladder"][-1]["effects"] if story is not None and story["ladder"] else ()
    alone = f"The linear fit alone, without {listed(effects)}" if effects else "The linear fit"
    made.append(captions.summary(one.study).replace(f"Axis {one.axis}: ", f"{alone}: ", 1))
    if one.verdicts is not None:
        failed = ", ".join(check.name.replace("_", " ") for check in one.verdicts.verdicts if not check.ok)
        passed, count = sum(check.ok for check in one.verdicts.verdicts), len(one.verdicts.verdicts)
        made.append(f"{passed} of {count} checks of the linear fit passed{f'; not passed: {failed}' if failed else ''}.")
    if story is not None and story["ladder"] and story["next_experiment"]:
        made.append(f"Next experiment: {story['next_experiment']}")
    return tuple(spoken(text, library) for text in made if text)


def _key_figures(axes: Mapping[str, AxisReport]) -> Table:
    rows = []
    for axis, one in axes.items():
        cells = ["–"] * 4
        if one.story is not None and one.story["ladder"]:
            last, unit = one.story["ladder"][-1], one.story["error"]["unit"]
            cells = [", ".join(words(name) for name in last["effects"]) or "nothing"]
            cells += [quantity(float(value), unit, 3) for value in (one.story["error"]["now"], last["held_out_error"], last["noise_floor"])]
        rows.append((axis, story_words.status(one.story), *cells))
    return Table(
        "Key figures", ("axis", "the motion is", "added to the rigid model", "error of the rigid model", "error now", "noise floor"), tuple(rows)
    )


def _experiment(page: _Page, axes: Mapping[str, AxisReport], units: tuple[str, str], facts: tuple[tuple[str, str], ...]) -> None:
    inputs = {axis: one.study.excitation for axis, one in axes.items()}
    outputs = {axis: one.study.motion for axis, one in axes.items()}
    said = captions.excitation(inputs, units[0])
    drawn = [page.draw("excitation", figures.excitation_figure(inputs, units[0]), said, "Input")]
    moved = captions.position(outputs, units[1])
    drawn.append(page.draw("motion", figures.position_figure(outputs, units[1]), moved, "Output"))
    table = table_html(Table("What was recorded", ("what", "value"), facts))
    page.add("experiment", "Experiment", section("experiment", "Experiment", drawn, f"Input. {said} Output. {moved}", table))


def _response(page: _Page, axes: Mapping[str, AxisReport], least: float) -> None:
    responses = {axis: one.study.frf for axis, one in axes.items() if one.study.frf is not None}
    if not responses:
        page.add("response", "Frequency response", block("response", "Frequency response", "No axis has one; the remarks say why.", ""))
        return
    said, coherent = captions.response(responses), captions.coherence(responses, least)
    drawn = [
        page.draw("bode", figures.response_figure(responses), said, "Response"),
        page.draw("coherence", figures.coherence_figure(responses, least), coherent, "Coherence"),
    ]
    page.add("response", "Frequency response", section("response", "Frequency response", drawn, f"{said} Coherence: {coherent}"))


def _fits(page: _Page, axes: Mapping[str, AxisReport]) -> None:
    fitted = {axis: one for axis, one in axes.items() if one.study.fits and one.study.frf is not None}
    title = "Transfer functions, side by side"
    if not fitted:
        page.add("fits", title, block("fits", title, captions.NO_FIT, ""))
        return
    drawn = []
    for place, (axis, one) in enumerate(fitted.items()):
        frf = one.study.frf
        assert frf is not None
        drawn.append(page.draw(f"fit-{place}", figures.fit_figure(frf, one.study.fits), captions.fit(axis, one.study.fits), f"Axis {axis}"))
    tables = "".join(table_html(result_table(one.study)) + table_html(coefficient_table(axis, one.study.fits)) for axis, one in fitted.items())
    checks = "".join(table_html(_verdicts(axis, one)) for axis, one in fitted.items())
    orders = "".join(_optional(order_table(axis, one.verdicts.orders, one.study.fits["ML"])) for axis, one in fitted.items() if one.verdicts)
    extra = f"{orders}{paragraph(captions.COEFFICIENTS)}{paragraph(NOT_A_CONFIDENCE)}{tables}<h3>Checks of the linear fit (ML)</h3>{checks}"
    page.add("fits", title, section("fits", title, drawn, captions.FITS, extra))


def _verdicts(axis: str, one: AxisReport) -> Table:
    checks = one.verdicts.verdicts if one.verdicts is not None else ()
    rows = tuple((check.name.replace("_", " "), "✓\u00a0passed" if check.ok else "✗\u00a0not\u00a0passed", check.sentence) for check in checks)
    return Table(f"Axis {axis}: checks", ("check", "", "in words"), rows)


def _axis(page: _Page, place: int, one: AxisReport, story: Mapping[str, Any], library: Library) -> None:
    """Add where the rigid model fails, the missing effect, and the residual error."""
    axis, last = one.axis, len(story["steps"]) - 1

    def draw(name: str, made: Any, alt: str, title: str = "") -> Drawing:
        return page.draw(f"{name}-{place}", made, f"Axis {axis}: {alt}", title)

    parts = ["<h3>Where the rigid model fails</h3>"]
    parts.append(pictures([draw("residual", story_figures.residual(story, 0), story_words.BASE_FAILS)], story_words.BASE_FAILS))
    parts.append(_against(draw, story, 0, "base", story_words.AGAINST))
    parts.append(_optional(story_words.places_table(story, axis)))
    if story["candidates"]:
        parts.append("<h3>What is missing</h3>")
        parts.append(paragraph(spoken(str(story["sentence"]), library)))
        parts.append(pictures([draw("candidates", story_figures.candidates(story), story_words.CANDIDATES)], story_words.CANDIDATES))
        parts.append(_optional(story_words.look_alike_table(story, axis, library)))
    if last > 0:
        parts.append("<h3>With what was added</h3>")
        parts.append(pictures([draw("overlay", story_figures.before_after(story, 0, last), story_words.BEFORE_AFTER)], story_words.BEFORE_AFTER))
        parts.append(_against(draw, story, last, "left", story_words.LEFT))
    left = draw("correlation", story_figures.residual_correlation(story), story_words.CORRELATION, "Correlation of the residual error")
    parts.append("<h3>The model</h3>")
    shown = [
        draw("zoom", story_figures.zoom(story), story_words.SIGNALS, "Velocity, zoomed"),
        draw("travel", story_figures.position(story), story_words.SIGNALS, "Position"),
        draw("roots", story_figures.poles_zeros(story), story_words.ROOTS, "Poles and zeros"),
    ]
    parts.append(pictures(shown, f"{story_words.SIGNALS} {story_words.ROOTS}"))
    parts.append(pictures([left], story_words.CORRELATION))
    parts.append(table_html(story_words.parameter_table(story, axis, library)))
    parts.append(table_html(story_words.ladder_table(story, axis)))
    title = f"Axis {axis}: missing effects and residual error"
    page.add(f"axis-{place}", f"Axis {axis}", f'<section id="axis-{place}"><h2>{escape(title)}</h2>{"".join(parts)}</section>')


def _against(draw: Any, story: Mapping[str, Any], step: int, label: str, caption: str) -> str:
    drawn = [
        draw(f"{label}-speed", story_figures.residual_speed(story, step), f"{caption} Against velocity.", "Against velocity"),
        draw(f"{label}-position", story_figures.residual_position(story, step), f"{caption} Against position.", "Against position"),
        draw(f"{label}-time", story_figures.residual_time(story, step), f"{caption} Against time.", "Against time"),
    ]
    return pictures(drawn, caption)


def _optional(table: Table | None) -> str:
    return "" if table is None else table_html(table)
