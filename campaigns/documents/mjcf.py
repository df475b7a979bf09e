"""The table of docs/use.md: each effect of the library, and its loss in MJCF.

    python -m campaigns.documents.mjcf      prints the table

Each effect is exported alone with typical values; the table contains the words of the export.
"""

from __future__ import annotations

import sys

from xy_sysid.axis.model import STANDARD, AxisModel
from xy_sysid.control_design.mjcf import mjcf
from xy_sysid.errors import BadInput

RATE = 2000.0  # Hz
BASE = AxisModel(0.097, 1.29e-3, 246.0)  # m/s/V, s, rad/s: a table
NOTHING = "nothing"


def lost(name: str) -> str:
    """The loss of an effect in an export, in its own words; ``NOTHING``, or why there is no export."""
    try:
        made = mjcf(BASE.with_effect(name), RATE)
    except BadInput as refused:
        return f"everything: it cannot be exported, because it is {refused.value}"
    found = [why for effect, why in made.lost if effect == name]
    return "; ".join(found) or NOTHING


def table() -> str:
    """Markdown, every effect of the library in its order."""
    rows = [f"| {effect.name} | {lost(effect.name)} |" for effect in STANDARD.acting]
    return "\n".join(("| effect | what MJCF loses |", "|---|---|", *rows))


if __name__ == "__main__":
    sys.stdout.write(table() + "\n")
