"""The measured frequency response as the page shows it, computed in the worker's process."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xy_sysid.fitting.of_run import fit
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.registry import format_of, sheet_of
from xy_sysid.imports.response_file import responses
from xy_sysid.report.plots import bode


def fitted_responses(path: Path, load: Mapping[str, Any]) -> dict[str, dict[str, Any]] | None:
    """Figure and words of the fit of each response in a file; None for a file of samples. Raises BadInput and BadRecording. Takes seconds."""
    kind, reading = format_of(path), Reading(**load)
    if not reading.a_response(kind.kind == "response"):
        return None
    found = {}
    for name, response in responses(path, sheet_of(path, kind), reading).items():
        model = fit(response)
        said = [f"{'ok  ' if verdict.ok else 'WARN'} {verdict.sentence}" for verdict in model.verdicts]
        words = "\n".join((str(model), "", *said, "", *response.origin.notes))
        found[name] = {"figure": bode(response, model).to_plotly_json(), "words": words}
    return found
