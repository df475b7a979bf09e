"""Content of the topics: columns, units and order of the contract, and a transfer function that can be read back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from helpers.fitting_cases import held, paper_machine

from xy_sysid.fitting import Structure, identify
from xy_sysid.live.messages import comparison_message, frf_message, read_transfer_function, table, transfer_function_message
from xy_sysid.live.plain_messages import topic_of


def test_a_response_is_rows_of_frequency_real_imag_coherence_sigma() -> None:
    """Row-major, one line per row, the columns named in the second dimension."""
    frf = held(paper_machine(), 0.01)
    message = frf_message("x", frf)
    assert message.topic == "frf/x" and message.labels == ("line", "frequency,real,imag,coherence,sigma") and message.sizes == (len(frf), 5)
    rows = message.data.reshape(message.sizes)
    np.testing.assert_array_equal(rows[:, 1] + 1j * rows[:, 2], frf.response)
    np.testing.assert_array_equal(rows[:, 0], frf.frequency)
    np.testing.assert_array_equal(rows[:, 4], frf.sigma)


def test_a_comparison_is_in_db_and_in_sigma() -> None:
    """The rms of the last column is near 1 for a complete model."""
    frf = held(paper_machine(), 0.01, seed=2)
    fit = identify(frf, Structure())
    message = comparison_message("y", fit)
    rows = message.data.reshape(message.sizes)
    assert message.topic == "comparison/y" and message.labels[1] == "frequency,measured_db,model_db,residual_sigma"
    np.testing.assert_allclose(10 ** (rows[:, 1] / 20), np.abs(fit.measured))
    np.testing.assert_allclose(10 ** (rows[:, 2] / 20), np.abs(fit.response))
    assert 0.85 < float(np.sqrt(np.mean(rows[:, 3] ** 2))) < 1.15


def test_a_transfer_function_reads_back() -> None:
    """Numerator, denominator and delay in sequence, separated by the sizes of three dimensions."""
    for tf in (paper_machine(), replace(paper_machine(0.0), numerator=np.array([5.0]))):
        message = transfer_function_message("x", tf)
        assert message.labels == ("numerator", "denominator", "delay") and sum(message.sizes) == message.data.size
        back = read_transfer_function(message)
        np.testing.assert_array_equal(back.numerator, tf.numerator)
        np.testing.assert_array_equal(back.denominator, tf.denominator)
        assert back.delay == tf.delay


def test_rows_of_samples_and_of_lines_are_named_so() -> None:
    """The first dimension names the kind of row; the numbers are contiguous for any array."""
    rows = np.arange(12.0).reshape(3, 4).T
    message = table("any", ("seq", "time", "x"), rows)
    assert message.labels[0] == "sample" and message.sizes == (4, 3)
    np.testing.assert_array_equal(message.data.reshape(4, 3), rows)


def test_an_axis_of_any_spelling_has_a_topic() -> None:
    """Characters that ROS does not allow become underscores; plain names are unchanged."""
    assert [topic_of("frf", axis) for axis in ("x", "shoulder_pan", "joint-2", "left/wrist 3", "2nd")] == [
        "frf/x", "frf/shoulder_pan", "frf/joint_2", "frf/left_wrist_3", "frf/_2nd"
    ]  # fmt: skip
