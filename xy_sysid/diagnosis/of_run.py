"""One call each: which effect is missing in a run, or in several of the same axis; and the rungs from the rigid model down."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

from threadpoolctl import threadpool_limits

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.diagnosis import diagnose as one
from xy_sysid.diagnosis.diagnose import Diagnosis
from xy_sysid.diagnosis.ladder import Ladder
from xy_sysid.diagnosis.refine import Effort, never
from xy_sysid.diagnosis.refine import refine as search
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import prepare_all
from xy_sysid.greybox.free_run import EPSILON, GreyboxFit
from xy_sysid.greybox.parameters import parameter_table
from xy_sysid.hypotheses.criteria import MOST_EFFECTS
from xy_sysid.hypotheses.enough_data import lacking
from xy_sysid.samples.recording import Recording, Run, one_run
from xy_sysid.tables import Table
from xy_sysid.units import bare, motion, moved, over

Data = Run | Recording | Sequence[Run | Recording]


@dataclass(frozen=True, slots=True)
class RefinedStep:
    """One rung: the effect added (None for the rigid base alone) and the model with it.

    held_out_error, training_error: rms, m/s, of data that no fit saw, and of those that it saw; noise_floor: the least
    error that a model can be known to have
    """

    added: str | None
    model: PhysicalModel

    @property
    def fit(self) -> GreyboxFit:
        """Parameters with intervals, errors, simulated velocity."""
        assert self.model.fit is not None
        return self.model.fit

    @property
    def held_out_error(self) -> float:
        """m/s rms, of data that no fit saw."""
        return self.fit.held_out_error

    @property
    def training_error(self) -> float:
        """m/s rms, of the data of the fit."""
        return self.fit.training_error

    @property
    def noise_floor(self) -> float:
        """m/s rms, the least error that a model can be known to have: of encoder noise and of the part of the motion that it may leave."""
        return self.fit.noise_floor

    def __repr__(self) -> str:
        unit = self.model.units.judged
        return f"<RefinedStep {self.added or 'rigid'}: held-out error {moved(self.held_out_error, unit)}, floor {bare(self.noise_floor, unit)}>"


@dataclass(frozen=True, slots=True)
class Refinement:
    """The rungs from the rigid base down, to be gone through; ``ladder`` has what was tried beside them."""

    steps: tuple[RefinedStep, ...]
    ladder: Ladder

    def __iter__(self) -> Iterator[RefinedStep]:
        return iter(self.steps)

    def __len__(self) -> int:
        return len(self.steps)

    def __getitem__(self, place: int) -> RefinedStep:
        return self.steps[place]

    @property
    def table(self) -> Table:
        """The falling error: one row for each step."""
        return ladder_table([(step.added, step.fit) for step in self.steps])

    def __str__(self) -> str:
        """The falling error, and the parameters of the last model."""
        return f"{self.table}\n\n{self.model.table}"

    @property
    def model(self) -> PhysicalModel:
        """The last one, with every effect."""
        return self.steps[-1].model

    def __repr__(self) -> str:
        unit = self.model.units.judged
        rungs = (f"{step.added or 'rigid'} {bare(step.held_out_error, unit)}" for step in self.steps)
        return f"<Refinement: {' -> '.join(rungs)} {motion(unit)[1]}, floor {bare(self.steps[-1].noise_floor, unit)}>"


@dataclass(frozen=True, slots=True)
class Diagnosed(Diagnosis):
    """The answer about some runs. ``sentence`` says it; ``verdict``, ``effects``, ``confidence``, ``next_experiment`` and the rest are its parts."""

    runs: tuple[Run, ...] = ()

    @property
    def runner_up(self) -> str | None:
        """The next best set of effects; None if nothing else was near."""
        rivals = self.ladder.rivals if self.ladder is not None else ()
        return " and ".join(rivals[0].effects) if rivals else None

    @property
    def table(self) -> Table:
        """The falling error: one row for each step; empty if the data do not suffice."""
        return ladder_table([(step.added, step.fit) for step in self.ladder.steps] if self.ladder is not None else [])

    @property
    def parameters(self) -> Table:
        """The parameters of the model with all effects that are named, with 95 % intervals."""
        return parameter_table(self.ladder.final.parameters if self.ladder is not None else ())

    def __str__(self) -> str:
        """The sentence, the falling error and the parameters."""
        tables = (str(self.table), str(self.parameters)) if self.ladder is not None else ()
        return "\n\n".join((f"{self.sentence} Confidence {self.confidence:.2f}.", *tables))

    def __repr__(self) -> str:
        return f"<Diagnosis: {self.sentence} Confidence {self.confidence:.2f}.>"


def diagnose(
    data: Data,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
    tolerance: float = EPSILON,
    first: tuple[str, ...] = (),
) -> Diagnosed:
    """Which physical effects the rigid model misses, with evidence and runner-up; or that nothing is missing, or that none is known.

    data:   a run or several of one axis, or a recording of one axis with all its stretches, V and m
    library: with effects of your own (``files.effects.library``)
    budget: s after which the best so far is said, if ``clock`` (for example ``time.process_time``) tells the time; without one the search
            ends after a fixed amount of work, and the same data give the same answer however busy the machine is
    tolerance: part of the motion that a model may leave
    first:  effects of an earlier recording of this axis. If they explain the data down to the noise floor, and no simpler set does as well,
            no other set is tried
    Too little data is an answer, ``not_enough_data``, and no error. Raises BadInput for runs that do not belong together.
    """
    runs = runs_together(data)
    rate, signals, units = runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], runs[0].units
    missing = lacking(rate, signals, units)
    with threadpool_limits(1, "blas"):  # as in commands and nodes
        if missing:
            found = one.not_enough(missing, units)
        else:
            found = one.diagnose_prepared(prepare_all(rate, signals, tolerance, units), library, budget, clock, first)
    values = {item.name: getattr(found, item.name) for item in fields(found)}
    return Diagnosed(**values, runs=runs)


def refine(
    data: Data,
    add: Iterable[str] = (),
    auto: bool = True,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
) -> Refinement:
    """Add effects, fit everything together, and see the error on held-out data fall: a step for the rigid base and one for each effect.

    add:  effects to add first, in this order, unasked; auto: go on until nothing promises more; the rest as for ``diagnose``
    Raises BadInput for too little data, or for a name that is unknown or in every model.
    """
    return refined(data, (add,) if isinstance(add, str) else tuple(add), library, Effort(MOST_EFFECTS if auto else 0, budget, clock))


def refined(data: Data, names: tuple[str, ...], library: Library, effort: Effort, tolerance: float = EPSILON) -> Refinement:
    """``refine`` with another effort, or another part of the signal that a model at the floor may leave."""
    runs = runs_together(data)
    for name in names:
        if library[name].category == "base":
            raise BadInput("add", name, "an effect that is not in every model already", "Leave it out.")
    rate, signals, units = runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], runs[0].units
    with threadpool_limits(1, "blas"):
        prepared = prepare_all(rate, signals, tolerance, units)
        missing = lacking(rate, signals, units)
        if missing:
            raise BadInput(f"data of axis {runs[0].axis}", "not enough", "what a model can be fitted to and judged by", missing)
        ladder = search(prepared, library, names, effort)
    digests = tuple(run.digest for run in runs)
    steps = tuple(
        RefinedStep(step.added, PhysicalModel(model=step.fit.model, axis=runs[0].axis, data=digests, units=runs[0].units, fit=step.fit))
        for step in ladder.steps
    )
    return Refinement(steps, ladder)


def ladder_table(steps: Sequence[tuple[str | None, GreyboxFit]]) -> Table:
    """One row for each step: effect, its errors as people read them, and the noise floor."""
    factor, unit = motion(steps[0][1].units.speed) if steps else (1.0, "")
    rows = ((added or "rigid", factor * fit.training_error, factor * fit.held_out_error, factor * fit.noise_floor) for added, fit in steps)
    return Table(("added", f"training error ({unit})", f"held-out error ({unit})", f"noise floor ({unit})"), tuple(rows))


def _stretches(data: Run | Recording) -> tuple[Run, ...]:
    if isinstance(data, Recording) and len(data.axes) == 1 and len(data):
        return data.stretches(data.axes[0])
    return (one_run(data),)


def runs_together(data: Data) -> tuple[Run, ...]:
    """One or several runs of the same axis; of a recording all stretches that tell something."""
    runs = tuple(run for item in (data if isinstance(data, Sequence) else (data,)) for run in _stretches(item))
    if not runs:
        raise BadInput("data", "empty", "a run, or several of one axis", "Give at least one.")
    for what, values in (
        ("sampling rate", [f"{run.sampling_rate:g} Hz" for run in runs]),
        ("axis", [run.axis for run in runs]),
        ("units", [over(run.units.measured, run.units.input) for run in runs]),
    ):
        if len(set(values)) > 1:
            raise BadInput(f"{what} of the runs", " and ".join(dict.fromkeys(values)), "one and the same", "Give runs of one axis.")
    return runs
