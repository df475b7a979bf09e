"""The study of one axis as JSON."""

from __future__ import annotations

from typing import Any

from xy_sysid.paper.pair import study_remarks
from xy_sysid.paper.study import AxisStudy
from xy_sysid.report.fits_document import fits_document


def document(one: AxisStudy) -> dict[str, Any]:
    """One axis of the JSON document."""
    change: dict[str, Any] | None = None
    if one.change is not None:
        moved = {shift.name: {"value": shift.value, "ci95": [shift.low, shift.high], "unit": "Hz"} for shift in one.change.shifts}
        change = {"before": one.change.before_name, "after": one.change.after_name, "shift": moved, "problem": one.change.problem}
    return fits_document(one, study_remarks(one), change)
