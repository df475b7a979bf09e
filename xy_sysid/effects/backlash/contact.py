"""Gap, masses and contact of an axis with backlash, fitted by one-step prediction.

Contact is chaotic: free simulations of the same gap diverge within milliseconds, so a model with backlash can only be judged
by its prediction of the next sample from all earlier samples (one-step prediction; Ljung, System
Identification, 2nd ed., sec. 3.2). The filter that predicts is in ``filter_template``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Companions, DryFriction, FilterFit, OneStepTask
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.effects.backlash.innovations import CLOSED, Innovations, View
from xy_sysid.effects.backlash.starts import SECOND, best_around, best_of_grid
from xy_sysid.effects.backlash.usual_machine import from_usual, to_usual, usual
from xy_sysid.jit import on_all_cores
from xy_sysid.samples.block import FloatArray

RIGID = (CLOSED, 0.4, 1500.0, 0.1, 0.0, 0.03, 0.0, 0.0)  # no gap
SOFT = 10.0  # rad/s, lower bound of the contact that replaces the gap in the fit without it
SEEN, LEFT = 2.5, 1.5  # least gap, in encoder noises, and in rms innovations
WHOLE = View(samples=1_000_000, process_noise_factor=0.5, sub_steps=4)
PROCESS_NOISE_FACTORS = (1.0, 0.3, 0.1, 0.03)  # factors on the process noise to choose from: the one that predicts the first stage best
BEHIND = 1.5  # innovation over the bar, after the first grid and after the second, above which the fit is given up. Development draws and other
# machines: gaps 0.1 to 1.4 after the first grid and 0.1 to 1.1 after the second; no gap 1.5 to 20 and 1.2 to 18
IDLE = 0.9  # innovation with a gap over that without it, after the first fits, above which the gap has no effect, and must reach the bar. The same
# machines: gaps that were finally found 0.04 to 0.82; no gap mostly 0.95 to 1.1
OWN, GAP, HERTZ = len(NAMES), NAMES.index("gap"), NAMES.index("hertz")


class Contact:
    """Fits gap, masses and contact to the innovations of the first samples; samples after the training are held out."""

    def fit(self, task: OneStepTask) -> FilterFit:
        """See ``OneStep``."""
        return from_usual(self._fit(to_usual(task)), task.companions.similar)

    def _fit(self, task: OneStepTask) -> FilterFit:
        fit = Innovations(task.sampling_rate, task.base, task.noise, task.companions, task.dry.laws)
        fit.late = task.limits.late
        whole, near = WHOLE.within(task.stages[0]), SECOND.within(task.stages[0])
        soft = fit.with_soft_contact(SOFT)
        first_without_gap = partial(self._fit_without_gap, soft, fit.start(task.base, RIGID, task.dry.values), near, 1e-2)
        earlier = self._earlier(fit, task)
        if earlier is None:
            found, scale = best_of_grid(fit, task)
            if task.limits.bar is not None and scale * task.noise > BEHIND * task.limits.bar:
                return self._result(fit, task, found, (1.0, fit.innovations(found, View(task.stages[2]))))
            best, rigid = on_all_cores(lambda job: job(), (partial(best_around, fit, task, found), first_without_gap))
        else:
            best, rigid = earlier, first_without_gap()
        if task.limits.bar is not None:
            process_noise_factor, innovation = self._predicted(fit, best, task)
            without_gap = soft.innovations(rigid, near)
            idle = task.earlier is None and fit.scale(fit.innovations(best, near)) > IDLE * fit.scale(without_gap)
            if fit.scale(innovation[task.stages[1] :]) * task.noise > (1.0 if idle else BEHIND) * task.limits.bar:
                return self._result(fit, task, best, (process_noise_factor, innovation))
        best = fit.solved(best, np.arange(best.size), whole, 20, 1e-3)
        calm = replace(whole, process_noise_factor=self._predicted(fit, best, task)[0])
        best = fit.solved(best, np.arange(best.size), calm, 10, 1e-3)
        rigid = self._fit_without_gap(soft, self._start_without_gap(fit, rigid, best, near), whole, 1e-3)
        without = self._predicted(soft, rigid, task)[1]
        return self._result(fit, task, best, self._predicted(fit, best, task), fit.spread(best, whole), without)

    @staticmethod
    def _predicted(fit: Innovations, inner: FloatArray, task: OneStepTask) -> tuple[float, FloatArray]:
        """The process-noise factor that predicts the first stage best, and all innovations with it, over the encoder noise."""
        first, training, n = task.stages
        sizes = on_all_cores(lambda factor: _rms(fit.innovations(inner, View(min(first, training), factor))), PROCESS_NOISE_FACTORS)
        best = PROCESS_NOISE_FACTORS[int(np.argmin(sizes))]
        return best, fit.innovations(inner, View(n, best))

    @staticmethod
    def _result(
        fit: Innovations,
        task: OneStepTask,
        best: FloatArray,
        predicted: tuple[float, FloatArray],
        spread: FloatArray | None = None,
        without: FloatArray | None = None,
    ) -> FilterFit:
        """The result as a ``FilterFit``; a fit that was given up has no standard errors and no innovations without the gap."""
        process_noise_factor, innovation = predicted
        values = fit.outer(best)
        errors = np.full(values.size, np.inf) if spread is None else spread
        large = values[GAP] > max(SEEN, LEFT * fit.scale(innovation[: task.stages[0]])) * task.noise
        return FilterFit(
            base=_three(values),
            values=tuple(values[3:OWN].tolist()),
            base_spread=_three(errors),
            spread=tuple(errors[3:OWN].tolist()),
            dry=DryFriction(task.dry.laws, tuple(values[fit.friction].tolist()), tuple(errors[fit.friction].tolist())),
            companions=(tuple(values[fit.others].tolist()), tuple(errors[fit.others].tolist())),
            innovation=innovation * task.noise,
            without=(innovation if without is None else without) * task.noise,
            noise=task.noise,
            runs=fit.runs,
            filtered=fit.filtered,
            process_noise_factor=process_noise_factor,
            too_small=not large,
            given_up=spread is None,
        )

    def innovation(self, sampling_rate: float, found: FilterFit, companions: Companions, samples: int) -> FloatArray:
        """See ``OneStep``."""
        found = from_usual(found, companions.similar, back=True)
        fit = Innovations(sampling_rate * companions.similar.time, found.base, found.noise, usual(companions), found.dry.laws)
        return fit.innovations(fit.start(found.base, found.values, found.dry.values), View(samples, found.process_noise_factor))

    @staticmethod
    def _earlier(fit: Innovations, task: OneStepTask) -> FloatArray | None:
        """Coordinates from an earlier result; None without one, or with a closed gap, which a fit cannot reopen: a grid has to be searched."""
        earlier = task.earlier
        if earlier is None or earlier.too_small:
            return None
        start = fit.start(earlier.base, earlier.values, earlier.dry.values if earlier.dry.names == task.dry.names else task.dry.values)
        return fit.solved(start, np.arange(start.size), SECOND.within(task.stages[0]), 15, 1e-2)

    @staticmethod
    def _start_without_gap(fit: Innovations, rigid: FloatArray, best: FloatArray, view: View) -> FloatArray:
        """Start of the fit without a gap: the better of its own first fit and the fit with a gap, its gap set to zero."""
        rigid[fit.others] = best[fit.others]
        closed = best.copy()
        closed[[GAP, HERTZ]] = rigid[[GAP, HERTZ]]
        soft = fit.with_soft_contact(SOFT)
        return min(rigid, closed, key=lambda start: soft.rms(start, view))

    @staticmethod
    def _fit_without_gap(soft: Innovations, start: FloatArray, view: View, enough: float) -> FloatArray:
        """Fit of the same filter without a gap; the contact may be soft."""
        return soft.solved(start, np.delete(np.arange(start.size), [GAP, HERTZ]), view, 15, enough)


def _rms(signal: FloatArray) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def _three(numbers: FloatArray) -> tuple[float, float, float]:
    return float(numbers[0]), float(numbers[1]), float(numbers[2])
