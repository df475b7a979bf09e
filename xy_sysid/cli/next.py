"""xy-sysid next: the experiment that distinguishes the effects that the recordings do not."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, progress, say
from xy_sysid.cli.reading import chosen, notes_of, read_each, reads, runs_of
from xy_sysid.errors import BadInput
from xy_sysid.units import Units, readable

if TYPE_CHECKING:
    from xy_sysid.axis.model import Library
    from xy_sysid.diagnosis.answer import Answer
    from xy_sysid.experiment_design.of_run import NextExperiment
    from xy_sysid.imports.reading import Reading
    from xy_sysid.samples.recording import Run
    from xy_sysid.settings import ExcitationSettings

NOTHING = "nothing"  # value of --for if the axis is unknown
POINTS = 100.0  # points per second of a trajectory
Between = Annotated[
    list[str] | None,
    typer.Option("--between", metavar="EFFECTS", help="a set of effects to compare, for example a+b, or rigid; repeat it for each set"),
]


@reads
def next_(
    reading: Reading,
    recs: Annotated[
        list[Path] | None, typer.Argument(metavar="[REC]", help="recordings of one machine, as for diagnose; none with --for nothing")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="write the experiment for the excitation node")] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option("--trajectory", metavar="FILE", help="write its motion too: trajectory_msgs/JointTrajectory as YAML, and as .csv"),
    ] = None,
    replay: Annotated[Path | None, typer.Option("--replay", metavar="FOLDER", help="repeat the decisions of a folder settle_* from its bags")] = None,
    between: Between = None,
    precision: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="PARAMETER",
            help="measure this parameter precisely (gain, pole, effect.parameter), or nothing: design the first experiment for an unknown axis",
        ),
    ] = None,
    to: Annotated[
        float, typer.Option("--to", metavar="PART", help="with --for: wanted half width of the 95 % interval, relative to the value", min=1e-6)
    ] = 0.02,
    run_file: Annotated[
        Path | None,
        typer.Option("--params", metavar="FILE", help="ROS parameter file or run file; the limits of the excitation are those of the experiment"),
    ] = None,
    voltage: Annotated[
        float | None, typer.Option(help="largest voltage, V (input in its own unit, as A); without limits: what the recordings show")
    ] = None,
    travel: Annotated[str, typer.Option(metavar="LOW:HIGH", help="ends of the travel, mm (rad of a joint)")] = "",
    speed: Annotated[float | None, typer.Option(help="largest speed, mm/s (rad/s)")] = None,
    acceleration: Annotated[float | None, typer.Option(help="largest acceleration, m/s^2 (rad/s^2)")] = None,
    rms: Annotated[
        float | None, typer.Option(help="largest rms of the voltage, V (input in its own unit), that the drive can give continuously")
    ] = None,
    seconds: Annotated[float, typer.Option(help="seconds of motion at most", min=2.0, max=3600.0)] = 60.0,
    effect_file: Own = None,
    budget: o.Budget = None,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Design the next experiment within the limits of the machine: it distinguishes the effects that the recordings do not."""
    from xy_sysid.diagnosis.of_run import diagnose
    from xy_sysid.experiment_design.limits import as_recorded
    from xy_sysid.experiment_design.of_run import next_experiment, sharpen
    from xy_sysid.experiment_design.rivals import check
    from xy_sysid.files.effects import library

    if replay is not None:
        raise typer.Exit(_replayed(replay, effect_file, json))
    o.output_file("--output", output, force)
    if trajectory is not None:
        if precision == NOTHING:
            raise BadInput(
                "--trajectory", "without a recording", "a recording, because its model predicts the motion of the axis", "Leave out --for nothing."
            )
        o.output_file("--trajectory", trajectory, force)
        o.output_file("--trajectory", trajectory.with_suffix(".csv"), force)
    asked = partial(_asked, voltage=voltage, travel=travel, speed=speed, acceleration=acceleration, rms=rms)
    if precision == NOTHING:
        _answered(_first(reading, run_file, asked, seconds), output, json, [])
        return
    if not recs:
        raise BadInput("REC", "missing", "recordings, or --for nothing", "Give a recording of the axis.")
    known = library(effect_file or [])
    if precision is not None and between:
        raise BadInput("--for", f"{precision} together with --between", "one of them", "Leave one out.")
    sets = sets_of(between)
    check(known, sets)
    recordings = read_each(recs, reading, json)
    names = chosen(recordings[0], reading.axes)
    if len(names) > 1:
        raise BadInput("--axis", "several axes", f"one of {', '.join(names)}", "An experiment is for one axis: add --axis.")
    runs = runs_of(recordings, names[0])
    limits = as_recorded(runs, **{**_own_limits(run_file, names[0]), **asked(runs[0].units.output), "seconds": seconds})
    with progress() as bar:
        task = bar.add_task(f"diagnosing axis {names[0]}", total=1.0)
        found = diagnose(runs, known, math.inf if budget is None else budget, time.process_time)
        bar.update(task, description="comparing experiments")
        if precision is not None:
            answer = sharpen(found, precision, to, limits)
        else:
            answer = next_experiment(found, limits, sets, known, tell=lambda part: bar.update(task, completed=part))
    if not json:
        say(f"axis {names[0]}: {found.sentence.rstrip()}")
    motion = _write_trajectory(answer, found, runs, known, trajectory) if trajectory is not None else None
    _answered(answer, output, json, notes_of(recordings), motion)


