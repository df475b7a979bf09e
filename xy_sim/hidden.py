"""Machines with hidden effects, drawn from a seed."""

from __future__ import annotations

from pathlib import Path

from xy_sim.drawing import Effects, with_drawn
from xy_sim.machine import Machine
from xy_sim.machine_file import read


def draw(seed: int, effects: Effects = (1, 3), machine: str | Path = "rigid.yaml", scale: float = 1.0, clean: bool = False) -> Machine:
    """A machine with effects drawn for each axis.

    effects: number per axis, or (fewest, most), or "1..3", or "none", or "outside" for one part that is not among the hypotheses;
    machine: file of the machine without them; scale: multiplies their sizes. Raises BadInput for a wrong file or number of effects.
    """
    return Machine(with_drawn(read(machine), seed, effects, scale), seed, clean)
