"""A recording of the simulated machine, as the live nodes would make it; for ``xy-sysid simulate`` and notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

if TYPE_CHECKING:
    from xy_sim.machine import Machine


def simulate(
    duration: float = 60.0,
    hidden: int | None = None,
    effects: Iterable[str] = (),
    machine: str = "paper.yaml",
    seed: int = 0,
    **excite: Any,
) -> Recording:
    """The simulated XY table, driven for some time; the machine shares no physics code with the identification.

    duration: s; hidden: draw an effect for each axis from this seed; effects: each as ``[axis:]name[=size][,parameter=value]``
    machine:  a file, or a name in config/machines; seed: of the noise; excite: of every axis, for example kind="multisine", rms=0.5
    Raises BadInput for an unknown machine, effect or setting.
    """
    if not 0.0 < duration <= 1e6:
        raise BadInput("duration", f"{duration} s", "above 0, up to 1e6 s", "Give seconds of data.")
    build(AxisExcitation, excite, "simulate")
    chosen = list(effects)
    if hidden is not None and chosen:
        raise BadInput("hidden", f"{hidden} together with effects", "one of them", "Leave one out.")
    table = table_of(machine, chosen, hidden, seed)
    return drive(table, excitation(table, excite, seed), duration)


def table_of(name: str, effects: Iterable[str], hidden: int | None, seed: int, clean: bool = False) -> Machine:
    """The machine; clean: without encoder noise and quantization."""
    from xy_sim.effect_text import with_effects
    from xy_sim.hidden import draw
    from xy_sim.machine import Machine

    wanted = list(effects)
    if hidden is not None and wanted:
        raise BadInput("--hidden", f"{hidden} together with --effect", "one of them", "Leave one out.")
    if hidden is not None:
        return draw(hidden, 1, "rigid.yaml" if name == "paper.yaml" else name, clean=clean)
    return with_effects(Machine.from_file(name, seed or None, clean), wanted)


def excitation(table: Machine, values: Mapping[str, Any], seed: int) -> ExcitationSettings:
    """The same signal settings for every axis, each with a seed of its own."""
    axes = {axis: build(AxisExcitation, {"seed": seed + 1 + k, **values}, "--excite") for k, axis in enumerate(table.axes)}
    return build(ExcitationSettings, {"rate": table.rate, "lockstep": True, "speed": 0.0, "unit": table.spec.unit, "axes": axes})
