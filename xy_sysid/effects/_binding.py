"""Laws in generated source text: their arguments are bound by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from xy_sysid.effects._contract import Effect, arguments
from xy_sysid.jit import module_text


def called(effect: Effect, function: str) -> str:
    """Name of a law in a loop."""
    return f"{effect.name}__{function}"


def call(effect: Effect, function: str, words: Mapping[str, str]) -> str:
    """Source text of a call; words: the text for each argument, including the effect's own parameters and states."""
    return f"{called(effect, function)}({', '.join(words[word] for word in arguments(effect.functions[function]))})"


def law_names(effects: Iterable[Effect]) -> dict[str, object]:
    """The laws by their names in the loop."""
    return {called(effect, function): item for effect in effects for function, item in effect.functions.items()}


def law_texts(effects: Iterable[Effect]) -> set[str]:
    """Source of each module that defines one of the laws: with it as cache key, a changed law is compiled again."""
    return {module_text(item) for effect in effects for item in effect.functions.values()}
