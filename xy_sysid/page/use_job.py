"""The output of ``xy-sysid use`` for a model on the page: it runs the command itself, so that both have the same words."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xy_sysid.files.story_models import model_text
from xy_sysid.page.beside import asked


def used_text(documents: Mapping[str, Mapping[str, Any]], recording: Path | None, reading: tuple[str, ...], limit: float | None) -> str:
    """The numbers to paste, as the command prints them. Raises BadInput with the command's error. Takes seconds."""
    with tempfile.TemporaryDirectory() as folder:
        return _asked(Path(folder), documents, recording, (*reading, *_limit(limit)))


def used_files(documents: Mapping[str, Mapping[str, Any]], recording: Path | None, reading: tuple[str, ...], limit: float | None) -> bytes:
    """A ZIP with a folder of exports for each axis, with the numbers of ``used_text``. Raises BadInput. Takes seconds."""
    packed = io.BytesIO()
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as pack:
        for axis, document in documents.items():
            out = Path(folder) / f"axis_{len(pack.namelist())}"
            _asked(Path(folder), {axis: document}, recording, (*reading, *_limit(limit), "--to", "all", "-o", str(out)))
            for file in sorted(out.iterdir()):
                pack.write(file, f"{axis}/{file.name}")
    return packed.getvalue()


def _limit(limit: float | None) -> tuple[str, ...]:
    return () if limit is None else ("--limit", f"{limit:.9g}")


def _asked(folder: Path, documents: Mapping[str, Mapping[str, Any]], recording: Path | None, more: tuple[str, ...]) -> str:
    model = folder / "axes.yaml"
    model.write_text(model_text("page", documents), encoding="utf-8")
    on = () if recording is None else ("--on", str(recording))
    return asked(("use", str(model), *on, *more), ("model", "not to be used", "one that the data determine"))
