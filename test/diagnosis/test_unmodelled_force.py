"""The unmodelled force is stated in the unit of the input, with its size and its frequency range."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.diagnosis.as_json import answer_document
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.diagnosis.unmodelled import UnmodelledForce
from xy_sysid.diagnosis.words import not_in_library
from xy_sysid.greybox.axis_data import prepare

RATE = 2000.0


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_a_force_that_no_effect_explains_is_told_with_its_size_and_its_frequencies(size: float) -> None:
    """Noise between 8 and 20 Hz, V rms, that the recorded input does not have."""
    voltage, _ = recorded("", seconds=30.0).axis("x")
    frequency = np.fft.rfftfreq(voltage.size, 1.0 / RATE)
    noise = np.fft.rfft(np.random.default_rng(3).normal(size=voltage.size)) * ((frequency > 8.0) & (frequency < 20.0))
    force = np.fft.irfft(noise, voltage.size)
    force *= size / float(np.std(force))
    moved = simulate(AxisModel(0.1, 1e-3, 200.0), RATE, voltage + force, np.zeros(voltage.size))
    found = diagnose(RATE, voltage, np.concatenate(([0.0], np.cumsum(moved))) / RATE)
    assert found.verdict == "not_in_library" and found.force is not None, found.sentence
    told = json.loads(json.dumps(answer_document(found)))["unmodelled_force"]
    assert told["unit"] == "V" and told["rms"] == pytest.approx(size, rel=0.2)
    assert told["input"] == pytest.approx(float(np.std(voltage)))
    inside = sum(row["rms"] ** 2 for row in told["spectrum"] if row["to"] > 8.0 and row["from"] < 20.0)
    assert inside > 0.9 * told["rms"] ** 2
    low, high = found.force.mostly
    assert 6.0 < low < high < 25.0
    assert "This corresponds to an unmodelled force of" in found.sentence and "V rms" in found.sentence
    none = replace(found, force=UnmodelledForce(((8.0, 20.0, 1e-31),), found.force.input))
    data = prepare(RATE, voltage, np.concatenate(([0.0], np.cumsum(moved))) / RATE)
    assert "force" not in not_in_library(data, none)  # the likeliest force is 0, which a search only approaches


def test_where_friction_is_named_the_force_is_what_it_leaves() -> None:
    """A small fraction of the friction."""
    found = diagnose(RATE, *recorded("coulomb_friction", seconds=20.0).axis("x"))
    assert found.effects == ("coulomb_friction",)
    assert found.force is not None and found.force.rms < 0.1 * found.final.parameter("coulomb_friction.coulomb").value
