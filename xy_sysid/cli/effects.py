"""xy-sysid effects: the library of physical effects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, say, table

if TYPE_CHECKING:
    from xy_sysid.effects import Effect


def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="show only this effect, with all details")] = None,
    effect_file: Annotated[list[Path] | None, typer.Option("--effect-file", metavar="FILE", help="a Python file with an effect of your own")] = None,
    json: o.Json = False,
) -> None:
    """List the physical effects: law, parameters, signs in the data, look-alikes and source."""
    from xy_sysid.files.effects import library

    known = library(effect_file or [])
    chosen = [known[name]] if name else sorted(known.effects.values(), key=lambda effect: (effect.category != "base", effect.name))
    if json:
        emit({"effects": {effect.name: _answer(effect) for effect in chosen}})
        return
    if name:
        _show(chosen[0])
        return
    for effect in chosen:
        _list(effect)
    say("F: force against the drive, in volts of the drive. One effect in full: xy-sysid effects NAME")


def _answer(effect: Effect) -> dict[str, Any]:
    """All fields of an effect."""
    words = ("law", "category", "meaning", "validity", "shows", "look_alikes", "experiment", "source", "family", "simulable")
    parameters = {
        item.name: {"unit": item.unit, "low": item.low, "high": item.high, "typical": item.typical, "meaning": item.meaning}
        for item in effect.parameters
    }
    return {word: getattr(effect, word) for word in words} | {"parameters": parameters}


def _list(effect: Effect) -> None:
    sizes = ", ".join(f"{item.name} [{item.unit or '1'}]" for item in effect.parameters)
    say(f"{effect.name}: {effect.law}")
    for label, text in (("parameters", sizes), ("shows as", effect.shows), ("taken for", ", ".join(effect.look_alikes))):
        say(f"    {label}: {text}")


def _show(effect: Effect) -> None:
    say(f"{effect.name}: {effect.meaning}\n\n    {effect.law}\n")
    rows = [(item.name, item.unit or "1", item.bounds, f"{item.typical:g}", item.meaning) for item in effect.parameters]
    table("parameters", ("name", "unit", "allowed", "usual", "meaning"), rows)
    told = {"valid for": effect.validity, "shows as": effect.shows, "taken for": ", ".join(effect.look_alikes)}
    told |= {"distinguished by": effect.experiment, "source": effect.source}
    say()
    for label, text in told.items():
        say(f"{label}: {text}")
