"""xy-sysid replay: the identifier's logic on a bag, at full speed."""

from __future__ import annotations

import itertools
import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, estimates, progress, say, table
from xy_sysid.cli.reading import chosen

if TYPE_CHECKING:
    from xy_sysid.bags.streaming import Topics
    from xy_sysid.errors import BadRecording
    from xy_sysid.live.diagnoser import Diagnoser
    from xy_sysid.live.fitter import Update
    from xy_sysid.live.identifier import Identifier
    from xy_sysid.samples.block import Block, StreamName
    from xy_sysid.samples.joint_fields import JointOutput
    from xy_sysid.settings import IdentifierSettings
    from xy_sysid.story.story import Story
    from xy_sysid.units import Units

OF_DIAGNOSER = ("memory", "minimum", "tolerance", "effect_files")  # settings of the live diagnoser that also apply to a full bag


def replay(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="rosbag2 folder or file with voltage and position")],
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    joint: o.Joints = None,
    effort_lag: o.EffortLag = 0,
    velocity: o.Velocity = False,
    diagnose: Annotated[bool, typer.Option("--diagnose", help="afterwards diagnose and add missing effects, like the node diagnoser")] = False,
    effect_file: Own = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="BAG", help="write a bag with the messages that the node would have published")] = None,
    json: o.Json = False,
) -> None:
    """Replay a bag through the identifier. The results are those of the live node, bit for bit."""
    from xy_sysid.files.effects import library
    from xy_sysid.live.diagnoser import Diagnoser, all_at_once
    from xy_sysid.settings import DiagnoserSettings, changed, given

    settings = o.settings_from(params, set_)
    looking = DiagnoserSettings()
    if diagnose and params is not None:
        given_to = o.told_to("diagnoser", params).parameters
        looking = changed(looking, {name: given_to[name] for name in OF_DIAGNOSER if name in given_to})
    if velocity:
        settings = changed(settings, {"output": "velocity"})
    o.new_bag(out)
    begun = time.perf_counter()
    with progress() as bar:
        task = bar.add_task(f"replaying {bag.name}", total=None)
        names = _names(params, topic, settings)
        source = _opened(bag, _wanted(settings, names, effort, joint, effort_lag), settings, axis or [], o.axes_from(params))
        told = {"reorder": settings.reorder, "input_unit": source.units.input, "output_unit": source.units.output}
        diagnoser = Diagnoser(changed(looking, told), source.identifier.axes)
        last, updates, alarms = None, 0, dict[str, str]()
        with closing(_updates(source, diagnoser if diagnose else None, out)) as made:
            for last in made:
                updates += 1
                bar.update(task, description=f"replaying {bag.name}: {last.request.seconds:.0f} s")
                for name, part in last.axes.items():
                    if part.track.alarm and name not in alarms:
                        alarms[name] = f"after {last.request.seconds:.1f} s of data: {_alarm(name, part)}"
    seconds = time.perf_counter() - begun
    stories = all_at_once(diagnoser, library(effect_file or given(looking.effect_files))) if diagnose else None
    if last is None:
        raise source.too_short()
    found = _Replayed(source=source, last=last, updates=updates, alarms=alarms, stories=stories, seconds=seconds)
    if json:
        emit(_document(found))
    else:
        _show(found)


@dataclass(frozen=True, slots=True)
class _Source:
    """A bag that is open. blocks: its samples; units: of input and output; notes: about the file, complete once all blocks are read."""

    bag: Path
    blocks: Iterator[tuple[StreamName, Block]]
    identifier: Identifier
    units: Units
    notes: list[str]

    def too_short(self) -> BadRecording:
        """The error of a bag without a full window."""
        from xy_sysid.errors import BadRecording

        identifier = self.identifier
        windows = f"{identifier.samples} paired samples, {identifier.settings.length + 1} needed in one piece"
        faults = ", ".join(f"{name} {count}" for name, count in identifier.faults.items()) or "no faults"
        return BadRecording(self.bag, f"not enough samples for one window ({windows}; {faults})", "Give a longer bag or a shorter --set length=.")


@dataclass(frozen=True, slots=True)
class _Replayed:
    """The end of a replay. updates: number of fits; alarms: the first of each axis; stories: None without a diagnosis; seconds: of computation."""

    source: _Source
    last: Update
    updates: int
    alarms: dict[str, str]
    stories: dict[str, Story] | None
    seconds: float

    @property
    def heard(self) -> float:
        """Seconds of data."""
        return self.source.identifier.samples / self.last.request.sampling_rate

    @property
    def coupled(self) -> str:
        """The sentence about two axes; empty without one."""
        return "" if self.last.request.coupling is None else self.last.request.coupling.sentence


def _names(params: Path | None, topic: list[str] | None, settings: IdentifierSettings) -> dict[str, Any]:
    """The topics to read."""
    from xy_sysid.processes.run_plan import Told

    live = Told({}) if params is None else o.told_to("identifier", params)
    names: dict[str, Any] = {"voltage_topic": live.topic("voltage"), "position_topic": live.topic("position"), **o.topics_from(topic)}
    if settings.source == "joint_state":
        names.setdefault("joint_topic", live.topic(settings.joint_topic))
    return names


