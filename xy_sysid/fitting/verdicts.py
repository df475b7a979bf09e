"""The verdicts on a fitted transfer function: each a yes or no with its figures and a sentence."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit
from xy_sysid.fitting.choose_orders import Choice
from xy_sysid.fitting.model_orders import CLEARLY, OrderTrial, independent_data, try_orders
from xy_sysid.linear.reduction import minreal
from xy_sysid.linear.simulate import SimulationError, simulation_error
from xy_sysid.linear.transfer_function import TransferFunction, unstable
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import readable

TAIL = 0.05  # part of the lines that may lie outside their own 95 % region
FAR_BELOW = 0.2  # of the expected cost: noise alone gives less once in many thousand fits, if the expected cost is above ENOUGH
ENOUGH = 10.0
FAR_ABOVE = 3.0  # times the band's end, above which the data do not determine a pole or zero
NEARLY_CANCEL = 0.02  # relative distance of a pole and a zero that the data cannot distinguish
FLAT = 1e-4  # singular value of the scaled Jacobian, of the largest, below which a combination is not determined
GOOD_SIMULATION = 70.0  # NRMSE fit, per cent, from which a model is good enough for simulation

NUMBERS_EACH = 2.0  # independent data for each parameter, below which nothing is judged
TRUSTED = 1.5  # times wider: beyond this, the model error and not the noise determines the intervals
UNTOLD = "Cannot be determined from so few values: {}."

HeldOut = tuple[FloatArray, FloatArray, float]
"""Input (n,), output (n,) and sampling rate, Hz, of data that were not used for the fit."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """One check: its name, whether it passed, a sentence for people, and its figures."""

    name: str
    ok: bool
    sentence: str
    figures: dict[str, float]


@dataclass(frozen=True, slots=True)
class Validation:
    """All verdicts; tested orders; the error of a simulation on held-out data (None without such data); pade4: the model with a Pade delay.

    trustworthy: True if the data suffice, the fit converged, and noise nearly explains the residual error, so that the intervals are valid
    """

    verdicts: tuple[Verdict, ...]
    orders: tuple[OrderTrial, ...]
    simulation: SimulationError | None
    pade4: TransferFunction
    trustworthy: bool

    @property
    def ok(self) -> bool:
        """Every check passed."""
        return all(verdict.ok for verdict in self.verdicts)


def validate(fit: Fit, frf: FrequencyResponse, unseen: HeldOut | None = None, orders: bool = True, choice: Choice | None = None) -> Validation:
    """Check a fit with its response and, if there are any, with held-out samples.

    orders: test others near those of the fit; choice: the choice of its orders, if there was one: then no others are tested
    """
    if choice is not None:
        tried = choice.tried
    else:
        tried = try_orders(frf, fit) if orders and fit.structure.domain == "s" and fit.structure.weighting == "sigma" else ()
    simulated = _simulated(fit, unseen)
    few = _few(fit, frf)
    checks = [_cost(fit), _residual(fit, frf), _identifiable(fit), _stable(fit), _inside(fit), _cancelled(fit), _feasible(fit)]
    if fit.structure.free_delay:
        checks.append(_delay(fit))
    if choice is not None:
        checks.append(Verdict("order", True, choice.reason, _figures(choice.fit)))
    elif tried:
        checks.append(_order(fit, tried))
    if few is not None:
        checks = [few, *(replace(check, ok=False, sentence=UNTOLD.format(check.name)) if check.ok else check for check in checks)]
    if simulated is not None:
        checks.append(_simulation(simulated))
    trustworthy = few is None and fit.converged and fit.misfit <= TRUSTED
    return Validation(verdicts=tuple(checks), orders=tried, simulation=simulated, pade4=fit.tf.pade(4), trustworthy=trustworthy)


def _few(fit: Fit, frf: FrequencyResponse) -> Verdict | None:
    """The verdict on too few data; None if they suffice."""
    data, parameters = independent_data(frf, len(fit.frequency)), fit.structure.parameters
    if data >= NUMBERS_EACH * parameters:
        return None
    text = f"The {len(fit.frequency)} lines hold {data:.2g} independent numbers for {parameters} parameters: a fit of them means nothing"
    figures = {"independent_numbers": data, "parameters": float(parameters)}
    return Verdict("data", False, f"{text}. Record longer, widen the band, shorten the window or lower the orders.", figures)


def _cost(fit: Fit) -> Verdict:
    figures = {"cost": fit.cost, "expected": fit.expected_cost, "deviation": fit.cost_deviation}
    if fit.consistent is None or not fit.expected_cost > 0.0:
        return Verdict("cost", True, "The cost cannot be judged: there is no uncertainty to compare it with.", figures)
    if fit.expected_cost > ENOUGH and fit.cost < FAR_BELOW * fit.expected_cost:
        text = f"The cost {fit.cost:.3g} is far below the {fit.expected_cost:.3g} expected from noise: the lines are not independent"
        return Verdict("cost", False, f"{text} (a smooth or short input leaks into them), so the intervals mean little.", figures)
    if fit.consistent:
        return Verdict(
            "cost", True, f"The cost {fit.cost:.4g} is what noise explains ({fit.expected_cost:.4g} +- {fit.cost_deviation:.2g}).", figures
        )
    times = fit.cost / fit.expected_cost
    return Verdict(
        "cost",
        False,
        f"The cost is {times:.3g} times what noise explains: something is missing in the model, or the axis is not linear. "
        f"Intervals that count noise only are {math.sqrt(times):.2g} times too narrow.",
        figures,
    )


def _residual(fit: Fit, frf: FrequencyResponse) -> Verdict:
    """Share of lines outside their own 95 % region; |error|^2 / sigma^2 is F(2, 2 (averages - 1)) as sigma is estimated."""
    sigma = np.interp(fit.frequency, frf.frequency, frf.sigma)
    ratio = np.abs(fit.measured - fit.response) / sigma
    freedom = max(2.0 * (frf.averages - 1.0), 1.0)
    limit = math.sqrt(freedom / 2.0 * (TAIL ** (-2.0 / freedom) - 1.0))
    outside = float(np.mean(ratio > limit))
    count = independent_data(frf, len(fit.frequency)) / 2.0
    allowed = TAIL + 3.0 * math.sqrt(TAIL * (1 - TAIL) / max(count, 1.0))
    worst = int(np.argmax(ratio))
    place = f"the worst is {ratio[worst]:.2g} sigma at {fit.frequency[worst]:.4g} Hz"
    figures = {"outside": outside, "allowed": allowed, "worst_sigma": float(ratio[worst]), "worst_hz": float(fit.frequency[worst])}
    ok = outside <= allowed
    text = (
        f"{100 * outside:.1f} % of the lines lie outside their 95 % region ({'at most' if ok else 'more than the'} {100 * allowed:.1f} %); {place}."
    )
    return Verdict("residual", ok, text, figures)


def _identifiable(fit: Fit) -> Verdict:
    """A small singular value of the Jacobian with unit columns belongs to a combination of parameters that the data do not determine."""
    norms = np.linalg.norm(fit.jacobian, axis=0)
    if not bool(np.all(np.isfinite(norms))) or bool(np.any(norms == 0.0)):
        blind = [name for name, norm in zip(fit.parameters, norms, strict=True) if not norm > 0.0]
        return Verdict("identifiable", False, f"The data do not depend on {', '.join(blind) or 'some parameters'}: lower the orders.", {})
    _, values, right = np.linalg.svd(fit.jacobian / norms, full_matrices=False)
    smallest = float(values[-1] / values[0])
    figures = {"smallest": smallest}
    if smallest >= FLAT:
        return Verdict("identifiable", True, "Every combination of parameters is determined by the data.", figures)
    parts = np.abs(right[-1])
    named = [fit.parameters[k] for k in np.argsort(-parts) if parts[k] > 0.3][:4]
    return Verdict(
        "identifiable",
        False,
        f"The combination of {', '.join(named)} is hardly determined ({smallest:.1e} of the best determined): lower the orders or widen the band.",
        figures,
    )


def _stable(fit: Fit) -> Verdict:
    beyond = unstable(fit.tf.poles(), fit.tf.sampling_time)
    figures = {"unstable_poles": float(beyond.size)}
    if beyond.size == 0:
        return Verdict("stable", True, f"Stable, {fit.tf.phase_type} phase.", figures)
    where = ", ".join(f"{pole.real:.4g}{pole.imag:+.4g}j" for pole in beyond)
    unit = "rad/s" if fit.tf.sampling_time is None else "(z)"
    return Verdict(
        "stable", False, f"Unstable pole at {where} {unit}: a machine at rest does not run away, so this is an artefact of the fit.", figures
    )


def _inside(fit: Fit) -> Verdict:
    top = float(fit.frequency[-1])
    far = [mode for mode in (*fit.tf.pole_modes(), *fit.tf.zero_modes()) if FAR_ABOVE * top < mode.frequency < math.inf]
    figures = {"band_end_hz": top, "roots_far_above": float(len(far))}
    if not far or fit.tf.sampling_time is not None:
        return Verdict("inside_band", True, "Poles and zeros lie in or near the band.", figures)
    where = ", ".join(f"{mode.frequency:.4g} Hz" for mode in far)
    return Verdict(
        "inside_band", False, f"Poles or zeros at {where}, far above the band's end of {top:.4g} Hz: they only represent delay or gain.", figures
    )


def _cancelled(fit: Fit) -> Verdict:
    removed = minreal(fit.tf, NEARLY_CANCEL).removed
    figures = {"cancelled": float(removed.size)}
    if removed.size == 0:
        return Verdict("cancellation", True, "No pole cancels a zero.", figures)
    where = ", ".join(f"{pole.real:.4g}{pole.imag:+.4g}j" for pole in removed)
    return Verdict("cancellation", False, f"Poles at {where} nearly cancel zeros: a lower order fits equally well.", figures)


def _feasible(fit: Fit) -> Verdict:
    """A passive axis has a finite gain and no negative damping; the denominators printed in the paper fail here."""
    problems = [f"{item.name} is {item.value:.3g}" for item in fit.intervals if item.name.endswith(".damping") and item.high < 0.0]
    if any(c < 0 for c in fit.tf.denominator) and fit.tf.sampling_time is None:
        problems.append("the denominator has a negative coefficient, read literally as negative mass, damping or stiffness")
    if not math.isfinite(fit.tf.gain) or fit.tf.gain == 0.0:
        problems.append("the gain is not finite or zero")
    figures = {"gain": float(fit.tf.gain)}
    if problems:
        return Verdict("feasible", False, f"Not a physical axis: {'; '.join(problems)}.", figures)
    sign = " The gain is negative: output and input are wired against each other." if fit.tf.gain < 0 else ""
    return Verdict("feasible", True, f"Physical: damping is not negative and the gain is finite.{sign}", figures)


def _delay(fit: Fit) -> Verdict:
    """A free delay that ends at a bound is not an estimate."""
    largest = fit.structure.delay_max
    figures = {"delay": fit.tf.delay, "largest": largest}
    if fit.tf.delay >= largest * (1 - 1e-9):
        return Verdict("delay", False, f"The delay ends at the largest value searched, {1e3 * largest:g} ms: it may be larger.", figures)
    if fit.tf.delay <= 0.0:
        text = "The delay ends at 0, its lower bound: the measured phase leads that of the model. Is the input really held (--set hold=none)?"
        return Verdict("delay", False, text, figures)
    return Verdict("delay", True, "The delay lies inside its bounds.", figures)


def _figures(fit: Fit) -> dict[str, float]:
    return {"numerator_order": float(fit.structure.numerator_order), "denominator_order": float(fit.structure.denominator_order)}


def _order(fit: Fit, tried: tuple[OrderTrial, ...]) -> Verdict:
    now = next(
        item for item in tried if (item.numerator_order, item.denominator_order) == (fit.structure.numerator_order, fit.structure.denominator_order)
    )
    best = tried[0]
    gain = now.length - best.length
    figures = {"numerator_order": float(best.numerator_order), "denominator_order": float(best.denominator_order), "gain": gain}
    asked = f"{now.numerator_order}/{now.denominator_order}"
    if gain <= CLEARLY:
        return Verdict("order", True, f"Orders {asked} are as good as any near them (minimum description length).", figures)
    text = f"Orders {best.numerator_order}/{best.denominator_order} describe the data clearly better than {asked} (by {gain:.3g} in MDL)."
    return Verdict("order", False, text, figures)


def _simulated(fit: Fit, unseen: HeldOut | None) -> SimulationError | None:
    if unseen is None:
        return None
    u, y, rate = unseen
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable model diverges, and the figure says so
            return simulation_error(fit.tf, rate, u, y, hold=fit.structure.hold)
    except BadInput:
        return None


def _simulation(error: SimulationError) -> Verdict:
    figures = {"rms": error.rms, "nrmse": error.nrmse, "seconds": error.seconds}
    return Verdict("simulation", error.nrmse >= GOOD_SIMULATION, f"Data not used for the fit, {simulation_sentence(error)}", figures)


def simulation_sentence(error: SimulationError) -> str:
    """A sentence on how much of a measured signal a simulation explains; lengths in mm."""
    scale, unit = readable(error.unit)
    if not np.isfinite(error.nrmse):
        return f"simulated over {error.seconds:.3g} s: the simulation diverges, or the model has another scale."
    return f"simulated over {error.seconds:.3g} s: {error.nrmse:.1f} % of the {error.compared} explained, rms error {error.rms * scale:.3g} {unit}."
