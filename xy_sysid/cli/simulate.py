"""xy-sysid simulate: a recording of the simulated machine, as the live nodes would make it."""

from __future__ import annotations

import json as _json
from pathlib import Path
from typing import Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, plain, progress, say
from xy_sysid.units import motion


def simulate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="new bag (a folder; .mcap for that format), or a .csv, .mat or .npz file")],
    machine: Annotated[str, typer.Option(help="machine file or a name in config/machines")] = "paper.yaml",
    effect: Annotated[
        list[str] | None,
        typer.Option("--effect", metavar="NAME[=SIZE]", help="add an effect, [axis:]name[=size][,parameter=value] (may be repeated)"),
    ] = None,
    hidden: Annotated[
        int | None, typer.Option(metavar="SEED", help="add hidden effects; this seed determines which, and their sizes", min=0, max=2**31 - 1)
    ] = None,
    duration: Annotated[float, typer.Option(help="seconds of data", min=0.01, max=1e6)] = 60.0,
    clean: Annotated[bool, typer.Option("--clean", help="without encoder noise and quantization")] = False,
    seed: Annotated[int, typer.Option(help="seed of encoder noise and excitation", min=0, max=2**31 - 100)] = 0,
    excite: Annotated[
        list[str] | None, typer.Option("--excite", "-e", metavar="NAME=VALUE", help="excitation setting for every axis, for example kind=multisine")
    ] = None,
    truth: Annotated[Path | None, typer.Option(metavar="FILE", help="write the true parameters as JSON")] = None,
    force: Annotated[bool, typer.Option("--force", help="replace an existing file of --truth; OUT is never replaced")] = False,
    json: o.Json = False,
) -> None:
    """Simulate the XY table and write a recording."""
    from xy_sysid.bags.atomic import write_text
    from xy_sysid.excitation.lockstep import drive
    from xy_sysid.front_door.simulated_recording import excitation, table_of
    from xy_sysid.imports import save
    from xy_sysid.settings import AxisExcitation

    _free(out)
    o.output_file("--truth", truth, force)
    table = table_of(machine, effect or [], hidden, seed, clean)
    settings = excitation(table, o.values_from(excite, "--excite", "rms=0.5", AxisExcitation), seed)
    with progress() as bar:
        task = bar.add_task("simulating", total=duration)
        recording = drive(table, settings, duration, lambda seconds: bar.update(task, completed=seconds))
    save(recording, out)
    told = {"machine": table.spec.description or machine, "axes": {axis: table.truth(axis) for axis in table.axes}}
    if truth is not None:
        write_text(truth, _json.dumps(plain(told), indent=1) + "\n")
    travel = {axis: [float(recording.position[:, k].min()), float(recording.position[:, k].max())] for k, axis in enumerate(recording.axes)}
    answer: dict[str, Any] = {"output": str(out), "samples": len(recording), "sampling_rate": recording.sampling_rate, "travel": travel}
    if hidden is None:
        answer["truth"] = told
    if json:
        emit(answer)
        return
    say(f"{out}: {len(recording)} samples of {', '.join(recording.axes)} at {recording.sampling_rate:g} Hz")
    scale, unit = motion(recording.output_unit)
    for axis, (low, high) in travel.items():
        say(f"axis {axis}: travel {low * scale:.2f} .. {high * scale:.2f} {unit}")


def _free(out: Path) -> None:
    from xy_sysid.bags.atomic import taken
    from xy_sysid.errors import BadInput
    from xy_sysid.imports import writer_of

    o.output_file("output", None if out.is_dir() else out, force=True)
    if taken(out):
        raise BadInput("output", str(out), "a name that is not there yet", "Choose another name or remove it first.")
    writer_of(out)
