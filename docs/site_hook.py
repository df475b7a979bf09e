"""What the site adds to the pages as they are in the repository: README is its first page, and examples are shown in full."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]


def on_files(files: Files, config: Any) -> Files:
    """README as index.md, with links as seen from docs/; pages outside docs/ are named and not linked."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").replace("](docs/", "](")
    outside = r"\[([^]]+)\]\((config/[^)]+|CHANGELOG\.md|CONTRIBUTING\.md|CITATION\.cff)\)"
    files.append(File.generated(config, "index.md", content=re.sub(outside, r"\1", text)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """A script of the gallery below its link; links out of docs/ become plain words."""
    if page.file.src_uri == "gallery.md":
        shown = lambda found: f"{found.group()}\n\n```python\n{(ROOT / 'docs' / found.group(1)).read_text(encoding='utf-8')}```\n"  # noqa: E731
        return re.sub(r"^\[.*?\]\((examples/\w+\.py)\).*$", shown, markdown, flags=re.MULTILINE)
    return re.sub(r"\[([^]]+)\]\(\.\./[^)]+\)", r"\1", markdown)
