"""Every part of the machine, found by folder."""

from __future__ import annotations

import importlib
import pkgutil

from xy_sim.parts.contract import Part

_TOOLS = ("chance", "contact", "contract", "curve")  # shared by several parts


def _found() -> dict[str, Part]:
    names = sorted(info.name for info in pkgutil.iter_modules(__path__) if info.name not in _TOOLS)
    found = {name: importlib.import_module(f"{__name__}.{name}").PART for name in names}
    return {name: part for name, part in found.items() if isinstance(part, Part) and part.name == name}


PARTS: dict[str, Part] = _found()
