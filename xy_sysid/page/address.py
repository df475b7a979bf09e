"""The view of the page as the query of its address: open recordings, and for each the axis, model, figures and added effects.

``?rec=dry.npz&axis=y&model=rigid&effects=x:coulomb_friction,cogging&rec=plain.npz&units=um``: each ``rec`` (or ``live``) starts a source;
the following entries belong to it. Unknown entries are ignored, so that an old link still opens.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from urllib.parse import parse_qsl, urlencode

from xy_sysid.units import CHOICES

LONGEST = 4000  # characters of the query; the rest is ignored
MOST = 7  # sources; the rest is ignored
OPTIONS = ("map", "unit", "scale", "rate")  # options for reading a table, named as the command's options without dashes


@dataclass(frozen=True, slots=True)
class SourceView:
    """The view of one recording, or of the machine.

    name: as the page lists it, empty for the machine; words: reading options, as for a command
    model: empty for the newest; pictures: of tabs other than the first; effects: added to the model of each axis
    """

    name: str = ""
    words: tuple[str, ...] = ()
    axis: str = ""
    model: str = ""
    pictures: tuple[str, ...] = ()
    effects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PageView:
    """All sources, in order; theme: light, dark, or empty for the system's; units: those of ``units.CHOICES`` that differ from the default."""

    sources: tuple[SourceView, ...] = ()
    theme: str = ""
    units: tuple[str, ...] = ()

    def of(self, name: str) -> SourceView:
        """The view of one source; an empty view if the source is not in the address."""
        return next((one for one in self.sources if one.name == name), SourceView(name))


def query_of(view: PageView) -> str:
    """The query of an address, without its question mark."""
    pairs: list[tuple[str, str]] = []
    for one in view.sources:
        own = [(option.removeprefix("--"), text) for option, text in zip(one.words[::2], one.words[1::2], strict=True)]
        own += [(name, value) for name, value in (("axis", one.axis), ("model", one.model), ("pictures", ",".join(one.pictures))) if value]
        own += [("effects", f"{axis}:{','.join(names)}") for axis, names in one.effects.items() if names]
        if one.name or own:
            pairs += [("rec", one.name) if one.name else ("live", "1"), *own]
    pairs += [("theme", view.theme)] if view.theme else []
    pairs += [("units", ",".join(view.units))] if view.units else []
    return urlencode(pairs, safe="/:,")


def view_of_query(query: str) -> PageView:
    """The view that a query describes."""
    sources: list[SourceView] = []
    theme = ""
    units: tuple[str, ...] = ()
    for name, value in _pairs(query):
        if name in ("rec", "live"):
            sources.append(SourceView(value if name == "rec" else ""))
        elif name == "theme":
            theme = value if value in ("light", "dark") else ""
        elif name == "units":
            units = tuple(own for kind in CHOICES.values() for own in [*kind][1:] if own in _names(value))
        elif sources:
            sources[-1] = _with(sources[-1], name, value)
    return PageView(tuple(sources[:MOST]), theme, units)


def _pairs(query: str) -> Iterable[tuple[str, str]]:
    try:
        return parse_qsl(query[:LONGEST], max_num_fields=200)
    except ValueError:  # too many fields
        return ()


def _with(one: SourceView, name: str, value: str) -> SourceView:
    if name in OPTIONS:
        return replace(one, words=(*one.words, f"--{name}", value))
    if name == "axis":
        return replace(one, axis=value)
    if name == "model":
        return replace(one, model=value)
    if name == "pictures":
        return replace(one, pictures=_names(value))
    axis, colon, effects = value.rpartition(":")
    if name == "effects" and colon:
        return replace(one, effects={**one.effects, axis: _names(effects)})
    return one


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(",") if name)


def without(query: str, name: str) -> str:
    """The query without the values of one name."""
    return urlencode([pair for pair in _pairs(query) if pair[0] != name], safe="/:,")
