"""xy-sysid validate: a model on data that it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from xy_sysid.cli import options as o


def validate(
    rec: o.Rec,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model file written by fit --model")],
    json: o.Json = False,
) -> None:
    """Check a model on data that it has not seen."""
