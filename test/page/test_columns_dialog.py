"""Assignment of columns: choices on the page become options of a command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xy_sysid.errors import BadInput
from xy_sysid.imports import load
from xy_sysid.imports.listing import listing
from xy_sysid.page.columns_dialog import AxisColumns, guesses, reading_of
from xy_sysid.page.orders import Reading


def test_what_is_chosen_reads_the_file_and_is_the_same_in_words(tmp_path: Path) -> None:
    """Two axes of a table with meaningless names, one in mm; the command's options are --map, --unit and --rate."""
    rng = np.random.default_rng(1)
    table = np.column_stack([rng.normal(size=(3000, 2)), np.cumsum(rng.normal(size=(3000, 2)), axis=0)])
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="p,q,r,s", comments="")
    axes = [AxisColumns("x", "p", "r", "V", "mm"), AxisColumns("y", "q", "s", "", "mm")]
    made = reading_of("", 500.0, axes, Reading(words=("--effects", "mine.py")))
    found = load(tmp_path / "a.csv", **made.load)
    assert found.axes == ("x", "y") and found.sampling_rate == 500.0
    assert np.allclose(np.ptp(found.position[:, 0]), 1e-3 * np.ptp(table[:, 2]))
    assert made.words[:4] == ("--effects", "mine.py", "--map", "x.input=p")
    assert made.words[-2:] == ("--rate", "500") and "y.output=mm" in made.words


def test_units_of_time_factors_and_references_are_chosen_too(tmp_path: Path) -> None:
    """A time in ticks of a millisecond, an encoder in counts times a factor, and a setpoint."""
    rng = np.random.default_rng(1)
    table = np.column_stack([np.arange(3000) * 2.0, rng.normal(size=3000), np.rint(np.cumsum(rng.normal(size=3000)) * 10), np.arange(3000)])
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="p,q,r,s", comments="")
    axis = AxisColumns("x", "q", "r", "A", "", "2", "1e-3", "s")
    made = reading_of("p", None, [axis], Reading(), "ms")
    found = load(tmp_path / "a.csv", **made.load)
    assert found.sampling_rate == 500.0 and found.input_unit == "A"
    assert np.allclose(found.voltage[:, 0], 2 * table[:, 1]) and np.allclose(found.position[:, 0], 1e-3 * table[:, 2])
    assert found.reference is not None and np.allclose(found.reference[:, 0], 1e-3 * table[:, 3])
    assert made.words.count("--scale") == 2 and "time=ms" in made.words and "x.reference=s" in made.words


def test_names_that_tell_are_chosen_already(tmp_path: Path) -> None:
    """Time in ms, a voltage and a position: no choice is needed; units are not part of a name."""
    rows = np.column_stack((np.arange(400) / 1e3, np.sin(np.arange(400.0)), np.cos(np.arange(400.0))))
    np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="Time,Motor Voltage (V),Encoder Pos", comments="")
    time, (axis,) = guesses(listing(tmp_path / "a.csv"))
    assert (time, axis.input, axis.output) == ("Time", "Motor Voltage", "Encoder Pos")


@pytest.mark.parametrize(
    ("time", "rate", "axes", "words"),
    [
        ("", None, [AxisColumns("x", "p", "q")], "a column, or a rate"),
        ("t", None, [AxisColumns("x", "p", "")], "output of x is not chosen"),
        ("t", None, [AxisColumns("x", "p", "q"), AxisColumns("x", "r", "s")], "a different name"),
        ("t", None, [], "a different name for each axis"),
        ("t", -5.0, [AxisColumns("x", "p", "q")], "> 0 Hz"),
    ],
)
def test_what_is_not_chosen_is_named(time: str, rate: float | None, axes: list[AxisColumns], words: str) -> None:
    """One line with the value, the allowed values and the next action."""
    with pytest.raises(BadInput, match=words):
        reading_of(time, rate, axes, Reading())
