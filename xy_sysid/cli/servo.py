"""xy-sysid servo: a position-controlled joint with known target and angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.mechanics import Gear, mechanics_cells, mechanics_row
from xy_sysid.cli.output import emit, estimates, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, notes_of, read_each, reads, stretches_of

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading

Inertia = Annotated[
    float | None,
    typer.Option(
        "--inertia",
        metavar="KG_M2",
        min=1e-12,
        help="inertia of the joint with its load (a mass in kg if it is linear); adds parameters in SI units with the names of MuJoCo",
    ),
]


@reads
def servo(recs: o.Recs, reading: Reading, inertia: Inertia = None, gear: Gear = "", json: o.Json = False) -> None:
    """Fit controller, damping, friction, torque limit and delay of a servo, from its target (the input) to its angle (the output)."""
    from xy_sysid.axis.mechanics import robot_parameters
    from xy_sysid.errors import BadInput
    from xy_sysid.time_models.as_words import servo_words
    from xy_sysid.time_models.servo import servo as logic

    if gear and inertia is None:
        raise BadInput("--gear", gear, "one together with --inertia", "Ratios to the inertia are the same at joint and motor: give --inertia, too.")
    recordings = read_each(recs, reading, json)
    found, refused = each(chosen(recordings[0], reading.axes), lambda name: logic(stretches_of(recordings, name)))
    if json:
        answers: dict[str, Any] = {}
        for name, item in found.items():
            made = robot_parameters(item.quantities, item.units, inertia, gear) if inertia is not None else ()
            answers[name] = {
                "quantities": {q.name: {"value": q.value, "ci95": [q.low, q.high], "unit": q.unit} for q in item.quantities}
                | {q.name: mechanics_row(q) for q in made},
                "explained": item.explained,
                "error": {"unit": item.units.output, "rms": item.error},
                "recordings": item.recordings,
                "sentences": servo_words(item, inertia),
            }
        emit({"axes": answers | {name: {"problem": text} for name, text in refused.items()}, "notes": notes_of(recordings)})
        return
    for name, item in found.items():
        first, *rest = servo_words(item, inertia)
        say(f"axis {name}: {first}", style="bold")
        estimates("", item.quantities, "over the inertia")
        if inertia is not None:
            si = robot_parameters(item.quantities, item.units, inertia, gear)
            geared = ("at the motor",) if gear else ()
            head = f"with an inertia of {inertia:g} {si[0].unit}"
            table(head, ("MuJoCo, URDF", "value", "95 % interval", "unit", *geared), [mechanics_cells(q) for q in si])
        for sentence in rest:
            say(f"  {sentence}")
        say()
    say_refused(refused)
