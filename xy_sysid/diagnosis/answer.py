"""The answer about one axis: its steps (rungs) from the rigid model on, the other sets that were tried, and the verdict.

``refine`` returns it without a verdict, ``diagnose`` adds the verdict. Sentences, JSON, tables and pictures are functions of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.comparison.where_it_fails import Comparison
from xy_sysid.diagnosis.unmodelled import UnmodelledForce
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.parameters import parameter_table
from xy_sysid.hypotheses.criteria import AT_FLOOR
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.recording import Run
from xy_sysid.tables import Table
from xy_sysid.units import USUAL, Units, bare, motion, moved

Kind = Literal["missing_effect", "nothing_missing", "not_in_library", "not_enough_data", "not_judged"]


@dataclass(frozen=True, slots=True)
class Rung:
    """One fit in a row of fits: what changed, and how good it is.

    came, went: effects that were added and removed with it; none of either for the rigid base
    gain, delay, pole, values: the model, and the values of each effect, SI; parameters: the same with 95 % intervals
    training_error, held_out_error: rms, m/s, on the fitted and on held-out data
    noise_floor: rms, m/s: the smallest error that the data can show; excess: 0 is at the floor
    one_step: judged by its prediction of the next sample, because a free simulation cannot follow it
    made: the model with its fit; None in another process
    """

    came: tuple[str, ...]
    went: tuple[str, ...]
    gain: float
    delay: float
    pole: float
    values: tuple[tuple[str, tuple[float, ...]], ...]
    parameters: tuple[Estimate, ...]
    training_error: float
    held_out_error: float
    noise_floor: float
    excess: float
    one_step: bool
    units: Units = USUAL
    made: PhysicalModel | None = None

    @staticmethod
    def of(fit: GreyboxFit, came: Sequence[str] = (), went: Sequence[str] = ()) -> Rung:
        """The rung of a fit."""
        return Rung(
            came=tuple(came),
            went=tuple(went),
            gain=fit.model.gain,
            delay=fit.model.delay,
            pole=fit.model.pole,
            values=fit.model.effects,
            parameters=fit.parameters,
            training_error=fit.training_error,
            held_out_error=fit.held_out_error,
            noise_floor=fit.noise_floor,
            excess=fit.excess,
            one_step=fit.one_step,
            units=fit.units,
            made=PhysicalModel(fit.model, units=fit.units, fit=fit),
        )

    def plain(self) -> Rung:
        """Without the fit: numbers and names only."""
        return replace(self, made=None)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in the model, in the order in which they were added."""
        return tuple(name for name, _ in self.values)

    @property
    def added(self) -> str | None:
        """The effects that came, in words; None if none did."""
        return " and ".join(self.came) or None

    @property
    def removed(self) -> str | None:
        """The effects that went, in words; None if none did."""
        return " and ".join(self.went) or None

    @property
    def label(self) -> str:
        """What changed, in words."""
        label = f"with {self.added}" if self.came else "rigid, with delay"
        if self.went:
            label = f"{self.added} instead of {self.removed}" if self.came else f"without {self.removed}"
        return f"{label} (error one sample ahead)" if self.one_step else label

    @property
    def explained(self) -> bool:
        """The error is at the noise floor."""
        return self.excess < AT_FLOOR

    @property
    def model(self) -> PhysicalModel:
        """The model, to be compared, drawn and saved."""
        assert self.made is not None
        return self.made

    @property
    def fit(self) -> GreyboxFit:
        """Parameters with intervals, errors, simulated velocity."""
        assert self.model.fit is not None
        return self.model.fit

    def __repr__(self) -> str:
        unit = self.units.judged
        return f"<Rung {self.added or 'rigid'}: held-out error {moved(self.held_out_error, unit)}, floor {bare(self.noise_floor, unit)}>"


@dataclass(frozen=True, slots=True)
class Tried:
    """Another set of effects that was tried: a single effect (candidate), or a rival of the chosen set.

    explained: part (0..1) of the base's error power beyond the noise that is gone with it; 0 one step ahead
    doubt: of a rival, the probability (0..1) that it predicts as well as the set that was taken, parameters at their price
    refused: why it explains nothing, though it may leave as little: in words, or empty
    """

    rung: Rung
    explained: float = 0.0
    doubt: float = 0.0
    refused: str = ""

    @property
    def name(self) -> str:
        """The effects in words."""
        return " and ".join(self.effects)

    @property
    def effects(self) -> tuple[str, ...]:
        """Their names."""
        return self.rung.came


@dataclass(frozen=True, slots=True)
class LookAlike:
    """A look-alike of the named effect: whether these data distinguish them, and the experiment that would."""

    effect: str
    told_apart: bool
    sentence: str
    experiment: str


