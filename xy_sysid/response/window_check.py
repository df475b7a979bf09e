"""Can a window of samples be used? Faults that no counter shows: an encoder that stands still or jumps."""

from __future__ import annotations

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray

Piece = tuple[int, FloatArray, FloatArray]
"""Counter of the first sample, input (n,), output (n,) of a gap-free stretch."""

CREST_FACTOR = 10.0  # a step of the encoder counts as a jump if its crest factor is this many times that of the voltage
OFTEN = 0.1  # of the samples; an encoder that changes less often is broken and not held by friction
CREST_USUAL = 4.0  # crest factor of any noise over a few thousand samples

HELD = (
    "In every window the output stands still at times while the input moves: friction holds it. "
    "The {kept} of {total} windows in which it moves again are used."
)
REASONS = {
    "frozen": "the encoder repeated one value while the voltage moved",
    "leap": "the encoder leapt further than the voltage can explain",
}
SILENT = {
    "level": "the input kept one value",
    "even": "the output rose evenly, as a clock or a counter does",
}
ACTS = {
    "level": "A response needs an input that changes within a window; steps between recordings or stretches are for xy-sysid steps.",
    "even": "Choose another output with --map.",
}
STILL, EVEN = 1e-9, 1e-12  # of a signal's size: smaller changes of the input (resampled) or the speed are rounding; no converter has 30 bits


def stands_still(voltage: FloatArray, position: FloatArray, frozen: int) -> bool:
    """Whether the position (n,) is constant for ``frozen`` samples after the voltage (n,) has changed."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(position) != 0) + 1, [position.shape[0]]))
    for run in np.flatnonzero(np.diff(edges) >= frozen):
        begin, end = int(edges[run]), int(edges[run + 1])
        if float(np.ptp(voltage[begin : end - frozen + 2])) > 0.0:
            return True
    return False


def window_fault(voltage: FloatArray, position: FloatArray, frozen: int) -> str | None:
    """The reason (a key of REASONS) not to use this window of one axis, or None.

    frozen: samples of standstill that count as a fault. A jump is a step whose ratio to the rms step is ten times the crest
    factor of the voltage (which is large for an impulse, so the response to it is no jump).
    """
    if stands_still(voltage, position, frozen):
        return "frozen"
    step = np.diff(position)
    rms = float(np.sqrt(np.mean(step**2)))
    if rms == 0.0:
        return None
    drive = voltage - voltage.mean()
    drive_rms = float(np.sqrt(np.mean(drive**2)))
    usual = max(CREST_USUAL, float(np.max(np.abs(drive))) / drive_rms) if drive_rms > 0 else CREST_USUAL
    return "leap" if float(np.max(np.abs(step))) > CREST_FACTOR * usual * rms else None


def silent(voltage: FloatArray, position: FloatArray) -> str | None:
    """The reason (a key of SILENT) why a window has no information on a response: input or speed is constant up to rounding; None if it has."""
    if float(np.ptp(voltage)) <= STILL * float(np.max(np.abs(voltage))):
        return "level"
    return "even" if float(np.ptp(np.diff(position))) <= EVEN * float(np.max(np.abs(position))) else None


def _resumes(voltage: FloatArray, position: FloatArray) -> bool:
    """Whether a position (n,) with rests moves often, also at the beginning and the end: then friction holds it, and the encoder works."""
    moves = np.diff(position) != 0.0
    quarter = max(moves.shape[0] // 4, 1)
    return bool(moves.mean() > OFTEN and moves[:quarter].any() and moves[-quarter:].any() and float(np.ptp(voltage)) > 0.0)


def stretches(pieces: list[Piece], shape: WindowShape, differenced: bool, frozen: int) -> tuple[list[tuple[int, int, int]], list[str]]:
    """(number of the piece, first sample, last sample + 1) of parts with faultless windows, and a sentence about those left out.

    differenced: True if a window needs one more sample. Raises BadInput if every window has a fault or is silent.
    """
    kept: list[tuple[int, int, int]] = []
    held: list[tuple[int, int, int]] = []  # windows with rests that move again
    faults: dict[str, int] = {}
    says: list[str | None] = []  # the result of ``silent`` for each window without a fault
    total = 0
    for number, (seq, u, y) in enumerate(pieces):
        follows = False
        for start in range(-seq % shape.hop, u.shape[0] - shape.length - int(differenced) + 1, shape.hop):
            stop = start + shape.length + int(differenced)
            fault = window_fault(u[start:stop], y[start:stop], frozen)
            total += 1
            if fault == "frozen" and _resumes(u[start:stop], y[start:stop]):
                held.append((number, start, stop))
            if fault is not None:
                faults[fault] = faults.get(fault, 0) + 1
                follows = False
                continue
            says.append(silent(u[start:stop], y[start:stop]))
            if follows:
                kept[-1] = (number, kept[-1][1], stop)
            else:
                kept.append((number, start, stop))
            follows = True
    if says and None not in says:
        most = max(SILENT, key=says.count)
        raise BadInput(f"windows in which {SILENT[most]}", f"{says.count(most)} of {total}", "fewer", ACTS[most])
    if not faults:
        return [(number, 0, len(u)) for number, (_, u, _) in enumerate(pieces)], []
    why = "; ".join(f"in {count} {REASONS[name]}" for name, count in faults.items())
    if not kept and held:
        return held, [HELD.format(kept=len(held), total=total)]
    if not kept:
        raise BadInput("number of sound windows", f"0 of {total} ({why})", "1 or more", "Check the encoder; --set frozen= allows longer standstill.")
    return kept, [f"{sum(faults.values())} of {total} windows are left out: {why}."]
