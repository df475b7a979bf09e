"""xy-sysid steps: a first order with delay and friction from short step and ramp tests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xy_sysid.cli import options as o
from xy_sysid.cli.mechanics import Gear, Kt, mechanics_document, mechanics_table
from xy_sysid.cli.output import emit, estimates, say, say_refused
from xy_sysid.cli.reading import chosen, each, notes_of, read_each, reads, stretches_of

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading


@reads
def steps(recs: o.Recs, reading: Reading, kt: Kt = None, gear: Gear = "", json: o.Json = False) -> None:
    """Fit gain, time constant, delay and friction (kS, kV, kA) to short step and ramp tests, with intervals, and name what they do not determine."""
    from xy_sysid.axis.mechanics import drive_from
    from xy_sysid.time_models.as_words import first_order_words
    from xy_sysid.time_models.first_order import first_order

    recordings = read_each(recs, reading, json)
    units = recordings[0].units
    drive = drive_from(kt, gear, units)
    found, refused = each(chosen(recordings[0], reading.axes), lambda name: first_order(stretches_of(recordings, name)))
    if json:
        answers: dict[str, Any] = {
            name: {
                "quantities": {q.name: {"value": q.value, "ci95": [q.low, q.high], "unit": q.unit} for q in item.quantities},
                "mechanics": mechanics_document(item.quantities, units, drive),
                "explained": item.explained,
                "error": {"unit": units.speed, "rms": item.error},
                "sentences": first_order_words(item),
            }
            for name, item in found.items()
        }
        emit({"axes": answers | {name: {"problem": text} for name, text in refused.items()}, "notes": notes_of(recordings)})
        return
    for name, item in found.items():
        first, *rest = first_order_words(item)
        say(f"axis {name}: {first}", style="bold")
        estimates("", item.quantities)
        mechanics_table(item.quantities, units, drive)
        for sentence in rest:
            say(f"  {sentence}")
        say()
    say_refused(refused)
