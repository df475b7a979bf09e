"""Effects with equal equations: no data distinguish them, so the more probable name is given with its probability.

A base that gives and a screw that gives are the same pole-zero pair to the motor's encoder. What is usual of each (``Parameter.typical``,
within a factor) tells which it is likely to be: a base is slow and heavy, so that its resonance lies near its antiresonance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.diagnosis.answer import Answer, Rung, Tried
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import USUAL_WITHIN
from xy_sysid.greybox.free_run import GreyboxFit


def equals(library: Library, name: str) -> list[Effect]:
    """Effects with this one's very law, itself among them."""
    effect = library[name]
    return [other for other in library.acting if other is effect or other.has_equations_of(effect)]


def likelihood(library: Library, name: str, values: Sequence[float]) -> float:
    """How likely it is this effect (0..1) among those of the same law; 1 if there are no others.

    Each of an effect's positive parameters is taken as log-normal about its usual size.
    """
    others = equals(library, name)
    if len(others) == 1:
        return 1.0
    depth = {other.name: _depth(other, values) for other in others}
    top = max(depth.values())
    return math.exp(depth[name] - top) / sum(math.exp(value - top) for value in depth.values())


def _depth(effect: Effect, values: Sequence[float]) -> float:
    pairs = ((item.typical, value) for item, value in zip(effect.parameters, values, strict=True) if item.positive)
    return -0.5 * sum((math.log(value / typical) / math.log(USUAL_WITHIN)) ** 2 for typical, value in pairs)


def likely_names(found: Answer, kept: Sequence[str] = ()) -> Answer:
    """The answer with the likelier name for each effect of its last model that has equals, except for those that a user gave."""
    library = found.final.model.library
    names: dict[str, str] = {}
    for name, values in found.final.model.effects:
        others = [other.name for other in equals(library, name)]
        likely = max(others, key=lambda other: likelihood(library, other, values)) if len(others) > 1 else name
        if likely != name and name not in kept:
            names |= {name: likely, likely: name}
    return _renamed(found, names) if names else found


def is_the_same(library: Library, one: tuple[frozenset[str], GreyboxFit], other: tuple[frozenset[str], GreyboxFit], least: float) -> bool:
    """Two sets are one by their laws, and their fits leave the same within ``least`` nats: they have found the same thing."""
    laws = [sorted(equals(library, name)[0].name for name in names) for names in (one[0], other[0])]
    return laws[0] == laws[1] and abs(one[1].excess - other[1].excess) < least


def _renamed(found: Answer, names: Mapping[str, str]) -> Answer:
    """Names of effects replaced by others of the same law, wherever they stand."""

    def word(name: str) -> str:
        return names.get(name, name)

    def rung(item: Rung) -> Rung:
        parameters = (replace(one, name=".".join((word(one.name.partition(".")[0]), *one.name.split(".")[1:]))) for one in item.parameters)
        return Rung.of(replace(item.fit, model=_model(item.fit.model, names), parameters=tuple(parameters)), tuple(map(word, item.came)))

    def tried(item: Tried) -> Tried:
        return replace(item, rung=rung(item.rung))

    return replace(
        found,
        rungs=tuple(map(rung, found.rungs)),
        best=tuple(map(word, found.best)),
        settled=found.settled and rung(found.settled),
        candidates=tuple(map(tried, found.candidates)),
        rivals=tuple(map(tried, found.rivals)),
        kept_out=found.kept_out and tried(found.kept_out),
        sizes={word(name): size for name, size in found.sizes.items()},
        refused=tuple((tuple(map(word, effects)), why) for effects, why in found.refused),
    )


def _model(model: AxisModel, names: Mapping[str, str]) -> AxisModel:
    return replace(model, effects=tuple((names.get(name, name), values) for name, values in model.effects))
