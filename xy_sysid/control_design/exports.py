"""Targets to which a model can be exported: name -> files by name. Each target names what it cannot represent."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design import fmu, snippets, state_text, to_c, to_matlab, to_python
from xy_sysid.control_design.compensation import SIMPLE, left_words
from xy_sysid.control_design.mjcf import mjcf
from xy_sysid.control_design.program import Program, program
from xy_sysid.control_design.sdf import sdf
from xy_sysid.control_design.snippets import plain_name
from xy_sysid.control_design.urdf import urdf
from xy_sysid.control_design.use import Used
from xy_sysid.errors import BadInput
from xy_sysid.settings import unknown_name

Losses = tuple[tuple[str, str], ...]  # (effect, loss) of each effect that a format cannot represent


@dataclass(frozen=True, slots=True)
class Exported:
    """The output for a target.

    files: text by name; note: effects that the target cannot represent, or how to use the text; commented: True if the files have it as a comment
    archive: the name of a functional mock-up unit into which the files are packed; mat: name of a .mat file -> its variables
    """

    files: Mapping[str, str]
    note: str = ""
    archive: str = ""
    mat: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    commented: bool = False


def tables(used: Used) -> Exported:
    """The correction tables as CSV."""
    every = [*used.tables, *([used.friction] if used.friction is not None else [])]
    if not every:
        raise BadInput(
            "tables", f"axis {used.axis}, without dry friction and effects by position", "a model with one", "There is nothing to correct."
        )
    return Exported({f"{used.axis}_{item.name}.csv": item.csv() for item in every}, "; ".join(f"{item.name}: {item.meaning}" for item in every))


def _snippet(write: Callable[[snippets.Designed], snippets.Snippet]) -> Callable[[Used], Exported]:
    def made(used: Used) -> Exported:
        speed = used.fastest.bounds.speed if used.fastest is not None else None
        item = write(snippets.Designed(used.axis, used.model, used.gains, used.feedback, used.calculation, used.shaper, speed))
        return Exported({f"{used.axis}_{item.target}_{item.file}": item.text}, item.note, commented=True)

    return made


def _program(used: Used) -> tuple[Program, str, str]:
    """The program, a name for it, and a title."""
    effects = ", ".join(used.model.effects) or "rigid"
    title = f"axis {used.axis} ({effects}): {used.model.units.input} to {used.model.units.output} at {used.sampling_rate:g} Hz, by xy_sysid"
    chosen = used.compensation.inverse if used.compensation is not None else None
    return program(used.model.model, used.sampling_rate, chosen or used.in_loop.model), plain_name(used.axis), title


def _inverse_note(used: Used) -> str:
    """The laws that the exported feedforward compensates, and whether to use it."""
    chosen = used.compensation
    if chosen is None:
        return "the feedforward undoes every law of the model; no path was simulated with it"
    if chosen.inverse is None:
        return f"the feedforward undoes every law of the model, but {SIMPLE} alone are predicted to follow a path better: use these"
    return f"the feedforward undoes {', '.join(chosen.terms)}{left_words(chosen.left)}"


def c_source(used: Used) -> Exported:
    """Simulation and feedforward in C."""
    of, name, title = _program(used)
    header, text = to_c.source(of, name, title)
    return Exported(
        {f"{name}.h": header, f"{name}.c": text},
        f"C99, no dependencies: {name}_step simulates, {name}_feedforward is the inverse; {_inverse_note(used)}",
    )


def python_source(used: Used) -> Exported:
    """Simulation and feedforward in Python."""
    of, name, title = _program(used)
    return Exported(
        {f"{name}.py": to_python.source(of, title)},
        f"no dependencies: Axis().step(u) simulates, Feedforward().input(r, v, a) is the inverse; {_inverse_note(used)}",
    )


def matlab_source(used: Used) -> Exported:
    """Simulation and feedforward as a MATLAB function, and the parameters as .mat."""
    of, name, title = _program(used)
    values = {key.replace(".", "_"): value for key, value in used.model.model.values().items()}
    intervals = {item.name.replace(".", "_"): [item.low, item.high] for item in used.model.parameters}
    known = {"parameters": values, "rate": used.sampling_rate}
    content = {**known, "ci95": intervals} if intervals else known
    gains = {item.name.replace(" ", "_"): used.gains.value(item.name) for item in used.gains.items}
    note = f"load {name}.mat for the numbers; {name}.m is one function for scripts and MATLAB Function blocks; {_inverse_note(used)}"
    note += f"; {used.gains.doubt}" if used.gains.doubt else ""
    return Exported({f"{name}.m": to_matlab.source(of, name, title)}, note, mat={f"{name}.mat": {**content, "gains": gains}})


def mujoco(used: Used) -> Exported:
    """MJCF."""
    made = mjcf(used.model.model, used.sampling_rate, used.model.units.output == "rad")
    note = f"hold the input for {made.steps} steps of the simulation; {_losses(made.lost)}"
    return Exported({f"{plain_name(used.axis)}.xml": made.text}, note)


def _joint(kind: str, write: Callable[[AxisModel, tuple[float, float] | None, float, bool], tuple[str, Losses]]) -> Callable[[Used], Exported]:
    def made(used: Used) -> Exported:
        text, lost = write(used.model.model, used.travel, used.limit, used.model.units.output == "rad")
        return Exported({f"{plain_name(used.axis)}.{kind}": text}, _losses(lost))

    return made


def observer(used: Used) -> Exported:
    """State feedback in C and Python."""
    if used.states is None:
        why = next((text for what, text in used.refused if what == "state feedback"), "none was designed")
        raise BadInput("state feedback", why, "a design with margins", "Ask for less bandwidth.")
    name = f"{plain_name(used.axis)}_control"
    title = f"axis {used.axis}, {used.model.units.input} for {used.model.units.output}, {used.states.bandwidth / (2.0 * math.pi):.3g} Hz"
    text, module = state_text.source(used.states, plain_name(used.axis), title, used.limit)
    note = (
        f"call it once every {1e3 / used.sampling_rate:g} ms with path minus encoder and the feedforward of the next period; "
        "its answer is the sum of both within the limit: write it one period later"
    )
    return Exported({f"{name}.c": text, f"{name}.py": module}, note)


def mock_up(used: Used) -> Exported:
    """FMU."""
    of, name, title = _program(used)
    note = f"FMI 2 co-simulation, one communication step is a whole number of samples of {1e3 / of.rate:g} ms"
    return Exported(fmu.files(of, name, title, used.model.units), note, archive=f"{name}.fmu")


def _losses(lost: Losses) -> str:
    return "lost: " + "; ".join(f"{name} ({why})" for name, why in lost) if lost else "nothing is lost"


TARGETS: dict[str, Callable[[Used], Exported]] = {
    "tables": tables,
    "c": c_source,
    "python": python_source,
    "matlab": matlab_source,
    "fmu": mock_up,
    "mujoco": mujoco,
    "urdf": _joint("urdf", urdf),
    "sdf": _joint("sdf", sdf),
    "state_feedback": observer,
    **{name: _snippet(write) for name, write in snippets.TARGETS.items()},
}


def export(used: Used, target: str) -> Exported:
    """The files of a target. Raises BadInput for an unknown target, or an axis that it cannot represent."""
    if target not in TARGETS:
        raise unknown_name(target, list(TARGETS), "target")
    return TARGETS[target](used)
