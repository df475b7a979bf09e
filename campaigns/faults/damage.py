"""Recordings and models with changed, cut, repeated and swapped bytes: the result is right, or a note reports the damage, or an error."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found, judged
from xy_sysid.bags import BagWriter
from xy_sysid.imports import load, save
from xy_sysid.samples.recording import Recording

WORDS = (
    "Some bytes of a recording are changed, cut off, filled with zeros, repeated or swapped, at random. Then the file is read and compared with "
    "the original, sample by sample."
)
ROWS = 2000
Damage = Callable[[bytes, np.random.Generator], bytes]


def truth(rows: int = ROWS) -> Recording:
    """Two axes at 2 kHz; all numbers are different."""
    random = np.random.default_rng(7)
    seq = np.arange(rows)
    return Recording(
        sampling_rate=2000.0,
        axes=("x", "y"),
        seq=seq,
        time=seq / 2000.0,
        voltage=random.normal(size=(rows, 2)),
        position=1e-3 * np.cumsum(random.normal(size=(rows, 2)), axis=0),
    )


def _stretch(data: bytes, random: np.random.Generator) -> bytes:
    size = int(random.choice([1, 1, 1, 4, 64, 5000]))
    place = int(random.integers(0, max(1, len(data) - size)))
    return data[:place] + random.bytes(size) + data[place + size :]


def _bit(data: bytes, random: np.random.Generator) -> bytes:
    place = int(random.integers(0, len(data)))
    return data[:place] + bytes([data[place] ^ (1 << int(random.integers(0, 8)))]) + data[place + 1 :]


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    return data[: int(random.integers(0, len(data)))]


def _zeros(data: bytes, random: np.random.Generator) -> bytes:
    size = int(random.choice([16, 512, 4096]))
    place = int(random.integers(0, max(1, len(data) - size)))
    return data[:place] + bytes(size) + data[place + size :]


def _twice(data: bytes, random: np.random.Generator) -> bytes:
    size = int(random.choice([8, 512, 4096]))
    place = int(random.integers(0, max(1, len(data) - size)))
    return data[:place] + data[place : place + size] + data[place:]


def _gone(data: bytes, random: np.random.Generator) -> bytes:
    size = int(random.choice([1, 8, 512, 4096]))
    place = int(random.integers(0, max(1, len(data) - size)))
    return data[:place] + data[place + size :]


def _swapped(data: bytes, random: np.random.Generator) -> bytes:
    size = int(random.choice([8, 512, 4096]))
    a, b = sorted(int(place) for place in random.integers(0, max(1, len(data) - 2 * size), size=2))
    b = max(b, a + size)
    return data[:a] + data[b : b + size] + data[a + size : b] + data[a : a + size] + data[b + size :]


DAMAGES: tuple[Damage, ...] = (_stretch, _bit, _bit, _cut, _zeros, _twice, _gone, _swapped)


def compared(found: Recording, true: Recording, summed: bool) -> Found:
    """Comparison of a read recording with the true one."""
    if not len(found) or not set(found.axes) <= set(true.axes):
        return Found("silent" if summed and not found.notes else "no sum" if not found.notes else "part-and-said")
    columns = [true.axes.index(axis) for axis in found.axes]
    inside = np.isin(found.seq, true.seq)
    rows = np.searchsorted(true.seq, found.seq[inside])
    same = (
        bool(inside.all())
        and np.array_equal(found.voltage[inside], true.voltage[rows][:, columns])
        and np.array_equal(found.position[inside], true.position[rows][:, columns])
        and (found.input_unit, found.output_unit) == (true.input_unit, true.output_unit)
        and abs(found.sampling_rate / true.sampling_rate - 1) < 1e-4
    )
    whole = len(found) == len(true) and found.axes == true.axes
    if same and whole:
        return Found("full")
    warned = any("some values may differ" in note or "may be wrong" in note for note in found.notes)
    if found.notes and (same or warned or not summed):
        return Found("part-and-said")
    if not summed and (not same or np.array_equal(found.seq, true.seq[: len(found)])):  # or cut between two rows
        return Found("no sum")
    return Found("silent", note=f"{len(found)} samples of {len(true)}, {'the same' if same else 'other numbers'}, notes {found.notes}")


def damaged(whole: bytes, number: int, seed: int) -> bytes:
    """The file of one try."""
    random = np.random.default_rng((seed, number))
    return DAMAGES[number % len(DAMAGES)](whole, random)


def in_file(made: Callable[[Path], tuple[Path, Path]], summed: bool, seed: int) -> Callable[[int, Path], Iterator[Found]]:
    """Tries on one file of a recording. made: writes it to a folder and returns (path to load, file to damage)."""

    def run(tries: int, folder: Path) -> Iterator[Found]:
        place, file = made(folder)
        whole, true = file.read_bytes(), load(place)
        for number in range(tries):
            file.write_bytes(damaged(whole, number, seed))
            yield judged(lambda: compared(load(place), true, summed), f"seed {seed}, try {number}")

    return run


def _bag(ending: str, sums: bool = False) -> Callable[[Path], tuple[Path, Path]]:
    def made(folder: Path) -> tuple[Path, Path]:
        path = folder / "bag"
        if ending == ".mcap":
            with BagWriter(path, "mcap") as writer:
                _write(writer)
        else:
            save(truth(), path)
        if ending == ".db3" and not sums:
            _without_sums(path)
        (file,) = path.glob(f"*{ending}")
        return path, file

    return made


def _write(writer: BagWriter) -> None:
    from xy_sysid.imports import blocks

    for number, (voltage, position) in enumerate(blocks(truth())):
        now = int(voltage.time[-1] * 1e9)
        writer.write_block("/xy/voltage", voltage, now)
        writer.write_block("/xy/position", position, now)
        if number % 10 == 9:
            writer.flush()


def _without_sums(path: Path) -> None:
    """Remove the checksums, as in a bag of another recorder."""
    told = json.loads((path / "metadata.yaml").read_text("utf-8"))
    told["rosbag2_bagfile_information"]["custom_data"] = None
    (path / "metadata.yaml").write_text(json.dumps(told), "utf-8")


def _table(ending: str) -> Callable[[Path], tuple[Path, Path]]:
    def made(folder: Path) -> tuple[Path, Path]:
        path = folder / f"rec{ending}"
        save(truth(), path)
        return path, path

    return made


def _packed_mat(folder: Path) -> tuple[Path, Path]:
    import scipy.io

    path, true = folder / "rec.mat", truth()
    scipy.io.savemat(path, {"t": true.time, "u": true.voltage, "y": true.position}, do_compression=True)
    return path, path


def _metadata(folder: Path) -> tuple[Path, Path]:
    save(truth(), folder / "bag")
    return folder / "bag", folder / "bag" / "metadata.yaml"


def models(tries: int, folder: Path) -> Iterator[Found]:
    """A saved model with changed bytes: an error, or the saved model."""
    from xy_sysid.files.models import load_model
    from xy_sysid.files.seal import sealed

    path, text = folder / "m.yaml", _model_text(folder)
    assert text.startswith(sealed("")[:10])
    path.write_text(text, encoding="utf-8")
    true = repr(load_model(path))
    whole = path.read_bytes()

    def look() -> Found:
        return Found("full") if repr(load_model(path)) == true else Found("silent", note="another model")

    for number in range(tries):
        path.write_bytes(damaged(whole, number, 31))
        yield judged(look, f"seed 31, try {number}")


def _model_text(folder: Path) -> str:
    from campaigns.faults.attack import command

    recording = rigid(folder / "rigid.npz")
    said = command("fit", recording, "--set", "numerator_order=0", "--set", "denominator_order=2", "--model", folder / "made.yaml")
    assert said.code == 0, said.err
    return (folder / "made.yaml").read_text(encoding="utf-8")


def rigid(path: Path, rows: int = 12_000) -> Path:
    """A recording of a rigid axis: 1 mm/s/V, a pole at 100 rad/s, held noise, 1 kHz."""
    from scipy.signal import lfilter

    random = np.random.default_rng(1)
    u = random.normal(size=rows)
    turn = 0.1
    decay = np.exp(-turn)
    y = lfilter(1e-5 * np.array([0.0, turn - 1 + decay, 1 - decay - turn * decay]), np.array([1.0, -1 - decay, decay]), u)
    np.savez(path, t=np.arange(rows) / 1000.0, u=u, y=y + 1e-7 * random.normal(size=rows))
    return path


def states(tries: int, folder: Path) -> Iterator[Found]:
    """The identifier's saved state with changed bytes: an error, or the saved state."""
    from xy_sysid.files.state import load_state, save_state

    path = folder / "state.npz"
    true: dict[str, Any] = {"a": np.arange(500.0), "b": np.random.default_rng(3).normal(size=(40, 20)), "name": np.array(["x", "y"])}
    save_state(path, true)
    whole = path.read_bytes()

    def look() -> Found:
        found = load_state(path)
        same = set(found) == set(true) and all(np.array_equal(found[name], true[name]) for name in true)
        return Found("full") if same else Found("silent", note="another state")

    for number in range(tries):
        path.write_bytes(damaged(whole, number, 37))
        yield judged(look, f"seed 37, try {number}")


ATTACKS = (
    Attack("rosbag2, sqlite3 of others (no sums)", in_file(_bag(".db3"), False, 11), 1500, 60),
    Attack("rosbag2, sqlite3 as written here (sums)", in_file(_bag(".db3", sums=True), True, 12), 1500, 60, "no other number"),
    Attack("rosbag2, MCAP", in_file(_bag(".mcap"), True, 13), 1500, 60, "no other number"),
    Attack("metadata.yaml", in_file(_metadata, True, 14), 800, 40, "no other number"),
    Attack("NPZ", in_file(_table(".npz"), True, 15), 1500, 60, "no other number"),
    Attack("CSV", in_file(_table(".csv"), False, 16), 800, 24),
    Attack("MAT, not compressed", in_file(_table(".mat"), False, 17), 160, 2),
    Attack("MAT, compressed", in_file(_packed_mat, True, 18), 160, 2, "no other number"),
    Attack("saved model", models, 600, 60, "the same model"),
    Attack("the identifier's saved state", states, 600, 60, "the same numbers"),
)
