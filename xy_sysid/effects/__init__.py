"""Every effect, found by folder: one file, or one folder, is one effect; a name that begins with an underscore is a tool.

_scene:          what a guess sees of a recording
_contract:       what every effect says of itself
_pole_zero_pair: a resonance as a pair of poles and a pair of zeros
_binding:        laws in generated text
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
