"""Time of the generated loop compared with a handwritten one for the same model; time of compiling, loading and fitting.

python -m campaigns.bench axis_model
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.signal import butter, sosfilt

from xy_sysid.axis.model import STANDARD, AxisModel, simulator
from xy_sysid.greybox.free_run import fit_base, fit_with, look, prepare
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

RATE, SECONDS, BRIEF = 2000.0, 60.0, 10.0
BASE = AxisModel(0.097, 1.29e-3, 246.0)
FIRST_CALL = """
import time
start = time.perf_counter()
import numpy as np
from xy_sysid.axis.model import AxisModel, simulate
loaded = time.perf_counter()
simulate(AxisModel(0.1, 0.0, 200.0), 2000.0, np.ones(100), np.zeros(100))
print(loaded - start, time.perf_counter() - loaded)
"""


@compiled
def by_hand(u: FloatArray, gain: float, delay: float, pole: float, coulomb: float, fs: float, out: FloatArray) -> None:
    """Base and Coulomb friction in one loop without anything else; the same mathematics."""
    whole = int(delay * fs)
    part = delay * fs - whole
    v = 0.0
    h_old, h_new = part / fs, (1.0 - part) / fs
    decay_old, decay_new = math.exp(-pole * h_old), math.exp(-pole * h_new)
    spent_old, spent_new = -math.expm1(-pole * h_old) / pole, -math.expm1(-pole * h_new) / pole
    for i in range(out.shape[0]):
        moved = 0.0
        for piece in range(2):
            h, decay, spent = (h_old, decay_old, spent_old) if piece == 0 else (h_new, decay_new, spent_new)
            if h <= 0.0:
                continue
            k = i - whole - 1 + piece
            push = u[k] if k >= 0 else 0.0
            if v == 0.0:
                if abs(push) <= coulomb:
                    continue
                direction = 1.0 if push > 0.0 else -1.0
            else:
                direction = 1.0 if v > 0.0 else -1.0
            reach = gain * (push - direction * coulomb)
            end = reach + (v - reach) * decay
            if end * direction >= 0.0:
                moved += reach * h + (v - reach) * spent
                v = end
                continue
            gone = min(math.log1p(-v / reach) / pole, h)
            moved += reach * gone + v / pole
            v = 0.0
            if abs(push) > coulomb:
                reach = gain * (push - (coulomb if push > 0.0 else -coulomb))
                grown = -math.expm1(-pole * (h - gone))
                moved += reach * (h - gone - grown / pole)
                v = reach * grown
        out[i] = moved * fs


def best(action: Callable[[], object], times: int) -> float:
    """Shortest of several runs, ms."""
    action()
    took = []
    for _ in range(times):
        start = time.perf_counter()
        action()
        took.append(time.perf_counter() - start)
    return min(took) * 1e3


def fresh(folder: str) -> tuple[float, float]:
    """Time of the import, and of the first simulation, in a new process, s, with numba's cache in this folder."""
    ran = subprocess.run(
        [sys.executable, "-c", FIRST_CALL], env={**os.environ, "NUMBA_CACHE_DIR": folder}, capture_output=True, text=True, check=True
    )
    loaded, first = ran.stdout.split()
    return float(loaded), float(first)


def main(short: bool = False) -> None:
    """Print the results."""
    seconds, times = (BRIEF, 1) if short else (SECONDS, 15)
    n = int(RATE * seconds) + 1
    u = np.asarray(sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(0).standard_normal(n)))
    u /= u.std()
    still, out = np.zeros(n), np.empty(n - 1)
    run = simulator(STANDARD, ["coulomb_friction"], RATE, u, still)
    row = np.array([0.097, 1.29e-3, 246.0, 0.2])
    gain, delay, pole, coulomb = row.tolist()
    hand_loop = partial(by_hand, u[:-1], gain, delay, pole, coulomb, RATE, out)
    hand_loop()
    print(f"largest difference of the two loops: {np.max(np.abs(run(row) - out)):.2g} m/s")
    ours, hand = best(lambda: run(row), times), best(hand_loop, times)
    print(f"{seconds:g} s at {RATE:g} Hz, base and Coulomb friction: {ours:.2f} ms, by hand {hand:.2f} ms, ratio {ours / hand:.2f}")

    for effect in STANDARD.acting:
        model = BASE.with_effect(effect.name)
        one = simulator(STANDARD, [effect.name], RATE, u, still)
        print(f"    {effect.name}: {best(partial(one, np.array(list(model.values().values()))), min(times, 5)):.2f} ms")

    with tempfile.TemporaryDirectory() as folder:
        for label in () if short else ("cold", "warm"):
            loaded, first = fresh(folder)
            print(f"{label}: import {loaded:.2f} s, first simulation {first:.2f} s")

    velocity = run(row)
    position = np.concatenate(([0.0], np.cumsum(velocity) / RATE)) + 2e-7 * np.random.default_rng(1).standard_normal(n)
    start = time.perf_counter()
    data = prepare(RATE, u, position)
    base = fit_base(data)
    fitted = time.perf_counter()
    found = fit_with(data, base, ["coulomb_friction"])
    added = time.perf_counter()
    traces = look(data, base, STANDARD.acting)
    looked = time.perf_counter()
    print(f"base fit {fitted - start:.2f} s, adding Coulomb friction {added - fitted:.2f} s ({found.runs} simulations), excess {found.excess:.3f}")
    print(f"screening {len(traces)} effects {looked - added:.2f} s, first: {traces[0].effect} ({traces[0].share:.0%})")


if __name__ == "__main__":
    main()
