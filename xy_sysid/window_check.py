"""Is a window of samples fit to be used? What no counter shows: an encoder that stands still or leaps."""

from __future__ import annotations

import numpy as np

from xy_sysid.stream import FloatArray

CREST_FACTOR = 10.0  # a step of the encoder counts as a leap when it stands out so many times more than the voltage does
CREST_USUAL = 4.0  # crest factor that any noise reaches in a few thousand samples

REASONS = {
    "frozen": "the encoder repeated one value while the voltage moved",
    "leap": "the encoder leapt further than the voltage can explain",
}


def longest_repeat(values: FloatArray) -> int:
    """Length of the longest run of equal consecutive values of a (n,) array."""
    changes = np.flatnonzero(np.diff(values) != 0)
    edges = np.concatenate(([-1], changes, [values.shape[0] - 1]))
    return int(np.max(np.diff(edges)))


def window_fault(voltage: FloatArray, position: FloatArray, frozen: int) -> str | None:
    """The reason (a key of REASONS) not to use this window of one axis, or None.

    frozen: samples of standstill that are too many. A leap is a step whose ratio to the rms step is ten times what the
    voltage's own crest factor suggests (an impulse has a large one, so its answer is not a leap).
    """
    if float(np.ptp(voltage)) > 0.0 and longest_repeat(position) >= frozen:
        return "frozen"
    step = np.diff(position)
    rms = float(np.sqrt(np.mean(step**2)))
    if rms == 0.0:
        return None
    drive = voltage - voltage.mean()
    drive_rms = float(np.sqrt(np.mean(drive**2)))
    usual = max(CREST_USUAL, float(np.max(np.abs(drive))) / drive_rms) if drive_rms > 0 else CREST_USUAL
    return "leap" if float(np.max(np.abs(step))) > CREST_FACTOR * usual * rms else None
