"""The numbers of an axis as people read them, each with what it means and what is good. Words only; nothing is drawn here."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from xy_sysid.messages import ArrayMessage
from xy_sysid.page.heard import columns
from xy_sysid.report.words import interval_text, number, quantity
from xy_sysid.stream import FloatArray

Values = Mapping[str, str]
RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹"
ENOUGH = 12  # windows
LIGHT = 0.4  # damping above which a pair is no resonance to speak of
GOOD_ERROR, POOR_ERROR = 0.02, 0.05


@dataclass(frozen=True, slots=True)
class Fact:
    """One number: label, text with unit, what it means; good: True, False, or None where there is no good or bad."""

    label: str
    text: str
    meaning: str
    good: bool | None = None


MEANINGS = {
    "delay": "Time from a voltage to the motion it causes. One or two milliseconds are usual; it limits how fast a loop can be.",
    "gain": "Speed per volt at low frequency: the rigid machine's gain.",
    "pole": "How fast the axis reaches its speed: 1/pole is the time constant of motor, mass and viscous friction.",
    "antiresonance": "Where the motor hardly moves because something else swings in its place. Comes in a pair with a resonance.",
    "resonance": "Where the machine swings most. Good is high and well damped; when it moves, something has become loose or heavier.",
    "relative error": "Distance between measured and modelled response, relative. Below 2 % is good; above 5 % something is missing.",
    "coherence": "Part of the motion that the voltage explains, 0 to 1; the median of all lines. Above 0.9 is good.",
    "windows": "Stretches of signal in the estimate. More make the bands narrower; a dozen is the least for a trend.",
    "windows dropped": "Windows that were not used because samples were missing or broken. Good is none.",
    "held-out error": "rms error of the simulated velocity on the last third of the data, which no fit has seen. Good is at the noise floor.",
    "noise floor": "The least error that encoder noise and the tolerance allow. No model can be better.",
}
ESTIMATES = ("delay", "gain", "antiresonance_1.frequency", "resonance_1.frequency")


def facts(values: Values, response: ArrayMessage | None = None) -> list[Fact]:
    """What the identifier's status of an axis says; response: its ``frf`` message, for the coherence."""
    found: list[Fact] = []
    for name in ESTIMATES:
        key = next((k for k in values if k.startswith(f"{name} (")), None)
        if key is None:
            continue
        unit, label = key.partition("(")[2].rstrip(")"), name.partition("_1")[0]
        value, low, high = _float(values, key), _float(values, f"{name} 95 % low"), _float(values, f"{name} 95 % high")
        shown = interval_text(value, low, high, unit) if math.isfinite(low) and math.isfinite(high) else quantity(value, unit)
        found.append(Fact(label, shown, MEANINGS[label]))
    error = _float(values, "relative error (1)")
    if math.isfinite(error):
        found.append(Fact("relative error", f"{number(100 * error, 3)} %", MEANINGS["relative error"], _within(error, GOOD_ERROR, POOR_ERROR)))
    rows = columns(response) if response is not None else {}
    if rows.get("coherence") is not None and rows["coherence"].size:
        middle = float(np.median(rows["coherence"]))
        found.append(Fact("coherence", number(middle, 3), MEANINGS["coherence"], _within(1 - middle, 0.1, 0.5)))
    if "windows" in values:
        enough = values["windows"].isdigit() and int(values["windows"]) >= ENOUGH
        found.append(Fact("windows", values["windows"], MEANINGS["windows"], True if enough else None))
    dropped = dropped_words(values)
    if dropped:
        found.append(Fact("windows dropped", dropped, MEANINGS["windows dropped"], dropped == "none"))
    return found


def story_facts(document: Mapping[str, Any]) -> list[Fact]:
    """The numbers of a story's newest model: base, resonances of its linear part, effects, and how far it is from the floor."""
    model, ladder = document["model"], document["ladder"]
    unit = str(document["error"]["unit"])
    last = ladder[-1]
    held, floor = float(last["held_out_error"]), float(last["noise_floor"])
    found = [
        Fact("held-out error", quantity(held, unit, 3), MEANINGS["held-out error"], bool(last["explained"]) or (None if held < 2 * floor else False)),
        Fact("noise floor", quantity(floor, unit, 3), MEANINGS["noise floor"]),
    ]
    for name, text in parameter_rows(model["parameters"]):
        effect, _, own = name.partition(".")
        label = name if not own else f"{effect.replace('_', ' ')}: {own.replace('_', ' ')}"
        found.append(
            Fact(label, text, MEANINGS.get(name, "A parameter of the effect, with its 95 % interval. An interval that holds 0 says: not needed."))
        )
    for kind, label in (("zeros", "antiresonance"), ("poles", "resonance")):
        for root in model["linear"][kind]:
            if root["imag"] and root["frequency"] and root["damping"] is not None and root["damping"] < LIGHT:
                found.append(Fact(label, f"{number(root['frequency'], 4)} Hz, damping {number(root['damping'], 2)}", MEANINGS[label]))
    return found


def dropped_words(values: Values) -> str:
    """Number and reasons; empty while nothing is known."""
    if "dropped windows" not in values:
        return ""
    reasons = [f"{_reason(key)} {values[key]}" for key in values if key.startswith("dropped windows: ") and values[key] != "0"]
    if values["dropped windows"] == "0":
        return "none"
    return f"{values['dropped windows']} ({', '.join(reasons)})" if reasons else values["dropped windows"]


REASONS = {
    "lost": "samples lost",
    "not_finite": "not a number",
    "time_jump": "time jumped",
    "restart": "source restarted",
    "overrun": "came too fast",
    "frozen": "encoder frozen",
    "leap": "encoder leapt",
}


def _reason(key: str) -> str:
    name = key.partition(": ")[2]
    return REASONS.get(name, name.replace("_", " "))


def _float(values: Values, key: str) -> float:
    try:
        return float(values.get(key, "nan"))
    except ValueError:
        return math.nan


def _within(value: float, good: float, poor: float) -> bool | None:
    return True if value <= good else False if value > poor else None


def parameter_rows(parameters: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Name and value with interval of fitted parameters, of a document's ``parameters``."""
    rows = []
    for name, item in parameters.items():
        value, unit, span = item.get("value"), str(item.get("unit") or ""), item.get("ci95") or (None, None)
        if not isinstance(value, (int, float)):
            continue
        low, high = span
        if isinstance(low, (int, float)) and isinstance(high, (int, float)):
            rows.append((name, interval_text(value, low, high, unit)))
        else:
            rows.append((name, quantity(value, unit)))
    return rows


def transfer_function_html(numerator: FloatArray, denominator: FloatArray, delay: float) -> str:
    """H(s) = N(s)/D(s) exp(-s delay) as HTML, D monic or not, in m/V."""
    top, bottom = escape(polynomial(numerator)), escape(polynomial(denominator))
    late = f"<span>e<sup>−<i>s</i> · {escape(quantity(delay, 's', 4))}</sup></span>" if delay else ""
    whole = f'<span class="frac"><span>{top}</span><span>{bottom}</span></span>'
    return f'<span class="math"><span><i>H</i>(<i>s</i>) =</span> {whole} {late}</span>'


def polynomial(coefficients: FloatArray) -> str:
    """Falling powers of s: s⁴ + 3.2 s³ − 1."""
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
    """7 s, 3 min 20 s, 1 h 2 min."""
    whole = round(seconds)
    if whole < 100:
        return f"{whole} s"
    if whole < 6000:
        return f"{whole // 60} min {whole % 60} s" if whole % 60 else f"{whole // 60} min"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
