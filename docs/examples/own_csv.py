"""Somebody's own CSV: columns with units in, a transfer function with its intervals and checks out.

python own_csv.py mine.csv
"""

import sys
from pathlib import Path

import numpy as np

import xy_sysid as xy


def example(path: Path) -> Path:
    """A table as a data logger writes it, for those who have none at hand: time in s, input in V, position in mm."""
    run = xy.simulate(30).run("x")
    time = np.arange(len(run)) / run.sampling_rate
    rows = np.column_stack([time, run.voltage, 1e3 * run.position])
    np.savetxt(path, rows, delimiter=",", header="time,x_voltage,x_position[mm]", comments="", fmt="%.9g")
    return path


recording = xy.load(sys.argv[1] if len(sys.argv) > 1 else example(Path("mine.csv")))
for note in recording.notes:
    print("note:", note)
run = recording.run(recording.axes[0])
frf = xy.frf(run)
for note in frf.origin.notes:
    print("note:", note)
model = xy.fit(frf)
print(model)
for item in model.intervals:
    print(f"{item.name:20} {item.value:.6g} [{item.low:.6g}, {item.high:.6g}] {item.unit}")
for verdict in model.verdicts:
    print("ok  " if verdict.ok else "WARN", verdict.sentence)
xy.plot.bode(frf, model).write_html("bode.html", include_plotlyjs="cdn")
xy.save(model, "own.yaml", force=True)
