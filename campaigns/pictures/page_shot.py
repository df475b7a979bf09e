"""The page on a recording, driven by clicks, as one PNG."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from campaigns.pictures.examples import SECONDS
from campaigns.pictures.shots import browser

WIDTH, HEIGHT = 1360, 1000  # px
EFFECTS = ("x:cogging", "x:coulomb_friction")
PATIENCE = 300_000  # ms


def shoot_page(path: Path) -> None:
    """A machine with cogging and friction: diagnosed, and brought to the floor by Auto. Raises what the browser raises."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as name:
        recording = Path(name) / "rec.npz"
        effects = [word for effect in EFFECTS for word in ("--effect", effect)]
        simulate = ["simulate", str(recording), "--machine", "rigid.yaml", *effects, "--duration", f"{SECONDS:g}"]
        subprocess.run([sys.executable, "-m", "xy_sysid", *simulate], check=True, stdout=subprocess.DEVNULL)
        with _served(Path(name), recording) as address, sync_playwright() as play:
            made = play.chromium.launch(executable_path=browser(), args=["--no-sandbox", "--disable-gpu"])
            page = made.new_page(viewport={"width": WIDTH, "height": HEIGHT})
            page.goto(address, timeout=PATIENCE)
            for act, words in (("diagnose", "Missing"), ("auto", "at the noise floor")):
                _press(page, act)
                page.wait_for_function(
                    "words => document.querySelector('[data-part=verdict]')?.textContent.includes(words)", arg=words, timeout=PATIENCE
                )
            page.wait_for_timeout(1500)  # until the last figure is drawn
            page.screenshot(path=path)
            made.close()


def _press(page: Any, act: str) -> None:
    page.wait_for_function("act => document.querySelector(`[data-act=${act}]:not([disabled])`)", arg=act, timeout=PATIENCE)
    page.locator(f"[data-act={act}]").first.click()


@contextmanager
def _served(folder: Path, recording: Path) -> Iterator[str]:
    words = [sys.executable, "-m", "xy_sysid", "page", str(recording), "--port", "0", "--no-browse", "--folder", str(folder)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)
