"""Options for reading recordings, and reading them with progress."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_type_hints

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import aside, compiling, progress
from xy_sysid.errors import BadInput
from xy_sysid.samples.recording import Recording, Run

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading
    from xy_sysid.response.frf import FrequencyResponse
    from xy_sysid.samples.block import Block

Found = TypeVar("Found")
Command = Callable[..., None]
Map = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="WHAT=COLUMN", help='assign columns: time=Zeit,x.input="Motor Voltage",x.output=Pos (see xy-sysid columns)'),
]
Units = Annotated[
    list[str] | None, typer.Option("--unit", metavar="WHAT=UNIT", help="unit of a column: x.output=mm, output=rad/s (a velocity), time=ms")
]
Scales = Annotated[
    list[str] | None,
    typer.Option("--scale", metavar="WHAT=FACTOR", help="factor to SI, or to the unit of --unit: x.output=0.5e-6 for counts of 0.5 um"),
]
Rate = Annotated[float | None, typer.Option(metavar="HZ", help="sampling rate of a table without a time column or with a wrong one")]


def reading_from(
    axis: o.Axes = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    span: o.Span = "",
    map_: Map = None,
    unit: Units = None,
    scale: Scales = None,
    rate: Rate = None,
    joint: o.Joints = None,
    effort_lag: o.EffortLag = 0,
    velocity: o.Velocity = False,
) -> Reading:
    """The options for reading; they are the parameters of this function."""
    from xy_sysid.imports.reading import Reading, numbers, pairs

    start, stop = o.span_from(span)
    return Reading(
        columns=pairs(map_ or [], "--map"),
        units=pairs(unit or [], "--unit"),
        scales=numbers(scale or [], "--scale"),
        rate=rate,
        axes=tuple(axis) if axis else None,
        start=start,
        stop=stop,
        effort_as_voltage=effort,
        joints=tuple(joint or ()),
        effort_lag=effort_lag,
        velocity=velocity,
        **o.topics_from(topic),
    )


def reads(command: Command) -> Command:
    """Decorate a command: its parameter ``reading`` is replaced by the options for reading."""
    own, options = inspect.signature(command), inspect.signature(reading_from)
    hints: dict[str, Any] = {}
    for function in (command, reading_from):
        hints |= get_type_hints(function, {**function.__globals__, "Reading": Any}, include_extras=True)

    @functools.wraps(command)
    def run(**values: Any) -> None:
        said = {name: values.pop(name) for name in options.parameters}
        command(**values, reading=reading_from(**said))

    parameters: list[inspect.Parameter] = []
    for name, parameter in own.parameters.items():
        parameters += options.parameters.values() if name == "reading" else [parameter]
    typed = [parameter.replace(annotation=hints[parameter.name]) for parameter in parameters]
    typed.sort(key=lambda parameter: parameter.default is not parameter.empty)
    vars(run)["__signature__"] = own.replace(parameters=typed)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in typed}
    return run


def read_each(paths: Sequence[Path], reading: Reading, quiet: bool) -> tuple[Recording, ...]:
    """The recordings; their notes go to stderr unless ``quiet``, in which case the document contains them."""
    from xy_sysid.imports.several import read_all
    from xy_sysid.jit import tell_compiling

    if aside.is_terminal:
        tell_compiling(*compiling())
    with progress() as bar:
        task = bar.add_task(f"reading {', '.join(path.name for path in paths)}", total=1.0)
        found = read_all(paths, reading, lambda part: bar.update(task, completed=part))
    if not quiet:
        for note in notes_of(found):
            aside.print(f"note: {note}")
    return found


def read(paths: Sequence[Path], reading: Reading, quiet: bool) -> Recording:
    """The recordings joined to one, with a gap between consecutive ones."""
    from xy_sysid.imports.several import joined

    return joined(read_each(paths, reading, quiet))


def notes_of(recordings: Sequence[Recording], names: Sequence[str] = ()) -> list[str]:
    """Notes from reading, and on the data of these axes that no fit uses."""
    return [note for recording in recordings for note in (*recording.notes, *recording.left_out(names))]


def measured_responses(paths: Sequence[Path], reading: Reading, averages: float | None = None) -> dict[str, FrequencyResponse] | None:
    """The responses by axis of a file with a measured frequency response instead of samples; None for any other file.

    averages: number of independent windows of its coherence
    """
    from xy_sysid.imports.registry import format_of, sheet_of
    from xy_sysid.imports.response_file import responses

    try:
        kinds = [format_of(path) for path in paths]
        if not any(reading.a_response(kind.kind == "response") for kind in kinds):
            return None
        if len(paths) > 1:
            raise BadInput("frequency responses", f"{len(paths)} files", "one", "Fit them one by one.")
        return responses(paths[0], sheet_of(paths[0], kinds[0]), reading, {} if averages is None else {"averages": averages})
    except OSError:
        return None  # reported when it is read as a recording


def runs_of(recordings: Sequence[Recording], axis: str) -> tuple[Run, ...]:
    """The stretches of an axis in all recordings. Raises BadInput if they do not belong together, or hold only one move."""
    from xy_sysid.diagnosis.of_run import runs_together
    from xy_sysid.samples.moves import several_moves

    runs = runs_together([run for recording in recordings for run in recording.stretches(axis)])
    several_moves(runs)
    return runs


def stretches_of(recordings: Sequence[Recording], axis: str) -> tuple[Run, ...]:
    """Every stretch of an axis in all recordings, also short ones. Raises BadInput if they do not belong together."""
    from xy_sysid.diagnosis.of_run import runs_together

    return runs_together([run for recording in recordings for run in recording.every_stretch(axis)])


def named(paths: Sequence[Path]) -> str:
    """The names of the recordings, in one text."""
    return ", ".join(map(str, paths))


def chosen(recording: Recording | Block, axes: Sequence[str] | None) -> tuple[str, ...]:
    """The requested axes, or all; raises BadInput for an unknown one."""
    for name in axes or []:
        if name not in recording.axes:
            raise BadInput("--axis", repr(name), ", ".join(recording.axes), "Choose one of these.")
    return tuple(axes) if axes else recording.axes


def each(names: tuple[str, ...], work: Callable[[str], Found], doing: str = "") -> tuple[dict[str, Found], dict[str, str]]:
    """Results of ``work`` by axis, and for the other axes the error in words; raises the first error if no axis has a result.

    doing: text of the progress bar before the name of an axis, such as "refining "
    """
    found: dict[str, Found] = {}
    refusals: dict[str, BadInput] = {}
    with progress() as bar:
        task = bar.add_task("", total=len(names))
        for name in names:
            bar.update(task, description=f"{doing}axis {name}")
            try:
                found[name] = work(name)
            except BadInput as refusal:
                refusals[name] = refusal
            bar.advance(task)
    if not found:
        raise next(iter(refusals.values()))
    return found, {name: str(refusal) for name, refusal in refusals.items()}
