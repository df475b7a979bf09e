"""What the site adds to the pages as they are in the repository: README is its first page, and examples are run and shown with their outputs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import nbformat
import plotly.offline
from latex2mathml.converter import convert as latex
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # campaigns is not installed

from campaigns.documents.notebooks import executed  # noqa: E402
from campaigns.documents.notebooks import markdown as as_markdown  # noqa: E402

ELSEWHERE = ("emps",)  # examples that need data which are not here
PLOTLY = '<script src="assets/javascripts/plotly.min.js"></script>\n\n'


def on_files(files: Files, config: Any) -> Files:
    """README as index.md, with links as seen from docs/; pages outside docs/ are named and not linked."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").replace("](docs/", "](")
    outside = r"\[([^]]+)\]\((config/[^)]+|CHANGELOG\.md|CONTRIBUTING\.md|CITATION\.cff)\)"
    files.append(File.generated(config, "index.md", content=re.sub(outside, r"\1", text)))
    return files


def on_page_markdown(markdown: str, page: Any, files: Files, config: Any, **_: Any) -> str:
    """A script of the gallery below its link, as a notebook with its outputs where it runs alone; links out of docs/ become plain words.

    Equations of the theory become MathML, which browsers draw by themselves; in a span, or one that begins a line would begin a paragraph.
    """
    if page.file.src_uri == "gallery.md":
        return PLOTLY + re.sub(r"^\[.*?\]\(examples/(\w+)\.py\).*$", lambda found: _shown(found, files, config), markdown, flags=re.MULTILINE)
    if page.file.src_uri == "theory.md":
        markdown = re.sub(r"\$\$(.+?)\$\$", lambda found: latex(found.group(1), display="block"), markdown, flags=re.DOTALL)
        markdown = re.sub(r"\$([^$\n]+)\$", lambda found: f"<span>{latex(found.group(1))}</span>", markdown)
    return re.sub(r"\[([^]]+)\]\(\.\./[^)]+\)", r"\1", markdown)


def on_post_build(config: Any) -> None:
    """The copy of plotly.js that draws the pictures of the gallery."""
    target = Path(config.site_dir) / "assets" / "javascripts" / "plotly.min.js"
    target.write_text(plotly.offline.get_plotlyjs(), encoding="utf-8")


def _shown(found: re.Match[str], files: Files, config: Any) -> str:
    name = found.group(1)
    script = ROOT / "docs" / "examples" / f"{name}.py"
    if not config.extra["notebooks"] or name in ELSEWHERE:
        return f"{found.group()}\n\n```python\n{script.read_text(encoding='utf-8')}```\n"
    own = (ROOT / "docs" / "your-own-effect.md").read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    notebook = executed(script, {"mains_hum.py": own})
    files.append(File.generated(config, f"examples/{name}.ipynb", content=nbformat.writes(notebook)))
    link = files.get_file_from_path(f"examples/{name}.ipynb")
    assert link is not None
    link.copy_file()
    return f"{found.group()}, or the [notebook](examples/{name}.ipynb) with its outputs\n\n{as_markdown(notebook, name)}"