def _wanted(settings: IdentifierSettings, names: dict[str, Any], effort: bool, joint: list[str] | None, effort_lag: int) -> Topics:
    """The streams to read, as the options or else the settings say."""
    from xy_sysid.bags.streaming import Topics
    from xy_sysid.settings import given

    joints, lag = tuple(joint or given(settings.joints)), effort_lag or settings.effort_lag
    output: JointOutput | None = "velocity" if settings.output == "velocity" else None
    return Topics(effort_as_voltage=effort or settings.effort_as_voltage, joints=joints, effort_lag=lag, output=output, **names)


def _opened(bag: Path, wanted: Topics, settings: IdentifierSettings, axes: list[str], usual: tuple[str, ...]) -> _Source:
    """The bag, read to its first block. axes: those that were asked for; usual: those to take otherwise, if it has them."""
    from xy_sysid.bags.streaming import stream_blocks
    from xy_sysid.errors import BadRecording
    from xy_sysid.live.identifier import Identifier
    from xy_sysid.response.methods import METHODS
    from xy_sysid.units import USUAL

    units: list[Units] = []
    notes: list[str] = []
    blocks = (item for item in stream_blocks(bag, wanted, notes=notes, about=units.append) if item[0] in METHODS[settings.response].streams)
    first = next(blocks, None)
    if first is None:
        raise BadRecording(bag, "holds no samples", "Give a bag with voltage and position.")
    wished = chosen(first[1], axes or [name for name in usual if name in first[1].axes])
    told = settings.units if settings.units != USUAL else units[0]
    return _Source(bag=bag, blocks=itertools.chain([first], blocks), identifier=Identifier(settings, wished, told), units=told, notes=notes)


def _updates(source: _Source, diagnoser: Diagnoser | None, out: Path | None) -> Generator[Update]:
    """The updates of the identifier, which are also written to a bag; the samples also go to a diagnoser."""
    from xy_sysid.bags import BagWriter
    from xy_sysid.bags.atomic import whole
    from xy_sysid.live.replay import replay as logic

    def all_blocks() -> Iterator[tuple[StreamName, Block]]:
        for name, block in source.blocks:
            if diagnoser is not None and name != "reference":
                diagnoser.feed(name, block)
            yield name, block

    identifier, writer = source.identifier, None
    with ExitStack() as stack:
        for update in logic(all_blocks(), identifier.settings, identifier.axes, identifier):
            if out is not None:
                writer = writer or stack.enter_context(BagWriter(stack.enter_context(whole(out))))
                stamp = round(update.request.seq / update.request.sampling_rate * 1e9)
                for message in update.arrays():
                    writer.write_array(f"/xy/{message.topic}", message.labels, message.sizes, message.data, stamp)
            yield update


def _document(found: _Replayed) -> dict[str, Any]:
    """The JSON document."""
    from xy_sysid.story.document import document

    identifier = found.source.identifier
    return {
        "updates": found.updates,
        "seconds": found.heard,
        "units": dict(zip(("input", "output"), found.source.units, strict=True)),
        "notes": found.source.notes,
        "speed": found.heard / found.seconds,
        "faults": identifier.faults,
        "dropped": identifier.dropped,
        "alarms": found.alarms,
        **({} if found.stories is None else {"stories": {name: document(story) for name, story in found.stories.items()}}),
        "axes": {
            s.name.removeprefix("axis "): {"level": s.level, "message": s.message, "values": dict(s.values)}
            for s in found.last.statuses()
            if s.name.startswith("axis ")
        },
        "coupling": found.coupled,
    }


def _show(found: _Replayed) -> None:
    """Print the result."""
    from xy_sysid.story.acts import sentence as words
    from xy_sysid.units import motion

    source, speed = found.source, found.heard / found.seconds
    say(f"{source.bag}: {found.heard:.1f} s of data in {found.seconds:.2f} s ({speed:.0f} times real time), {found.updates} fits")
    for note in source.notes:
        say(f"note: {note}", aside)
    for reason, sentence in source.identifier.sentences.items():
        say(f"{reason}: {sentence}", aside)
    for sentence in found.alarms.values():
        say(f"ALARM {sentence}", style="bold")
    for name, part in found.last.axes.items():
        if part.fit is None:
            say(f"axis {name}: {part.problem}")
            continue
        estimates(f"axis {name}: relative error {100 * part.fit.relative_error:.2g} %", part.fit.intervals_with_misfit)
    if found.coupled:
        say(found.coupled)
    for name, story in (found.stories or {}).items():
        say(words(story))
        scale, unit = motion(story.units.judged)
        errors = ((rung.label, rung.training_error, rung.held_out_error, rung.noise_floor) for rung in story.rungs)
        rows = [(label, *(f"{scale * value:.4g}" for value in row)) for label, *row in errors]
        table(f"axis {name}: {unit}", ("step", "training error", "held-out error", "noise floor"), rows)


def _alarm(name: str, part: Any) -> str:
    from xy_sysid.live.resonance_watch import alarm_sentence

    return alarm_sentence(name, part.track)
