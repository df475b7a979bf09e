"""Every effect, found by folder: one file is one effect."""

from __future__ import annotations

import importlib
import pkgutil

from xy_sysid.effects.contract import Effect, Parameter, law
from xy_sysid.effects.scene import Guess, Scene, columns

TOOLS = ("contract", "scene", "modes", "contact", "contact_filter")


def _found() -> dict[str, Effect]:
    names = sorted(info.name for info in pkgutil.iter_modules(__path__) if info.name not in TOOLS)
    return {name: importlib.import_module(f"{__name__}.{name}").EFFECT for name in names}


EFFECTS: dict[str, Effect] = _found()

__all__ = ["EFFECTS", "Effect", "Guess", "Parameter", "Scene", "columns", "law"]
