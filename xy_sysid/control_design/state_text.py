"""State feedback as C and Python source without dependencies: error and feedforward in, the voltage within the limit out."""

from __future__ import annotations

import math

from xy_sysid.control_design.state_feedback import StateFeedback
from xy_sysid.samples.block import FloatArray

PYTHON = """\
# State feedback with an observer: {title}
FREE = [{free}]
B = [{b}]
C = [{c}]
DRIVE = [{drive}]
LIMIT = {limit}


class Controller:
    # error: path minus encoder, once every {period:.9g} s; feedforward: of the path, for the next period
    # the answer is the sum of feedback and feedforward within the limit, to be written one period later, and held for one

    def __init__(self):
        self.z, self.held = [0.0] * {n}, 0.0

    def input(self, error, feedforward=0.0):
        z, held = self.z, self.held
        self.z = [
            sum(a * x for a, x in zip(FREE[i * {n} : (i + 1) * {n}], z)) + B[i] * error + DRIVE[i] * held
            for i in range({n})
        ]
        u = sum(c * x for c, x in zip(C, self.z))
        total = min(max(u + feedforward, -LIMIT), LIMIT)
        self.held = total - feedforward
        return total
"""

C_SOURCE = """\
/* State feedback with an observer: {title}
   error: path minus encoder, once every {period:.9g} s; z: {n} + 1 numbers, 0 at the start
   feedforward: of the path, for the next period
   the answer is the sum of feedback and feedforward within the limit, to be written one period later, and held for one */
static const double FREE[] = {{{free}}};
static const double B[] = {{{b}}};
static const double C[] = {{{c}}};
static const double DRIVE[] = {{{drive}}};

double {name}_control(double *z, double error, double feedforward)
{{
    double next[{n}], u = feedforward;
    int i, j;
    for (i = 0; i < {n}; i++) {{
        next[i] = B[i] * error + DRIVE[i] * z[{n}];
        for (j = 0; j < {n}; j++)
            next[i] += FREE[i * {n} + j] * z[j];
    }}
    for (i = 0; i < {n}; i++) {{
        z[i] = next[i];
        u += C[i] * z[i];
    }}
    u = u > {limit} ? {limit} : u < -{limit} ? -{limit} : u;
    z[{n}] = u - feedforward;
    return u;
}}
"""


def source(made: StateFeedback, name: str, title: str, limit: float) -> tuple[str, str]:
    """(C, Python) source; limit: of the drive, in the unit of its input, infinite if unknown."""
    words = {
        "name": name,
        "title": title,
        "n": made.b.size,
        "period": 1.0 / made.sampling_rate,
        "limit": repr(limit if math.isfinite(limit) else 1e12),
        **{key: _numbers(getattr(made, key)) for key in ("free", "b", "c", "drive")},
    }
    return C_SOURCE.format(**words), PYTHON.format(**words)


def _numbers(values: FloatArray) -> str:
    return ", ".join(repr(float(value)) for value in values.ravel())
