"""Two effects with the same equations: the given name, and its confidence."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.diagnosis.equal_laws import equals, likelihood

HEAVY_BASE = (0.06, 46.0, 0.02, 0.03)
TWO_INERTIAS = (0.41, 54.0, 0.02, 0.03)


def test_a_base_and_a_screw_that_give_are_one_law() -> None:
    """No other two effects of the library have the same equations."""
    assert {effect.name for effect in equals(STANDARD, "base_resonance")} == {"base_resonance", "screw_compliance"}
    alone = [effect.name for effect in STANDARD.acting if len(equals(STANDARD, effect.name)) == 1]
    assert len(alone) == len(STANDARD.acting) - 2


@pytest.mark.parametrize(
    ("values", "likely"), [(HEAVY_BASE, "base_resonance"), (TWO_INERTIAS, "screw_compliance"), ((0.1, 140.0, 0.02, 0.05), "screw_compliance")]
)
def test_the_likelier_name_is_that_of_which_it_is_usual(values: tuple[float, ...], likely: str) -> None:
    """A base is slow and heavy; if the resonance is far above the antiresonance, two parts of similar inertia oscillate."""
    both = {effect.name: likelihood(STANDARD, effect.name, values) for effect in equals(STANDARD, likely)}
    assert sum(both.values()) == pytest.approx(1.0)
    assert max(both, key=lambda name: both[name]) == likely


def test_what_no_other_effect_does_has_its_name_for_sure() -> None:
    """For any size."""
    assert likelihood(STANDARD, "coulomb_friction", (0.0,)) == 1.0


def test_two_like_inertias_are_a_shaft_that_gives_and_the_sentence_says_what_else_it_may_be() -> None:
    """A motor and a load of its own size on a shaft, antiresonance at 54 Hz, noise."""
    drive, position = two_inertias()
    found = diagnose(1000.0, drive, position)
    assert found.effects == ("screw_compliance",), found.sentence
    assert 0.6 < found.confidence < 0.98
    assert "A motor encoder cannot distinguish screw_compliance from base_resonance" in found.sentence
    model = found.final.model
    zero, split = dict(model.effects)["screw_compliance"][1::-1]
    assert (zero, zero * (1.0 + split)) == pytest.approx((54.0, 54.0 * 2.0**0.5), rel=0.02)
    assert found.final.parameter("screw_compliance.frequency").value == zero
    assert {rung.added for rung in found.rungs} == {None, "screw_compliance"}


def two_inertias() -> tuple[np.ndarray, np.ndarray]:
    """(n,) drive and (n,) position of a motor with an equal load on a shaft, 20 s at 1 kHz, exactly integrated."""
    random = np.random.default_rng(3)
    drive = scipy.signal.sosfilt(scipy.signal.butter(2, (0.5, 200.0), "bandpass", fs=1000.0, output="sos"), random.standard_normal(20_000))
    inertia, stiff = 1e-2, 1e-2 * (2.0 * np.pi * 54.0) ** 2
    inner = np.array([[0, 1, 0, 0], [-stiff, -0.3, stiff, 0.1], [0, 0, 0, 1], [stiff, 0.1, -stiff, -0.3]])
    inner[1] /= inertia
    inner[3] /= inertia
    exact = scipy.linalg.expm(np.block([[inner, np.array([[0.0], [1.0 / inertia], [0.0], [0.0]])], [np.zeros((1, 5))]]) * 1e-3)
    state, position = np.zeros(4), np.empty(drive.size)
    for i, volts in enumerate(drive):
        position[i] = np.round(state[0] / 1e-6) * 1e-6
        state = exact[:4, :4] @ state + exact[:4, 4] * volts
    return drive, position
