"""Users' own effects: a Python file given by path, or a package's entry point of the group ``xy_sysid.effects``.

A file defines ``EFFECT`` (or ``EFFECTS``, a sequence); an entry point names one. docs/your-own-effect.md walks through it.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import entry_points
from pathlib import Path

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.effects import Effect
from xy_sysid.errors import BadInput
from xy_sysid.files.blame import blamed, run_from
from xy_sysid.jit import TextLoader

GROUP = "xy_sysid.effects"


def library(files: Iterable[Path | str] | Path | str = ()) -> Library:
    """The standard effects, those of installed packages, and those of the files; raises BadInput for an object that is not an effect.

    The files are run: give only those that you trust.
    """
    paths = (files,) if isinstance(files, (str, Path)) else files
    added = [effect for point in entry_points(group=GROUP) for effect in _effects(point.load(), f"entry point {point.name}")]
    added += [effect for file in paths for effect in from_file(Path(file))]
    return STANDARD.extended(added) if added else STANDARD


def from_file(path: Path) -> list[Effect]:
    """The effects that a Python file defines. The file is run: give only files that you trust. Raises BadInput."""
    if path.suffix != ".py" or not path.is_file():
        raise BadInput("effect file", str(path), "a .py file that is there", "Check the path; see docs/your-own-effect.md.")
    run_from(path)
    with blamed(path):
        text = importlib.util.decode_source(path.read_bytes())
        total = hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()
        name = f"xy_sysid_user_{total[:16]}"  # named by its text alone: cached compiled code imports this module, even if the file was moved
        loader = TextLoader(text, str(path), {"__file__": str(path)})  # run exactly this text, even if the file changes
        spec = importlib.util.spec_from_loader(name, loader)
        assert spec is not None
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
    return _effects(getattr(module, "EFFECTS", getattr(module, "EFFECT", None)), str(path))


def _effects(found: object, where: str) -> list[Effect]:
    items = list(found) if isinstance(found, Sequence) else [found]
    effects = [item for item in items if isinstance(item, Effect)]
    if not effects or len(effects) != len(items):
        raise BadInput(f"effects of {where}", type(found).__name__, "EFFECT = Effect(...) or a sequence of them", "See docs/your-own-effect.md.")
    return effects
