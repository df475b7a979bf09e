"""The documentation site builds, and none of its links is broken."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_the_site_builds_without_a_warning_and_shows_the_docstrings(tmp_path: Path) -> None:
    """make docs: strict, so that a dead link is an error; examples in full; the reference has meaning, not only names."""
    pytest.importorskip("material", reason="pip install '.[docs]'")
    pytest.importorskip("mkdocstrings")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "site"
    assert "Four commands" in (site / "index.html").read_text(encoding="utf-8")
    gallery = re.sub(r"<[^>]+>", "", (site / "gallery.html").read_text(encoding="utf-8"))
    assert "xy.simulate(60, hidden=12)" in gallery
    reference = (site / "api.html").read_text(encoding="utf-8")
    assert "H1 with coherence and sigma of every line" in reference and "Biometrika" in reference
