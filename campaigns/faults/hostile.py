"""Malicious files, and recordings with single wrong messages: an error in one line at once, or the rest is read and paired correctly."""

from __future__ import annotations

import json
import os
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found, judged
from campaigns.faults.damage import compared, truth
from xy_sysid.bags import BagWriter
from xy_sysid.errors import BadRecording
from xy_sysid.imports import blocks, limits, load, save
from xy_sysid.samples.block import Block
from xy_sysid.samples.recording import Recording

WORDS = (
    "Decompression bombs (declared and hidden sizes, with 40 MB of memory), every field of metadata.yaml with unusual values, pipes, and "
    "recordings with single wrong messages, counters or clocks. Voltage and position of a row must belong to the same sample."
)
QUICK = 2.0  # s, limit for an error
Messages = list[tuple[str, Block]]


@contextmanager
def small_memory() -> Iterator[None]:
    """Context in which at most 40 MB may be loaded."""
    before, memory = limits.SHARE, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    limits.SHARE = limits.COPIES * 40e6 / memory
    try:
        yield
    finally:
        limits.SHARE = before


def _npz(path: Path) -> Path:
    np.savez_compressed(path.with_suffix(".npz"), t=np.arange(3000.0), u=np.zeros(3000), y=np.zeros(3000), other=np.zeros(50_000_000))
    return path.with_suffix(".npz")


def _mat(path: Path) -> Path:
    import scipy.io

    scipy.io.savemat(path.with_suffix(".mat"), {"t": np.arange(3000.0), "u": np.zeros(3000), "other": np.zeros(50_000_000)}, do_compression=True)
    return path.with_suffix(".mat")


def _lying_npz(path: Path) -> Path:
    """A header of 10^12 numbers, and a directory with a small file size."""
    np.save(path.with_suffix(".npy"), np.zeros(3000))
    honest = path.with_suffix(".npy").read_bytes()
    with zipfile.ZipFile(path.with_suffix(".npz"), "w") as archive:
        for name in ("t", "y"):
            archive.writestr(f"{name}.npy", honest)
        archive.writestr("u.npy", honest.replace(b"(3000,), }          ", b"(1000000000000,), } "))
    return path.with_suffix(".npz")


def _lying_zip(path: Path) -> Path:
    """The directory gives 3 kB, the stream decompresses to 400 MB."""
    made = _npz(path)
    data = bytearray(made.read_bytes())
    at = data.rfind(b"other.npy") - 46
    assert data[at : at + 4] == b"PK\x01\x02"
    struct.pack_into("<I", data, at + 24, 3000)
    made.write_bytes(data)
    return made


