"""The speed at the first sample, where the model forgets it before the second."""

from __future__ import annotations

import numpy as np

from xy_sysid.greybox.open_loop import open_loop


def test_a_pole_far_above_the_sampling_rate_leaves_the_first_speed_alone() -> None:
    """Its start fades to nothing within a sample: there is nothing to estimate, and the error is what was simulated."""
    position = np.sin(np.arange(100) / 10.0)
    found = open_loop(125.0, position, np.zeros(99), 1e6)
    assert found.speed == 0.0
    assert np.array_equal(found.error, position - position[0])
