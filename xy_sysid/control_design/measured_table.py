"""A table, measured on a recording, of the force by position that the model does not explain.

A table can represent forces without a simple law, such as cogging with many periods or the force of a cable. It is fitted to the part of the
recorded input that the model does not predict, linear between grid points. Cross-validation selects the grid spacing, and whether there is a
table at all: the table of one half of the recording is tested on the other half.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.path import SampledPath, recorded
from xy_sysid.control_design.tables import MOST_ROWS, Correction
from xy_sysid.errors import BadInput
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run

BLOCKS = 10  # of the recording, to compare a gain with its scatter
SURE = 3.0  # standard errors of gain that a table needs, because the best of several is selected
SHRUNK = 1.0  # weight of zero force at each grid point, in samples: points without data get 0


@dataclass(frozen=True, slots=True)
class MeasuredTable:
    """at: (k,) positions, m, evenly spaced; value: (k,) V to be added there; error: (k,) its standard error, V.

    parts: (2, k) the tables of the first and of the second half of the recording
    before, after: V rms of the unexplained input, without and with the table of the other half of the recording
    """

    at: FloatArray
    value: FloatArray
    error: FloatArray
    parts: FloatArray
    before: float
    after: float

    def along(self, path: SampledPath) -> FloatArray:
        """(n,) V along a path."""
        return np.interp(path.position, self.at, self.value)

    def of_other_half(self, path: SampledPath) -> FloatArray:
        """(n,) V along the path of the recording: each half with the table of the other half."""
        half = path.position.size // 2
        ends = path.position[:half], path.position[half:]
        return np.concatenate([np.interp(places, self.at, table) for places, table in zip(ends, self.parts[::-1], strict=True)])

    def correction(self, model: PhysicalModel) -> Correction:
        """The table as a correction with 95 % intervals."""
        return Correction(
            name="residual",
            at=self.at,
            value=self.value,
            low=self.value - Z95 * self.error,
            high=self.value + Z95 * self.error,
            at_unit=model.units.output,
            unit=model.units.input,
            meaning="measured, and not in the model: add to the command at this position",
        )


def measured_table(model: PhysicalModel, run: Run, below: float) -> MeasuredTable | None:
    """The unexplained input of a run by position, as a table; None if no table gains more than ``SURE`` of its standard errors.

    below: cut-off of the low-pass on the motion, Hz. Raises BadInput if the run is too short or does not move.
    """
    path = recorded(run.position, run.sampling_rate, below)
    left = run.voltage - feedforward(model.model, path).voltage
    half = len(run) // 2
    halves = (slice(0, half), slice(half, None))
    best: MeasuredTable | None = None
    for power in range(1, int(math.log2(MOST_ROWS)) + 1):
        at = np.linspace(np.min(path.position), np.max(path.position), 2**power + 1)
        if not at[-1] > at[0]:
            raise BadInput("positions of the recording", "all the same", "an axis that moves", "Give another recording.")
        basis = _basis(path.position, at)
        tables = [_fitted(basis[part], left[part]) for part in halves]
        error = np.concatenate([left[part] - basis[part] @ other for part, other in zip(halves, tables[::-1], strict=True)])
        gains = np.array([np.mean(block) for block in np.array_split(left**2 - error**2, BLOCKS)])
        after = float(np.sqrt(np.mean(error**2)))
        sure = np.mean(gains) > SURE * np.std(gains, ddof=1) / math.sqrt(BLOCKS)
        if sure and (best is None or after < best.after):
            value, spread = _fitted(basis, left), 0.5 * np.abs(tables[0] - tables[1])
            best = MeasuredTable(at, value, spread, np.array(tables), before=float(np.sqrt(np.mean(left**2))), after=after)
    return best


def _basis(position: FloatArray, at: FloatArray) -> scipy.sparse.csr_array:
    """(n, k) weights of the two grid points around each sample."""
    rows = np.arange(position.size)
    before = np.clip(((position - at[0]) / (at[1] - at[0])).astype(np.int64), 0, at.size - 2)
    share = np.clip((position - at[before]) / (at[1] - at[0]), 0.0, 1.0)
    columns, values = np.concatenate((before, before + 1)), np.concatenate((1.0 - share, share))
    return scipy.sparse.csr_array((values, (np.tile(rows, 2), columns)), shape=(position.size, at.size))


def _fitted(basis: scipy.sparse.csr_array, values: FloatArray) -> FloatArray:
    """(k,) the table of least squares, with ``SHRUNK`` samples of 0 at each grid point."""
    normal = basis.T @ basis + SHRUNK * scipy.sparse.eye_array(basis.shape[1])
    return np.asarray(scipy.sparse.linalg.spsolve(scipy.sparse.csc_array(normal), basis.T @ values))
