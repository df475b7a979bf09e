"""All effects of the folder: each file or subfolder is one effect; names with a leading underscore are shared tools.

_scene:          the measured motion, input of a guess
_contract:       the description of an effect
_pole_zero_pair: resonances, with or without zeros
_binding:        laws in generated source text
"""

from __future__ import annotations

import importlib
import pkgutil

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


def _found() -> dict[str, Effect]:
    names = sorted(info.name for info in pkgutil.iter_modules(__path__) if not info.name.startswith("_"))
    return {name: importlib.import_module(f"{__name__}.{name}").EFFECT for name in names}


EFFECTS: dict[str, Effect] = _found()
SIMPLEST_FRICTION = min((effect for effect in EFFECTS.values() if effect.is_dry), key=lambda effect: len(effect.parameters))
SIMPLEST_LOAD = next(effect for effect in EFFECTS.values() if len(effect.parameters) == 1 and effect.parameters[0].per_recording)

__all__ = ["EFFECTS", "SIMPLEST_FRICTION", "SIMPLEST_LOAD", "Effect", "Guess", "Parameter", "Scene", "columns", "law"]
