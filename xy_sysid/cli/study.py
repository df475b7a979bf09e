"""xy-sysid study: the paper's figures and tables of any recording, as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, people


def study(
    rec: o.Rec,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="the page to write")] = Path("study.html"),
    json: o.Json = False,
) -> None:
    """The paper's study (figures 2-7, tables 1-2) of any recording, as one HTML page that opens offline."""
    if json:
        emit({"recording": str(rec), "page": str(out)})
    else:
        people.print(f"no page written to {out} yet")
