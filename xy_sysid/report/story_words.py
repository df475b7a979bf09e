"""A story in words: verdict, figure captions, and tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from xy_sysid.axis.model import Library
from xy_sysid.report.story_parts import AHEAD, Document, words
from xy_sysid.report.tables import Table
from xy_sysid.report.words import interval_text, number, quantity
from xy_sysid.story.standing import nearer
from xy_sysid.units import listed

STANDARD_TOLERANCE = 1e-3

LADDER = (
    "The error after each added effect, with all parameters fitted again. Solid: error on held-out data, which no fit has seen. "
    "Dashed: error on the fitted data. Dotted: noise floor (encoder noise and a tolerance of the laws). A step at the floor has a "
    "tick."
)
CANDIDATES = "The held-out error that remains when only this effect is added to the rigid model. Shorter is better."
BEFORE_AFTER = (
    "The rigid model and the last model: error over the noise floor by frequency, and the error in time around the largest error of the rigid model."
)
BASE_FAILS = "Error of the rigid model by frequency, over the noise floor, on held-out data. Shaded: more than twice the floor."
AGAINST = (
    "The error of the rigid model against velocity, position and time. Top: its size over the noise floor. Bottom: its mean. A "
    "jump of the mean at zero velocity is dry friction, a wave along the travel is cogging or a lead error, growth in time is "
    "drift."
)
LEFT = "The same pictures for the last model: its residual error over the noise floor."
SIGNALS = (
    "Measured, and simulated from the input alone: velocity around the largest error of the rigid model, and position over the "
    "whole recording. The simulated position is integrated from the first sample, so small errors of speed add up to a drift."
)
CORRELATION = (
    "Autocorrelation of the residual error (top) and its correlation with the input (bottom), with the 95 % bounds of unrelated "
    "signals in grey. A stem beyond the bounds of the input after 0 s is motion that the model could still explain. Before 0 s it "
    "comes from feedback or a wrong delay."
)
ROOTS = "Poles and zeros of the linear part, without the nonlinear effects."


def status(story: Document | None) -> str:
    """The state as text: explained, partly explained, not explained, or nothing can be said."""
    if story is None or not story["ladder"]:
        return "nothing can be said"
    first, last = story["ladder"][0], story["ladder"][-1]
    if last["explained"]:
        return "explained"
    before, now = ((float(rung["excess"]), float(rung["held_out_error"])) for rung in (first, last))
    return "partly explained" if last["effects"] and nearer(before, now) else "not explained"


def named(name: str, library: Library) -> str:
    """The name of an effect together with its meaning on a machine."""
    known = library.effects.get(name)
    return f"{words(name)} ({known.meaning})" if known is not None else words(name)


def spoken(text: str, library: Library) -> str:
    """A sentence in which names of effects are replaced by words."""
    for name in sorted(library.effects, key=len, reverse=True):
        text = text.replace(name, words(name))
    return text


def verdict(story: Document, library: Library) -> str:
    """The result of the story, for a reader who knows the machine but not the method."""
    if not story["ladder"]:
        return str(story["sentence"])
    last = story["ladder"][-1]
    parts = ["a rigid axis with delay", *(named(name, library) for name in last["effects"])]
    model = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
    tolerance = float(story["tolerance"])
    down_to = "" if tolerance <= STANDARD_TOLERANCE else f", down to {number(100 * tolerance, 2)} % of the signal"
    kind = status(story)
    if kind == "explained":
        rest = "is sufficient: the data show no missing effect" if len(parts) == 1 else "explain the motion: the residual error is noise"
        return f"{_capital(model)} {rest}{down_to}."
    if kind == "partly explained":
        return f"{_capital(model)} explain part of the motion; the residual error is not in the library of effects."
    return "The model misses something that no effect of the library explains."


def size(story: Document, speed: float) -> str:
    """The size of the error, relative to the motion, the rigid model and the noise."""
    unit = story["error"]["unit"]
    first, last = story["ladder"][0], story["ladder"][-1]
    how = "Predicted one sample ahead (contact allows no free simulation)" if AHEAD in last["label"] else "Simulated from the input alone"
    off = quantity(float(last["held_out_error"]), unit, 3)
    text = f"{how} on the held-out part of the recording, the model has an error of {off} rms"
    if math.isfinite(speed) and speed > 0:
        text += f", {number(100 * float(last['held_out_error']) / speed, 2)} % of the speed"
    text += f"; the noise floor is {quantity(float(last['noise_floor']), unit, 3)}."
    if last["effects"]:
        times = float(first["held_out_error"]) / max(float(last["held_out_error"]), 1e-300)
        text += f" Without {listed([words(name) for name in last['effects']])} its error was {quantity(float(first['held_out_error']), unit, 3)}"
        text += f", {number(times, 2)} times as much." if times >= 1.1 else "."
    return text


def confidence(story: Document) -> str:
    """The confidence in the named effect; empty without one."""
    if story["verdict"] != "missing_effect":
        return ""
    sure = 100 * float(story["confidence"])
    return f"Confidence in {words(story['effects'][0])}: {'above 99' if sure > 99 else number(sure, 2)} %."


def runner_up(story: Document) -> str:
    """Why the second-best candidate was rejected; empty without one."""
    return f"Runner-up: {story['runner_up']['sentence']}" if story["verdict"] == "missing_effect" and story["runner_up"] else ""


def places_table(story: Document, axis: str) -> Table | None:
    """Where the rigid model fails, worst first; None if it does not."""
    if not story["steps"] or not story["steps"][0]["pictures"]["failing"]:
        return None
    rows = tuple(
        (str(item["kind"]), number(float(item["error_over_floor"]), 3), str(item["sentence"])) for item in story["steps"][0]["pictures"]["failing"]
    )
    return Table(f"Axis {axis}: where the rigid model fails", ("by", "times the floor", "in words"), rows)


def ladder_table(story: Document, axis: str) -> Table:
    """The errors of all steps as a table."""
    unit = story["error"]["unit"]
    rows = tuple(
        (
            words(item["label"]),
            *(quantity(float(item[name]), unit, 4) for name in ("train_error", "held_out_error", "noise_floor")),
            "yes" if item["explained"] else "no",
        )
        for item in story["ladder"]
    )
    return Table(f"Axis {axis}: the ladder", ("model", "training error", "held-out error", "noise floor", "at the floor"), rows)


def parameter_table(story: Document, axis: str, library: Library) -> Table:
    """Parameters of the last model with 95 % intervals and what they mean."""
    rows = tuple(
        (words(name.replace(".", ": ")), _interval(item, name), _meaning(name, library)) for name, item in story["model"]["parameters"].items()
    )
    return Table(f"Axis {axis}: parameters of the last model", ("parameter", "value [95 % interval]", "what it is"), rows)


def look_alike_table(story: Document, axis: str, library: Library) -> Table | None:
    """Look-alikes of the named effect; None without any."""
    if not story["look_alikes"]:
        return None
    rows = tuple(
        (words(item["effect"]), "yes" if item["told_apart"] else "no", spoken(str(item["sentence"]), library)) for item in story["look_alikes"]
    )
    return Table(f"Axis {axis}: look-alikes of {words(story['effects'][0])}", ("effect", "distinguished", "why"), rows)


def _interval(item: Mapping[str, Any], name: str) -> str:
    low, high = (float("nan") if end is None else float(end) for end in item["ci95"])
    text = interval_text(float(item["value"]), low, high, str(item["unit"]), name) if math.isfinite(low) and math.isfinite(high) else ""
    return text or f"{quantity(float(item['value']), str(item['unit']), 4)}, not determined"


_BASE = {"gain": "steady speed per unit of input", "delay": "from command to motion", "pole": "drag over mass: rate at which the speed settles"}


def _meaning(name: str, library: Library) -> str:
    effect, _, own = name.partition(".")
    if not own:
        return _BASE.get(effect, "")
    known = library.effects.get(effect)
    return next((item.meaning for item in known.parameters if item.name == own), "") if known is not None else ""


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
