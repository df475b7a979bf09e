"""Effects from outside: a Python file given by path, or a package's entry point of the group ``xy_sysid.effects``.

A file defines ``EFFECT`` (or ``EFFECTS``, a sequence); an entry point names one. docs/your-own-effect.md walks through it.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import entry_points
from pathlib import Path

from xy_sysid.axis_model import STANDARD, Library
from xy_sysid.effects import Effect
from xy_sysid.errors import BadInput

GROUP = "xy_sysid.effects"


def library(files: Iterable[Path] = ()) -> Library:
    """The standard effects, those of installed packages, and those of the files; raises BadInput for what is not an effect."""
    added = [effect for point in entry_points(group=GROUP) for effect in _effects(point.load(), f"entry point {point.name}")]
    added += [effect for file in files for effect in from_file(file)]
    return STANDARD.extended(added) if added else STANDARD


def from_file(path: Path) -> list[Effect]:
    """The effects that a Python file defines. The file is run: give only files that you trust. Raises BadInput."""
    if path.suffix != ".py" or not path.is_file():
        raise BadInput("effect file", str(path), "a .py file that is there", "Check the path; see docs/your-own-effect.md.")
    name = f"xy_sysid_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BadInput("effect file", str(path), "a Python module", "See docs/your-own-effect.md.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # its text is part of the compiled loop's name
    try:
        spec.loader.exec_module(module)
    except (ImportError, SyntaxError, NameError, TypeError, ValueError, AttributeError) as problem:
        raise BadInput("effect file", str(path), "a module that can be run", f"{type(problem).__name__}: {problem}") from problem
    return _effects(getattr(module, "EFFECTS", getattr(module, "EFFECT", None)), str(path))


def _effects(found: object, where: str) -> list[Effect]:
    items = list(found) if isinstance(found, Sequence) else [found]
    effects = [item for item in items if isinstance(item, Effect)]
    if not effects or len(effects) != len(items):
        raise BadInput(f"effects of {where}", type(found).__name__, "EFFECT = Effect(...) or a sequence of them", "See docs/your-own-effect.md.")
    return effects
