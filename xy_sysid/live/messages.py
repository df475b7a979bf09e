"""Topic content as plain numbers and words, shared by the node and the replay."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.result import Fit
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.plain_messages import ArrayMessage, topic_of
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import FloatArray

FRF_COLUMNS = ("frequency", "real", "imag", "coherence", "sigma")
COMPARISON_COLUMNS = ("frequency", "measured_db", "model_db", "residual_sigma")


def table(topic: str, columns: tuple[str, ...], rows: FloatArray) -> ArrayMessage:
    """Rows of named columns, like the sample streams."""
    label = "line" if columns[0] == "frequency" else "sample"
    return ArrayMessage(topic, (label, ",".join(columns)), (rows.shape[0], rows.shape[1]), np.ascontiguousarray(rows).ravel())


def frf_message(axis: str, frf: FrequencyResponse) -> ArrayMessage:
    """``frf/<axis>``: Hz, output_unit / input_unit, coherence, sigma of the complex error."""
    rows = np.column_stack((frf.frequency, frf.response.real, frf.response.imag, frf.coherence, frf.sigma))
    return table(topic_of("frf", axis), FRF_COLUMNS, rows)


def comparison_message(axis: str, fit: Fit) -> ArrayMessage:
    """``comparison/<axis>``: Hz, dB, dB, and the distance between measured and model in sigma, at the fitted lines."""
    measured_db, model_db = 20 * np.log10(np.abs(fit.measured)), 20 * np.log10(np.abs(fit.response))
    residual = np.abs(fit.measured - fit.response) * fit.weight
    return table(topic_of("comparison", axis), COMPARISON_COLUMNS, np.column_stack((fit.frequency, measured_db, model_db, residual)))


def transfer_function_message(axis: str, tf: TransferFunction) -> ArrayMessage:
    """``transfer_function/<axis>``: coefficients of falling powers of s, then the delay in s.

    Three dimensions name the consecutive parts of ``data``: numerator, denominator, delay.
    """
    data = np.concatenate((tf.numerator, tf.denominator, [tf.delay]))
    sizes = (tf.numerator.shape[0], tf.denominator.shape[0], 1)
    return ArrayMessage(topic_of("transfer_function", axis), ("numerator", "denominator", "delay"), sizes, data)


def read_transfer_function(message: ArrayMessage) -> TransferFunction:
    """The transfer function that a message holds."""
    first, second, _ = message.sizes
    return TransferFunction(message.data[:first], message.data[first : first + second], float(message.data[-1]))
