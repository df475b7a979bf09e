"""Which of two fits is better, by more than chance, where a record is too short for its held-out windows to tell."""

from __future__ import annotations

import pytest
from helpers.foreign import Joint, driven

from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import fit_base, fit_with
from xy_sysid.judge.axis_judge import AxisJudge

SHORT = Joint(fs=1000.0, seconds=12.0, count=1e-6, mass=1.0, drag=5.0, coulomb=0.6, moves=(0.1, 0.15, 2.0), control=(4e3, 120.0))


@pytest.fixture(scope="module")
def short() -> AxisData:
    """Slow moves with pauses, of which four half overlapping windows are held out."""
    return prepare(SHORT.fs, *driven(SHORT, 1))


def test_few_windows_are_too_few_for_any_test_of_ranks(short: AxisData) -> None:
    """What makes the other fold necessary: even if all are better, chance makes it so more often than once in forty times."""
    assert short.held.begins.size < 6
    assert 0.5**short.held.begins.size > 0.0228


def test_a_law_that_holds_is_better_in_a_short_record_and_one_that_does_not_is_not(short: AxisData) -> None:
    """Each window is held out once: those that were fitted are judged by a fit to the others."""
    judge, base = AxisJudge(short, STANDARD), fit_base(short)
    rubbed, lagged = (fit_with(short, base, [name]) for name in ("coulomb_friction", "gain_drift"))
    assert judge.better(rubbed, base)
    assert not judge.better(base, rubbed)
    assert not judge.better(base, base)
    wrong = fit_with(short, rubbed, ["gain_drift"])
    assert not judge.better(wrong, rubbed)
    assert lagged.excess > rubbed.excess


def test_a_short_record_is_named(short: AxisData) -> None:
    """As a long one would be."""
    found = diagnose(SHORT.fs, *driven(SHORT, 1))
    assert found.effects == ("coulomb_friction",), found.sentence
    assert found.confidence > 0.9
