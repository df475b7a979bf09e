"""numba's njit with types: compiled to machine code at first use, and kept on disk for the next process.

Also from text: a loop that is written from laws becomes a function through Python's own import machinery, under a name that
carries the check sum of every text that has a part in it, so that a changed law is never run stale.
"""

from __future__ import annotations

import hashlib
import importlib.abc
import importlib.util
import inspect
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from types import CodeType, ModuleType
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core import event

P = ParamSpec("P")
Q = TypeVar("Q")
R = TypeVar("R")


_COMPILING: Any = cast("Callable[[], Any]", event.TimingListener)()
cast("Callable[..., None]", event.register)("numba:compile", _COMPILING)


def spent_compiling() -> float:
    """s that this process has spent making machine code: once on a machine, and no part of any task. From the disk it comes at once."""
    return float(_COMPILING.duration) if _COMPILING.done else 0.0


def tell_compiling(begins: Callable[[], None], ends: Callable[[], None] = lambda: None) -> None:
    """Call these when this process begins to make machine code and when it has made it; the disk then keeps it for all others.

    Functions that are compiled for another one are a part of it, and not told. Neither is called if the disk has all that is needed.
    """
    deep = 0

    def on_start(_listener: object, _happening: object) -> None:
        nonlocal deep
        deep += 1
        if deep == 1:
            begins()

    def on_end(_listener: object, _happening: object) -> None:
        nonlocal deep
        deep -= 1
        if deep == 0:
            ends()

    listener = type("Told", (event.Listener,), {"on_start": on_start, "on_end": on_end})
    cast("Callable[..., None]", event.register)("numba:compile", listener())


REORDERED = frozenset({"contract", "reassoc", "arcp", "nsz"})


def compiled(function: Callable[P, R], exact: bool = True) -> Callable[P, R]:
    """The same function, compiled. Results repeat bit for bit on one machine: strict IEEE arithmetic, or, if not exact, sums and
    products in an order that the compiler chooses, up to twice as fast (infinities and what is not a number stay what they are).
    Other threads go on meanwhile."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True, fastmath=False if exact else set(REORDERED))(function))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, compiled, exact, and written into each compiled one that calls it: for what takes less time than a call."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True, forceinline=True)(function))


def cores() -> int:
    """How many threads may calculate at once: those that this process may use, or the environment's NUMBA_NUM_THREADS."""
    return int(vars(numba.config)["NUMBA_NUM_THREADS"])  # its module of settings declares none of them


def on_all_cores(work: Callable[[Q], R], items: Iterable[Q]) -> list[R]:
    """What the work makes of each, several at a time: for work in compiled code, which leaves the interpreter to others."""
    if cores() == 1:
        return list(map(work, items))
    with ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(work, items))


class TextLoader(importlib.abc.InspectLoader):
    """A module whose source is a text in memory and whose names are given; file: where numba's cache is to be kept beside."""

    def __init__(self, source: str, file: str, names: Mapping[str, object]) -> None:
        self.source, self.file, self.names = source, file, names

    def get_source(self, fullname: str) -> str:
        return self.source

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.source, self.file)  # numba's cache asks for a file that is there

    def exec_module(self, module: ModuleType) -> None:
        module.__dict__.update(self.names)
        super().exec_module(module)


def module_text(item: object) -> str:
    """Source of the module that a function is from, and of a text its name, for which compiled code asks; of what was typed in, its own."""
    module = inspect.getmodule(item)
    loader = getattr(module, "__loader__", None)
    if module is not None and isinstance(loader, TextLoader):
        return f"# {module.__name__}\n{loader.source}"
    return inspect.getsource(module or cast("Callable[..., Any]", item))


def compiled_text(text: Callable[[str], str], names: Mapping[str, object], parts: Iterable[str], exact: bool = True) -> Callable[..., Any]:
    """The function that ``text(name)`` defines; compiling happens at its first call, or never if the disk has it.

    names: what the text may call; parts: every other text on which its code depends; exact: see ``compiled``. numba keeps the code
    beside the file in which ``text`` is written, and finds it again by that file's module.
    """
    total = hashlib.sha256(text("loop").encode())
    for part in (*sorted(set(parts)), "" if exact else repr(sorted(REORDERED))):
        total.update(part.encode())
    name = f"run_{total.hexdigest()[:16]}"
    loader = TextLoader(text(name), inspect.getfile(text), {**names, "__name__": text.__module__})
    spec = importlib.util.spec_from_loader(f"{text.__module__}_{name}", loader)
    assert spec is not None
    made = importlib.util.module_from_spec(spec)
    loader.exec_module(made)
    function: Callable[..., Any] = made.__dict__[name]
    try:
        return compiled(function, exact)
    except RuntimeError:  # no folder that numba may write to: compile for this process only
        return cast("Callable[..., Any]", numba.njit(nogil=True, fastmath=False if exact else set(REORDERED))(function))
