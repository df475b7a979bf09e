"""Recordings of cases, and what can be seen in them; kept in a folder, so that another campaign need not simulate them again."""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from campaigns.blind.cases import Case
from campaigns.blind.dirt import change, moved
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Seen:
    """How much of the motion is due to what: rms of the change in velocity over its rms.

    change: effect of the truth -> by taking it away; noise: by the encoder; dirt: by the dirt, on the axis without the truth
    kinds:  of the dirt
    """

    change: dict[str, float]
    noise: float
    dirt: float
    kinds: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Recorded:
    """One case, driven: rate (Hz), voltage (n,), V, position (n,), m."""

    rate: float
    voltage: FloatArray
    position: FloatArray
    seen: Seen


def recorded(case: Case, folder: Path | None = None) -> Recorded:
    """Drive it, or take it from the folder, where it is put if it was not there."""
    path = folder / file_name(case) if folder else None
    if path is not None and path.exists():
        try:
            return _read(path)
        except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):  # of a run that was killed
            path.unlink()
    found = _simulated(case)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        with part.open("wb") as file:
            np.savez_compressed(file, rate=found.rate, voltage=found.voltage, position=found.position, seen=json.dumps(asdict(found.seen)))
        part.replace(path)
    return found


def file_name(case: Case) -> str:
    """By the case and its machine; what the laws of the machine do is not in it: empty the folder when they change."""
    key = hashlib.sha256(repr((case, case.exact().spec)).encode()).hexdigest()[:12]
    return f"{re.sub('[^a-z0-9]+', '_', f'{case.draws} {case.name}'.lower())}_{key}.npz"


def _read(path: Path) -> Recorded:
    with np.load(path) as file:
        seen = json.loads(str(file["seen"]))
        return Recorded(float(file["rate"]), file["voltage"], file["position"], Seen(**seen | {"kinds": tuple(seen["kinds"])}))


def _simulated(case: Case) -> Recorded:
    machine, recording = case.record()
    voltage, position = recording.axis("x")
    rate = recording.sampling_rate
    exact = moved(machine, voltage)
    gone = {name: change(exact, moved(machine.with_parts({part: False}), voltage), rate) for name, part in zip(case.truth, case.parts, strict=True)}
    reached = case.dirt_reached
    return Recorded(rate, voltage, position, Seen(gone, change(exact, position, rate), reached, case.kinds))
