"""Choice of the orders from a response: from the rigid body with delay upwards, as long as each step is significant and physically plausible.

A step adds a pole, or a pair with or without zeros. It is accepted if (1) it shortens the description by more than CLEARLY, where the
cost is divided by the excess of the best plausible model over noise (overdispersion: Burnham & Anderson, Model Selection and Multimodel
Inference, 2nd ed., sec. 2.5, as noise alone never explains a real machine); (2) it explains at least half of the misfit near the
frequencies that it adds, unlike a resonance that only imitates friction; and (3) it is physical: stable, with roots in the band that
do not cancel, and with a frequency that the data determine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting.damped import minimise
from xy_sysid.fitting.identify import identify, warm
from xy_sysid.fitting.model_orders import CLEARLY, OrderTrial, description_length, independent_data, length_of
from xy_sysid.fitting.problem import from_transfer_function, problem
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import Mode, TransferFunction
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.units import derivative_of

STEPS = ((0, 1), (2, 2), (0, 2), (1, 2), (4, 4))  # zeros and poles added at once; two pairs if one alone finds no minimum
MOST_POLES = 9  # in addition to the integrators
HALF = 0.5  # fraction of the misfit near an added mode that may remain
NEAR = 1.4  # factor below and above the added frequencies within which the misfit is counted
LIGHT = 0.7  # damping above which a pair is not a resonance
NUMBERS_EACH = 4.0  # independent data that each parameter of a step needs
WIDEST = 0.1  # relative standard error, including misfit, of a frequency that counts as determined
FAR_ABOVE = 3.0  # factor above the band's end beyond which a rigid body's pole is not visible


@dataclass(frozen=True, slots=True)
class Choice:
    """The fit of the chosen orders, the tested structures (best first), the reason in words, and the models of the structures not chosen."""

    fit: Fit
    tried: tuple[OrderTrial, ...]
    reason: str
    others: tuple[tuple[Structure, TransferFunction], ...] = ()


@dataclass(frozen=True, slots=True)
class _Step:
    """A richer fit, the pole modes that it adds, and why it is not plausible (empty if it is)."""

    fit: Fit
    added: tuple[Mode, ...]
    doubt: str


def choose(frf: FrequencyResponse, family: Structure, thorough: bool = True) -> Choice:
    """The orders that the data support; everything but the orders is kept from ``family``, with sigma as weight in the s domain.

    thorough: test higher orders even if noise explains the residual. Raises BadInput for too few lines for a rigid body.
    """
    family = replace(family, weighting="sigma", domain="s")
    rigid = _rigid(frf, family)
    now, tried, refused = rigid, [rigid], ""
    words: list[str] = []
    while True:
        steps = _steps(frf, now) if thorough or not now.consistent else []
        tried += [step.fit for step in steps]
        data = independent_data(frf, len(now.frequency))
        sure = [step.fit for step in steps if not step.doubt]
        scale = max(1.0, min(excess(fit) for fit in (now, *sure)))
        clear = [step for step in steps if description_length(step.fit, data, scale) < description_length(now, data, scale) - CLEARLY]
        good = [step for step in clear if not step.doubt]
        if not good:
            if clear:
                nearest = min(clear, key=lambda step: description_length(step.fit, data, scale))
                refused = f"{_orders(nearest.fit)} would have {_times(nearest.fit)}, but {nearest.doubt}"
            break
        best = min(good, key=lambda step: description_length(step.fit, data, scale))
        words.append(f"{_named(best)} {'reduce' if len(best.added) > 1 else 'reduces'} that to {_times(best.fit)}")
        now = best.fit
    data = independent_data(frf, len(now.frequency))
    scale = max(1.0, excess(now))
    trials = {(fit.structure.numerator_order, fit.structure.denominator_order): fit for fit in tried}
    ranked = sorted((OrderTrial.of(fit, data, scale) for fit in trials.values()), key=lambda item: item.length)
    base = "a rigid body" if rigid.structure.denominator_order > max(family.integrators, 1) else "an integrator" if family.integrators else "a lag"
    reason = f"Orders {_orders(now)}, chosen from the data: {base}{' with delay' if family.free_delay else ''} has {_times(rigid)}"
    reason += "".join(f"; {text}" for text in words)
    reason += f"; {refused}." if refused else f"; of {len(trials) - 1} other orders tried, none with more parameters is clearly better."
    others = tuple((fit.structure, fit.tf) for fit in trials.values() if fit.structure != now.structure)
    return Choice(now, tuple(ranked), reason, others)


def stands(frf: FrequencyResponse, choice: Choice, now: Fit, options: FitOptions) -> bool:
    """True if the orders of a choice that was not thorough still serve for a newer response of this axis, for which ``now`` is their fit.

    This holds if noise explains the stable fit, so that no higher orders would be tested, and if every other structure that was tested loses again.
    Each of these starts from its own model of that time, which takes a small part of the time of ``choose``.
    """
    if not (now.converged and now.consistent and now.tf.is_stable and choice.others):
        return False
    data, scale = independent_data(frf, len(now.frequency)), max(1.0, excess(now))
    length = description_length(now, data, scale)
    for structure, tf in choice.others:
        simpler = structure.parameters < now.structure.parameters
        try:
            task = problem(frf, structure)
            start = from_transfer_function(task, tf)
            cost = None if start is None else minimise(task, start, warm(options)).cost
        except (BadInput, ZeroDivisionError, np.linalg.LinAlgError):  # too few lines for it, or outside the range of floating-point numbers
            cost = None
        if cost is None or not length < length_of(cost, structure, data, scale) - CLEARLY * simpler:
            return False
    return True


def choose_among(frf: FrequencyResponse, families: Sequence[Structure]) -> Choice:
    """The orders and the family that the data support: a free mass (two integrators of its position), with drag (one), or on a spring (none).

    The slope of an acceleration does not show the family, unlike that of a position, so each is tested. Raises BadInput as ``choose``.
    """
    choices = [choose(frf, family) for family in families]
    scale = max(1.0, min(excess(choice.fit) for choice in choices))
    return min(choices, key=lambda choice: description_length(choice.fit, independent_data(frf, len(choice.fit.frequency)), scale))


def excess(fit: Fit) -> float:
    """Cost divided by its expected value for noise alone; 1 if that is unknown."""
    return fit.cost / fit.expected_cost if fit.expected_cost > 0.0 else 1.0


def _rigid(frf: FrequencyResponse, family: Structure) -> Fit:
    """A mass with drag (or on a spring, without integrators) and delay; one pole less if the last is not visible, or the fit is unstable."""
    floats = family.integrators == 2 and derivative_of(frf.output_unit) == 2  # a mass without drag responds to a force with its acceleration
    order = 2 if floats else max(2, family.integrators + 1)
    rigid = identify(frf, replace(family, numerator_order=0, denominator_order=order))
    if floats:
        return rigid
    if rigid.converged and rigid.tf.is_stable and rigid.tf.pole_modes()[-1].frequency < FAR_ABOVE * rigid.frequency[-1]:
        return rigid
    bare = identify(frf, replace(family, numerator_order=0, denominator_order=order - 1))
    return bare if bare.converged and bare.tf.is_stable and not bare.cost > NEAR * rigid.cost else rigid


def _steps(frf: FrequencyResponse, now: Fit) -> list[_Step]:
    found: list[_Step] = []
    at = now.structure
    for zeros, poles in STEPS:
        if at.denominator_order + poles > MOST_POLES + at.integrators:
            continue
        structure = replace(at, numerator_order=at.numerator_order + zeros, denominator_order=at.denominator_order + poles)
        if independent_data(frf, len(now.frequency)) < NUMBERS_EACH * structure.parameters:
            continue
        try:
            fit = identify(frf, structure)
        except (BadInput, ZeroDivisionError, np.linalg.LinAlgError):  # outside the range of floating-point numbers
            continue
        if fit.converged:
            added = _added(now.tf.pole_modes(), fit.tf.pole_modes(), poles)
            found.append(_Step(fit, added, _doubt(now, fit, added, poles)))
    return found


def _added(before: tuple[Mode, ...], after: tuple[Mode, ...], poles: int) -> tuple[Mode, ...]:
    """The modes of additional poles: the least damped new pairs, or the new real pole; fewer if there are none."""
    pairs = poles > 1

    def alike(mode: Mode) -> bool:
        return mode.frequency > 0.0 and (abs(mode.damping) <= LIGHT if pairs else abs(mode.damping) >= 1.0)

    left = [mode for mode in after if alike(mode)]
    for old in filter(alike, before):
        if left:
            left.remove(min(left, key=lambda mode: abs(math.log(mode.frequency / old.frequency))))
    return tuple(sorted(left, key=lambda mode: abs(mode.damping))[: max(poles // 2, 1)])


def _doubt(now: Fit, fit: Fit, added: tuple[Mode, ...], poles: int) -> str:
    """Why a richer fit is not physical, or not determined by the data; empty if it is both."""
    low, high = float(fit.frequency[0]), float(fit.frequency[-1])
    if not fit.tf.is_stable:
        return "it is unstable"
    if len(added) < max(poles // 2, 1):
        return "its poles are no resonance" if poles > 1 else "its pole is not real"
    for kind, modes in (("pole", added), ("zero", fit.tf.zero_modes())):
        outside = [mode.frequency for mode in modes if not low <= mode.frequency <= high and mode.frequency > 0.0]
        if outside:
            return f"its {kind} at {outside[0]:.3g} Hz lies outside the band of {low:.3g} to {high:.4g} Hz"
    if any(mode.damping < -LIGHT for mode in fit.tf.zero_modes()):
        return "its zero makes it go the wrong way first"
    for mode in added:
        apart = min((abs(mode.root - zero) for zero in fit.tf.zeros()), default=math.inf) / (2.0 * math.pi)
        if apart < 0.5 * fit_resolution(fit):
            return f"its pole and zero near {mode.frequency:.4g} Hz are less than half a line apart"
    factor = math.sqrt(max(excess(fit), 1.0))
    for item in fit.intervals:
        ours = any(abs(item.value - mode.frequency) < 1e-6 * mode.frequency for mode in added)
        if item.name.startswith("resonance") and ours and not factor * item.sigma < WIDEST * item.value:
            return f"its resonance at {item.value:.3g} Hz is not determined"
    left = _misfit(fit, fit, added) / max(_misfit(now, fit, added), 1e-300)
    return f"it leaves {100.0 * left:.0f} % of the misfit at its frequency" if left > HALF else ""


def fit_resolution(fit: Fit) -> float:
    """Spacing of the lines of a fit, Hz."""
    return float(np.min(np.diff(fit.frequency))) if fit.frequency.size > 1 else 0.0


def _misfit(fit: Fit, richer: Fit, added: tuple[Mode, ...]) -> float:
    """Cost above noise near the added modes and the zeros next to them; over all lines for a single pole."""
    parts = 0.5 * np.abs(fit.weight * (fit.measured - fit.response)) ** 2
    noise = fit.expected_cost / max(len(parts), 1)
    if all(abs(mode.damping) >= 1.0 for mode in added):
        return max(float(np.sum(parts - noise)), 0.0)
    zeros = [zero.frequency for zero in richer.tf.zero_modes() if abs(zero.damping) < 1.0]
    inside = np.zeros(len(parts), dtype=np.bool_)
    for mode in added:
        beside = min(zeros, key=lambda zero: abs(math.log(zero / mode.frequency)), default=mode.frequency)
        beside = beside if 0.5 < beside / mode.frequency < 2.0 else mode.frequency
        bottom, top = min(beside, mode.frequency) / NEAR, max(beside, mode.frequency) * NEAR
        inside |= (fit.frequency >= bottom) & (fit.frequency <= top)
    return max(float(np.sum((parts - noise)[inside])), 0.0)


def _orders(fit: Fit) -> str:
    return f"{fit.structure.numerator_order}/{fit.structure.denominator_order}"


def _times(fit: Fit) -> str:
    return f"{excess(fit):.3g} times the cost of noise alone"


def _named(step: _Step) -> str:
    pairs = [mode for mode in step.added if abs(mode.damping) < 1.0]
    if not pairs:
        return f"a pole at {step.added[0].frequency:.4g} Hz"
    return " and ".join(f"a resonance at {mode.frequency:.4g} Hz" for mode in pairs)
