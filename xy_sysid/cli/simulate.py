"""xy-sysid simulate: a recording of the simulated machine, made as the live nodes would make it."""

from __future__ import annotations

import json as _json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, people, plain, progress

if TYPE_CHECKING:
    from xy_sim.machine import Machine
    from xy_sysid.recording import Recording
    from xy_sysid.settings import ExcitationSettings


def simulate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="new bag (a folder; .mcap for that format), or a .csv, .mat or .npz file")],
    machine: Annotated[str, typer.Option(help="machine file or a name in config/machines")] = "paper.yaml",
    effect: Annotated[
        list[str] | None,
        typer.Option("--effect", metavar="NAME[=SIZE]", help="add an effect, [axis:]name[=size][,parameter=value] (may be repeated)"),
    ] = None,
    hidden: Annotated[
        int | None, typer.Option(metavar="SEED", help="draw effects and sizes from this seed, and do not tell", min=0, max=2**31 - 1)
    ] = None,
    duration: Annotated[float, typer.Option(help="seconds of data", min=0.01, max=1e6)] = 60.0,
    clean: Annotated[bool, typer.Option("--clean", help="without encoder noise and quantization")] = False,
    seed: Annotated[int, typer.Option(help="of encoder noise; the excitation's seeds are added to it", min=0, max=2**31 - 100)] = 0,
    excite: Annotated[
        list[str] | None, typer.Option("--excite", "-e", metavar="NAME=VALUE", help="excitation setting for every axis, for example kind=multisine")
    ] = None,
    truth: Annotated[Path | None, typer.Option(metavar="FILE", help="write what was really simulated as JSON")] = None,
    json: o.Json = False,
) -> None:
    """Simulate the XY table and write a recording."""
    from xy_sysid.imports import save

    _free(out)
    o.output_file("--truth", truth)
    table = _machine(machine, effect, hidden, seed, clean)
    settings = _excitation(table, excite, seed)
    with progress() as bar:
        task = bar.add_task("simulating", total=duration)
        recording = drive(table, settings, duration, lambda seconds: bar.update(task, completed=seconds))
    save(recording, out)
    told = {"machine": table.spec.description or machine, "axes": {axis: table.truth(axis) for axis in table.axes}}
    if truth is not None:
        truth.write_text(_json.dumps(plain(told), indent=1) + "\n", encoding="utf-8")
    travel = {axis: [float(recording.position[:, k].min()), float(recording.position[:, k].max())] for k, axis in enumerate(recording.axes)}
    answer: dict[str, Any] = {"output": str(out), "samples": len(recording), "sampling_rate": recording.sampling_rate, "travel": travel}
    if hidden is None:
        answer["truth"] = told
    if json:
        emit(answer)
        return
    people.print(f"{out}: {len(recording)} samples of {', '.join(recording.axes)} at {recording.sampling_rate:g} Hz")
    for axis, (low, high) in travel.items():
        people.print(f"axis {axis}: travel {low * 1e3:.2f} .. {high * 1e3:.2f} mm")


def _machine(name: str, effects: list[str] | None, hidden: int | None, seed: int, clean: bool) -> Machine:
    from xy_sim.effect_text import with_effects
    from xy_sim.hidden import draw
    from xy_sim.machine import Machine
    from xy_sysid.errors import BadInput

    if hidden is not None and effects:
        raise BadInput("--hidden", f"{hidden} together with --effect", "one of them", "Leave one out.")
    if hidden is not None:
        base = "rigid.yaml" if name == "paper.yaml" else name
        return draw(hidden, 1, base, clean=clean)
    return with_effects(Machine.from_file(name, seed or None, clean), effects or [])


def _excitation(table: Machine, pairs: list[str] | None, seed: int) -> ExcitationSettings:
    from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

    values = o.values_from(pairs, "--excite", "rms=0.5", AxisExcitation)
    axes = {axis: build(AxisExcitation, {"seed": seed + 1 + k, **values}, "--excite") for k, axis in enumerate(table.axes)}
    return build(ExcitationSettings, {"rate": table.rate, "lockstep": True, "speed": 0.0, "axes": axes})


def _free(out: Path) -> None:
    from xy_sysid.errors import BadInput
    from xy_sysid.imports import writer_of

    o.output_file("output", None if out.is_dir() else out)
    if out.exists():
        raise BadInput("output", str(out), "a name that is not there yet", "Choose another name or remove it first.")
    writer_of(out)


def drive(table: Machine, settings: ExcitationSettings, duration: float, tell: Any) -> Recording:
    """Excitation and machine in lockstep, without ROS: block k is made with the positions of block k - ahead."""
    import numpy as np

    from xy_sysid.drive import Drive
    from xy_sysid.recording import Recording
    from xy_sysid.stream import Block

    driver = Drive(settings)
    total = round(duration * settings.rate)
    voltage, position = np.empty((2, total, len(table.axes)))
    zero = Block(table.axes, np.zeros(1), np.zeros(1), np.zeros((1, len(table.axes))))
    driver.start()
    driver.see(zero)
    answers: list[Block] = []
    done = 0
    while done < total:
        if len(answers) >= settings.ahead:
            driver.see(answers.pop(0))
        block = driver.next(min(settings.block, total - done))
        answer = table.step(block.values)
        answers.append(Block(table.axes, block.seq, block.time, answer))
        voltage[done : done + len(block)], position[done : done + len(block)] = block.values, answer
        done += len(block)
        if done % (200 * settings.block) == 0:
            tell(done / settings.rate)
    seq = np.arange(total)
    return Recording(settings.rate, table.axes, seq, seq / settings.rate, voltage, position, source="simulated")