@dataclass(frozen=True, slots=True)
class Answer:
    """What is missing in the rigid model of one axis, and how that was found. It can be gone through, rung by rung.

    rungs:    from the rigid base down; none if the data do not suffice
    best:     effects of the last rung, that which explains most first
    settled:  the last model where it was fitted once more: to the whole record, or with one law for several effects that were given
    candidates: single effects on the base, least error first; rivals: other sets, best first
    sizes:    of each effect: error power that it explains, divided by the power that remains
    helps:    the largest part (0..1) of the base's error power beyond the noise that any set explains, named or not
    kept_out: the refused set with the smallest error, if that is below the error of the last rung
    refused:  (effects, why they explain nothing); explained: part (0..1) of the base's error power beyond the noise that is gone
    noise, discrepancy: of the held-out error, m/s rms: what the encoder adds, and what no effect explains
    stopped:  the time was up before the search ended by itself
    tried_first: a set that was known before and ended the search, as it explains the data down to the noise floor; see ``first_set``
    verdict:  see Kind; confidence: 0..1; sentence: both in words; units: of input and output
    tolerance: part of the motion (rms) that is left unexplained beyond the noise
    could_hide: an effect that changes less of the motion (rms) than this part may be there unseen, in the noise or in the residual error
    where:    the places where the base fails; look_alikes: of the first effect; runs: that it is about
    force:    that nobody modelled: what the last rung leaves, or the base where no effect is named
    untried:  effects that need one stretch without a gap, where the longest is too short for them
    stretch:  the place of the stretch that the answer is about, if it is about one of several
    """

    rungs: tuple[Rung, ...]
    best: tuple[str, ...] = ()
    settled: Rung | None = None
    candidates: tuple[Tried, ...] = ()
    rivals: tuple[Tried, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    helps: float = 0.0
    kept_out: Tried | None = None
    refused: tuple[tuple[tuple[str, ...], str], ...] = ()
    explained: float = 0.0
    noise: float = 0.0
    discrepancy: float = 0.0
    stopped: bool = False
    tried_first: tuple[str, ...] = ()
    units: Units = USUAL
    verdict: Kind = "not_judged"
    confidence: float = 0.0
    sentence: str = ""
    tolerance: float = 0.0
    could_hide: float = 0.0
    where: Comparison | None = None
    look_alikes: tuple[LookAlike, ...] = ()
    next_experiment: str = ""
    runs: tuple[Run, ...] = ()
    force: UnmodelledForce | None = None
    untried: tuple[str, ...] = ()
    stretch: int | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that are missing, that which explains most first; of a search that is not judged those that it added."""
        return self.best if self.verdict in ("missing_effect", "not_judged") else ()

    @property
    def effect(self) -> str | None:
        """The first of the effects."""
        return self.effects[0] if self.effects else None

    @property
    def told(self) -> Rung | None:
        """The rung whose effects are named: the last, the base where none is named; None if the data do not suffice."""
        return (self.rungs[-1] if self.effects else self.rungs[0]) if self.rungs else None

    @property
    def base(self) -> GreyboxFit:
        """The rigid base."""
        return self.rungs[0].fit

    @property
    def final(self) -> GreyboxFit:
        """The fit with all effects."""
        return (self.settled or self.rungs[-1]).fit

    @property
    def model(self) -> PhysicalModel:
        """The model of the last rung, with every effect."""
        return self.rungs[-1].model

    @property
    def runner_up(self) -> str | None:
        """The next best set of effects; None if nothing else was near."""
        return self.rivals[0].name if self.rivals else None

    @property
    def table(self) -> Table:
        """The falling error: one row for each rung; empty if the data do not suffice."""
        factor, unit = motion(self.units.speed) if self.rungs else (1.0, "")
        rows = ((one.added or "rigid", factor * one.training_error, factor * one.held_out_error, factor * one.noise_floor) for one in self.rungs)
        return Table(("added", f"training error ({unit})", f"held-out error ({unit})", f"noise floor ({unit})"), tuple(rows))

    @property
    def parameters(self) -> Table:
        """The parameters of the model with all effects, with 95 % intervals."""
        return parameter_table(self.rungs[-1].parameters if self.rungs else ())

    def plain(self) -> Answer:
        """Without fits, samples and code: what can go to another process or into a document."""
        none = np.zeros(0)
        return replace(
            self,
            rungs=tuple(rung.plain() for rung in self.rungs),
            settled=None,
            candidates=tuple(replace(item, rung=item.rung.plain()) for item in self.candidates),
            rivals=tuple(replace(item, rung=item.rung.plain()) for item in self.rivals),
            kept_out=None,
            where=self.where and replace(self.where, time=none, measured=none, predicted=none, position=none),
            runs=(),
        )

    def __iter__(self) -> Iterator[Rung]:
        return iter(self.rungs)

    def __len__(self) -> int:
        return len(self.rungs)

    def __bool__(self) -> bool:
        return True  # too little data is an answer, too

    def __getitem__(self, place: int) -> Rung:
        return self.rungs[place]

    def __str__(self) -> str:
        """The sentence, the falling error and the parameters."""
        said = () if self.verdict == "not_judged" else (f"{self.sentence} Confidence {self.confidence:.2f}.",)
        return "\n\n".join((*said, *((str(self.table), str(self.parameters)) if self.rungs else ())))

    def __repr__(self) -> str:
        if self.verdict != "not_judged":
            return f"<Diagnosis: {self.sentence} Confidence {self.confidence:.2f}.>"
        unit = self.units.judged
        rungs = (f"{rung.added or 'rigid'} {bare(rung.held_out_error, unit)}" for rung in self.rungs)
        return f"<Refinement: {' -> '.join(rungs)} {motion(unit)[1]}, floor {bare(self.rungs[-1].noise_floor, unit)}>"
