"""The feedforward of a refined model along a path: the voltage that makes the axis follow it, as far as laws can be inverted."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from xy_sysid.axis import resonant_loop
from xy_sysid.axis.linear_part import lag_of
from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.control_design import series
from xy_sysid.control_design.inverse_text import InverseText
from xy_sysid.control_design.path import SampledPath
from xy_sysid.control_design.sample_step import SERIES, Plant, most_hanging, plant
from xy_sysid.control_design.step_text import ROOM
from xy_sysid.effects._binding import law_names, law_texts
from xy_sysid.effects._contract import arguments
from xy_sysid.jit import compiled_text
from xy_sysid.samples.block import FloatArray

HALF = 0.5  # of a sample: mean delay of a held voltage


@dataclass(frozen=True, slots=True)
class Feedforward:
    """voltage: (n,) V to be held from each sample of the path; ahead: s, preview of the path; not_undone: effects that are not inverted, and why."""

    voltage: FloatArray
    ahead: float
    not_undone: tuple[tuple[str, str], ...]


def guided(ready: Plant) -> FloatArray:
    """The generator, flattened, of an axis with prescribed acceleration and the masses attached to it."""
    n = ready.order
    made = ready.moving.reshape(n, n).copy()
    made[1, :] = 0.0
    made[1, n - 1] = 1.0
    return made.ravel()


def parts_of_sample(ready: Plant) -> int:
    """Number of parts per sample for which the power series of the attached masses is accurate."""
    n = ready.order
    fastest = max((abs(root) for root in np.linalg.eigvals(ready.moving.reshape(n, n)[2 : n - 1, 2 : n - 1])), default=0.0)
    return max(math.ceil(float(fastest) / (resonant_loop.STIFF * ready.sampling_rate)), 1)


def feedforward(model: AxisModel, path: SampledPath, shake: float = 0.0) -> Feedforward:
    """The voltage along a path, with delay, hold, lag, resonances and amplifier undone; see ``not_undone`` for the rest.

    shake: m/s, mean absolute speed of the axis due to noise at rest (``closed_loop.shake``), which relaxes presliding friction
    """
    ready = plant(model, path.sampling_rate, shake=shake)
    ahead = ahead_of(model, path.sampling_rate)
    wanted = path.ahead(ahead)
    library = model.library.looped([model.library[name] for name, _ in model.effects])
    out = np.empty(wanted.position.size)
    run = _run_of(library)
    moving = (wanted.position, wanted.speed, wanted.acceleration, 1.0 / path.sampling_rate, parts_of_sample(ready))
    run(*moving, ready.parameters, ready.flags, ready.numbers, ready.moving, guided(ready), ready.rest(), np.zeros(ROOM * ready.order), out)
    return Feedforward(out, ahead, not_undone(model))


def ahead_of(model: AxisModel, sampling_rate: float) -> float:
    """s of path preview: delay, half a sample of the hold, and the part of each lag's time constant that its inverse leaves.

    That inverse is total + (total - old) / (exp(h / lag) - 1), which leads by h / (exp(h / lag) - 1) at low frequencies; h: a sample, s.
    """
    h = 1.0 / sampling_rate
    lags = [lag for lag in (lag_of(model.library[name], values) for name, values in model.effects) if lag is not None]
    return model.delay + HALF * h + sum(lag - h * math.exp(-h / lag) / -math.expm1(-h / lag) for lag in lags if lag > 0.0)


def not_undone(model: AxisModel) -> tuple[tuple[str, str], ...]:
    """Effects that the feedforward does not compensate, and why."""
    found = []
    for name, values in model.effects:
        effect = model.library[name]
        if any("t" in arguments(item) for item in effect.functions.values()):
            found.append((name, "it changes with time, so it is not known ahead"))
        elif effect.category == "state" and lag_of(effect, values) is None:
            found.append((name, "no voltage can cancel it: see the correction by direction"))
    return tuple(found)


@cache
def _run_of(library: Library) -> Callable[..., None]:
    writer = InverseText(library.acting, most_hanging(library.acting))
    names = {"math": math, "np": np, **SERIES, **law_names(library.acting)}
    parts = [*law_texts(library.acting), inspect.getsource(series)]
    return compiled_text(lambda name: _along(writer, name), names, parts)


def _along(writer: InverseText, name: str) -> str:
    """Source of the loop over a path, which contains the source of one sample."""
    sample = writer.text(f"{name}_sample").split("\n")
    head, body = sample[0], sample[1:]
    assert head.startswith("def ")
    lines = [
        f"def {name}(rs, vs, accs, h, cuts, p, on, z, moving, guided, s, w, out):",
        "    for i in range(out.size):",
        "        r, v, acc = rs[i], vs[i], accs[i]",
        *("    " + line.replace("return total", "out[i] = total") for line in body),
    ]
    return "\n".join(lines) + "\n"
