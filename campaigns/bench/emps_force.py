"""python -m campaigns.bench emps_force: the input of the second half of EMPS, predicted from its motion by a model of the first half.

EMPS is a motor, a ball screw and a mass under position control, measured by Janot, Gautier and Brunot (2019); 1 V is 35.15 N. The table is written to
docs/use.md. Both inputs are compared below a frequency; above, the recorded one is the controller's response to quantisation. The last column adds
the position-dependent force that the model does not explain in the first half (``control_design.measured_table``).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import scipy.signal

from campaigns.bench.recordings import between, markdown
from campaigns.bench.use import PAGE
from campaigns.faults.shared import DATA
from xy_sysid.control_design.gains import gains, simple_feedforward
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.measured_table import measured_table
from xy_sysid.control_design.path import ORDER, recorded
from xy_sysid.control_design.worth import WIDER, clear_below
from xy_sysid.diagnosis.of_run import refine
from xy_sysid.imports import load

BELOW = (10.0, 20.0, 50.0, 100.0)  # Hz
COLUMNS = ("compared below", "kV and kA", "with kS", "whole feedforward", "and the table of the first half")
SHORT_EFFECTS = ("coulomb_friction", "asymmetric_viscous_friction")  # result of the search


def parts(short: bool) -> list[tuple[str, ...]]:
    """Rows: residual of each prediction, in per cent of the recorded input's rms."""
    run = load(Path(os.environ.get("XY_SYSID_DATA") or DATA) / "emps" / "emps_train.npz").run("x")
    first, second = run.until(0.5 * run.seconds), run.after(len(run) // 2)
    model = refine(first, SHORT_EFFECTS, auto=False).model if short else refine(first).model
    table = measured_table(model, first, WIDER * clear_below(model, first))
    rows = []
    for below in BELOW:
        path = recorded(second.position, run.sampling_rate, WIDER * below)
        sos = scipy.signal.butter(ORDER, below, fs=run.sampling_rate, output="sos")
        early = path.ahead(model.model.delay + 0.5 / run.sampling_rate)
        found = gains(model)
        whole = feedforward(model.model, path).voltage
        tabled = whole if table is None else whole + table.along(path)
        tries = (simple_feedforward(found, early, False), simple_feedforward(found, early), whole, tabled)
        edge = len(second) // 50
        wanted, *told = (scipy.signal.sosfiltfilt(sos, voltage)[edge:-edge] for voltage in (second.voltage, *tries))
        left = [float(np.sqrt(np.mean((wanted - one) ** 2) / np.mean(wanted**2))) for one in told]
        rows.append((f"{below:g} Hz", *(f"{100 * value:.2f} %" for value in left)))
    return rows


def main(short: bool = False) -> None:
    """Print the table as Markdown; if not short, write it to the page."""
    made = markdown(COLUMNS, parts(short))
    sys.stdout.write(made + "\n")
    if not short:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), "emps_force", made), encoding="utf-8")
