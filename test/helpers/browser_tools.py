"""A real browser and a real page server in tests.

Import from a test module that starts with ``pytestmark = needs_browser``.
"""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from helpers.busy import PATIENCE
from helpers.cli_tools import bare

CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
needs_browser = pytest.mark.skipif(
    CHROMIUM is None or importlib.util.find_spec("playwright") is None, reason="no Chromium (Debian: apt-get install chromium) or no playwright"
)
ARGUMENTS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


OVER_EACH_OTHER = """() => {
    const shown = element => {
        for (let one = element; one && one.nodeType === 1; one = one.parentElement) {
            const style = getComputedStyle(one);
            if (style.visibility === "hidden" || style.display === "none" || Number(style.opacity) === 0) return false;
        }
        return true;
    };
    const leaves = [...document.querySelectorAll("main *")].filter(e => !e.closest("svg") && e.textContent.trim() && !e.children.length);
    const drawn = [...document.querySelectorAll("main .js-plotly-plot svg text")].filter(e => e.textContent.trim());
    const seen = e => {  // without what a scrolled box around it cuts off
        const {left, right, top, bottom} = e.getBoundingClientRect();
        const box = {left, right, top, bottom};
        for (let one = e.parentElement; one; one = one.parentElement) if (/auto|scroll/.test(getComputedStyle(one).overflowY)) {
            const around = one.getBoundingClientRect();
            box.top = Math.max(box.top, around.top);
            box.bottom = Math.min(box.bottom, around.bottom);
        }
        return {...box, width: right - left, height: box.bottom - box.top};
    };
    const words = [...leaves, ...drawn].map(e => ({box: seen(e), said: e.textContent.trim().slice(0, 60), e}))
        .filter(word => word.box.width > 1 && word.box.height > 1 && shown(word.e));
    const found = [];
    for (let i = 0; i < words.length; i++) for (let k = i + 1; k < words.length; k++) {
        const a = words[i].box, b = words[k].box;
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left), high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        const least = Math.min(a.width * a.height, b.width * b.height);
        if (wide > 0 && high > 0 && wide * high > 0.15 * least) found.push(words[i].said + " / " + words[k].said);
    }
    return found;
}"""


class Server:
    """``xy-sysid page`` as a process; ``first`` is its first line of output, ``address`` the same if it is an address."""

    def __init__(self, folder: Path, *arguments: object, **environment: str) -> None:
        self.log = folder / f"page{time.monotonic_ns()}.log"
        words = [sys.executable, "-m", "xy_sysid", "page", *map(str, arguments), "--port", "0", "--no-browse", "--folder", str(folder)]
        self.begun = time.monotonic()
        with self.log.open("wb") as err:
            self.process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=err, text=True, env=bare(**environment))
        assert self.process.stdout is not None
        self.first = self.process.stdout.readline().strip()
        self.address = self.first if self.first.startswith("http") else ""
        assert self.first, self.said()

    def said(self) -> str:
        """Its output on stderr."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    def children(self) -> list[int]:
        """Its child processes: one for each recording, and Python's helper."""
        return [int(word) for word in Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()]

    def end(self) -> int:
        """Ctrl-C; the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(PATIENCE * 15)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait(5)


@contextmanager
def browser() -> Iterator[Any]:
    """A browser with a profile of its own."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        made = play.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        try:
            yield made
        finally:
            made.close()


