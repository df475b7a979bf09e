"""The examples as notebooks with their outputs: run in a kernel, shown by the site offline, and downloaded as .ipynb.

Each paragraph of a script is a cell; ``write_html`` of a picture is left out, so that the picture is the output of its cell.
"""

from __future__ import annotations

import ast
import json
import re
import tempfile
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any

SHOWN = re.compile(r"\.write_html\([^)]*\)")
PLOT = "application/vnd.plotly.v1+json"
PATIENCE = 600  # s for a cell; the first simulation compiles the laws


def cells(source: str) -> tuple[str, list[str]]:
    """(docstring, code of each cell) of a script: statements without an empty line between them are one cell,
    which ends with its picture."""
    tree = ast.parse(source)
    lines = source.splitlines()
    found: list[list[str]] = []
    last = -1
    for node in tree.body[1:]:
        start = min(node.lineno, *(item.lineno for item in getattr(node, "decorator_list", [])), node.lineno) - 1
        while start > 0 and lines[start - 1].startswith("#"):
            start -= 1
        assert node.end_lineno is not None
        if found and not any(not line.strip() for line in lines[last:start]) and not SHOWN.search("\n".join(found[-1])):
            found[-1] += lines[start : node.end_lineno]
        else:
            found.append(lines[start : node.end_lineno])
        last = node.end_lineno
    return ast.get_docstring(tree) or "", [SHOWN.sub("", "\n".join(cell)) for cell in found]


def executed(script: Path, files: Mapping[str, str] | None = None) -> Any:
    """The notebook of a script with its outputs, run in an empty folder with these files. Raises nbclient's error if a cell fails."""
    from nbclient import NotebookClient
    from nbformat import v4

    make: Any = v4  # it has no types
    said, code = cells(script.read_text(encoding="utf-8"))
    notebook = make.new_notebook()
    hidden = (
        "import os, sys, plotly.io\nsys.argv = ['notebook']\nplotly.io.renderers.default = 'plotly_mimetype'\n"
        "for name in ('FORCE_COLOR', 'CLICOLOR_FORCE', 'TTY_COMPATIBLE'): os.environ.pop(name, None)\n"  # the kernel sets them: bars would be printed
    )
    for k, text in enumerate(code):
        notebook.cells.append(make.new_code_cell((hidden if k == 0 else "") + text))
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (files or {}).items():
            (Path(folder) / name).write_text(content, encoding="utf-8")
        where = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources=where, extra_arguments=["--log-level=ERROR"]).execute()
    notebook.cells[0].source = notebook.cells[0].source.removeprefix(hidden)
    notebook.cells.insert(0, make.new_markdown_cell(said))
    for cell in notebook.cells:
        cell.metadata.clear()
    return notebook


def markdown(notebook: Any, name: str) -> str:
    """The notebook as part of a page: code, printed output, and figures drawn by the site's own copy of plotly.js."""
    return "\n".join(_parts(notebook, name))


def _parts(notebook: Any, name: str) -> Iterator[str]:
    drawn = 0
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            continue
        yield f"```python\n{cell.source}\n```\n"
        for output in cell.outputs:
            data = output.get("data", {})
            if PLOT in data:
                drawn += 1
                figure = json.dumps({"data": data[PLOT]["data"], "layout": data[PLOT]["layout"]}).replace("</", "<\\/")
                here = f"{name}-{drawn}"
                yield f'<div id="{here}" class="plot"></div>\n<script>Plotly.newPlot("{here}", {figure})</script>\n'
            else:
                text = output.get("text") or data.get("text/plain", "")
                yield f'<pre class="output"><code>{escape(text)}</code></pre>\n' if text else ""
