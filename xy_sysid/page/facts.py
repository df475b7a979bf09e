"""The numbers of an axis in display units, each with its meaning and good values. Text only; draws nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from typing import Any

import numpy as np

from xy_sysid.fitting.result import GOOD_ERROR, POOR_ERROR
from xy_sysid.linear.transfer_function import LIGHT_DAMPING
from xy_sysid.live.plain_messages import ArrayMessage
from xy_sysid.live.status_values import DROPPED, DROPPED_FOR, RELATIVE_ERROR, WINDOWS, Values, estimate_of
from xy_sysid.live.status_values import number as number_of
from xy_sysid.page.topics_state import columns
from xy_sysid.report.story_curves import between
from xy_sysid.report.story_parts import pictured, row
from xy_sysid.report.words import interval_text, moved, number, quantity
from xy_sysid.samples.block import FloatArray

RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹"
ENOUGH = 12  # windows


@dataclass(frozen=True, slots=True)
class Fact:
    """One number: label, text with unit, what it means.

    good: True, False, or None where there is no good or bad; sure: False where the model fails, so that its interval is not valid
    """

    label: str
    text: str
    meaning: str
    good: bool | None = None
    sure: bool = True


MEANINGS = {
    "delay": "Time from an input to its motion. One or two milliseconds are typical. It limits the bandwidth of a control loop.",
    "gain": "Speed per unit of input at low frequency: the gain of the rigid model.",
    "pole": "1/pole is the time constant with which the axis reaches its speed, from motor, mass and viscous friction.",
    "antiresonance": "The frequency at which the motor hardly moves because another part oscillates. It comes in a pair with a resonance.",
    "resonance": "The frequency of the largest oscillation. High and well damped is good. If it changes, something has become loose or heavier.",
    "relative error": "Relative difference between measured and modelled response. Below 2 % is good; above 5 % something is missing.",
    "worst coherence": "Lowest part of the motion, 0 to 1, that a linear response to the input explains. Low: too little input, noise, or a "
    "nonlinearity. Above 0.9 is good.",
    "linear part": "Lowest coherence: the part of the measured motion, 0 to 1, that a linear response explains. It is a property of the "
    "recording, not of this model. Friction and backlash lower it, even if the model includes them.",
    "worst place": "The largest error, in multiples of the noise floor. Below 2 is good.",
    "windows": "Parts of the signal in the estimate. More windows give narrower bands; use at least a dozen.",
    "windows dropped": "Windows that were not used because samples were missing or invalid. None is good.",
    "held-out error": "rms error of the simulated velocity on held-out data, which no fit has seen. At the noise floor is good.",
    "noise floor": "The error of a perfect model: encoder noise and a tolerance of 0.1 % of the motion.",
}
UNSURE = " The model fails: the interval includes noise only and is too narrow."
NEIGHBOURS = 5  # lines whose median counts, so that one outlier is not reported as the worst
WORTH = 2.0  # multiple of the noise floor from which a model fails
ESTIMATES = ("delay", "gain", "antiresonance_1.frequency", "resonance_1.frequency")


def facts(values: Values, response: ArrayMessage | None = None, fails: bool = False) -> list[Fact]:
    """Facts of the identifier's status of an axis; response: its ``frf`` message, for the coherence; fails: True if its model fails in any band."""
    found: list[Fact] = []
    for name in ESTIMATES:
        told = estimate_of(values, name)
        if told is None:
            continue
        label, bounded = name.partition("_1")[0], math.isfinite(told.low) and math.isfinite(told.high)
        shown = interval_text(told.value, told.low, told.high, told.unit, name) if bounded else quantity(told.value, told.unit)
        found.append(Fact(label, shown, MEANINGS[label] + (UNSURE if fails else ""), sure=not fails))
    error = number_of(values, RELATIVE_ERROR)
    if math.isfinite(error):
        found.append(Fact("relative error", f"{number(100 * error, 3)} %", MEANINGS["relative error"], _within(error, GOOD_ERROR, POOR_ERROR)))
    rows = columns(response) if response is not None else {}
    if rows.get("coherence") is not None and rows["coherence"].size:
        found.append(coherence_fact(rows["frequency"], rows["coherence"]))
    windows = values.get(WINDOWS)
    if windows is not None:
        found.append(Fact("windows", windows, MEANINGS["windows"], True if windows.isdigit() and int(windows) >= ENOUGH else None))
    dropped = dropped_words(values)
    if dropped:
        found.append(Fact("windows dropped", dropped, MEANINGS["windows dropped"], dropped == "none"))
    return found


