"""Origin of an answer: versions, command, and a fingerprint of the data."""

from __future__ import annotations

import platform
import sys
from typing import Any

from xy_sysid.samples.recording import Recording


def fingerprint(recording: Recording, axis: str) -> str:
    """SHA-256 of an axis's samples in the longest run without a gap; empty if there is none."""
    return recording.run(axis).digest if len(recording) else ""


def provenance(source: str, recording: Recording) -> dict[str, Any]:
    """Plain values for a model file or report."""
    return {
        **provenance_of_response(source),
        "samples": len(recording),
        "sampling_rate_hz": float(recording.sampling_rate),
        "units": {"input": recording.input_unit, "output": recording.output_unit},
        "measured": recording.measured,
        "data_sha256": {axis: fingerprint(recording, axis) for axis in recording.axes},
        "notes": list(recording.notes),
    }


def provenance_of_response(source: str) -> dict[str, Any]:
    """Provenance of a file without samples."""
    from importlib.metadata import PackageNotFoundError, version

    versions = {"python": platform.python_version()}
    for name in ("xy_sysid", "numpy", "scipy", "numba"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "from source"
    return {"source": _printable(source), "command": _printable(" ".join(["xy-sysid", *sys.argv[1:]])), "versions": versions}


def _printable(text: str) -> str:
    """The text with invalid bytes of a file name replaced."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
