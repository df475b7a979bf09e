"""References for tests: the refined model sample by sample, and the exact z form of a transfer function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.sample_step import begin, plant, step_of
from xy_sysid.control_design.step_text import ROOM
from xy_sysid.linear.simulate import _run, stepper
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray


def simulate_alone(model: AxisModel, sampling_rate: float, voltage: FloatArray) -> FloatArray:
    """(n,) encoder position, m, for a voltage (n,), V, from rest at position 0; there is no feedback."""
    ready = plant(model, sampling_rate)
    step, state, room = step_of(model.library.looped([model.library[name] for name, _ in model.effects])), ready.rest(), np.zeros(ROOM * ready.order)
    begin(ready, state, 0.0)
    shown = np.zeros(voltage.size)
    for k, volts in enumerate(voltage[:-1].tolist()):
        shown[k + 1] = step(volts, ready.parameters, ready.flags, ready.numbers, ready.moving, ready.still, state, room)
    return shown


def discrete(tf: TransferFunction, sampling_rate: float) -> TransferFunction:
    """The exact z form after a zero-order hold; a fractional delay adds one pole at z = 0."""
    if tf.sampling_time is not None:
        return tf
    s = stepper(tf, sampling_rate)
    order = s.out.size
    denominator = np.real(np.poly(np.exp(tf.poles() / sampling_rate))) if order else np.ones(1)
    if np.any(s.old != 0) or s.direct_old != 0:
        denominator = np.append(denominator, 0.0)
    impulse = np.zeros(denominator.size)
    impulse[0] = 1.0
    markov = _run(s.step, s.new, s.old, s.out, s.direct_new, s.direct_old, 0, impulse)
    numerator = np.convolve(denominator, markov)[: denominator.size]
    return replace(
        tf, numerator=np.trim_zeros(numerator, "f"), denominator=denominator, delay=s.whole / sampling_rate, sampling_time=1.0 / sampling_rate
    )
