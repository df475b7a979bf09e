"""xy-sysid replay: the identifier's logic on a bag, at full speed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, estimates, progress, say, table
from xy_sysid.cli.reading import chosen

if TYPE_CHECKING:
    from xy_sysid.live.fitter import Update
    from xy_sysid.samples.joint_fields import JointOutput
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
    import itertools
    from contextlib import ExitStack

    from xy_sysid.bags import BagWriter
    from xy_sysid.bags.atomic import whole
    from xy_sysid.bags.streaming import Topics, stream_blocks
    from xy_sysid.errors import BadRecording
    from xy_sysid.files.effects import library
    from xy_sysid.live.diagnoser import Diagnoser, all_at_once
    from xy_sysid.live.identifier import Identifier
    from xy_sysid.live.replay import replay as logic
    from xy_sysid.processes.run_plan import Told
    from xy_sysid.response.methods import METHODS
    from xy_sysid.settings import DiagnoserSettings, changed, given
    from xy_sysid.story.acts import sentence as words
    from xy_sysid.story.document import document
    from xy_sysid.units import USUAL, motion

    settings = o.settings_from(params, set_)
    looking = DiagnoserSettings()
    if diagnose and params is not None:
        given_to = o.told_to("diagnoser", params).parameters
        looking = changed(looking, {name: given_to[name] for name in OF_DIAGNOSER if name in given_to})
    if velocity:
        settings = changed(settings, {"output": "velocity"})
    o.new_bag(out)
    last: Update | None = None
    updates, alarms = 0, dict[str, str]()
    begun = time.perf_counter()
    with ExitStack() as stack:
        writer: BagWriter | None = None
        bar = stack.enter_context(progress())
        task = bar.add_task(f"replaying {bag.name}", total=None)
        live = Told({}) if params is None else o.told_to("identifier", params)
        names: dict[str, Any] = {"voltage_topic": live.topic("voltage"), "position_topic": live.topic("position"), **o.topics_from(topic)}
        units: list[Units] = []
        notes: list[str] = []
        if settings.source == "joint_state":
            names.setdefault("joint_topic", live.topic(settings.joint_topic))
        joints, lag = tuple(joint or given(settings.joints)), effort_lag or settings.effort_lag
        output: JointOutput | None = "velocity" if settings.output == "velocity" else None
        wanted = Topics(effort_as_voltage=effort or settings.effort_as_voltage, joints=joints, effort_lag=lag, output=output, **names)
        heard = stream_blocks(bag, wanted, notes=notes, about=units.append)
        blocks = (item for item in heard if item[0] in METHODS[settings.response].streams)
        kind, first = next(blocks, (None, None))
        if kind is None or first is None:
            raise BadRecording(bag, "holds no samples", "Give a bag with voltage and position.")
        wished = chosen(first, axis or [name for name in o.axes_from(params) if name in first.axes])
        if settings.units != USUAL:
            units[0] = settings.units
        identifier = Identifier(settings, wished, units[0])

        looking = changed(looking, {"reorder": settings.reorder, "input_unit": units[0].input, "output_unit": units[0].output})
        diagnoser = Diagnoser(looking, identifier.axes)

        def all_blocks() -> Any:
            for name, block in itertools.chain([(kind, first)], blocks):
                if diagnose and name != "reference":
                    diagnoser.feed(name, block)
                yield name, block

        for update in logic(all_blocks(), settings, identifier.axes, identifier):
            last, updates = update, updates + 1
            bar.update(task, description=f"replaying {bag.name}: {update.request.seconds:.0f} s")
            for name, part in update.axes.items():
                if part.track.alarm and name not in alarms:
                    alarms[name] = f"after {update.request.seconds:.1f} s of data: {_alarm(name, part)}"
            if out is not None:
                writer = writer or stack.enter_context(BagWriter(stack.enter_context(whole(out))))
                stamp = round(update.request.seq / update.request.sampling_rate * 1e9)
                for message in update.arrays():
                    writer.write_array(f"/xy/{message.topic}", message.labels, message.sizes, message.data, stamp)
    seconds = time.perf_counter() - begun
    stories = all_at_once(diagnoser, library(effect_file or given(looking.effect_files))) if diagnose else {}
    if last is None:
        windows = f"{identifier.samples} paired samples, {settings.length + 1} needed in one piece"
        faults = ", ".join(f"{name} {count}" for name, count in identifier.faults.items()) or "no faults"
        raise BadRecording(bag, f"not enough samples for one window ({windows}; {faults})", "Give a longer bag or a shorter --set length=.")
    seconds_heard = identifier.samples / last.request.sampling_rate
    coupled = "" if last.request.coupling is None else last.request.coupling.sentence
    if json:
        emit(
            {
                "updates": updates,
                "seconds": seconds_heard,
                "units": dict(zip(("input", "output"), units[0], strict=True)),
                "notes": notes,
                "speed": seconds_heard / seconds,
                "faults": identifier.faults,
                "dropped": identifier.dropped,
                "alarms": alarms,
                **({"stories": {name: document(story) for name, story in stories.items()}} if diagnose else {}),
                "axes": {
                    s.name.removeprefix("axis "): {"level": s.level, "message": s.message, "values": dict(s.values)}
                    for s in last.statuses()
                    if s.name.startswith("axis ")
                },
                "coupling": coupled,
            }
        )
        return
    say(f"{bag}: {seconds_heard:.1f} s of data in {seconds:.2f} s ({seconds_heard / seconds:.0f} times real time), {updates} fits")
    for note in notes:
        say(f"note: {note}", aside)
    for reason, sentence in identifier.sentences.items():
        say(f"{reason}: {sentence}", aside)
    for sentence in alarms.values():
        say(f"ALARM {sentence}", style="bold")
    for name, part in last.axes.items():
        if part.fit is None:
            say(f"axis {name}: {part.problem}")
            continue
        estimates(f"axis {name}: relative error {100 * part.fit.relative_error:.2g} %", part.fit.intervals_with_misfit)
    if coupled:
        say(coupled)
    for name, story in stories.items():
        say(words(story))
        scale, unit = motion(story.units.judged)
        errors = ((rung.label, rung.training_error, rung.held_out_error, rung.noise_floor) for rung in story.rungs)
        rows = [(label, *(f"{scale * value:.4g}" for value in row)) for label, *row in errors]
        table(f"axis {name}: {unit}", ("step", "training error", "held-out error", "noise floor"), rows)


def _alarm(name: str, part: Any) -> str:
    from xy_sysid.live.resonance_watch import alarm_sentence

    return alarm_sentence(name, part.track)