def _zstd_bag(path: Path) -> Path:
    from backports import zstd

    path.mkdir()
    (path / "a.db3.zstd").write_bytes(zstd.compress(bytes(400_000_000)))
    words = "relative_file_paths: [a.db3.zstd]\n  compression_format: zstd\n  compression_mode: FILE\n"
    (path / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  {words}")
    return path


def _wide_csv(path: Path) -> Path:
    path.with_suffix(".csv").write_text(",".join(["time", "u", "y"] * 300_000) + "\n" + ",".join(["1"] * 900_000) + "\n")
    return path.with_suffix(".csv")


def _long_csv(path: Path) -> Path:
    path.with_suffix(".csv").write_text("time,u,y\n0,1,2\n" + "1" * 30_000_000)
    return path.with_suffix(".csv")


def _digits_csv(path: Path) -> Path:
    rows = "".join(f"{k / 100},{'9' * 400}e{'9' * 400},{k}\n" for k in range(500))
    path.with_suffix(".csv").write_text("time,u,y\n" + rows)
    return path.with_suffix(".csv")


def _many_arrays(path: Path) -> Path:
    with zipfile.ZipFile(path.with_suffix(".npz"), "w") as archive:
        np.save(path.with_suffix(".npy"), np.zeros(3))
        for number in range(20_000):
            archive.writestr(f"a{number}.npy", path.with_suffix(".npy").read_bytes())
    return path.with_suffix(".npz")


BOMBS: tuple[Callable[[Path], Path], ...] = (_npz, _mat, _lying_npz, _lying_zip, _zstd_bag, _wide_csv, _long_csv, _digits_csv, _many_arrays)


def bombs(tries: int, folder: Path) -> Iterator[Found]:
    """Files with a much larger decompressed size."""
    for number, made in enumerate(BOMBS[:tries]):
        path = made(folder / f"bomb{number}")

        def refuse(path: Path = path) -> Found:
            load(path)
            return Found("silent", note=f"{path.name} was read")

        with small_memory():
            found = judged(refuse, made.__name__)
        late = found.seconds > (QUICK + 3 if path.suffix in (".mat", "") else QUICK + 2)
        yield replace(found, outcome="too late", note=f"{made.__name__}: {found.seconds:.1f} s") if late else found


ODD = (
    *("2024-99-99 25:61:61", ".inf", "-.inf", ".nan", "9" * 100_000, "-" + "9" * 30, "null", "true", "[]", "{}", "[1, 2]", "''", "'\\0'"),
    *(
        "!!python/object/apply:os.system ['touch hacked']",
        "!!binary aGFjaw==",
        "[" * 100_000,
        "[" * 400 + "]" * 400,
        "*nothing",
        "1e999",
        "0x" + "f" * 500,
    ),
    *("'../../../../etc/passwd'", "/dev/zero", "'" + "a" * 100_000 + "'", "&a [*a, *a]"),
)


def metadata(tries: int, folder: Path) -> Iterator[Found]:
    """Wrong values of every field of metadata.yaml: the files next to it are read unchanged."""
    bag = folder / "bag"
    save(truth(400), bag)
    told = json.loads((bag / "metadata.yaml").read_text("utf-8"))["rosbag2_bagfile_information"]
    true = load(bag)
    pairs = [(key, value) for key in told for value in ODD]
    for number in np.random.default_rng(61).permutation(len(pairs))[:tries]:
        key, value = pairs[number]
        lines = [f"  {name}: {value if name == key else json.dumps(content)}" for name, content in told.items()]
        (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n" + "\n".join(lines) + "\n", "utf-8")
        found = judged(lambda: compared(load(bag), true, True), f"{key}: {value[:60]}", 20.0)
        late = found.outcome != "too late" and found.seconds > QUICK
        yield replace(found, outcome="too late", note=f"{key}: {value[:60]}: {found.seconds:.1f} s") if late else found
    assert not Path("hacked").exists()


def pipes(tries: int, folder: Path) -> Iterator[Found]:
    """A pipe or device instead of each kind of file."""
    for name in ("a.csv", "a.npz", "a.mat", "a.db3", "a.mcap", "a.txt")[:tries]:
        os.mkfifo(folder / name)

        def refuse(path: Path = folder / name) -> Found:
            load(path)
            return Found("silent", note=path.name)

        yield judged(refuse, name, QUICK)
    bag = folder / "bag"
    save(truth(400), bag)
    true = load(bag)
    (bag / "metadata.yaml").unlink()
    os.mkfifo(bag / "metadata.yaml")
    yield judged(lambda: compared(load(bag), true, True), "metadata.yaml", QUICK)


def messages() -> Messages:
    """2000 samples in blocks of 20."""
    return [(kind, block) for both in blocks(truth()) for kind, block in zip(("voltage", "position"), both, strict=True)]


def _seq(block: Block, random: np.random.Generator) -> Block:
    seq = block.seq.copy()
    seq[int(random.integers(0, len(seq)))] = float(random.choice([np.nan, np.inf, -np.inf, 1e300, -5.0, 0.5, 1e15, 2.0**60]))
    return replace(block, seq=seq)


def _value(block: Block, random: np.random.Generator) -> Block:
    values = block.values.copy()
    values[int(random.integers(0, 20)), int(random.integers(0, 2))] = float(random.choice([np.nan, np.inf, -np.inf, 1e300, -1e200]))
    return replace(block, values=values)


def _time(block: Block, random: np.random.Generator) -> Block:
    time = block.time.copy()
    time[int(random.integers(0, 20))] = float(random.choice([np.nan, np.inf, -np.inf, 1e300, -1e9, 0.0]))
    return replace(block, time=time)


def _axes(block: Block, random: np.random.Generator) -> Block:
    return replace(block, axes=[("x", "x"), ("y", "x"), ("a", "b"), ("", ""), ("x" * 5000, "y")][int(random.integers(0, 5))])


def _missing(block: Block, random: np.random.Generator) -> Block:
    return replace(block, axes=("x",), values=block.values[:, :1])


def _empty(block: Block, random: np.random.Generator) -> Block:
    return Block(block.axes, block.seq[:0], block.time[:0], block.values[:0])


def _all_nan(block: Block, random: np.random.Generator) -> Block:
    return replace(block, values=np.full_like(block.values, np.nan))


def _backwards(block: Block, random: np.random.Generator) -> Block:
    return Block(block.axes, block.seq[::-1], block.time[::-1], block.values[::-1])


WRONG = (_seq, _seq, _value, _value, _time, _axes, _missing, _empty, _all_nan, _backwards)


def _as_written(path: Path, true: Recording) -> Found:
    return paired(load(path), true)


def paired(found: Recording, true: Recording) -> Found:
    """Check that every read row is one sample: voltage and position of the same instant."""
    for axis in found.axes:
        if axis not in true.axes:
            return Found("part-and-said" if found.notes else "silent", note="" if found.notes else f"axis {axis}")
        column = true.axes.index(axis)
        u, y = found.axis(axis)
        order = np.argsort(true.voltage[:, column])
        rows = order[np.clip(np.searchsorted(true.voltage[order, column], u), 0, len(true) - 1)]
        if not (np.array_equal(true.voltage[rows, column], u) and np.array_equal(true.position[rows, column], y)):
            wrong = int(np.sum(true.position[rows, column] != y))
            return Found("silent", note=f"{wrong} of {len(found)} rows of {axis} are paired wrongly; notes {found.notes}")
    if len(found) == len(true) and len(found.axes) == len(true.axes):
        return Found("part-and-said" if found.notes else "full")
    return Found("part-and-said") if found.notes else Found("silent", note=f"{len(found)} of {len(true)} rows, and nothing was said")


def _loaded(folder: Path, name: str, content: Messages, storage: str, what: str) -> Found:
    path = folder / f"{name}{storage}"
    with BagWriter(path) as writer:
        for count, (kind, block) in enumerate(content):
            writer.write_block(f"/xy/{kind}", block, 1_000_000 * count)
    true = truth()
    found = judged(lambda: paired(load(path), true), what)
    path.unlink()
    return found


def wrong_messages(tries: int, folder: Path) -> Iterator[Found]:
    """One to three wrong messages among two hundred."""
    for number in range(tries):
        random = np.random.default_rng((62, number))
        content = messages()
        names = []
        for _ in range(int(random.integers(1, 4))):
            change, place = WRONG[int(random.integers(0, len(WRONG)))], int(random.integers(0, len(content)))
            content[place] = (content[place][0], change(content[place][1], random))
            names.append(f"{change.__name__} of message {place}")
        yield _loaded(folder, f"m{number}", content, (".db3", ".mcap")[number % 2], f"seed (62, {number}): {', '.join(names)}")


def slips(tries: int, folder: Path) -> Iterator[Found]:
    """The counter of one or both streams slips by up to 5 at some point, while its time continues."""
    for number in range(tries):
        random = np.random.default_rng((63, number))
        first, size = 20 * int(random.integers(2, 98)), int(random.choice([-5, -2, -1, 1, 1, 2, 5]))
        kinds = [("voltage",), ("position",), ("voltage", "position")][number % 3]
        content = [(kind, replace(b, seq=b.seq + size) if kind in kinds and b.seq[0] >= first else b) for kind, b in messages()]
        yield _said(_loaded(folder, f"s{number}", content, ".db3", f"seed (63, {number}): {kinds} by {size} at {first}"), kinds, first)


def jumps(tries: int, folder: Path) -> Iterator[Found]:
    """The clock of one or both streams jumps by 1 ms to an hour, forward or back, while the counter continues."""
    for number in range(tries):
        random = np.random.default_rng((64, number))
        first, size = 20 * int(random.integers(2, 98)), float(random.choice([-1.0, 1.0]) * 10 ** random.uniform(-3, 3.5))
        kinds = [("voltage",), ("position",), ("voltage", "position")][number % 3]
        content = [(kind, replace(b, time=b.time + size) if kind in kinds and b.seq[0] >= first else b) for kind, b in messages()]
        yield _said(_loaded(folder, f"j{number}", content, ".db3", f"seed (64, {number}): {kinds} by {size:.4g} s at {first}"), kinds, first)


def _said(found: Found, kinds: tuple[str, ...], first: int) -> Found:
    if found.outcome == "full":
        return Found("silent", found.seconds, note=f"{kinds} at {first}: nothing was said")
    return found


def compressed(tries: int, folder: Path) -> Iterator[Found]:
    """Individually compressed messages, some of them damaged: the others are read."""
    from backports import zstd
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    from xy_sysid.bags.cdr import ARRAY_TYPE, encode_array
    from xy_sysid.samples.block import columns, pack

    store = get_typestore(Stores.ROS2_JAZZY)
    for number in range(tries):
        random = np.random.default_rng((65, number))
        path = folder / f"c{number}"
        bad = set(random.integers(0, 200, size=int(random.integers(1, 6))).tolist())
        with Writer(path, version=9, storage_plugin=(StoragePlugin.SQLITE3, StoragePlugin.MCAP)[number % 2]) as writer:
            topics: Any = {kind: writer.add_connection(f"/xy/{kind}", ARRAY_TYPE, typestore=store) for kind in ("voltage", "position")}
            for count, (kind, block) in enumerate(messages()):
                packed = zstd.compress(encode_array(("sample", columns(block.axes)), (len(block), 2 + len(block.axes)), pack(block)))
                if count in bad:
                    place = int(random.integers(0, len(packed) - 4))
                    packed = [packed[:place], packed[:place] + random.bytes(4) + packed[place + 4 :], b"", random.bytes(100)][
                        int(random.integers(0, 4))
                    ]
                writer.write(topics[kind], count * 1_000_000, packed)
        text = (path / "metadata.yaml").read_text("utf-8")
        text = text.replace("compression_format: ''", "compression_format: zstd").replace("compression_mode: ''", "compression_mode: MESSAGE")
        (path / "metadata.yaml").write_text(text, "utf-8")
        true = truth()
        found = judged(partial(_as_written, path, true), f"seed (65, {number})")
        # a message that decompresses has no checksum: at most one message with wrong numbers for each damaged one
        unpacked = found.outcome == "silent" and int(found.note.partition(" of ")[0].rpartition(" ")[2]) <= 20 * len(bad)
        yield Found("no sum") if unpacked else found


def csv_ends(tries: int, folder: Path) -> Iterator[Found]:
    """A CSV truncated at any byte: only complete rows are read, with a note."""
    true, path = truth(300), folder / "a.csv"
    save(true, path)
    whole = path.read_bytes()
    true = load(path)
    for number in range(tries):
        end = int(np.random.default_rng((66, number)).integers(len(whole) // 2, len(whole) - 1))
        path.write_bytes(whole[:end])
        boundary = whole[end - 1 : end] == b"\n"  # truncation between rows cannot be detected

        def look(boundary: bool = boundary) -> Found:
            found = load(path)
            judgement = compared(found, true, True)
            return Found("full") if boundary and judgement.outcome in ("silent", "part-and-said") else judgement

        yield judged(look, f"cut at byte {end}")


def cut_models(tries: int, folder: Path) -> Iterator[Found]:
    """A model truncated anywhere, mostly inside a number: ``validate`` reports an error."""
    from campaigns.faults.attack import command
    from campaigns.faults.damage import rigid

    recording, model = rigid(folder / "rec.npz"), folder / "m.yaml"
    order = ("--set", "numerator_order=0", "--set", "denominator_order=2")
    assert command("fit", recording, *order, "--model", model).code == 0
    whole = model.read_bytes()
    for number in range(tries):
        end = int(np.random.default_rng((67, number)).integers(1, len(whole)))
        model.write_bytes(whole[:end])
        said = command("validate", recording, model, *order)
        good = said.code == 2 and said.err.count("\n") == 1 and str(model) in said.err
        yield Found("one line" if good else "silent", note="" if good else f"cut at byte {end} of {len(whole)}: code {said.code}, {said.err[:200]}")


def refused_writers(tries: int, folder: Path) -> Iterator[Found]:
    """Existing names, and files instead of folders: nothing is overwritten."""
    save(truth(100), folder / "bag")
    (folder / "file").write_text("old")
    for path in (folder / "bag", folder / "file" / "rec.npz", folder / "file" / "bag", folder / ("x" * 300))[:tries]:

        def write(path: Path = path) -> Found:
            save(truth(100), path)
            return Found("silent", note=f"{path.name} was written")

        try:
            yield judged(write, path.name)
        except BadRecording:
            yield Found("one line")


ATTACKS = (
    Attack("bombs", bombs, len(BOMBS), 3, "5 s"),
    Attack("crafted metadata.yaml", metadata, 10_000, 30, "2 s"),
    Attack("pipes", pipes, 6, 6, "2 s"),
    Attack("wrong messages", wrong_messages, 600, 24, "no wrong pair"),
    Attack("slips of the counter", slips, 240, 12, "no wrong pair"),
    Attack("jumps of the clock", jumps, 240, 12, "no wrong pair"),
    Attack("damaged compressed messages", compressed, 60, 4, "no wrong pair"),
    Attack("CSV cut at any byte", csv_ends, 300, 20, "no wrong number"),
    Attack("model cut at any byte, given to validate", cut_models, 200, 6),
    Attack("names that cannot be written to", refused_writers, 3, 3),
)
