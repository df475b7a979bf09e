"""xy-sysid use: from a refined model to numbers for a controller and files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, estimate, plain, quantity, say, say_refused, table
from xy_sysid.cli.reading import each, read, reads
from xy_sysid.units import bare, motion, moved

if TYPE_CHECKING:
    from xy_sysid.comparison.physical_model import PhysicalModel
    from xy_sysid.control_design.exports import Exported
    from xy_sysid.control_design.filters import Swing
    from xy_sysid.control_design.use import Used
    from xy_sysid.imports.reading import Reading
    from xy_sysid.samples.recording import Recording

TURN = 6.283185307179586  # rad
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
        float | None, typer.Option("--controller-rate", metavar="HZ", help="rate of the controller; by default that of the recording, or 2000")
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(metavar="V", help="largest input of the drive; by default the saturation of the model or the largest input of the recording"),
    ] = None,
    bandwidth: Annotated[
        float | None, typer.Option(metavar="HZ", help="crossover frequency of the loop; by default the highest with sufficient margins")
    ] = None,
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
    done, refused = each(tuple(found), lambda name: logic(found[name], _run(recording, found[name]), controller_rate, limit, bandwidth, travel))
    files: dict[str, dict[str, Exported]] = {name: {} for name in done}
    for name, used in done.items():
        for target in asked:
            try:
                files[name][target] = export(used, target)
            except BadInput as problem:
                if to and target in to:
                    refused[f"{name} to {target}"] = str(problem)
    binary = sorted({target for axis in files.values() for target, item in axis.items() if item.archive or item.mat})
    if binary and out is None:
        raise BadInput("--to", f"{', '.join(binary)} without a folder", "--out DIR", "These files are no text.")
    written = _write(out, files, force) if out is not None and asked else []
    if json:
        emit({"axes": {name: plain(_answer(used)) for name, used in done.items()}, "files": written, "refused": refused})
        return
    for name, used in done.items():
        _show(name, used)
        for target, item in files[name].items():
            if out is None:
                for file, text in item.files.items():
                    say(f"--- {file}")
                    typer.echo(text, nl=False)
            if item.note:
                say(f"  {target}: {item.note}.")
    for text in written:
        say(f"wrote {text}", aside)
    say_refused(refused)


def _models(paths: list[Path], effect_file: list[Path] | None, axes: Sequence[str] | None) -> dict[str, PhysicalModel]:
    """The models with physical effects, by axis; of several files the file's name goes before it."""
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
    """Every file of every target into a folder that may be made."""
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