def _write_trajectory(answer: NextExperiment, found: Answer, runs: tuple[Run, ...], known: Library, to: Path) -> Path:
    """Write the motion of the experiment, as predicted by the first of its sets or the diagnosed model; returns the CSV.

    The joint has the name of the axis. The points are as dense as those of the excitation, if the limits are of one that sends trajectories.
    """
    from xy_sysid.bags.atomic import write_text
    from xy_sysid.diagnosis.of_run import refine
    from xy_sysid.experiment_design.as_trajectory import as_trajectory
    from xy_sysid.experiment_design.criteria import POINTS_EACH
    from xy_sysid.files.trajectories import as_csv, as_yaml

    model = refine(runs, add=answer.sets[0], auto=False, library=known).model.model if answer.sets else found.final.model
    highest = answer.limits.highest
    made = as_trajectory(answer, model, POINTS_EACH * highest if math.isfinite(highest) else min(POINTS, answer.sampling_rate))
    write_text(to, as_yaml(made, answer.axis))
    write_text(to.with_suffix(".csv"), as_csv(made))
    return to.with_suffix(".csv")


def _replayed(folder: Path, effect_file: list[Path] | None, json: bool) -> int:
    """Print every step as now decided from its bags; returns 1 if one differs from the earlier decision."""
    from xy_sysid.files.effects import library
    from xy_sysid.files.walk import replayed

    pairs = replayed(folder, library(effect_file or []))
    same = [kept == again for kept, again in pairs]
    if json:
        emit({"steps": [again for _, again in pairs], "same": same})
    for number, (kept, again) in enumerate(() if json else pairs):
        say(f"step {number}: {again['sentence']}" + ("" if same[number] else f" It was: {kept['sentence']}"))
    return 0 if all(same) else 1


def _answered(answer: NextExperiment, output: Path | None, json: bool, notes: list[str], motion: Path | None = None) -> None:
    """Write the file, and print the result. notes: of the recordings; motion: CSV of its trajectory."""
    from xy_sysid.files.experiment import document, write_experiment

    if output is not None and answer.experiment is not None:
        beside = motion is not None and motion.resolve().parent == output.resolve().parent
        write_experiment(output, answer, motion if beside else None)
    if json:
        file = document(answer) if answer.experiment else None
        emit({"axis": answer.axis, "sentence": answer.sentence, **_plain(answer), "file": file, "notes": notes})
        return
    _show(answer, output)


