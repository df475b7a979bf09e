"""The speed at the first sample, if it decays before the second."""

from __future__ import annotations

import numpy as np

from xy_sysid.greybox.open_loop import open_loop


def test_a_pole_far_above_the_sampling_rate_leaves_the_first_speed_alone() -> None:
    """The start speed decays within a sample: it is not estimated, and the error is that of the simulation."""
    position = np.sin(np.arange(100) / 10.0)
    found = open_loop(125.0, position, np.zeros(99), 1e6)
    assert found.speed == 0.0
    assert np.array_equal(found.error, position - position[0])
