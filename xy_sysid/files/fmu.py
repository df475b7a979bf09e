"""A functional mock-up unit as one file: description, sources, and a binary for this machine if a C compiler is found."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from xy_sysid.bags.atomic import whole

PLACE = "binaries/linux64"
OPTIONS = ("-shared", "-fPIC", "-O2", "-std=c99", "-ffp-contract=off", "-fvisibility=hidden")  # no fused sums: the same numbers on any processor
LONGEST = 120.0  # s for a compiler


def write_fmu(path: Path, name: str, files: Mapping[str, str]) -> str:
    """Write the archive; returns why it has no binary, or an empty text. Raises OSError if it cannot be written."""
    binary, missing = _binary(name, files)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for place, text in files.items():
            archive.writestr(zipfile.ZipInfo(place), text)
        if binary is not None:
            archive.writestr(zipfile.ZipInfo(f"{PLACE}/{name}.so"), binary)
    with whole(path) as part:
        Path(part).write_bytes(packed.getvalue())
    return missing


def _binary(name: str, files: Mapping[str, str]) -> tuple[bytes | None, str]:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None, "no C compiler was found, so it holds sources only: your tool has to compile them"
    with tempfile.TemporaryDirectory() as folder:
        for place, text in files.items():
            target = Path(folder) / place
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        made = Path(folder) / f"{name}.so"
        command = [compiler, *OPTIONS, "-o", str(made), str(Path(folder) / "sources" / f"{name}_fmu.c"), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=LONGEST)
        if done.returncode != 0:
            return (
                None,
                f"the C compiler failed ({done.stderr.strip().splitlines()[0] if done.stderr else 'no reason given'}), so it holds sources only",
            )
        return made.read_bytes(), ""
