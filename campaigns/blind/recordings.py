"""Recordings of cases, and the visibility of effects in them; kept in a folder for the next campaign."""

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
    """Contributions to the motion: rms of the change in velocity over its rms.

    change: effect of the truth -> change without it; noise: of the encoder; dirt: of the dirt, on the axis without the truth
    kinds:  kinds of dirt
    """

    change: dict[str, float]
    noise: float
    dirt: float
    kinds: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Recorded:
    """Recording of a case: rate (Hz), voltage (n,), V, position (n,), m."""

    rate: float
    voltage: FloatArray
    position: FloatArray
    seen: Seen


def recorded(case: Case, folder: Path | None = None) -> Recorded:
    """The recording of a case, from the folder if it is there; otherwise it is simulated and stored there."""
    path = folder / file_name(case) if folder else None
    if path is not None and path.exists():
        try:
            return _read(path)
        except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):  # file of a killed run
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
    """A name from the case and its machine, but not from the machine's laws: empty the folder when they change."""
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
