"""Start values from the motion without the base's delay, if that is too long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.foreign import Joint, driven

from xy_sysid.greybox.axis_data import prepare
from xy_sysid.greybox.free_run import LATE, first_excess, fit_base, inverse_start_models, scene_of
from xy_sysid.greybox.whitened import ORDER, enough

LIMITED = Joint(fs=500.0, seconds=30.0, count=2e-5, mass=0.3, drag=8.0, limit=3.0, shake=4.0, band=(0.5, 40.0))


def test_behind_a_base_that_is_late_the_motion_is_seen_without_its_delay_too() -> None:
    """Otherwise there is one scene only."""
    data = prepare(LIMITED.fs, *driven(LIMITED, 1))
    base = fit_base(data)
    assert base.model.delay < LATE and scene_of(data, base).prompt is None
    late = replace(base, model=replace(base.model, delay=0.02))
    scene = scene_of(data, late)
    assert scene.prompt is not None
    shift = int(0.02 * LIMITED.fs)
    np.testing.assert_allclose(scene.voltage[shift:], scene.prompt.voltage[:-shift])


def test_a_limit_is_read_though_the_base_has_a_delay_that_the_axis_has_not() -> None:
    """With the base's delay of 40 ms there are no useful start values."""
    data = prepare(LIMITED.fs, *driven(LIMITED, 1))
    base = fit_base(data)
    late = replace(base, model=replace(base.model, delay=0.04))
    assert not inverse_start_models(data, late, late.model, "saturation", replace(scene_of(data, late), prompt=None))
    read = min(inverse_start_models(data, late, late.model, "saturation"), key=lambda start: first_excess(data, start))
    assert first_excess(data, read) < first_excess(data, late.model) - 1.0
    assert dict(read.effects)["saturation"][0] == pytest.approx(LIMITED.limit, rel=0.2)


def test_an_autoregressive_model_needs_four_samples_for_each_number() -> None:
    """And one that is judged."""
    held = np.zeros(6 * ORDER, dtype=np.bool_)
    assert not enough(held)
    held[-1] = True
    assert enough(held)
    assert not enough(held[-4 * ORDER :])