def _first(reading: Reading, run_file: Path | None, asked: Callable[[str], dict[str, Any]], seconds: float) -> NextExperiment:
    """The first experiment for an unknown axis, with the limits of a run file or of the options."""
    from xy_sysid.experiment_design.first import first_experiment
    from xy_sysid.experiment_design.limits import MachineLimits

    axis = (reading.axes or ("x",))[0]
    told, settings = _settings(run_file, axis)
    of = {name: reading.units.get(f"{axis}.{name}", reading.units.get(name)) for name in ("input", "output")}
    units = Units(of["input"] or settings.units.input, of["output"] or settings.units.output)
    values = {**_own_limits(run_file, axis), **asked(units.output)}
    for name in ("voltage", "travel"):
        if name not in values:
            raise BadInput(
                "--for nothing", f"without the limit of {name}", f"--{name}, or --params with a run file", "Give the limits of the machine."
            )
    rate = settings.rate if "rate" in told else reading.rate or settings.rate
    middle = 0.5 * (values["travel"][0] + values["travel"][1])
    return first_experiment(axis, rate, MachineLimits(start=middle, seconds=seconds, units=units, **values))


def _plain(answer: NextExperiment) -> dict[str, Any]:
    return {
        "sets": answer.sets,
        "probability": answer.probability,
        "settles": answer.settles,
        "seconds": answer.seconds,
        "ask": answer.ask or None,
        "needs": None if answer.needs is None else asdict(answer.needs),
        "units": {"input": answer.limits.units.input, "output": answer.limits.units.output},
    }


def _show(answer: NextExperiment, output: Path | None) -> None:
    say(f"  {answer.sentence}")
    if answer.experiment is not None and answer.needs is not None:
        limits, needs = answer.limits, answer.needs
        say(f"  Experiment: {answer.experiment.said(limits.units)}, for {answer.seconds:.0f} s.")
        say(f"  It needs up to {needs.voltage:.3g} {limits.units.input} and the travel from {limits.span(needs.travel)}, with margin.")
        say(f"  The axis has to stand between {limits.span(needs.starts(), ' and ')} when it begins.")
    if answer.ask:
        say(f"  To do by hand: {answer.ask}")
    if output is not None and answer.experiment is not None:
        say(f"  {output}: run it with parameter experiment of the excitation node, then diagnose all recordings together.")


def sets_of(between: list[str] | None) -> list[tuple[str, ...]]:
    """The sets of --between; raises BadInput for a single one."""
    if between is None:
        return []
    if len(between) < 2:
        raise BadInput("--between", between[0], "two sets of effects or more", "Give it once for each set, for example --between coulomb_friction.")
    return [() if words == "rigid" else tuple(word.strip() for word in words.split("+")) for words in between]


def _asked(unit: str, voltage: float | None, travel: str, speed: float | None, acceleration: float | None, rms: float | None) -> dict[str, Any]:
    """MachineLimits by name, SI, from the options."""
    scale = readable(unit)[0]
    asked: dict[str, Any] = {}
    if travel:
        low, colon, high = travel.partition(":")
        try:
            asked["travel"] = (float(low) / scale, float(high) / scale)
        except ValueError:
            colon = ""
        if not colon:
            raise BadInput("--travel", repr(travel), "LOW:HIGH", "Write for example --travel -140:140.")
    if speed is not None:
        asked["speed"] = speed / scale
    others = {"voltage": voltage, "acceleration": acceleration, "rms": rms}
    return asked | {name: value for name, value in others.items() if value is not None}


def _settings(run_file: Path | None, axis: str) -> tuple[Mapping[str, Any], ExcitationSettings]:
    """The excitation's parameters in a parameter file, and its settings for one axis with them."""
    from xy_sysid.settings import ExcitationSettings, changed, for_axes, knobs

    told: Mapping[str, Any] = o.told_to("excitation", run_file).parameters if run_file is not None else {}
    settings = for_axes(ExcitationSettings, [axis])
    names = {item.name for item in knobs(settings)}
    return told, changed(settings, {name: value for name, value in told.items() if name in names})


def _own_limits(run_file: Path | None, axis: str) -> dict[str, Any]:
    """MachineLimits from the excitation's parameters in a parameter file."""
    from xy_sysid.experiment_design.limits import of_settings

    if run_file is None:
        return {}
    told, settings = _settings(run_file, axis)
    said = {"voltage": ("limit",), "travel": ("travel_min", "travel_max")}  # a default is not a limit that the user has set
    unsaid = {name for name, knobs_of in said.items() if any(f"{axis}.{one}" not in told for one in knobs_of)}
    return {name: value for name, value in of_settings(settings, axis).items() if name not in unsaid}
