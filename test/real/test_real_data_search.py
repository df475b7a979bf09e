"""Results of the search on recordings of real machines; skipped without the recordings."""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import pytest
from helpers.real_data import data

from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.diagnosis.rungs import rungs_of
from xy_sysid.greybox.axis_data import prepare
from xy_sysid.greybox.free_run import fit_with, fitted_score
from xy_sysid.greybox.open_loop import open_loop, settled
from xy_sysid.imports import load
from xy_sysid.response.estimate import Estimate
from xy_sysid.units import Units

EMPS = "emps/emps_train.npz"
FORCE = 35.15065  # N/V of EMPS


@cache
def found(path: str) -> tuple[Answer, float]:
    """The answer for the only axis with the default budget, and the sampling rate, Hz."""
    recording = load(data(path))
    return diagnose(recording.sampling_rate, *recording.axis(recording.axes[0]), clock=time.process_time), recording.sampling_rate


@pytest.mark.parametrize("path", ["crane/crane_1.npz", "bam_servo/bam_xl330_sin_time_square_kp800_even.npz"])
def test_no_mode_is_named_above_what_the_sampling_can_see(path: str) -> None:
    """No resonance above 0.8 of Nyquist in any set that could be best; one fitted above is refused with a reason."""
    item, rate = found(path)
    highest = 0.4 * rate
    for names, fit in ((item.effects, item.final), *((rival.effects, rival.rung.fit) for rival in item.rivals)):
        for name in names:
            mode = STANDARD[name].mode_frequency
            if mode:
                assert fit.parameter(f"{name}.{mode}").value <= highest, (names, name)
    above = [reason for _, reason in item.refused if "a mode at" in reason]
    assert all("outside the excited band" in reason for reason in above)


def test_emps_has_coulomb_friction_and_drag_that_differs_between_directions() -> None:
    """These two effects first; more than 97 % of the error's power explained, and the residual is compared with the encoder's noise."""
    item, _ = found(EMPS)
    assert item.verdict == "missing_effect"
    assert set(item.effects[:2]) == {"coulomb_friction", "asymmetric_viscous_friction"}
    assert item.explained > 0.97
    assert item.discrepancy > 10.0 * item.noise
    assert item.sentence.startswith("Missing: coulomb_friction")


def test_emps_is_refined_without_being_told() -> None:
    """Dry friction and its direction dependence; at least 95 % of the held-out error power explained; mass within 3 %, position to 2.5 mm."""
    item, rate = found(EMPS)
    families = ("coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis")
    assert set(families) & set(item.effects) and "asymmetric_viscous_friction" in item.effects
    base, final = item.base, item.final
    assert (final.held_out_error / base.held_out_error) ** 2 < 0.05
    voltage, position = load(data(EMPS)).axis("x")
    alone = settled(prepare(rate, voltage, position), final)
    assert FORCE / (alone.model.gain * alone.model.pole) == pytest.approx(95.1089, rel=0.03)
    assert open_loop(rate, position, alone.simulated, alone.model.pole).rms <= 2.5e-3


def test_a_servo_that_lifts_a_pendulum_feels_gravity() -> None:
    """Its joint turns far enough to distinguish gravity from a spring."""
    item, _ = found("bam_servo/bam_xl330_sin_time_square_kp800_even.npz")
    assert (item.verdict, item.effects[0]) == ("missing_effect", "gravity")
    assert item.explained > 0.95


def test_hsm150_has_coulomb_friction() -> None:
    """It turns in one direction only, for which a constant load is the same law."""
    item, _ = found("hsm150/hsm_pos_0.06_1.npz")
    assert item.verdict == "missing_effect"
    assert item.effects == ("coulomb_friction",)
    assert item.explained > 0.98


def test_each_half_of_emps_says_what_the_whole_says_and_their_intervals_overlap() -> None:
    """Twelve seconds each, with four held-out windows: dry friction, less certain than from the full record."""
    recording = load(data(EMPS))
    voltage, position = recording.axis(recording.axes[0])
    middle = voltage.size // 2
    halves = [diagnose(recording.sampling_rate, voltage[part], position[part]) for part in (slice(0, middle), slice(middle, None))]
    for half in halves:
        assert {"coulomb_friction", "asymmetric_friction"} & set(half.effects), half.sentence
        assert half.explained > 0.8
    first, second = (half.final for half in halves)
    both = {item.name for item in first.parameters} & {item.name for item in second.parameters}
    apart = [item.name for item in first.parameters if item.name in both and not _overlap(item, second.parameter(item.name))]
    assert len(apart) < len(both)


def _overlap(one: Estimate, other: Estimate) -> bool:
    return max(one.low, other.low) <= min(one.high, other.high)


def test_two_like_inertias_on_a_shaft_are_a_compliance_and_no_base() -> None:
    """Antiresonance at 54 Hz and resonance at 76 Hz: a base would be as heavy as the moving mass."""
    for name in ("A", "B"):
        item, _ = found(f"two_inertia_bench/multisine{name}.npz")
        assert item.effects[0] == "screw_compliance", item.sentence
        assert "base_resonance" not in item.effects
        assert "A motor encoder cannot distinguish screw_compliance from base_resonance" in item.sentence
        assert item.confidence < 0.96


def test_one_more_effect_never_ends_worse_than_the_model_that_it_was_added_to() -> None:
    """If a slow pole explains all friction, the fit ends with hardly any friction, and not at a worse minimum; so does each rung of ``refine``."""
    rate = 1000.0
    drive, speed = (np.loadtxt(data(f"generator/{name}_cc.csv"), delimiter=",").ravel()[:100_000] for name in ("x", "y"))
    prepared = prepare(rate, drive, np.cumsum(speed) / rate, units=Units("V", "rad"))
    base, load, both = (rung.fit for rung in rungs_of(prepared, STANDARD, ["constant_load", "coulomb_friction"]))
    for less, more in ((base, load), (load, both), (base, fit_with(prepared, base, ["coulomb_friction"]))):
        assert fitted_score(prepared, more) < fitted_score(prepared, less) + 1e-6
