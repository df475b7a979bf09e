"""A transfer function as an object of other packages: python-control and scipy.signal."""

from __future__ import annotations

from typing import Any

import numpy as np

from xy_sysid.errors import MissingExtra
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.linear.transfer_function import TransferFunction


def to_control(model: TransferFunction | AnyModel, pade_order: int = 4) -> Any:
    """A python-control TransferFunction; a continuous delay becomes a Pade form, a discrete one an integer number of steps.

    For a model with physical effects, its linear part. Raises MissingExtra if python-control is not installed.
    """
    try:
        import control
    except ImportError:
        raise MissingExtra("python-control", "control") from None
    tf = model if isinstance(model, TransferFunction) else model.tf
    if tf.sampling_time is None:
        if tf.delay > 0:
            top, bottom = control.pade(tf.delay, pade_order)
            return control.TransferFunction(np.polymul(tf.numerator, top), np.polymul(tf.denominator, bottom))
        return control.TransferFunction(tf.numerator, tf.denominator)
    steps = round(tf.delay / tf.sampling_time)
    return control.TransferFunction(tf.numerator, np.concatenate((tf.denominator, np.zeros(steps))), tf.sampling_time)


def to_scipy(model: TransferFunction | AnyModel, pade_order: int = 4) -> Any:
    """A scipy.signal.TransferFunction; delay and effects as in ``to_control``."""
    from scipy import signal

    tf = (model if isinstance(model, TransferFunction) else model.tf).pade(pade_order)
    if tf.sampling_time is None:
        return signal.TransferFunction(tf.numerator, tf.denominator)
    return signal.TransferFunction(tf.numerator, tf.denominator, dt=tf.sampling_time)
