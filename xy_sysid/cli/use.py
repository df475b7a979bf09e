"""xy-sysid use: from a refined model to numbers for a controller and files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, plain, say, say_refused
from xy_sysid.cli.reading import each, read, reads

if TYPE_CHECKING:
    from xy_sysid.comparison.physical_model import PhysicalModel
    from xy_sysid.control_design.exports import Exported
    from xy_sysid.control_design.use import Used
    from xy_sysid.imports.reading import Reading
    from xy_sysid.samples.recording import Recording

Models = Annotated[list[Path], typer.Argument(metavar="MODEL", help="model files of refine --model")]
On = Annotated[
    list[Path] | None,
    typer.Option("--on", metavar="REC", help="a recording of the machine: compare with and without the numbers on its motion (may be repeated)"),
]


@reads
def use(
    models: Models,
    reading: Reading,
    on: On = None,
    controller_rate: Annotated[
        float | None,
        typer.Option("--controller-rate", metavar="HZ", help="rate of the controller; by default that of the recording, or of the model's"),
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(metavar="V", help="largest input of the drive; by default the saturation of the model or the largest input of the recording"),
    ] = None,
    bandwidth: Annotated[
        float | None, typer.Option(metavar="HZ", help="crossover frequency of the loop; by default the highest with sufficient margins")
    ] = None,
    phase_margin: Annotated[
        float, typer.Option("--phase-margin", metavar="DEG", help="phase margin that the worst sample of the parameters keeps")
    ] = 45.0,
    gain_margin: Annotated[
        float, typer.Option("--gain-margin", metavar="TIMES", help="gain margin that the worst sample of the parameters keeps; 2 is 6 dB")
    ] = 2.0,
    calculation: Annotated[
        float,
        typer.Option("--calculation", metavar="PERIODS", help="controller periods from reading the encoder to writing; 1: next cycle"),
    ] = 1.0,
    travel: Annotated[tuple[float, float] | None, typer.Option(metavar="LOW HIGH", help="positions that tables and paths cover, SI")] = None,
    to: Annotated[
        list[str] | None, typer.Option("--to", metavar="TARGET", help="write for this target, or all (may be repeated; see docs/use.md)")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="folder for the files; without it they are printed")] = None,
    effect_file: Own = None,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Turn a model into numbers for a controller, correction tables, margins and limits, or into files for other programs."""
    from xy_sysid.cli.use_words import answer, show
    from xy_sysid.control_design.exports import TARGETS, export
    from xy_sysid.control_design.use import use as logic
    from xy_sysid.errors import BadInput
    from xy_sysid.settings import unknown_name

    if out is not None and out.exists() and not out.is_dir():
        raise BadInput("--out", str(out), "a folder", "Choose another name.")
    asked = list(TARGETS) if to and "all" in to else list(to or [])
    for name in asked:
        if name not in TARGETS:
            raise unknown_name(name, [*TARGETS, "all"], "--to")
    found = _models(models, effect_file, reading.axes)
    recording = read(on, reading, json) if on else None
    margins = phase_margin, gain_margin

    def of(name: str) -> Used:
        return logic(found[name], _run(recording, found[name]), controller_rate, limit, bandwidth, travel, margins=margins, calculation=calculation)

    done, refused = each(tuple(found), of)
    files: dict[str, dict[str, Exported]] = {name: {} for name in done}
    for name, used in done.items():
        for target in asked:
            try:
                files[name][target] = export(used, target)
            except BadInput as problem:
                if to and target in to:
                    refused[f"{name} to {target}"] = str(problem)
                else:  # --to all skips targets that are not possible
                    say(f"axis {name} to {target}: {problem}", aside)
    binary = sorted({target for axis in files.values() for target, item in axis.items() if item.archive or item.mat})
    if binary and out is None:
        raise BadInput("--to", f"{', '.join(binary)} without a folder", "--out DIR", "These files are no text.")
    written = _write(out, files, force) if out is not None and asked else []
    if json:
        answers = {name: plain(answer(used)) for name, used in done.items()}
        emit({"axes": answers, "files": written, "refused": refused, "notes": () if recording is None else recording.notes})
        return
    for name, used in done.items():
        show(name, used)
        for target, item in files[name].items():
            if out is None:
                for file, text in item.files.items():
                    say(f"--- {file}")
                    typer.echo(text, nl=False)
            if item.note and not (item.commented and out is None):  # a printed file already says it
                say(f"  {target}: {item.note}.")
    for text in written:
        say(f"wrote {text}", aside)
    say_refused(refused)


def _models(paths: list[Path], effect_file: list[Path] | None, axes: Sequence[str] | None) -> dict[str, PhysicalModel]:
    """The models with physical effects, by axis; with several files, the file's name precedes the axis."""
    from xy_sysid.comparison.physical_model import PhysicalModel
    from xy_sysid.errors import BadInput
    from xy_sysid.files.effects import library
    from xy_sysid.files.models import read_models

    known, found = library(effect_file or []), {}
    for path in paths:
        for axis, model in read_models(path, known).items():
            if axes and axis not in axes:
                continue
            if not isinstance(model, PhysicalModel):
                raise BadInput(str(path), "a transfer function", "a model with physical effects", "Make one with xy-sysid refine --model.")
            found[axis if len(paths) == 1 else f"{path.stem} {axis}"] = model
    if not found:
        raise BadInput("--axis", ", ".join(axes or ()), "an axis of the models", "Choose one of these.")
    return found


def _run(recording: Recording | None, model: PhysicalModel) -> Any:
    return None if recording is None else recording.run(model.axis)


def _write(folder: Path, files: dict[str, dict[str, Exported]], force: bool) -> list[str]:
    """Write every file of every target to a folder, which is created if needed; returns the paths."""
    from scipy.io import savemat

    from xy_sysid.bags.atomic import whole, write_text
    from xy_sysid.errors import BadInput
    from xy_sysid.files.fmu import write_fmu
    from xy_sysid.files.unasked import free

    exported = [item for axis in files.values() for item in axis.values()]
    texts = {folder / name: text for item in exported if not item.archive for name, text in item.files.items()}
    mats = {folder / name: content for item in exported for name, content in item.mat.items()}
    archives = {folder / item.archive: item for item in exported if item.archive}
    names = [name for item in exported for name in ([item.archive] if item.archive else [*item.files, *item.mat])]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput("--out", f"one folder for two models with {twice[0]}", "a folder for each", "Use them one by one, or choose with --axis.")
    for path in (*texts, *mats, *archives):
        free("--out", path, force, "add --force")
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        write_text(path, text)
    for path, content in mats.items():
        with whole(path) as part:
            savemat(part, content, oned_as="row", long_field_names=True, appendmat=False)
    for path, item in archives.items():
        missing = write_fmu(path, path.stem, item.files)
        if missing:
            say(f"{path}: {missing}", aside)
    return [str(path) for path in (*texts, *mats, *archives)]
