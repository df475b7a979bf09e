"""The sentences of a diagnosis are consistent: numbers of one error, and the reason why a candidate with a small error is refused."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.mechanics import Transmission
from xy_sysid.axis.model import STANDARD
from xy_sysid.cli.diagnose import _show
from xy_sysid.cli.refine import _words, verdict
from xy_sysid.diagnosis import words
from xy_sysid.diagnosis.answer import Answer, Rung, Tried
from xy_sysid.diagnosis.as_json import answer_document
from xy_sysid.diagnosis.diagnose import judged
from xy_sysid.diagnosis.refine import Effort, refine
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import fit_with
from xy_sysid.page.document_words import candidate_rows
from xy_sysid.story.document import document
from xy_sysid.story.story import Story


@pytest.fixture(scope="module")
def data() -> AxisData:
    return prepare(2000.0, *recorded("quadratic_drag", seconds=8.0).axis("x"))


@pytest.fixture(scope="module")
def ladder(data: AxisData) -> Answer:
    """The rigid model alone, which fails: nothing was searched."""
    return refine(data, effort=Effort(most=0))


def noisier(data: AxisData, ladder: Answer) -> tuple[AxisData, Answer]:
    """The same axis with overestimated encoder noise at high frequency, as with few coarse counts."""
    noise = data.floor.noise.copy()
    noise[-3:] *= 1e6
    louder = replace(data, floor=replace(data.floor, noise=noise))
    left = math.sqrt(max(ladder.base.held_out_error**2 - louder.noise**2, 0.0))
    return louder, replace(ladder, noise=louder.noise, discrepancy=left)


def test_what_is_not_in_the_library_is_never_nothing_of_the_motion(data: AxisData, ladder: Answer) -> None:
    """Noise in one band does not hide the error in another: the error above it is part of the stated error, and not 0 %."""
    louder, same = noisier(data, ladder)
    assert same.noise > same.base.held_out_error and same.discrepancy == 0.0
    for found in (judged(data, ladder, STANDARD), judged(louder, same, STANDARD)):
        assert found.verdict == "not_in_library"
        figures = re.search(
            r"of the rigid model \(([\d.]+) (\S+)\)\. Error above the encoder noise: ([\d.]+) (\S+), ([\d.e-]+) % of the motion", found.sentence
        )
        assert figures is not None, found.sentence
        left, unit, beyond, same_unit, part = figures.groups()
        assert unit == same_unit and 0.5 * float(left) < float(beyond) <= float(left) and float(part) > 0.0
        assert "noise alone" not in found.sentence


def with_a_refused_candidate(data: AxisData, ladder: Answer) -> Answer:
    """One effect with a very small error, which is refused."""
    rung = Rung.of(replace(ladder.base, held_out_error=0.01 * ladder.base.held_out_error), ("cogging",))
    tried = Tried(rung, explained=0.991, refused="cogging: amplitude is at its bound")
    return judged(data, replace(ladder, candidates=(tried,)), STANDARD)


def test_an_effect_that_leaves_little_and_is_refused_says_so_where_it_stands(data: AxisData, ladder: Answer) -> None:
    """The reason is in the evidence of the page, of the report and of the JSON document; an accepted effect has none."""
    found = with_a_refused_candidate(data, ladder)
    assert found.sentence.startswith("Not in the library: no effect explains")
    (told,) = found.candidates
    evidence = words.evidence(found, told)
    assert "99.1 %" in evidence and "refused (cogging: amplitude is at its bound)" in evidence
    assert "refused" not in words.evidence(found, replace(told, refused=""))
    story = Story("x", 2000.0, 8.0, 1e-3, data.units, diagnosis=found.plain())
    assert "refused" in candidate_rows(document(story))[0].evidence


def test_refine_does_not_say_that_nothing_helps_beside_a_falling_error(ladder: Answer) -> None:
    """If an effect explains a tenth of the error, the sentence gives the effect and the tenth. If no effect was found, it says that none helps."""
    assert verdict(ladder) == "not_in_library" and _words(ladder) == "No effect of the library reduces the error."
    less = Rung.of(replace(ladder.base, held_out_error=0.95 * ladder.base.held_out_error), ("cogging",))
    falling = replace(ladder, best=("cogging",), rungs=(*ladder.rungs, less), explained=0.1, discrepancy=1e-3)
    assert verdict(falling) == "not_in_library"
    assert _words(falling) == "cogging explains only 10 % of the error's power; the residual error beyond the noise is 1 mm/s."


def test_nothing_missing_is_told_with_the_floor_of_the_ladder(data: AxisData) -> None:
    """The number after the error is the noise floor of page, report and refine."""
    clean = prepare(2000.0, *recorded("", seconds=8.0).axis("x"))
    found = judged(clean, refine(clean, effort=Effort(most=0)), STANDARD)
    assert found.verdict == "nothing_missing"
    (told,) = re.findall(r"at the noise floor \(([\d.]+) mm/s\)", found.sentence)
    assert float(told) == pytest.approx(1e3 * found.base.noise_floor, rel=5e-3)
    assert np.isfinite(found.confidence)


def test_parameters_of_what_is_not_named_are_not_shown_as_found(data: AxisData, ladder: Answer, capsys: pytest.CaptureFixture[str]) -> None:
    """Friction that explains a part of an unknown effect is in the sentence, but not in the model."""
    more = fit_with(data, ladder.base, ["coulomb_friction"])
    found = replace(ladder, rungs=(*ladder.rungs, Rung.of(more, ("coulomb_friction",))), best=("coulomb_friction",), explained=0.3)
    found = judged(data, found, STANDARD)
    assert found.verdict == "not_in_library" and "At best coulomb_friction explains 30 %" in found.sentence
    assert found.told is found.rungs[0]
    _show("x", found, Transmission())
    assert "coulomb_friction.coulomb" not in capsys.readouterr().out
    assert answer_document(found)["error"]["held_out"] == answer_document(found)["error"]["now"] == ladder.base.held_out_error
