"""Refused fits, with any residual error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.linear_part import resonance
from xy_sysid.axis.model import STANDARD, AxisModel, Library
from xy_sysid.effects._contract import law
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with
from xy_sysid.hypotheses.refusal import at_bound, refusal
from xy_sysid.response.estimate import Estimate

SPLIT = Estimate(name="screw_compliance.split", value=1.0, unit="", low=0.9, high=1.1)


@pytest.fixture(scope="module")
def data() -> AxisData:
    return prepare(2000.0, *recorded("gain_drift=-0.01", seconds=10.0).axis("x"))


def ending(data: AxisData, rate: float) -> GreyboxFit:
    """A fit that ends at this rate of change, 1/s."""
    found = fit_with(data, fit_base(data), ["gain_drift"])
    return replace(found, model=found.model.with_effect("gain_drift", (rate,)))


@pytest.mark.parametrize(("side", "refused"), [("low", True), ("high", True), ("middle", False)])
def test_a_size_with_a_sign_has_two_bounds(side: str, refused: bool, data: AxisData) -> None:
    """A gain that falls at its bound is as undetermined as one that rises at it."""
    item = STANDARD["gain_drift"].on(data.similar)[0]
    rate = {"low": item.low, "high": item.high, "middle": -0.01}[side]
    assert at_bound(item, rate) is refused
    why = "gain_drift: rate is at its bound" if refused else ""
    assert refusal(data, STANDARD, ending(data, rate)) == why


@pytest.mark.parametrize(("split", "refused"), [(0.3, False), (5.0, True)])
def test_a_resonance_above_the_excited_band_does_not_count_wherever_its_antiresonance_is(split: float, refused: bool, data: AxisData) -> None:
    """Only its zeros would show, and these imitate a lag of the amplifier. The antiresonance at 300 Hz is inside the band."""
    base = fit_base(data)
    values = (split, 300.0, 0.08, 0.15)
    assert resonance(STANDARD["screw_compliance"], values) == pytest.approx(300.0 * (1.0 + split) * (1.0 - 0.15**2) ** 0.5, rel=1e-3)
    bent = replace(base, model=base.model.with_effect("screw_compliance", values), is_screening=True, parameters=(*base.parameters, SPLIT))
    why = refusal(data, STANDARD, bent)
    assert why.startswith("screw_compliance: a mode at 1.78e+03 Hz, outside the excited band") if refused else why == ""


@pytest.mark.parametrize(("damping", "refused"), [(0.3, False), (1.0, True)])
def test_a_resonance_that_does_not_oscillate_does_not_count(damping: float, refused: bool, data: AxisData) -> None:
    """With a damping ratio of 1 the load on a flexible coupling is a lag, and imitates that of the amplifier."""
    base = fit_base(data)
    known = replace(SPLIT, name="load_side_resonance.frequency", unit="Hz", value=60.0, low=50.0, high=70.0)
    bent = replace(
        base, model=base.model.with_effect("load_side_resonance", (60.0, damping)), is_screening=True, parameters=(*base.parameters, known)
    )
    why = refusal(data, STANDARD, bent)
    assert ("outside the excited band" in why) is refused, why


@pytest.mark.parametrize(("b0", "a1", "a2"), [(1.0, 0.0, 0.0), (1.0, -3.0, 2.5), (1.0, -2.5, 1.0), (np.nan, np.nan, np.nan)])
def test_a_law_of_a_user_without_a_resonance_is_refused_in_words(b0: float, a1: float, a2: float, data: AxisData) -> None:
    """No poles, unstable poles as a pair and on either side of 1, and no numbers."""

    @law
    def section(split: float) -> tuple[float, float, float, float, float]:
        return b0, 0.0, 0.0, a1, a2

    own = replace(STANDARD["base_resonance"], name="shaky", functions={"section": section}, guesses=None, joint=None, family="")
    library = Library([own])
    base = fit_base(data)
    model = AxisModel(base.model.gain, base.model.delay, base.model.pole, library=library).with_effect("shaky", (0.3, 100.0, 0.02, 0.02))
    split = replace(SPLIT, name="shaky.split")
    bent = replace(base, model=model, is_screening=True, parameters=(*base.parameters, split))
    assert refusal(data, library, bent).startswith("shaky: a mode at ")
