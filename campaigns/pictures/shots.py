"""Figures to PNG, by the browser that also shows the page and the report.

Headless Chromium comes with every distribution and draws exactly what readers see; kaleido, Plotly's own tool, either brings
an old browser or needs this one.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from xy_sysid.errors import BadInput

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PAPER = "#ffffff"  # background of a picture, readable on a dark page, too
GAP = 14  # px between figures


def browser() -> str:
    """The Chromium to use: $CHROME, or the first that is installed; raises BadInput without one."""
    found = os.environ.get("CHROME") or next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise BadInput("browser", "not found", ", ".join(BROWSERS), "Install chromium, or set CHROME to its path.")
    return found


def shoot(figures: Sequence[go.Figure], path: Path, width: int, height: int) -> None:
    """Figures side by side as one PNG; width, height: of each, px."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        page.write_text(_page(figures, width, height), encoding="utf-8")
        size = f"{len(figures) * width + (len(figures) - 1) * GAP},{height}"
        options = (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--virtual-time-budget=10000",
            f"--user-data-dir={folder}/own",
        )
        subprocess.run(
            [browser(), *options, f"--window-size={size}", f"--screenshot={path.absolute()}", page.as_uri()],
            check=True,
            capture_output=True,
            timeout=120,
        )


def _page(figures: Sequence[go.Figure], width: int, height: int) -> str:
    plots = [json.loads(figure.to_json()) for figure in figures]
    for plot in plots:
        plot["layout"] |= {"width": width, "height": height, "paper_bgcolor": PAPER}
    boxes = "".join(f'<div id="p{k}"></div>' for k in range(len(plots)))
    style = f"body{{margin:0;background:{PAPER};display:flex;gap:{GAP}px}}"
    draw = "plots.forEach((p, k) => Plotly.newPlot('p' + k, p.data, p.layout, {staticPlot: true}));"
    text = json.dumps(plots).replace("<", "\\u003c")
    return (
        f'<!DOCTYPE html><meta charset="utf-8"><style>{style}</style>{boxes}<script>{get_plotlyjs()}</script>'
        f"<script>const plots = {text}; {draw}</script>"
    )
