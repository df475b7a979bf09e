"""The experiment within the limits that distinguishes some sets of effects in the shortest time.

Every proposal is judged roughly, with the most likely model of each set, and the most promising ones with draws of the parameters and refitted
rivals; then the neighbours of the best. The measure is the time in seconds after which the true set is distinguished from its rivals with 95 %
probability, averaged over sets and draws. If no experiment achieves this, the measure is the probability at its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from xy_sysid.axis.forward import move
from xy_sysid.axis.model import AxisModel
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.criteria import ALIKE, BLOCK, COARSE, ENOUGH, JUDGED, NO_EVIDENCE, ROUNDS, SURE
from xy_sysid.experiment_design.evidence import Power, powers, seconds_needed, settled
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.prediction import Setting, seen
from xy_sysid.experiment_design.proposals import neighbours, proposals
from xy_sysid.hypotheses.criteria import DOUBTFUL

STAGES: tuple[tuple[int | None, int], ...] = ((1, 1), (1, ROUNDS), (None, ROUNDS))  # draws and rounds of the evaluations of an experiment


@dataclass(frozen=True)
class Judged:
    """An experiment with its evaluation.

    seconds: of steady motion after which the sets are distinguished with 95 %, infinite if the limit of duration does not suffice; probability: of
    this at the end; each: powers of each draw; broken: name of a limit that it would exceed, with margin, or empty; shortest: least duration, s
    stage: of ``STAGES``
    """

    experiment: Experiment
    seconds: float = math.inf
    probability: float = 0.0
    each: tuple[tuple[Power, ...], ...] = ()
    broken: str = ""
    shortest: float = 0.0
    stage: int = 0

    @property
    def order(self) -> tuple[float, float, float]:
        """Sort key, smaller is better: duration if it decides, else probability; then evidence after the least duration."""
        evidence = sum(min((one.after(self.shortest) for one in item), default=0.0) for item in self.each)
        if math.isfinite(self.seconds):
            return max(self.seconds + self.experiment.ramp, self.shortest), 0.0, -evidence
        return math.inf, -round(self.probability / ALIKE), -evidence

    def most(self, seconds: float) -> float:
        """The largest evidence of a draw after some seconds, nats on what is judged."""
        return JUDGED * max((one.after(seconds) for draw in self.each for one in draw), default=0.0)

    def lasting(self, seconds: float) -> Judged:
        """The experiment with this duration, and its evaluation."""
        steady = seconds - self.experiment.ramp
        reached = self.seconds if self.seconds <= steady else math.inf
        return replace(self, experiment=self.experiment.lasting(seconds), seconds=reached, probability=settled(self.each, steady))


@dataclass(frozen=True)
class Design:
    """beliefs: of the sets to distinguish; best: the experiment that does so in the shortest time; tried: all evaluated ones; rate: Hz."""

    beliefs: tuple[Belief, ...]
    limits: MachineLimits
    best: Judged | None
    tried: tuple[Judged, ...]
    rate: float

    def lasting(self, seconds: float) -> Design:
        """The design with this duration for its best experiment, and the new evaluation."""
        return self if self.best is None else replace(self, best=self.best.lasting(seconds))

    def broken(self, experiment: Experiment) -> str:
        """Name of the limit that an experiment would exceed, with margin, at any time with any draw, or empty."""
        return broken_in_time([model for belief in self.beliefs for model in belief.draws], self.rate, self.limits, experiment)

    @property
    def possible(self) -> bool:
        """True if an experiment within the limits distinguishes the sets with 95 %."""
        return self.best is not None and math.isfinite(self.best.seconds)

    @property
    def alike(self) -> bool:
        """True if no experiment within the machine's limits gives evidence for any draw of the sets."""
        return max((item.most(self.limits.seconds) for item in self.tried if item.each), default=math.inf) < NO_EVIDENCE

    @property
    def helps(self) -> bool:
        """True if the best experiment may decide, or gives information for a better one."""
        return self.best is not None and self.best.probability >= DOUBTFUL


def design(setting: Setting, beliefs: Sequence[Belief], limits: MachineLimits, tell: Callable[[float], None]) -> Design:
    """The best experiment for some beliefs; tell: called with the progress, 0..1."""
    setting, rate = replace(setting, ramp=limits.ramp), setting.layout.sampling_rate
    rough, closer = partial(judge, setting, beliefs, limits, *STAGES[0]), partial(judge, setting, beliefs, limits)
    judged: list[Judged] = []
    first = proposals(limits, rate)
    for number, proposal in enumerate(first):
        judged.append(rough(proposal))
        tell(0.6 * (number + 1) / len(first))
    none = Design(beliefs=tuple(beliefs), limits=limits, best=None, tried=(), rate=rate)
    best = next(best_first(judged, closer), None)
    tell(0.8)
    if best is not None:
        judged += map(rough, neighbours(best.experiment, limits, rate))
    for item in best_first(judged, closer):
        timed = _timed(item, limits)
        if not none.broken(timed.experiment):
            none = replace(none, best=timed)
            break
    if not none.helps:
        _look_for_evidence(judged, closer, limits.seconds)
    tell(1.0)
    return replace(none, tried=tuple(judged))