class Tab:
    """One tab on the page, with what went wrong in it."""

    def __init__(self, made: Any, address: str, width: int = 1400, mode: str = "light") -> None:
        self.context = made.new_context(viewport={"width": width, "height": 900}, color_scheme=mode)
        self.context.set_default_timeout(PATIENCE * 30_000)
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.asked: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)

    def until(self, done: Callable[[], object], seconds: float = 20.0, why: str | Callable[[], str] = "") -> None:
        """Let the browser work until ``done``; it may take PATIENCE times the seconds."""
        from playwright.sync_api import Error

        def seen() -> bool:
            try:
                return bool(done())
            except Error as error:  # the page is being reloaded, as it does by itself after a lost connection
                if "context was destroyed" not in str(error):
                    raise
                return False

        end = time.monotonic() + PATIENCE * seconds
        while not seen():
            what = why() if callable(why) else why
            assert time.monotonic() < end, f"{what or 'waited in vain'}: {self.headline()!r}, {self.verdict()!r}; messages: {self.notices()}"
            self.page.wait_for_timeout(50)

    def verdict(self) -> str:
        """The sentence of the first story."""
        found = self.page.locator("[data-part=verdict]")
        return str(found.first.text_content()) if found.count() else ""

    def headline(self) -> str:
        """The headline of the first story."""
        found = self.page.locator("[data-part=headline]")
        return str(found.first.text_content()) if found.count() else ""

    def said(self) -> tuple[str, str] | None:
        """Headline and sentence of the first story at one moment; None without a story, for example during a reload."""
        script = """() => ["headline", "verdict"].map(part => document.querySelector(`[data-part=${part}]`)?.textContent ?? null)"""
        headline, sentence = self.page.evaluate(script)
        return None if headline is None or sentence is None else (str(headline), str(sentence))

    def fact(self, label: str) -> str:
        """The text of a number."""
        found = self.page.locator(f".fact[aria-label='{label}'] .value")
        return str(found.first.text_content()) if found.count() else ""

    def filled(self) -> list[str]:
        """Words of the visible filled buttons; STOP is always filled and not counted."""
        return [text.strip() for text in self.page.locator("main .q-btn--unelevated:visible:not(.q-btn-group *)").all_text_contents()]

    def failing(self, by: str) -> str:
        """Words in the first figure, by frequency, speed, position or time."""
        plot = self.page.locator(f".js-plotly-plot[aria-label^='Error over the noise floor by {by}']")
        return " ".join(plot.locator(".annotation-text").all_text_contents()) if plot.count() else ""

    def over_floor(self) -> float:
        """Largest error over the noise floor by frequency in the first figure; 0 before it is drawn."""
        (found,) = self.curves("Error over the noise floor by frequency", "this model")
        return max(found, default=0.0)

    def notices(self) -> str:
        """All visible messages and warnings."""
        return " | ".join(text for text in self.page.locator(".notice:visible").all_text_contents())

    def curves(self, label: str, *names: str) -> list[list[float]]:
        """y of named curves of the plot with this start of its description, all at one moment; empty lists before it is drawn."""
        script = """([label, names]) => {
            const plot = [...document.querySelectorAll(".js-plotly-plot")].find(p => (p.getAttribute("aria-label") || "").startsWith(label));
            return names.map(name => {
                const trace = plot && plot._fullData && plot._fullData.find(t => t.name === name);
                return trace ? Array.from(trace.y, Number) : [];
            });
        }"""
        return [[float(value) for value in row] for row in self.page.evaluate(script, [label, list(names)])]

    def ladder(self) -> list[float]:
        """Held-out error of each step over the noise floor there."""
        held, floor = self.curves("The error ladder", "held-out error", "noise floor")
        return [a / b for a, b in zip(held[::2], floor[::2], strict=True)]

    @contextmanager
    def unheard(self) -> Iterator[None]:
        """Context in which typed text does not reach the server, as with a broken connection."""
        self.page.evaluate("() => { socket.kept = socket.emit; socket.emit = (what, ...rest) => what === 'event' ? 0 : socket.kept(what, ...rest); }")
        yield
        self.page.evaluate("() => { socket.emit = socket.kept; }")

    def press(self, act: str) -> None:
        """Press a button, named by its action."""
        self.page.locator(f"[data-act={act}]").first.click()

    def press_until(self, act: str, done: Callable[[], object], seconds: float = 20.0, why: str = "") -> None:
        """Press a button, named by its action, until ``done``; see ``click_until``."""
        self.click_until(self.page.locator(f"[data-act={act}]").first, done, seconds, why)

    def click_until(self, what: Any, done: Callable[[], object], seconds: float = 20.0, why: str = "") -> None:
        """Click, and let the browser work until ``done``; repeat after 20 s, because a reload after a stall loses a click."""
        from playwright.sync_api import TimeoutError as Late

        clicked: list[float] = []

        def tried() -> bool:
            if done():
                return True
            if not clicked or time.monotonic() > clicked[-1] + 20.0:
                with contextlib.suppress(Late):  # it is being reloaded, or busy
                    what.click(timeout=PATIENCE * 5000)
                    clicked.append(time.monotonic())
            return False

        self.until(tried, seconds, why)

    def places(self) -> dict[str, tuple[float, float]]:
        """Left and top of each visible card, px from the corner of the page."""
        script = """() => Object.fromEntries([...document.querySelectorAll("main .card")].filter(card => card.offsetParent).map((card, k) => {
            const box = card.getBoundingClientRect();
            return [card.getAttribute("aria-label") || card.className, [box.left + scrollX, box.top + scrollY]];
        }))"""
        return {name: (float(left), float(top)) for name, (left, top) in self.page.evaluate(script).items()}

    def over_each_other(self) -> list[str]:
        """Pairs of visible words, on the page and in its figures, that overlap."""
        return [str(pair) for pair in self.page.evaluate(OVER_EACH_OTHER)]

    def wide(self) -> int:
        """Width of the content, px."""
        return int(self.page.evaluate("document.documentElement.scrollWidth"))

    def close(self) -> None:
        """Close the tab."""
        self.context.close()
