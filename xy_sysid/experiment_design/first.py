"""A first experiment for an unknown axis with known limits.

The axis is assumed to cross its travel at full voltage in 0.3 to 10 s, with any pole, delay and dry friction that
machines have, and with a load that is smaller than its friction: the axis rests at 0 V, which the first run (``xy-sysid run --first``) checks.

The experiment stays within the limits for every drawn axis, and gives the most information on gain, delay and pole on average.
"""

from __future__ import annotations

import math

import numpy as np
from threadpoolctl import threadpool_limits

from xy_sysid.axis.forward import move
from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import SIMPLEST_FRICTION, SIMPLEST_LOAD
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.criteria import COARSE, FITTED, LOOKED, SEED
from xy_sysid.experiment_design.design import broken_in_time
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.of_run import NextExperiment, with_needs
from xy_sysid.experiment_design.precision import Information, information
from xy_sysid.experiment_design.prediction import Setting, seen
from xy_sysid.experiment_design.proposals import proposals
from xy_sysid.greybox.axis_data import EPSILON, WINDOWS
from xy_sysid.greybox.floor import bands
from xy_sysid.greybox.least_squares import Scale
from xy_sysid.response.frf import Z95

CROSSES = (0.3, 10.0)  # s in which an axis crosses its travel at full voltage
POLE = (5.0, 500.0)  # rad/s
DELAY = (0.5e-3, 5e-3)  # s
FRICTION = (0.01, 0.2)  # of the full voltage
COUNTS = 1e5  # encoder counts within the travel, at least
WIDTH = 0.05  # wanted half width of the 95 % interval of gain and pole
DRAWS = 8
SHORTEST = 30.0  # s, least duration: a diagnosis needs held-out windows


def first_experiment(axis: str, sampling_rate: float, limits: MachineLimits) -> NextExperiment:
    """A good first experiment for an unknown axis: amplitude, band, duration. Raises BadInput for inconsistent limits."""
    encoder = (limits.travel[1] - limits.travel[0]) / COUNTS / math.sqrt(12.0)
    setting = Setting(bands(sampling_rate, int(LOOKED * sampling_rate / WINDOWS)), encoder, EPSILON, ramp=limits.ramp)
    models = _draws(limits)
    judged = []
    with threadpool_limits(1, "blas"):
        for number, experiment in enumerate(proposals(limits, sampling_rate)):
            found = _informations(setting, models, limits, experiment)
            if found:
                tells = float(np.mean([np.linalg.slogdet(item.each_second[:3, :3] + np.eye(3))[1] for item in found]))
                judged.append((-tells, number, experiment, found))
    judged.sort(key=lambda item: item[:2])
    lasting = (
        (found, best.lasting(float(min(max(math.ceil(_seconds(found, limits.seconds)), SHORTEST), limits.seconds)))) for *_, best, found in judged
    )
    chosen = next(((found, item) for found, item in lasting if not broken_in_time(models, sampling_rate, limits, item)), None)
    if chosen is None:
        sentence = "No experiment stays within the limits for every possible axis: widen the travel, or start with xy-sysid run --first."
        return NextExperiment(axis=axis, sampling_rate=sampling_rate, sentence=sentence, limits=limits)
    found, best = chosen
    seconds = best.seconds
    share = float(np.mean([_width(item, seconds) <= WIDTH for item in found]))
    sentence = f"After {seconds:.0f} s, gain and pole are known to {100.0 * WIDTH:.0f} % on {100.0 * share:.0f} % of the possible axes."
    made = NextExperiment(axis=axis, sampling_rate=sampling_rate, sentence=sentence, limits=limits, experiment=best, probability=share)
    return with_needs(made, models)


def _draws(limits: MachineLimits) -> list[AxisModel]:
    """Possible axes, including the fastest."""
    random = np.random.default_rng(SEED)
    found = []
    for number in range(DRAWS):
        crosses, pole, delay, friction = (low * (high / low) ** random.uniform() for low, high in (CROSSES, POLE, DELAY, FRICTION))
        gain = (limits.travel[1] - limits.travel[0]) / (limits.voltage * (crosses if number else CROSSES[0]))
        rubs = friction if number else FRICTION[0]
        held = random.uniform(-1.0, 1.0) * rubs  # a load that is smaller than the friction
        model = AxisModel(gain, delay, pole).with_effect(SIMPLEST_FRICTION.name, (rubs * limits.voltage,))
        found.append(model.with_effect(SIMPLEST_LOAD.name, (held * limits.voltage,)))
    return found


def _informations(setting: Setting, models: list[AxisModel], limits: MachineLimits, experiment: Experiment) -> list[Information]:
    rate = setting.layout.sampling_rate
    told = experiment.excitation
    seconds = max(setting.looked, (told.slow_period + limits.ramp) * (told.slow > 0.0))
    motions = []
    for model in models:
        motions.append(move(model, rate, experiment.drive(rate, seconds, limits.start), COARSE))
        if limits.broken(motions[-1]):
            return []
    return [information(_believed(model), model, seen(setting, motion)) for model, motion in zip(models, motions, strict=True)]


def _believed(model: AxisModel) -> Belief:
    """A draw as a belief, for the calculation of its sensitivities."""
    low, high = np.array([-np.inf, 0.0, 1e-2, 1e-9, -np.inf]), np.array([np.inf, 1.0, 1e5, 1e3, np.inf])
    scale = Scale(low, high, np.array([False, False, True, True, False]), np.array([model.gain, model.delay, 1.0, 1.0, 1.0]))
    effects = tuple(name for name, _ in model.effects)
    return Belief(effects=effects, model=model, draws=(model,), scale=scale, precision=np.eye(5), free=2, force=0.0, motion=0.0)


def _width(item: Information, seconds: float) -> float:
    """The larger of the half widths of gain and pole, as fractions of their values."""
    covariance = item.covariance(1e-6 * np.eye(item.each_second.shape[0]), FITTED * seconds)
    return Z95 * math.sqrt(max(float(covariance[0, 0]), float(covariance[2, 2])))


def _seconds(found: list[Information], most: float) -> float:
    """s after which the median of the intervals reaches the wanted width, ``most`` at most."""
    steps = np.arange(2.0, most + 1.0, 2.0)
    return next((float(step) for step in steps if float(np.median([_width(item, float(step)) for item in found])) <= WIDTH), most)