def _look_for_evidence(judged: list[Judged], closer: Callable[[int | None, int, Experiment], Judged], seconds: float) -> None:
    """Evaluate what could give evidence more closely, until one experiment exactly does, or none could."""
    while True:
        number = max((k for k, item in enumerate(judged) if item.each), key=lambda k: judged[k].most(seconds), default=-1)
        if number < 0 or judged[number].most(seconds) < NO_EVIDENCE or not _look_closer(judged, number, closer):
            return


def _look_closer(judged: list[Judged], number: int, closer: Callable[[int | None, int, Experiment], Judged]) -> bool:
    """Replace one evaluation by the next closer one; False if it is exact."""
    item = judged[number]
    if item.stage == len(STAGES) - 1:
        return False
    judged[number] = replace(closer(*STAGES[item.stage + 1], item.experiment), stage=item.stage + 1)
    return True


def best_first(judged: list[Judged], closer: Callable[[int | None, int, Experiment], Judged]) -> Iterator[Judged]:
    """Experiments in the order of their exact evaluations, best first.

    An early evaluation is optimistic: with few rounds a rival is not refitted. So the most promising one is always evaluated more closely, until
    it is exact. judged: early evaluations, replaced by closer ones; closer: evaluates with a number of draws and of rounds
    """
    given: set[int] = set()
    while True:
        waiting = [number for number, item in enumerate(judged) if not item.broken and number not in given]
        if not waiting:
            return
        number = min(waiting, key=lambda number: judged[number].order)
        if not _look_closer(judged, number, closer):
            given.add(number)
            yield judged[number]


def broken_in_time(models: Sequence[AxisModel], rate: float, limits: MachineLimits, experiment: Experiment) -> str:
    """Name of the limit that an experiment would exceed, with margin, at any time with any of the models, or empty. rate: Hz"""
    drive = experiment.drive(rate, experiment.seconds, limits.start)
    return next((word for model in models if (word := limits.broken(move(model, rate, drive, COARSE)))), "")


def judge(setting: Setting, beliefs: Sequence[Belief], limits: MachineLimits, draws: int | None, rounds: int, experiment: Experiment) -> Judged:
    """The evaluation of one experiment; draws: number of draws of each set, None: all; rounds: of the refits of its rivals."""
    told = experiment.excitation
    shortest = setting.shortest()
    seconds = max(setting.looked, shortest, min(2.0 * told.slow_period * (told.slow > 0.0), limits.seconds) + limits.ramp)
    looked = [(number, model) for number, belief in enumerate(beliefs) for model in belief.draws[:draws]]
    motions = []
    for _, model in looked:
        motions.append(move(model, setting.layout.sampling_rate, experiment.drive(setting.layout.sampling_rate, seconds, limits.start), COARSE))
        broken = limits.broken(motions[-1])
        if broken:
            return Judged(experiment, broken=broken)
    pairs = zip(looked, motions, strict=True)
    steady = 0.5 * seconds  # what happens once, as the way to a place, may fall into the windows of the fit, and shows nothing later
    each = [tuple(powers(beliefs, number, model, seen(setting, motion, steady), rounds)) for (number, model), motion in pairs]
    most = limits.seconds - limits.ramp
    needed, chance = seconds_needed(each, most), settled(each, most)
    least = max(shortest, told.slow_period + limits.ramp if told.slow > 0.0 else 0.0)
    return Judged(experiment, seconds=needed, probability=chance, each=tuple(each), shortest=least)


def _timed(item: Judged, limits: MachineLimits) -> Judged:
    """The evaluation with the duration that the experiment should have."""
    most = limits.seconds - limits.ramp
    steps = (BLOCK * k for k in range(1, math.ceil(most / BLOCK)))
    wanted = item.seconds
    if not math.isfinite(wanted):
        wanted = next((step for step in steps if settled(item.each, step) >= ENOUGH * item.probability), most)
    return item.lasting(min(BLOCK * math.ceil(max(wanted + limits.ramp, item.shortest) / BLOCK), limits.seconds))


def expects(found: Design, wanted: float = 0.0) -> str:
    """The expected result of the best experiment, in a sentence. wanted: s that it was designed for; the budget may allow less."""
    names = f"{found.beliefs[0].name} and {' or '.join(item.name for item in found.beliefs[1:])}"
    if found.best is None:
        why = sorted({item.broken for item in found.tried if item.broken})
        return f"No experiment within the limits can distinguish {names}: all come too near to the limit of {' or '.join(why)}."
    chance = f"{100.0 * found.best.probability:.0f} %"
    if found.possible:
        return f"After {found.best.experiment.seconds:.0f} s, {names} are distinguished with {100.0 * SURE:.0f} % probability."
    if found.best.experiment.seconds < wanted:
        left = f"{found.best.experiment.seconds:.0f} s that the budget leaves"
        return f"In the {left}, {names} are distinguished with {chance} probability; {wanted:.0f} s were designed."
    if found.alike:
        return f"Within the limits of this machine {names} are the same: no experiment can favour one of them."
    if found.helps:
        return f"No experiment within the limits is sure to distinguish {names}: the best does with {chance} probability."
    return f"No experiment within the limits can distinguish {names}: the best would with {chance} probability."
