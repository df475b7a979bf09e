"""Time compared with the sample counter: differences are reported in notes."""

from __future__ import annotations

import numpy as np

from xy_sysid.samples.block import FloatArray

OFF = 0.4  # of a period; less is jitter of the stamps
BEFORE = 8  # samples before and after a step, over which it must persist
SAID = 3  # most places named in one sentence


def disagreements(name: str, seq: FloatArray, time: FloatArray, rate: float) -> list[str]:
    """Sentences on the places where the time jumps or the counter slips."""
    jumps, slips = steps(seq, time, rate)
    said = []
    if jumps:
        places = ", ".join(f"{1e3 * size:+.4g} ms at sample {seq[row]:.0f} ({time[row]:.6g} s)" for row, size in jumps[:SAID])
        said.append(f"the time of {name} jumps{_times(jumps)}: {places}; samples are numbered by seq")
    if slips:
        places = ", ".join(f"by {round(size):+d} at sample {seq[row]:.0f} ({time[row]:.6g} s)" for row, size in slips[:SAID])
        said.append(
            f"the counter of {name} slips{_times(slips)} while its time goes on: {places}; from there on a sample may be paired with a neighbour"
        )
    return said


def _times(found: list[tuple[int, float]]) -> str:
    return f" {len(found)} times" if len(found) > 1 else ""


def steps(seq: FloatArray, time: FloatArray, rate: float) -> tuple[list[tuple[int, float]], list[tuple[int, float]]]:
    """(row, size) of lasting steps: of the time, s, while the counter continues, and of the counter, samples, while the time continues."""
    if len(seq) < 2 * BEFORE or rate <= 0:
        return [], []
    ahead = (time - time[0]) * rate - (seq - seq[0])  # periods by which time is ahead of the counter
    counted, passed = np.diff(seq), np.diff(time) * rate
    rows = np.flatnonzero(np.abs(passed - counted) > OFF) + 1
    jumps: list[tuple[int, float]] = []
    slips: list[tuple[int, float]] = []
    for row in rows[:1000].tolist():
        before, after = ahead[max(0, row - BEFORE) : row], ahead[row : row + BEFORE]
        lasting = float(np.median(after) - np.median(before))
        if abs(lasting) <= OFF:
            continue
        if counted[row - 1] != 1 and abs(passed[row - 1] - 1.0) <= OFF:
            slips.append((row, float(-lasting)))
        else:
            jumps.append((row, lasting / rate))
    return jumps, slips