def story_facts(document: Mapping[str, Any], step: int | None = None) -> list[Fact]:
    """The numbers of a story's step (None: the newest): the error relative to the noise floor, the worst place, then the parameters."""
    last = document["ladder"][-1 if step is None else step]
    unit = str(document["error"]["unit"])
    held, floor = float(last["held_out_error"]), float(last["noise_floor"])
    fails = held > WORTH * floor
    found = [
        Fact("held-out error", moved(held, unit), MEANINGS["held-out error"], bool(last["explained"]) or (False if fails else None)),
        Fact("noise floor", moved(floor, unit), MEANINGS["noise floor"]),
    ]
    pictures = (pictured(document, step) or {}).get("pictures")
    if pictures is not None:
        place = max(pictures["failing"], key=lambda item: float(item["error_over_floor"]), default=None)
        text = "nowhere above 2 × floor" if place is None else f"{number(float(place['error_over_floor']), 3)} × floor, by {place['kind']}"
        meaning = MEANINGS["worst place"] + ("" if place is None else f" Here: {place['sentence']}.")
        found.append(Fact("worst place", text, meaning, place is None))
    if document["measured"] is not None:
        response = document["measured"]["frequency_response"]
        trusted = np.array(response["trusted"], dtype=bool)
        if bool(trusted.any()):
            inside = between(trusted)
            measured = coherence_fact(row(response["frequency"])[inside], row(response["coherence"])[inside])
            found.append(replace(measured, label="linear part", meaning=MEANINGS["linear part"], good=None))
    for name, text in parameter_rows(last["parameters"]):
        effect, _, own = name.partition(".")
        label = name if not own else f"{effect.replace('_', ' ')}: {own.replace('_', ' ')}"
        meaning = MEANINGS.get(name, "A parameter of the effect, with its 95 % interval. If the interval contains 0, the effect is not needed.")
        found.append(Fact(label, text, meaning + (UNSURE if fails else ""), sure=not fails))
    for kind, label in (("zeros", "antiresonance"), ("poles", "resonance")):
        for root in pictures["linear"][kind] if pictures is not None else ():
            if root["imag"] and root["frequency"] and root["damping"] is not None and root["damping"] < LIGHT_DAMPING:
                shown = f"{number(root['frequency'], 4)} Hz, damping {number(root['damping'], 2)}"
                found.append(Fact(label, shown, MEANINGS[label], sure=not fails))
    return found


def base_fails(document: Mapping[str, Any] | None) -> str:
    """The error of the rigid model if it fails; empty if it does not fail or this is unknown."""
    if document is None or not document["ladder"]:
        return ""
    base = document["ladder"][0]
    held, floor = float(base["held_out_error"]), float(base["noise_floor"])
    if held <= WORTH * floor:
        return ""
    left = moved(held, str(document["error"]["unit"]))
    return f"In time a linear model fails: it leaves {left}, {number(held / floor, 2)} times the noise floor."


def coherence_fact(frequency: FloatArray, coherence: FloatArray) -> Fact:
    """The lowest coherence and its frequency, after a running median over a few lines."""
    around = np.lib.stride_tricks.sliding_window_view(coherence, min(NEIGHBOURS, coherence.size))
    smooth = np.median(around, axis=1)
    at = int(np.argmin(smooth))
    lowest, where = float(smooth[at]), float(frequency[at + around.shape[1] // 2])
    return Fact("worst coherence", f"{number(lowest, 2)} at {number(where, 3)} Hz", MEANINGS["worst coherence"], _within(1 - lowest, 0.1, 0.5))


def dropped_words(values: Values) -> str:
    """Number of dropped windows with reasons; empty while nothing is known."""
    if DROPPED not in values:
        return ""
    reasons = [f"{_reason(key.removeprefix(DROPPED_FOR))} {values[key]}" for key in values if key.startswith(DROPPED_FOR) and values[key] != "0"]
    if values[DROPPED] == "0":
        return "none"
    return f"{values[DROPPED]} ({', '.join(reasons)})" if reasons else values[DROPPED]


REASONS = {
    "lost": "samples lost",
    "not_finite": "not a number",
    "time_jump": "time jumped",
    "restart": "source restarted",
    "overrun": "came too fast",
    "no_reference": "without reference",
    "frozen": "encoder frozen",
    "leap": "encoder leapt",
}


def _reason(name: str) -> str:
    return REASONS.get(name, name.replace("_", " "))


def _within(value: float, good: float, poor: float) -> bool | None:
    return True if value <= good else False if value > poor else None


def parameter_rows(parameters: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """(name, value with interval) of the fitted parameters in a document's ``parameters``."""
    rows = []
    for name, item in parameters.items():
        value, unit, span = item.get("value"), str(item.get("unit") or ""), item.get("ci95") or (None, None)
        if not isinstance(value, (int, float)):
            continue
        low, high = span
        if isinstance(low, (int, float)) and isinstance(high, (int, float)):
            rows.append((name, interval_text(value, low, high, unit, name)))
        else:
            rows.append((name, quantity(value, unit)))
    return rows


def transfer_function_html(numerator: FloatArray, denominator: FloatArray, delay: float) -> str:
    """H(s) = N(s)/D(s) exp(-s delay) as HTML, in units of output over input; D need not be monic."""
    top, bottom = escape(polynomial(numerator)), escape(polynomial(denominator))
    late = f"<span>e<sup>−<i>s</i> · {escape(quantity(delay, 's', 4))}</sup></span>" if delay else ""
    whole = f'<span class="frac"><span>{top}</span><span>{bottom}</span></span>'
    return f'<span class="math"><span><i>H</i>(<i>s</i>) =</span> {whole} {late}</span>'


def polynomial(coefficients: FloatArray) -> str:
    """A polynomial in falling powers of s: s⁴ + 3.2 s³ − 1."""
    parts: list[str] = []
    order = len(coefficients) - 1
    for place, value in enumerate(coefficients):
        power = order - place
        if value == 0:
            continue
        variable = "" if power == 0 else "s" if power == 1 else "s" + "".join(RAISED[int(digit)] for digit in str(power))
        size = "" if abs(value) == 1 and power else number(float(abs(value)), 4)
        parts.append(("− " if value < 0 else "+ ") + f"{size} {variable}".strip())
    text = " ".join(parts) or "0"
    return "−" + text[2:] if text.startswith("− ") else text.removeprefix("+ ")


def seconds_text(seconds: float) -> str:
    """A duration as text: 7 s, 3 min 20 s, 1 h 2 min."""
    whole = round(seconds)
    if whole < 100:
        return f"{whole} s"
    if whole < 6000:
        return f"{whole // 60} min {whole % 60} s" if whole % 60 else f"{whole // 60} min"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
