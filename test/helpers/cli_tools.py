"""The command line in this process, and recordings to give it."""

from __future__ import annotations

import io
import json
import os
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal

from helpers import ROOT
from xy_sysid.cli import run
from xy_sysid.samples.block import FloatArray

COMMAND = (sys.executable, "-m", "xy_sysid")
RIGID = ("--set", "numerator_order=0", "--set", "denominator_order=2")


@dataclass(frozen=True)
class Said:
    """Result of a command: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The JSON document on stdout; fails for any other output."""
        return json.loads(self.out)


WIDE = "400"  # columns: so that a test finds a sentence in one line


def bare(**changes: str) -> dict[str, str]:
    """This process's environment without variables that change Python's behaviour, and with the project on the path."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "LC_")) and name not in ("LANG", "LANGUAGE")}
    return {**kept, "PYTHONPATH": str(ROOT), "COLUMNS": WIDE, **changes}


def cli(*arguments: object) -> Said:
    """Run a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(argument) for argument in arguments])
    return Said(code, out.getvalue(), err.getvalue())


def refused(*arguments: object) -> str:
    """The error line of a command without other output."""
    said = cli(*arguments)
    assert said.code == 2, said
    assert said.out == ""
    lines = [line for line in said.err.splitlines() if not line.startswith("note: ")]
    assert len(lines) == 1 and lines[0].startswith("xy-sysid: "), said.err
    return lines[0]


def rigid(rows: int, rate: float = 1000.0, seed: int = 1) -> dict[str, FloatArray]:
    """t, u, y of a rigid axis with a gain of 1 mm/s/V, a pole at 100 rad/s, held noise and a little encoder noise."""
    random = np.random.default_rng(seed)
    u = random.normal(size=rows)
    turn = 100.0 / rate  # of the pole in one sample, and the exact response to a held input
    decay = np.exp(-turn)
    y = signal.lfilter(1e-5 * np.array([0.0, turn - 1 + decay, 1 - decay - turn * decay]), np.array([1.0, -1 - decay, decay]), u)
    y += 1e-7 * random.normal(size=rows)
    return {"t": np.arange(rows) / rate, "u": u, "y": y}


def npz(path: Path, rows: int = 30_000, rate: float = 1000.0, **changes: Any) -> Path:
    """A recording of a rigid axis, with some of its arrays changed (a function of the arrays, a value, or None to leave out)."""
    content: dict[str, Any] = dict(rigid(rows, rate))
    for name, change in changes.items():
        content[name] = change(content) if callable(change) else change
    np.savez(path, **{name: value for name, value in content.items() if value is not None})
    return path


def with_one(values: FloatArray, place: Any, value: float) -> FloatArray:
    """A copy with some samples replaced."""
    changed = values.copy()
    changed[place] = value
    return changed
