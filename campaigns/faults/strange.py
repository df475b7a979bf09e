"""Meaningless signals, and effect files with errors: an answer that reports the problem, or one line, within seconds."""

from __future__ import annotations

import json
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from campaigns.faults.attack import Attack, Found, Said, answered, command
from campaigns.faults.damage import rigid

WORDS = (
    "Recordings of a rigid axis in which one signal is meaningless, given to frf, fit and diagnose: the result must be one line, or an answer "
    "with a note or verdict that says what is wrong, but never an effect named with confidence. Then effect files with errors in their text, laws "
    "and functions."
)
Arrays = dict[str, NDArray[np.float64]]
ROWS, CONFIDENT = 12_000, 0.9


def _stuck(a: Arrays) -> Arrays:
    y = a["y"].copy()
    y[len(y) // 2 :] = y[len(y) // 2]
    return {**a, "y": y}


def _saturated(a: Arrays) -> Arrays:
    middle, half = float(np.median(a["y"])), 0.3 * float(np.std(a["y"]))
    return {**a, "y": np.clip(a["y"], middle - half, middle + half)}


def _shuffled(a: Arrays) -> Arrays:
    return {**a, "y": np.random.default_rng(5).permutation(a["y"])}


def _other(a: Arrays) -> Arrays:
    return {**a, "u": np.random.default_rng(6).normal(size=len(a["u"]))}


def _some(count: int, value: float) -> Callable[[Arrays], Arrays]:
    def change(a: Arrays) -> Arrays:
        y = a["y"].copy()
        y[np.random.default_rng(8).integers(0, len(y), count)] = value
        return {**a, "y": y}

    return change


STRANGE: dict[str, Callable[[Arrays], Arrays]] = {
    "voltage equals position": lambda a: {**a, "u": a["y"]},
    "stuck halfway": _stuck,
    "offset of 1e9": lambda a: {**a, "y": a["y"] + 1e9},
    "offset of 1e15": lambda a: {**a, "y": a["y"] + 1e15},
    "scale of 1e-12": lambda a: {**a, "y": a["y"] * 1e-12},
    "scale of 1e-300": lambda a: {**a, "y": a["y"] * 1e-300},
    "scale of 1e150": lambda a: {**a, "y": a["y"] * 1e150},
    "saturated encoder": _saturated,
    "constant position": lambda a: {**a, "y": np.full_like(a["y"], 0.1)},
    "standing: noise of the encoder alone": lambda a: {**a, "y": 1e-7 * np.random.default_rng(4).normal(size=len(a["y"]))},
    "constant voltage": lambda a: {**a, "u": np.full_like(a["u"], 1.0)},
    "no voltage": lambda a: {**a, "u": np.zeros_like(a["u"])},
    "voltage of another day": _other,
    "position in random order": _shuffled,
    "position against time": lambda a: {**a, "y": a["y"][::-1].copy()},
    "all NaN": lambda a: {**a, "y": np.full_like(a["y"], np.nan)},
    "some NaN": _some(40, np.nan),
    "some 1e300": _some(40, 1e300),
    "infinite": _some(3, np.inf),
    "three samples": lambda a: {name: values[:3] for name, values in a.items()},
    "no samples": lambda a: {name: values[:0] for name, values in a.items()},
    "time stands": lambda a: {**a, "t": np.zeros_like(a["t"])},
    "time runs backwards": lambda a: {**a, "t": a["t"][::-1].copy()},
    "time is random": lambda a: {**a, "t": np.random.default_rng(9).uniform(0, 12, len(a["t"]))},
    "one sample an hour": lambda a: {**a, "t": a["t"] * 3.6e6},
    "negative gain": lambda a: {**a, "y": -a["y"]},
}
MEANT = ("negative gain",)  # valid for a machine with reversed wiring: a normal answer is right
QUESTIONS: tuple[tuple[str, ...], ...] = (
    ("frf",),
    ("fit", "--set", "numerator_order=0", "--set", "denominator_order=2"),
    ("compare",),
    ("diagnose",),
)
SECONDS = 30.0


def asked(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries of all commands on one recording."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        with np.load(rigid(folder / "true.npz", ROWS)) as file:
            arrays = {key: file[key] for key in file.files}
        path = folder / "rec.npz"
        changed: dict[str, Any] = STRANGE[name](arrays)
        np.savez(path, **changed)
        for words in QUESTIONS[-count:]:
            begun = _processor_time()
            said = command(words[0], path, *words[1:], "--json")
            seconds = _processor_time() - begun
            found = replace(_meant(said, name, words[0]), seconds=seconds)
            yield found if seconds < SECONDS else Found("too late", seconds, note=f"{words[0]} of {name}: {seconds:.0f} s")

    return tries


def _processor_time() -> float:
    """Processor time of the ended commands, s, independent of the load of the computer."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _meant(said: Said, name: str, question: str) -> Found:
    found = answered(said, f"{question} of {name}")
    if said.code not in (0, 1) or found.outcome == "traceback":
        return found
    answer: dict[str, Any] = json.loads(said.out)
    sure = [part for part in answer["axes"].values() if part.get("verdict") == "missing_effect" and part.get("confidence", 0) >= CONFIDENT]
    if sure and name not in MEANT:
        return Found(
            "silent", note=f"{question} of {name}: {sure[0]['effect']} with confidence {sure[0]['confidence']:.2f}, notes {answer.get('notes')}"
        )
    told = bool(answer.get("notes") or answer.get("refused")) or _verdict(answer)
    return Found(
        "full" if name in MEANT else "part-and-said" if told else "silent", note="" if told or name in MEANT else _short(said, question, name)
    )


def _short(said: Said, question: str, name: str) -> str:
    return f"{question} of {name}: {said.out[:400]}"


def _verdict(answer: dict[str, Any]) -> bool:
    """True if the answer reports a doubt about an axis: by a verdict, a quality, an empty trusted band, or words."""
    text = json.dumps(answer).lower()
    words = (
        "not_enough_data",
        "not_in_library",
        "not enough",
        "do not trust",
        "coherence",
        "doubt",
        "unreliable",
        "untrusted",
        "warn",
        "does not",
        "no band",
    )
    return any(word in text for word in words)


GOOD_EFFECT = '''
from xy_sysid.effects import Effect, Guess, Parameter, columns, law


@law
def force(coefficient, v):
    """Force against the drive at speed v, in volts of the drive."""
    return coefficient * abs(v) * v


def guesses(scene):
    v = scene.smooth(scene.velocity, 300.0)
    yield Guess(columns(abs(v) * v), lambda c: (max(float(c[0]), 1e-3),))


EFFECT = Effect(
    name="own_drag",
    law="F = coefficient |v| v",
    meaning="air",
    validity="fast motion",
    source="Worden & Tomlinson, Nonlinearity in Structural Dynamics, 2001, sec. 2.2.5",
    category="force",
    parameters=(Parameter("coefficient", "V/(m/s)2", 1e-3, 1e5, 40.0, "drive voltage that it eats"),),
    shows="error that grows faster than speed",
    look_alikes=("viscous_friction",),
    experiment="constant speeds",
    functions={"force": force},
    guesses=guesses,
)
'''
ERRORS = (
    *(
        "raise ValueError('x')",
        "raise SystemExit(3)",
        "import sys; sys.exit('bye')",
        "1 / 0",
        "def f(:",
        "{}['a']",
        "raise MemoryError",
    ),
    *(
        "open('/nonexistent')",
        "import nothing_of_that_name",
        "EFFECT = 3",
        "EFFECT = None",
        "",
        "class A(BaseException): pass\nraise A()",
        "assert False",
    ),
    *(
        "def f(): f()\nf()",
        "raise GeneratorExit",
        "import os; os.close(2); raise OSError('x')",
        "x = '\\ud800'.encode()",
        "raise StopIteration",
        "yield 1",
        "exit()",
        "quit()",
    ),
)
INSIDE = (
    ("    v = scene.smooth", "    raise ValueError('x')\n    v = scene.smooth"),
    ("    v = scene.smooth", "    raise SystemExit(2)\n    v = scene.smooth"),
    ("    v = scene.smooth", "    1 / 0\n    v = scene.smooth"),
    ("    v = scene.smooth", "    import sys; sys.exit()\n    v = scene.smooth"),
    ("    yield Guess(columns(abs(v) * v)", "    yield Guess(columns(abs(v[:5]) * v[:5])"),
    ("    yield Guess(columns(abs(v) * v)", "    yield Guess(columns(v * float('nan'))"),
    ("max(float(c[0]), 1e-3)", "float('nan')"),
    ("max(float(c[0]), 1e-3)", "-1e9"),
    ("(max(float(c[0]), 1e-3),)", "(1.0, 2.0, 3.0)"),
    ("(max(float(c[0]), 1e-3),)", "'word'"),
    ("return coefficient * abs(v) * v", "return nothing_of_that_name"),
    ("return coefficient * abs(v) * v", "return 'word'"),
    ("return coefficient * abs(v) * v", "return coefficient / 0.0"),
    ("return coefficient * abs(v) * v", "return float('nan')"),
    ("return coefficient * abs(v) * v", "return 1e300 * abs(v)"),
    ("1e-3, 1e5, 40.0", "1e5, 1e-3, 40.0"),
    ("1e-3, 1e5, 40.0", "float('nan'), 1e5, 40.0"),
    ('name="own_drag"', 'name="coulomb_friction"'),
    ('name="own_drag"', 'name="Own Drag"'),
    ('name="own_drag"', "name=3"),
    ('look_alikes=("viscous_friction",)', 'look_alikes=("nobody",)'),
    ("guesses=guesses", "guesses=3"),
)


def effect_files(tries: int, folder: Path) -> Iterator[Found]:
    """Errors of an effect file during loading."""
    file = folder / "own.py"
    cases = [*ERRORS] + [f"{GOOD_EFFECT}\n{text}" for text in ERRORS]
    for text in cases[:: max(1, len(cases) // tries)]:
        file.write_text(text, encoding="utf-8", errors="replace")
        if "os.close(2)" in text:
            continue
        said = command("effects", "--effect-file", file)
        what = f"effect file of {text[-60:]!r}"
        if said.code == 0 and text.endswith("EFFECT = None\n"):
            yield Found("silent", note=what)
            continue
        found = answered(said, what)
        named = said.code != 2 or str(file) in said.err
        yield found if named else Found("not told", note=f"{what}: {said.err[:200]}")


def effect_functions(tries: int, folder: Path) -> Iterator[Found]:
    """Errors of its laws and guesses during a fit."""
    rec, file = rigid(folder / "rec.npz", 6000), folder / "own.py"
    for before, after in INSIDE[:tries]:
        assert before in GOOD_EFFECT
        file.write_text(GOOD_EFFECT.replace(before, after))
        begun = time.monotonic()
        said = command("refine", rec, "--effect-file", file, "--add", "own_drag", "--json")
        found = answered(said, f"{after!r}")
        if said.code == 0 and "NaN" in said.out:
            found = Found("silent", note=f"{after!r}: NaN in the answer")
        yield replace(found, seconds=time.monotonic() - begun)


ATTACKS = (
    *(
        Attack(
            name,
            asked(name),
            3,
            1 if name in ("stuck halfway", "voltage equals position", "offset of 1e9") else 0,
            f"{SECONDS:.0f} s of processor time",
        )
        for name in STRANGE
    ),
    Attack("effect files with errors", effect_files, 60, 8),
    Attack("effects whose functions fail", effect_functions, len(INSIDE), 0),
)
