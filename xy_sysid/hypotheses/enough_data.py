"""Do the data suffice for a diagnosis? If not, what is lacking, in words: time, motion, tones, an output that follows the input."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import EPSILON, AxisData, prepare_all
from xy_sysid.hypotheses.criteria import CHANCE, FEWEST, PARTS, SHORTEST, STILL, STRONGEST, TONE
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units


def prepared(
    sampling_rate: float, recordings: Sequence[tuple[FloatArray, FloatArray]], epsilon: float = EPSILON, units: Units = USUAL
) -> AxisData | str:
    """The data ready to be fitted (see ``prepare_all``), or what is missing in them, in words.

    Recordings of which one suffices alone suffice together: windows are longer for more data, and another motion may need more of them.
    """
    voltage, position = _one_after_the_other(recordings)
    if float(voltage.std()) == 0.0:
        return "the input does not move; excite the axis."
    if float(position.std()) == 0.0:
        return "the output does not move; excite more, or check the encoder."
    try:
        data = prepare_all(sampling_rate, recordings, epsilon, units)
    except BadInput as problem:
        return str(problem)
    if not data.holds_out:
        seconds = voltage.size / sampling_rate
        return f"{seconds:.3g} s without a gap are too few windows to fit some and judge by others; record longer, better 60 s."
    lacking = _lacking(data, sampling_rate, voltage, position)
    alone = ([one] for one in recordings if lacking and len(recordings) > 1)
    if lacking and not any(isinstance(prepared(sampling_rate, one, epsilon, units), AxisData) for one in alone):
        return lacking
    return data


def _lacking(data: AxisData, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> str:
    """What these data do not show, in words; empty if nothing is missing."""
    followed, least = _coherence(sampling_rate, voltage, position)
    if followed < least:
        return f"the output does not follow the input (coherence {followed:.2g} at best, {least:.2g} is the least); check which signals these are."
    moving = [_moving(data, begins) for begins in (data.fitted.begins, data.held_out.begins)]
    if moving[0] < 2 * FEWEST or moving[1] < FEWEST:
        seconds, every = data.layout.length / sampling_rate, data.fitted.begins.size + data.held_out.begins.size
        goes = sum(_moving(data, begins, about_mean=False) for begins in (data.fitted.begins, data.held_out.begins))
        what = "stands most of the time: it moves" if goes <= sum(moving) else "keeps its speed most of the time: it changes"
        return (
            f"the axis {what} in {sum(moving)} of {every} windows of {seconds:.2g} s; "
            "let it move for longer, in all of its directions and speeds. For short step tests use steps."
        )
    if _tones(voltage) < FEWEST:
        return "the input holds one tone only; use noise, a multisine over the whole band, or steps."
    excited = int(data.floor.excited.sum())
    if excited < FEWEST:
        return f"only {excited} bands of frequency are excited; use noise or a multisine over the whole band."
    return ""


def _one_after_the_other(recordings: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """(n,) input and output of all recordings; each continues where the last one ended."""
    if len(recordings) == 1:
        return recordings[0]
    steps = [np.diff(position) for _, position in recordings]
    return np.concatenate([voltage[1:] for voltage, _ in recordings]), np.cumsum(np.concatenate(steps))


def _moving(data: AxisData, begins: np.ndarray, about_mean: bool = True) -> int:
    """Number of windows with motion, compared with the tenth with the strongest motion; about_mean: only changes of speed count."""
    every = np.concatenate((data.fitted.begins, data.held_out.begins))
    length = data.layout.length

    def sizes(starts: np.ndarray) -> FloatArray:
        parts = (data.velocity[start : start + length] for start in starts)
        return np.array([float(np.std(part) if about_mean else np.sqrt(np.mean(part**2))) for part in parts])

    return int(np.sum(sizes(begins) > STILL * float(np.quantile(sizes(every), STRONGEST))))


def _tones(voltage: FloatArray) -> float:
    """Least number of tones of the input: lines of its spectrum within 50 dB of the largest, divided by the width of one tone."""
    power = np.abs(np.fft.rfft((voltage - voltage.mean()) * scipy.signal.get_window("blackmanharris", voltage.size))) ** 2
    return float(np.sum(power > TONE * float(power.max()))) / 8.0  # the window's main lobe; its side lobes are 92 dB down


def _coherence(sampling_rate: float, voltage: FloatArray, position: FloatArray) -> tuple[float, float]:
    """The largest mean coherence of input and velocity in an octave, and the least value above chance, for the best window length.

    Of unrelated signals it is one over the number of windows, and spreads as much (Carter, Knapp & Nuttall 1973); an octave has two lines
    at least.
    """
    best = (0.0, 1.0)
    for part in PARTS:
        length = int(2 ** np.floor(np.log2(voltage.size / part)))
        if length < SHORTEST:
            continue
        with np.errstate(all="ignore"):  # of a line that holds nothing there is none
            frequency, value = scipy.signal.coherence(voltage[:-1], np.diff(position), sampling_rate, nperseg=length)
        octave = np.floor(np.log2(np.maximum(frequency, frequency[1]) / frequency[-1])).astype(np.int64)
        means = [float(np.nanmean(np.nan_to_num(value[octave == k]))) for k in range(-12, 0) if int(np.sum(octave == k)) >= 2]
        found = (max(means, default=0.0), (1.0 + CHANCE / math.sqrt(2.0)) / part)
        best = max(best, found, key=lambda item: item[0] / item[1])
    return best
