"""Every writer on a disk that becomes full at any moment: the old file is unchanged, or there is no file, and one line names the file."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from campaigns.faults.attack import Attack, Found, Said, command, environment, judged
from campaigns.faults.damage import rigid, truth
from xy_sysid.errors import XySysidError
from xy_sysid.imports import load, save

WORDS = (
    "The size of files is limited to a random number of bytes, so a write fails in its middle, as on a full disk; with and without an existing "
    "output file. Then a disk that is really full (a small tmpfs, as root), and /dev/full as stdout."
)
RIGID = ("--set", "numerator_order=0", "--set", "denominator_order=2")
OLD = b"what was there before"
COMMANDS: dict[str, tuple[str, ...]] = {
    "fit --model": ("fit", "REC", *RIGID, "--force", "--model", "OUT"),
    "fit --mat": ("fit", "REC", *RIGID, "--mat", "OUT", "--force"),
    "frf --csv": ("frf", "REC", "--csv", "OUT", "--force"),
    "study --out": ("study", "REC", *RIGID, "--out", "OUT", "--force"),
    "refine --model": ("refine", "REC", "--add", "coulomb_friction", "--force", "--model", "OUT"),
    "refine --mat": ("refine", "REC", "--add", "coulomb_friction", "--mat", "OUT", "--force"),
    "report -o": ("report", "REC", "-o", "OUT", "--force"),
}
FRESH: dict[str, tuple[str, ...]] = {
    "simulate, a bag": ("simulate", "OUT", "--duration", "2"),
    "simulate, MCAP": ("simulate", "OUT.mcap", "--duration", "2"),
    "simulate, CSV": ("simulate", "OUT.csv", "--duration", "2"),
    "simulate, NPZ": ("simulate", "OUT.npz", "--duration", "2"),
    "simulate, MAT": ("simulate", "OUT.mat", "--duration", "2"),
    "replay --out": ("replay", "BAG", "--set", "length=1024", "--out", "OUT"),
}


@contextmanager
def full_disk(room: int) -> Iterator[None]:
    """Context in which no file can grow beyond ``room`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def _words(words: tuple[str, ...], folder: Path, out: Path) -> list[str]:
    places = {"REC": str(folder / "rec.npz"), "BAG": str(folder / "bag")}
    return [str(out) + word[3:] if word.startswith("OUT") else places.get(word, word) for word in words]


def _size(path: Path) -> int:
    return sum(item.stat().st_size for item in path.rglob("*") if item.is_file()) if path.is_dir() else path.stat().st_size


def _largest(path: Path) -> int:
    return max(item.stat().st_size for item in path.rglob("*") if item.is_file()) if path.is_dir() else path.stat().st_size


def on_a_file(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries of a command that replaces a file."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        rigid(folder / "rec.npz")
        out = folder / "out" / "made"
        out.parent.mkdir()
        said = command(*_words(COMMANDS[name], folder, out))  # once with enough disk space, so that all code is compiled before the disk is full
        assert said.code == 0, said.err
        most = out.stat().st_size
        for number in range(count):
            out.write_bytes(OLD)
            room = int(np.random.default_rng((71, number)).integers(0, most))
            with full_disk(room):
                said = command(*_words(COMMANDS[name], folder, out))
            yield _judged(said, out, [out], f"{name}, room {room}")
            if out.read_bytes() != OLD:
                yield Found("stump", note=f"{name}, room {room}: the old file is gone")

    return tries


def _judged(said: Said, out: Path, left: list[Path], what: str) -> Found:
    line = said.code == 2 and said.err.count("\n") == 1 and said.err.startswith("xy-sysid: ") and str(out) in said.err
    if sorted(out.parent.iterdir()) != left:
        return Found("stump", note=f"{what}: {sorted(out.parent.iterdir())}")
    return Found("one line" if line else "not told", note="" if line else f"{what}: code {said.code}, {said.err[:300]!r}")


def on_nothing(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries of a command that makes a new file."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        save(truth(8000), folder / "bag")
        words = _words(FRESH[name], folder, folder / "out" / "made")
        out = Path(next(word for word in words if word.startswith(str(folder / "out"))))
        out.parent.mkdir()
        said = command(*words)
        assert said.code == 0, said.err
        most = _largest(out)
        for number in range(count):
            _gone(out)
            room = int(np.random.default_rng((72, number)).integers(0, most))
            with full_disk(room):
                said = command(*words)
            yield _judged(said, out, [], f"{name}, room {room}")

    return tries


def _gone(path: Path) -> None:
    import shutil

    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def library(tries: int, folder: Path) -> Iterator[Found]:
    """``save`` of recordings, models and the identifier's state, called from Python."""
    from xy_sysid.files.state import save_state

    state = {"a": np.random.default_rng(3).normal(size=2000)}
    for number in range(tries):
        random = np.random.default_rng((73, number))
        ending = (".npz", ".mat", ".csv", ".state")[number % 4]
        path = folder / f"made{ending}"
        path.write_bytes(OLD)

        def write(path: Path = path, ending: str = ending) -> Found:
            if ending == ".state":
                save_state(path, state)
            else:
                save(truth(1000), path)
            return Found("silent", note="it was written")

        with full_disk(int(random.integers(0, 15_000))):
            found = judged(write, f"seed (73, {number}), {ending}")
        if path.read_bytes() != OLD or list(folder.iterdir()) != [path]:
            found = Found("stump", note=f"seed (73, {number}), {ending}: {list(folder.iterdir())}")
        path.unlink()
        yield found


def real_disk(tries: int, folder: Path) -> Iterator[Found]:
    """A partly used tmpfs of 200 kB: simulate and fit write there until it is full."""
    place = folder / "small"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(place)], capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        yield Found("skipped", note=f"no tmpfs can be mounted here: {mounted.stderr.strip()}")
        return
    try:
        rigid(folder / "rec.npz")
        for number in range(tries):
            taken = int(np.random.default_rng((74, number)).integers(60, 180)) * 1000
            (place / "taken").write_bytes(bytes(taken))
            out = place / ("made" + ("", ".mcap", ".csv", ".npz", ".mat")[number % 5])
            said = command("simulate", out, "--duration", "2")
            line = said.code == 2 and said.err.count("\n") == 1 and str(out) in said.err
            left = sorted(item.name for item in place.iterdir())
            whole = left == ["taken"] and (place / "taken").stat().st_size == taken
            yield Found(
                "one line" if line and whole else "stump", note="" if line and whole else f"{out.name}: code {said.code}, {said.err!r}, {left}"
            )
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)


def full_stdout(tries: int, folder: Path) -> Iterator[Found]:
    """Standard output is full: exit code 2, and one line on stderr if possible, after the notes on the recording."""
    rigid(folder / "rec.npz")
    rec = str(folder / "rec.npz")
    for words in (("frf", rec), ("fit", rec, *RIGID, "--json"), ("effects", "--json"), ("columns", rec), ("--help",))[:tries]:
        with open("/dev/full", "wb") as full:
            done = subprocess.run(
                [sys.executable, "-m", "xy_sysid", *words], stdout=full, stderr=subprocess.PIPE, env=environment(), check=False, timeout=120
            )
        last = done.stderr.splitlines()[-1:]
        good = done.returncode == 2 and b"Traceback" not in done.stderr and b"No space left" in b"".join(last)
        yield Found("one line" if good else "not told", note="" if good else f"{words}: {done.returncode}, {done.stderr[-200:]!r}")


def _has_what_was_flushed(path: Path, flushed: int) -> Found:
    return Found("full" if len(load(path)) >= flushed else "silent")


def recorder(tries: int, folder: Path) -> Iterator[Found]:
    """The recorder's bag while the disk becomes full: all flushed data are a complete bag."""
    from xy_sysid.bags import BagWriter
    from xy_sysid.imports import blocks

    content = blocks(truth(8000))
    for number in range(tries):
        path = folder / f"bag{number}"
        storage, room = ("sqlite3", "mcap")[number % 2], int(np.random.default_rng((75, number)).integers(60_000, 400_000))
        writer, flushed, full = BagWriter(path, "sqlite3" if storage == "sqlite3" else "mcap"), 0, False
        try:
            with full_disk(room):
                for count, (voltage, position) in enumerate(content):
                    writer.write_block("/xy/voltage", voltage, count * 10_000_000)
                    writer.write_block("/xy/position", position, count * 10_000_000)
                    if count % 10 == 9:
                        writer.flush()
                        flushed = 20 * (count + 1)
        except (OSError, XySysidError):
            full = True
        if not full:
            yield Found("silent", note=f"seed (75, {number}): it never became full")
            continue
        found = judged(partial(_has_what_was_flushed, path, flushed), "x")
        good = found.outcome == "full" or (found.outcome == "one line" and not flushed)
        yield Found("part-and-said" if good else "stump", note="" if good else f"seed (75, {number}): {storage}, {flushed} flushed: {found}")


ATTACKS = (
    *(Attack(name, on_a_file(name), 2 if name.startswith(("study", "report", "refine")) else 5, int(name == "fit --model")) for name in COMMANDS),
    *(Attack(name, on_nothing(name), 5, int(name in ("simulate, a bag", "replay --out"))) for name in FRESH),
    Attack("recordings and state, from Python", library, 80, 8),
    Attack("a real full disk", real_disk, 10, 2),
    Attack("a full stdout", full_stdout, 5, 0),
    Attack("the recorder's disk becomes full", recorder, 30, 4, "what was flushed is there"),
)