def _show(name: str, used: Used) -> None:
    units = used.model.units
    for note in used.notes:
        say(f"axis {name}: {note}", aside)
    doubtful = {item.name: item.doubt for item in used.gains.items if used.model.parameters and item.doubt}
    shown = [
        (
            *estimate(item.name, (item.value, item.low, item.high), item.unit),
            f"NOT DETERMINED: {doubtful[item.name]}" if item.name in doubtful else item.meaning,
        )
        for item in used.gains.items
    ]
    table(f"axis {name}: feedforward", ("gain", "value", "95 % interval", "unit", "in words"), shown)
    loop = used.feedback
    if loop is not None:
        rows = [
            ("P-PI: position loop", f"{loop.position_gain:.4g}", "1/s"),
            ("P-PI: velocity loop", f"{loop.velocity_gain:.4g}", units.of("V/(m/s)")),
            ("P-PI: integral time", f"{1e3 * loop.integral_time:.4g}", "ms"),
            ("PID: kp", f"{loop.controller.kp:.4g}", units.of("V/m")),
            ("PID: ki", f"{loop.controller.ki:.4g}", units.of("V/m") + "/s"),
            ("PID: kd", f"{loop.controller.kd:.4g}", units.of("V/(m/s)")),
            ("derivative filter", f"{1e3 * loop.controller.derivative_time:.3g}", "ms"),
        ]
        table(f"axis {name}: feedback at {loop.sampling_rate:g} Hz", ("number", "value", "unit"), rows)
        say(
            f"  Crossover {loop.nominal.crossover:.3g} Hz. Worst of {loop.count} samples of the intervals: "
            f"phase margin {loop.worst.phase:.3g} degrees, gain margin {loop.worst.gain:.3g}, sensitivity {loop.worst.sensitivity:.3g}; "
            f"{loop.allowed}. Encoder noise makes {quantity(loop.noise, units.input, 2)} rms."
        )
    if used.states is not None:
        s = used.states
        say(
            f"  State feedback with an observer (--to state_feedback): bandwidth {s.bandwidth / TURN:.3g} Hz, {s.b.size} states. Worst of {s.count} "
            f"samples: phase margin {s.worst.phase:.3g} degrees, gain margin {s.worst.gain:.3g}. A load of 1 {units.input} moves it by "
            f"{moved(s.rejects, units.output)} at most, and a tenth of that is left after {1e3 * s.settles:.3g} ms."
        )
    for mode in used.modes:
        say(f"  {_mode(mode)}")
    if used.shaper is not None:
        said = f"{used.shaper.name} at {used.shaper.frequency:.2f} Hz, damping {used.shaper.damping:.3g}"
        left = f"leaves {100 * used.shaper.worst:.2g} % of the vibration over its interval"
        say(f"  Input shaper: {said}; {1e3 * used.shaper.duration:.3g} ms longer, {left}.")
    if used.notch is not None:
        say(f"  A notch at {used.notch.frequency:.4g} Hz changes the phase at the crossover by {-used.notch.phase_cost:+.2g} degrees.")
    for item in (*used.tables, *([used.friction] if used.friction is not None else [])):
        say(f"  Table {item.name}: {item.before:.3g} {item.unit} rms, known to {item.after:.2g}; {item.meaning}.")
    if used.gap is not None:
        say(f"  Backlash {moved(used.gap.value, units.output)}: {used.gap.meaning}.")
    if used.fastest is not None:
        f = used.fastest
        scale, unit = motion(units.output)
        speeds = f"{scale * f.bounds.speed:.3g} {unit}/s, {scale * f.bounds.acceleration:.4g} {unit}/s2"
        kept = f"{100 * f.reserve:.0f} % of {used.limit:.4g} {units.input} kept ({used.limit_from})"
        say(f"  Fastest S-curve over the travel with {kept}: {speeds}, {f.path.seconds:.3g} s.")
    if used.predicted is not None:
        p = used.predicted
        off = [f"{100 * value / p.voltage:.3g} %" for value in (p.inertia, p.simple, p.whole)]
        say(
            f"  The recorded input below {p.below:.3g} Hz, predicted from the recorded motion, is off by {off[0]} with kV and kA alone, "
            f"{off[1]} with kS, {off[2]} with the whole feedforward."
        )
    errors = [
        (
            item.path,
            *(bare(value, units.output) for value in (item.feedback, item.simple, item.whole, item.worst)),
            f"{item.largest:.3g}",
        )
        for item in used.tracking
    ]
    if errors:
        columns = ("path", "feedback", "+ kS kV kA", "+ whole", "worst", f"largest {units.input}")
        table(f"axis {name}: simulated tracking error, rms, {motion(units.output)[1]}", columns, errors)
    for effect, why in used.not_undone:
        say(f"  The feedforward leaves {effect}: {why}.")
    for what, why in used.refused:
        say(f"  No {what}: {why}")
    say()


def _mode(mode: Swing) -> str:
    held = f"{mode.held.value:.4g} Hz with the encoder's side held (damping {mode.held_damping:.3g})"
    return f"Mode: {held}, {mode.free.value:.4g} Hz free ({mode.free_damping:.3g})."


def _answer(used: Used) -> dict[str, Any]:
    """Everything but the model, which has a file of its own, and the paths."""
    names = ("sampling_rate", "limit", "limit_from", "travel", "friction", "tables", "gap", "modes", "notch", "shaper", "predicted", "tracking")
    found: dict[str, Any] = {name: getattr(used, name) for name in names}
    found["gains"] = {
        item.name: {"value": item.value, "unit": item.unit, "ci95": [item.low, item.high], "determined": item.determined, "because": item.because}
        for item in used.gains.items
    }
    loop = used.feedback
    servo = ("position_gain", "velocity_gain", "integral_time")
    found["feedback"] = None if loop is None else {**plain(loop), **{name: getattr(loop, name) for name in servo}}
    found["state_feedback"] = plain(used.states) if used.states is not None else None
    quick = used.fastest
    found["fastest"] = None if quick is None else {"bounds": quick.bounds, "voltage": quick.voltage, "seconds": quick.path.seconds}
    found["refused"] = [{"what": what, "reason": why} for what, why in used.refused]
    found["not_undone"] = [{"effect": name, "reason": why} for name, why in used.not_undone]
    found["notes"] = used.notes
    return found
