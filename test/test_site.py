"""The documentation site builds, and none of its links is broken."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.browser_tools import browser, needs_browser

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """make docs: strict, so that a broken link is an error."""
    made = tmp_path_factory.mktemp("docs") / "site"
    pytest.importorskip("material", reason="pip install '.[docs]'")
    pytest.importorskip("mkdocstrings")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(made)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "NOTEBOOKS": "false"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return made


def test_the_site_shows_the_examples_and_the_docstrings(site: Path) -> None:
    """Full examples; the reference has descriptions, not only names."""
    assert "Four commands" in (site / "index.html").read_text(encoding="utf-8")
    gallery = re.sub(r"<[^>]+>", "", (site / "gallery.html").read_text(encoding="utf-8"))
    assert "xy.simulate(60, hidden=12)" in gallery
    theory = (site / "theory.html").read_text(encoding="utf-8")
    assert theory.count('display="block"') >= 8 and "$" not in re.sub(r"<[^>]+>", "", theory.partition("<article")[2].partition("</article>")[0])
    reference = (site / "api.html").read_text(encoding="utf-8")
    assert "H1 with coherence and sigma of every line" in reference and "Biometrika" in reference


@needs_browser
def test_the_site_is_searched_from_a_folder_without_a_network(site: Path) -> None:
    """Opened as a file: the search works, the picture of the packages is shown, and there is no request to another host."""
    asked: list[str] = []
    with browser() as chromium:
        page = chromium.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.goto((site / "architecture.html").as_uri())
        assert page.evaluate("[...document.images].every(image => image.naturalWidth > 0)") and page.locator("img[src$='packages.svg']").count() == 1
        page.locator("input.md-search__input").click()
        page.keyboard.type("coherence")
        page.locator(".md-search-result__item").first.wait_for(timeout=60_000)
    assert asked and all(url.startswith(("file:", "data:", "blob:")) for url in asked), asked
