"""What goes on the topics, as plain numbers and words: the node and the replay send the same."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.result import Fit
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.plain_messages import OK, STALE, WARN, ArrayMessage, StatusMessage, topic_of
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.story.acts import sentence
from xy_sysid.story.story import Story

FRF_COLUMNS = ("frequency", "real", "imag", "coherence", "sigma")
COMPARISON_COLUMNS = ("frequency", "measured_db", "model_db", "residual_sigma")
LADDER_COLUMNS = ("step", "train_error", "held_out_error", "noise_floor")


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

    Three dimensions that name the parts of ``data``, one after the other: numerator, denominator, delay.
    """
    data = np.concatenate((tf.numerator, tf.denominator, [tf.delay]))
    sizes = (tf.numerator.shape[0], tf.denominator.shape[0], 1)
    return ArrayMessage(topic_of("transfer_function", axis), ("numerator", "denominator", "delay"), sizes, data)


def read_transfer_function(message: ArrayMessage) -> TransferFunction:
    """The transfer function that a message holds."""
    first, second, _ = message.sizes
    return TransferFunction(message.data[:first], message.data[first : first + second], float(message.data[-1]))


def ladder_message(story: Story) -> ArrayMessage:
    """``error_ladder/<axis>``: one row per step, the output's unit over s."""
    rungs = [step.rung for step in story.steps]
    rows = np.array([(k, rung.train_error, rung.held_out_error, rung.noise_floor) for k, rung in enumerate(rungs)], dtype=np.float64)
    return ArrayMessage(topic_of("error_ladder", story.axis), ("step", ",".join(LADDER_COLUMNS)), (len(rungs), len(LADDER_COLUMNS)), rows.ravel())


def diagnosis_status(story: Story) -> StatusMessage:
    """``diagnosis``: verdict, errors and ranking of one axis; OK if the model explains it or nothing is missing, else WARN."""
    values: dict[str, str] = {"seconds of data (s)": f"{story.seconds:.6g}", "tolerance (1)": f"{story.tolerance:.3g}"}
    found, now = story.diagnosis, story.now
    if found is not None:
        values |= {
            "verdict": found.verdict,
            "effect": found.effect or "",
            "effects": ", ".join(found.effects),
            "confidence (1)": f"{found.confidence:.3f}",
        }
    if now is not None:
        speed = story.units.judged
        values |= {
            f"error of the rigid model ({speed})": f"{story.steps[0].rung.held_out_error:.6g}",
            f"error now ({speed})": f"{now.held_out_error:.6g}",
            f"training error now ({speed})": f"{now.train_error:.6g}",
            f"noise floor ({speed})": f"{now.noise_floor:.6g}",
            "effects in the model": ", ".join(now.effects),
            "explained": str(now.explained).lower(),
        }
        for item in now.parameters:
            values[f"{item.name} ({item.unit or '1'})"] = f"{item.value:.9g}"
            values[f"{item.name} 95 % low"], values[f"{item.name} 95 % high"] = f"{item.low:.9g}", f"{item.high:.9g}"
    if found is not None:
        values |= {f"candidate {k}": f"{one.effect}: {one.evidence}" for k, one in enumerate(found.candidates, start=1)}
        values |= {"runner-up": found.runner_up[1]} if found.runner_up else {}
        values |= {f"look-alike {one.effect}": one.sentence for one in found.look_alikes}
        values |= {f"fails {k}": place.sentence for k, place in enumerate(found.where[:5], start=1)}
        values["next experiment"] = found.next_experiment
    well = (now is not None and now.explained) or (found is not None and found.verdict == "nothing_missing")
    level = OK if well else STALE if found is not None and found.verdict == "not_enough_data" else WARN
    return StatusMessage(f"axis {story.axis}", level, sentence(story), tuple(values.items()))
