"""The reader of each kind of file: a new kind is one module and one row of ``FORMATS``."""

from __future__ import annotations

import importlib
import re
from dataclasses import dataclass
from pathlib import Path

from xy_sysid.bags.opening import regular_file
from xy_sysid.errors import BadRecording
from xy_sysid.imports import guarded
from xy_sysid.imports.leaves import sheet_of_leaves
from xy_sysid.imports.limits import COPY, fits
from xy_sysid.imports.sheet import Sheet

TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm", ".prn", ".log")
HEAD = 65536  # first bytes, which distinguish text formats
COPIES = 2  # bytes in memory for each byte of a text file
BAGS = ("", ".db3", ".mcap")


@dataclass(frozen=True, slots=True)
class Format:
    """One kind of file.

    kind:    its name in listings
    endings: in lower case; begins: pattern of the first bytes, for kinds that share an ending
    module:  of this package, with ``sheet(path)``; otherwise library: a file of ``libraries``, run in a separate process
    extra:   of this package, installs the library
    """

    kind: str
    endings: tuple[str, ...]
    begins: str = ""
    module: str = ""
    library: str = ""
    extra: str = ""


FORMATS = (  # the first that fits is used
    Format("twincat", TEXT, r"(?s)Name\t.*\nSampleTime\[ms\]", module="twincat"),
    Format("codesys", TEXT, r"\[key\]\s*;\s*\[value\]", module="codesys"),
    Format("mitsubishi", TEXT, r"(?s).*\bSampling time interval\(\w+\)", module="mitsubishi"),
    Format("klipper", TEXT, r"#\s*time,accel_x", module="klipper"),
    Format("response", TEXT, r"(?i)\W*(axis\W+)?(freq[a-z]*|omega|f|w)(_hz|_rad_s)?\b[^\n]*\b(phase|imag|arg|psd)", module="response_file"),
    Format("csv", TEXT, module="csv"),
    Format("json", (".json", ".jsonl", ".ndjson"), module="json_log"),
    Format("npz", (".npz",), module="arrays"),
    Format("mat", (".mat",), r"MATLAB 7\.3|\x89HDF", library="mat73", extra="mat73"),
    Format("mat", (".mat",), library="mat"),
    Format("mf4", (".mf4", ".mdf"), library="mf4", extra="mf4"),
    Format("tdms", (".tdms",), library="tdms", extra="tdms"),
    Format("ulog", (".ulg", ".ulog"), library="ulog", extra="ulog"),
    Format("wpilog", (".wpilog",), library="wpilog", extra="wpilog"),
    Format("parquet", (".parquet",), library="parquet", extra="parquet"),
)
BAG = Format("bag", BAGS)
TABLES = tuple(dict.fromkeys(ending for one in FORMATS for ending in one.endings))
KINDS = f"a rosbag2 folder, .db3, .mcap, {', '.join(ending for ending in TABLES if ending not in TEXT[1:])}"


def format_of(path: Path) -> Format:
    """The kind of a file; raises BadRecording for an unknown kind or an empty file, OSError for a missing one."""
    suffix = "" if path.is_dir() else path.suffix.lower()
    path.stat()
    if suffix in BAGS:
        return BAG
    if suffix not in TABLES:
        raise BadRecording(path, f"a file of kind {path.suffix!r}, which is not a recording", f"Give {KINDS}.")
    regular_file(path)
    if path.stat().st_size == 0:
        raise BadRecording(path, "the file is empty (0 bytes)", COPY)
    head = _head(path)
    return next(one for one in FORMATS if suffix in one.endings and re.match(one.begins, head))


def _head(path: Path) -> str:
    """The first characters, one for each byte (for UTF-16 one for each two)."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    return head.removeprefix(b"\xef\xbb\xbf").replace(b"\0", b"").removeprefix(b"\xff\xfe").decode("latin-1")


def sheet_of(path: Path, kind: Format) -> Sheet:
    """The columns of a file. Raises BadRecording, or MissingExtra if its library is not installed."""
    if kind.library:
        return sheet_of_leaves(path, guarded.leaves(path, kind.library, kind.extra))
    if kind.endings == TEXT:
        fits(path, float(COPIES * path.stat().st_size), "as numbers")
    found: Sheet = importlib.import_module(f"xy_sysid.imports.{kind.module}").sheet(path)
    return found
