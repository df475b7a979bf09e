"""Statuses of a node's axes compared with commissioning, from the settings ``baseline`` and ``baseline_table``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from xy_sysid.errors import BadInput
from xy_sysid.live.plain_messages import StatusMessage
from xy_sysid.settings import DiagnoserSettings, IdentifierSettings

if TYPE_CHECKING:
    from xy_sysid.axis.model import Library
    from xy_sysid.fleets.baseline import Baseline
    from xy_sysid.fleets.causes import Causes
    from xy_sysid.linear.transfer_function import TransferFunction
    from xy_sysid.response.estimate import Estimate

Column = Callable[[str], str]


class SinceCommissioning:
    """The baselines of the axes in a model file; without a file there are none, and the comparison is not imported.

    models: transfer functions of the file, by axis; effects: names that models may contain
    """

    def __init__(
        self,
        known: Mapping[str, tuple[Estimate, ...]],
        table: str,
        column: Column,
        models: Mapping[str, TransferFunction],
        effects: Collection[str] = (),
    ) -> None:
        self.models, self._effects = models, effects
        self._known, self._column, self._spreads = known, column, _spreads(table) if known else {}
        self.forget()

    @classmethod
    def of_identifier(cls, settings: IdentifierSettings, axes: tuple[str, ...]) -> SinceCommissioning:
        """From a file of ``fit --model``. Raises BadRecording or BadInput for another file, or one of other axes."""
        if not settings.baseline:
            return cls({}, settings.baseline_table, str, {})
        from xy_sysid.fleets.commissioned import of_transfer_functions

        found = of_transfer_functions(Path(settings.baseline).expanduser())
        _same(settings.baseline, found, axes)
        known = {axis: estimates for axis, (_, estimates) in found.items()}
        return cls(known, settings.baseline_table, column_of_fit, {axis: tf for axis, (tf, _) in found.items()})

    @classmethod
    def of_diagnoser(cls, settings: DiagnoserSettings, axes: tuple[str, ...], library: Library) -> SinceCommissioning:
        """From a file of ``refine --model``. Raises BadRecording or BadInput for another file, or one of other axes."""
        if not settings.baseline:
            return cls({}, settings.baseline_table, str, {})
        from xy_sysid.fleets.columns import column_of
        from xy_sysid.fleets.commissioned import of_axis_models

        known = of_axis_models(Path(settings.baseline).expanduser(), library)
        _same(settings.baseline, known, axes)
        return cls(known, settings.baseline_table, column_of, {}, library.effects)

    def forget(self) -> None:
        """Delete the comparisons so far."""
        self._baselines: dict[str, Baseline] = {}
        if self._known:
            from xy_sysid.fleets.baseline import Baseline

            self._baselines = {axis: Baseline(known, self._spreads, self._column, self._effects) for axis, known in self._known.items()}

    def hear(self, axis: str, estimates: Iterable[Estimate], begin: float, end: float) -> None:
        """Add the estimates from a stretch of data of an axis; begin, end: s; see ``Baseline.hear``."""
        if axis in self._baselines:
            self._baselines[axis].hear(estimates, begin, end)

    def statuses(self) -> list[StatusMessage]:
        """A status for each axis that has a baseline."""
        if not self._baselines:
            return []
        from xy_sysid.fleets.baseline_words import status
        from xy_sysid.fleets.trends import AXIS_MONTHS

        return [status(axis, baseline, self._causes, AXIS_MONTHS) for axis, baseline in self._baselines.items()]

    @cached_property
    def _causes(self) -> Causes:
        from xy_sysid.fleets.causes import causes

        return causes()


def column_of_fit(name: str) -> str:
    """The column for an estimate of a transfer function in the table of the fleet."""
    from xy_sysid.fleets.columns import column_of

    return f"tf_{column_of(name)}"


def _spreads(table: str) -> Mapping[str, float]:
    if not table:
        return {}
    from xy_sysid.fleets.commissioned import spreads

    return spreads(Path(table).expanduser())


def _same(path: str, known: Mapping[str, object], axes: tuple[str, ...]) -> None:
    if path and not set(known) & set(axes):
        raise BadInput(
            "parameter baseline", f"a model of axis {', '.join(known)}", f"one of axis {' or '.join(axes)}", "Give the file of this machine."
        )
