"""Laws in generated text: their arguments are bound by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from xy_sysid.effects._contract import Effect, arguments
from xy_sysid.jit import module_text


def called(effect: Effect, function: str) -> str:
    """Name of a law in a loop."""
    return f"{effect.name}__{function}"


def call(effect: Effect, function: str, words: Mapping[str, str]) -> str:
    """Text of a call; words: what stands for each argument, the effect's own parameters and states too."""
    return f"{called(effect, function)}({', '.join(words[word] for word in arguments(effect.functions[function]))})"


def law_names(effects: Iterable[Effect]) -> dict[str, object]:
    """The laws by their names in the loop."""
    return {called(effect, function): item for effect in effects for function, item in effect.functions.items()}


def law_texts(effects: Iterable[Effect]) -> set[str]:
    """Source of every module that one of the laws is from: a changed law is never run stale."""
    return {module_text(item) for effect in effects for item in effect.functions.values()}
