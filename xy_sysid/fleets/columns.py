"""Every column of the fleet's table: its name, type, unit and meaning.

All columns are flat (numbers, text, booleans, one date), so that every Parquet reader accepts them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from xy_sysid.axis.model import STANDARD, Library

Kind = Literal["text", "number", "count", "truth", "date"]
ROOTS = 3  # resonances and antiresonances that have columns, lowest frequency first
TIMES = ("seconds_reading", "seconds_fit", "seconds_diagnosis")  # the only columns that differ between two runs of one version


@dataclass(frozen=True, slots=True)
class Column:
    """One column. unit: SI; V and m stand for the units of the axis's input and output; trended: True if ``xy-sysid trend`` follows it."""

    name: str
    kind: Kind
    unit: str
    meaning: str
    trended: bool = False


_RECORDING = (
    Column("machine", "text", "", "name of the machine"),
    Column("axis", "text", "", "name of the axis; empty where the file could not be read"),
    Column("date", "date", "", "when the recording was made, UTC; empty if unknown"),
    Column("source", "text", "", "path of the recording"),
    Column("problem", "text", "", "why an answer is missing, in one line; empty where none is"),
    Column("stage", "text", "", "what could not be done: naming, reading, fit, diagnosis, or worker (its process died)"),
    Column("samples", "count", "", "samples of the axis"),
    Column("gaps", "count", "", "gaps between them"),
    Column("sampling_rate", "number", "Hz", "samples per second"),
    Column("input_unit", "text", "", "unit of the input; it takes the place of V in the units below"),
    Column("output_unit", "text", "", "unit of the output; it takes the place of m in the units below"),
    Column("notes", "text", "", "what was converted or assumed while reading, one sentence after another"),
)
_RESPONSE = (
    Column("frf_averages", "number", "", "independent averages of the frequency response"),
    Column("frf_low", "number", "Hz", "lowest trusted line"),
    Column("frf_high", "number", "Hz", "highest trusted line"),
    Column("frf_trusted", "number", "", "part of the lines in the band that are coherent enough, 0 to 1"),
    Column("frf_coherence", "number", "", "median coherence of the band, 0 to 1"),
    Column("tf_numerator", "text", "", "coefficients of the transfer function's numerator in s, highest power first"),
    Column("tf_denominator", "text", "", "the same of the denominator"),
    Column("tf_trustworthy", "truth", "", "the data determine it, and noise nearly explains its residual error"),
    Column("tf_relative_error", "number", "", "rms of the error over the magnitude, line by line"),
    Column("tf_misfit", "number", "", "factor by which the intervals of noise alone are too narrow; the intervals below include it"),
)
_DIAGNOSIS = (
    Column("verdict", "text", "", "missing_effect, nothing_missing, not_in_library or not_enough_data"),
    Column("effects", "text", "", "the effects that are named, largest first, separated by commas"),
    Column("confidence", "number", "", "confidence of the verdict, 0 to 1"),
    Column("sentence", "text", "", "the verdict in words"),
    Column("explained", "number", "", "part of the rigid model's error power beyond the noise that the effects explain, 0 to 1"),
    Column("rigid_error", "number", "m/s", "held-out error of the rigid model, rms"),
    Column("held_out_error", "number", "m/s", "held-out error of the model below, rms", trended=True),
    Column("noise_floor", "number", "m/s", "smallest error that the data can show: encoder noise and a tolerated part of the motion, rms"),
    Column("noise", "number", "m/s", "part of the error that comes from encoder noise, rms", trended=True),
    Column("discrepancy", "number", "m/s", "part of the error that neither noise nor an effect explains, rms"),
    Column("model", "text", "", "effects of the model whose parameters are in the next columns: the named ones, and those given with --follow"),
    Column("tried_first", "text", "", "effects of the axis' first recording, if they explain this one too, so that no others were tried; else empty"),
    Column("one_step", "truth", "", "the model is judged one sample ahead (backlash); its held-out error is that of the prediction"),
)
_ORIGIN = (
    Column("seconds_reading", "number", "s", "processor time for reading the file, shared by its axes"),
    Column("seconds_fit", "number", "s", "processor time for the response and the transfer function"),
    Column("seconds_diagnosis", "number", "s", "processor time for the diagnosis"),
    Column("versions", "text", "", "versions of the software that made the row"),
    Column("file_sha256", "text", "", "SHA-256 of the file, or of all files of a bag"),
    Column("data_sha256", "text", "", "SHA-256 of the samples of the longest stretch without a gap"),
    Column("key", "text", "", "SHA-256 of file, name, options and version: a recording whose key is in the table is skipped"),
)


def columns(library: Library = STANDARD) -> tuple[Column, ...]:
    """All columns in order, including those of every parameter of a library."""
    return (*_RECORDING, *_RESPONSE, *_linear(), *_DIAGNOSIS, *_parameters(library), *_ORIGIN)


def column_of(parameter: str) -> str:
    """The column of a parameter: coulomb_friction_coulomb for coulomb_friction.coulomb."""
    return parameter.replace(".", "_")


def _linear() -> Iterator[Column]:
    yield from _interval("tf_gain", "m/s/V", "velocity gain of the transfer function, with friction in it", False)
    yield from _interval("tf_delay", "s", "delay of the transfer function", False)
    yield from _interval("tf_pole", "rad/s", "slowest real pole of the transfer function", False)
    for kind in ("resonance", "antiresonance"):
        for number in range(1, ROOTS + 1):
            yield from _interval(f"tf_{kind}_{number}_frequency", "Hz", f"{kind} {number} of the transfer function", True)
            yield from _interval(f"tf_{kind}_{number}_damping", "", f"damping ratio of {kind} {number}", False)


def _parameters(library: Library) -> Iterator[Column]:
    base = (("gain", "m/s/V", "velocity gain"), ("delay", "s", "delay"), ("pole", "rad/s", "viscous pole"))
    for name, unit, meaning in base:
        yield from _interval(name, unit, f"{meaning} of the axis model", True)
    for effect in library.effects.values():
        for item in effect.parameters if effect.category != "base" else ():
            whole_turn = item.unit == "rad"  # a phase has no magnitude that could grow
            yield from _interval(column_of(f"{effect.name}.{item.name}"), item.unit, f"{effect.name}: {item.meaning}", not whole_turn)


def _interval(name: str, unit: str, meaning: str, trended: bool) -> Iterator[Column]:
    yield Column(name, "number", unit, meaning, trended=trended)
    yield Column(f"{name}_low", "number", unit, "lower end of its 95 % interval")
    yield Column(f"{name}_high", "number", unit, "upper end of its 95 % interval")
