"""The page on recordings in a real browser: figures, diagnosis, effects by clicks, reload, two tabs, access."""

from __future__ import annotations

import functools
import json
import os
import signal
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.cli_tools import cli

pytestmark = needs_browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings: dry friction that the rigid model lacks, and a table without missing effects."""
    made = tmp_path_factory.mktemp("recordings")
    said = cli("simulate", made / "dry.npz", "--machine", "rigid.yaml", "--effect", "coulomb_friction", "--duration", "12")
    assert said.code == 0, said.err
    assert cli("simulate", made / "plain.npz", "--machine", "rigid.yaml", "--duration", "8").code == 0
    with np.load(made / "plain.npz") as kept:
        voltage, position = (np.asarray(kept[name], dtype=np.float64)[:, 0] for name in ("u", "y"))
    rows = np.column_stack((np.arange(voltage.size) / 2000.0, voltage, 1e3 * position))
    np.savetxt(made / "export.csv", rows, "%.9g", ",", header="A,B,C", comments="")
    return made


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[Server]:
    made = Server(folder, folder / "dry.npz")
    yield made
    made.end()
    assert "Traceback" not in made.said(), made.said()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as made:
        yield made


@pytest.fixture(scope="module")
def usual(chromium: Any, server: Server) -> Iterator[Tab]:
    """A tab shared by most tests, because loading takes longer than most of them."""
    made = Tab(chromium, server.address)
    yield made
    made.close()


@pytest.fixture
def tab(chromium: Any, server: Server) -> Iterator[Callable[..., Tab]]:
    """Open a separate tab."""
    made: list[Tab] = []

    def open_tab(width: int = 1400, mode: str = "light", address: str = "") -> Tab:
        made.append(Tab(chromium, address or server.address, width, mode))
        return made[-1]

    yield open_tab
    for one in made:
        one.close()


def turn(one: Tab, axis: str) -> None:
    """Select another axis, and wait until it is shown."""
    one.page.get_by_role("button", name=f"axis {axis}").click()
    one.until(lambda: one.page.locator(f".plot[aria-label^='The error ladder of axis {axis}']").count() == 1)


LEAVE_AT_ONCE = """async () => {
    document.querySelector("[data-act=diagnose]").click();
    const leave = document.querySelector("[data-act=cancel]");
    for (let k = 0; k < 400 && getComputedStyle(leave).visibility !== "visible"; k++) await new Promise(done => setTimeout(done, 10));
    leave.click();
}"""


def ready(one: Tab) -> Tab:
    one.until(lambda: one.ladder() and one.page.locator("[data-act=diagnose]").is_enabled(), 40, "the rigid base was not fitted")
    return one


def test_everything_is_drawn_and_nothing_is_fetched_from_elsewhere(usual: Tab, server: Server) -> None:
    """Each figure has curves and a description; no request goes to another server, and no error is in the console."""
    one = ready(usual)
    one.until(lambda: one.curves("Measured and modelled over frequency, bode", "model")[0])
    for name in ("bode", "coherence", "residual speed", "zoom", "poles zeros"):
        one.until(one.page.locator(f".js-plotly-plot[aria-label*=', {name}, axis x'] .main-svg").count, 10, name)
    assert any("fails" in text or "times the floor" in text for text in one.page.locator(".annotation-text").all_text_contents())
    assert one.errors == [] and all(url.startswith((server.address, "data:", "blob:")) for url in one.asked), one.asked
    assert "12 s at 2000 Hz" in str(one.page.locator(".panel").first.text_content())


@pytest.mark.parametrize(("width", "mode"), [(400, "dark"), (1400, "light")])
def test_it_fits_a_phone_and_follows_light_and_dark(tab: Callable[..., Tab], width: int, mode: str) -> None:
    """No horizontal scrolling; colours follow the system; every button and figure has a name for screen readers."""
    one = ready(tab(width, mode))
    assert one.wide() <= width
    shade = one.page.evaluate("getComputedStyle(document.body).backgroundColor")
    bright = sum(int(part) for part in shade.strip("rgba()").split(",")[:3]) / 3
    assert bright < 60 if mode == "dark" else bright > 200
    nameless = "all => all.filter(e => e.offsetParent && !(e.textContent.trim() || e.getAttribute('aria-label') || e.labels?.length)).length"
    assert one.page.eval_on_selector_all("button, [role=img], select", nameless) == 0
    assert one.page.evaluate("document.documentElement.lang") == "en-US"
    one.page.keyboard.press("Tab")
    assert one.page.evaluate("document.activeElement.textContent") == "to the pictures"


def test_the_first_picture_shows_the_failure_and_one_button_is_next(usual: Tab) -> None:
    """Visible at 1400 x 900: where the model fails, the error ladder, the missing effect, and Diagnose as the only filled button."""
    one = ready(usual)
    one.page.set_viewport_size({"width": 1400, "height": 900})
    one.until(lambda: "fails" in one.failing("frequency"))
    picture, ladder = (one.page.locator(f".js-plotly-plot[aria-label^='{words}']").bounding_box() for words in (FAILS, "The error ladder"))
    assert picture["y"] + picture["height"] < 600 and ladder["y"] + ladder["height"] < 900 and ladder["x"] > picture["x"] + 300
    assert one.headline().startswith("Something is missing: ") and one.filled() == ["Diagnose"]
    assert one.fact("worst place").endswith("by frequency") and one.page.locator(".fact.unsure[aria-label=gain]").count() == 1


def explained(one: Tab, steps: int) -> bool:
    """Headline, ladder, first figure and tiles show it at the same time."""
    told = one.headline().startswith("Explained: ") and one.fact("worst place").startswith("nowhere")
    return told and len(one.ladder()) == steps and one.over_floor() < 2


def failing(one: Tab, steps: int) -> bool:
    """The same for a model that fails."""
    told = one.headline().startswith("Something is missing: ") and one.fact("worst place").endswith("by frequency")
    return told and len(one.ladder()) == steps and one.over_floor() > 20


FAILS = "Error over the noise floor by frequency"


RESPONSE = ("Measured and modelled over frequency, bode", "measured, 95 % band", "model with coulomb friction")


def drawn(seen: Tab) -> bool:
    """Whether the response and that of the model with friction are there."""
    return all(len(curve) > 3 for curve in seen.curves(*RESPONSE))


def test_the_whole_page_follows_the_story_from_failing_to_explained(usual: Tab, tab: Callable[..., Tab]) -> None:
    """Diagnose names it, Add explains it: headline, response, tiles, residual and ladder change together, also in a second tab.

    Remove, Auto and Start over update everything, and the rigid model is one click away.
    """
    one, other = ready(usual), ready(tab())
    worst = one.over_floor()
    gain = one.fact("gain")
    assert one.ladder()[0] > 5 and worst > 20
    one.press_until("diagnose", lambda: "Missing: coulomb friction" in one.verdict() and one.filled() == ["Add coulomb friction"], 60)
    assert one.headline().startswith("Something is missing: ")
    one.press_until("named", functools.partial(explained, one, 2), 60, "not explained")
    for seen in (one, other):
        seen.until(functools.partial(explained, seen, 2), 60, "not explained")
        assert seen.ladder()[1] < 1.2 and "at the noise floor" in seen.verdict() and "missing" not in (seen.headline() + seen.verdict()).lower()
        assert seen.fact("gain") != gain and seen.page.locator(".fact.unsure").count() == 0
        seen.until(functools.partial(drawn, seen), 20, "the model with friction is not drawn")
        measured, model = seen.curves(*RESPONSE)
        assert abs(measured[3] - model[3]) < 0.5
    assert one.filled() == ["Download the model"] and "coulomb friction" in str(one.page.locator(".math").first.text_content())
    one.page.get_by_role("button", name="rigid, with delay").click()
    one.until(lambda: one.over_floor() > 20 and one.fact("gain") == gain)
    one.click_until(one.page.locator("[data-remove=coulomb_friction]").first, functools.partial(failing, one, 3), 60, "stale after Remove")
    for seen in (one, other):
        seen.until(functools.partial(failing, seen, 3), 60, "stale after Remove")
        assert seen.fact("gain") == gain
    one.press_until("auto", lambda: explained(one, 4) and one.filled() == ["Download the model"], 60, "stale after Auto")
    one.page.reload()
    one.until(lambda: explained(one, 4), 30, "stale after a reload")
    with one.page.expect_download() as taken:
        one.press("keep")
    model = yaml.safe_load(Path(taken.value.path()).read_text(encoding="utf-8"))
    assert set(model["axes"]) == {"x", "y"} and model["axes"]["x"]["effects"] == ["coulomb_friction"]
    one.press_until("reset", lambda: failing(one, 1) and one.filled() == ["Diagnose"], 30, "stale after Start over")
    assert one.fact("gain") == gain
    for kind, head in (("SVG", "<svg"), ("CSV", "noise floor: ")):
        with one.page.expect_download() as taken:
            one.page.locator(f"[aria-label='save ladder as {kind}']").click()
        assert head in Path(taken.value.path()).read_text(encoding="utf-8")[:200]
    assert one.errors == [] == other.errors


def test_a_reload_in_the_middle_loses_nothing_and_a_fit_can_be_left(usual: Tab) -> None:
    """The work continues without the browser; Cancel keeps the previous story."""
    one = ready(usual)
    busy, free = one.page.locator("[data-act=cancel]"), one.page.locator("[data-act=diagnose]")
    turn(one, "y")
    one.until(free.is_enabled)
    for _ in range(6):  # a short fit may end before the click
        one.page.evaluate(LEAVE_AT_ONCE)
        one.until(free.is_enabled, 60)
        one.page.wait_for_timeout(1000)  # the notice comes with the next push
        if "Left as it was" in one.notices():
            break
    assert "Left as it was" in one.notices() and len(one.ladder()) == 1
    one.press("diagnose")
    one.page.reload()
    one.until(lambda: one.page.locator(".plot[aria-label^='The error ladder of axis y']").count() == 1, 30, "another axis after a reload")
    one.until(lambda: busy.is_visible() or "coulomb" in one.verdict(), 10)
    one.until(lambda: "Missing: coulomb friction" in one.verdict() and free.is_enabled(), 60)


def test_wrong_use_is_answered_in_a_sentence(usual: Tab) -> None:
    """No effect chosen to add: the page gives the allowed ones."""
    one = ready(usual)
    one.press_until("add", lambda: "effect: name is ''" in one.notices() and "coulomb_friction" in one.notices(), 10)


def test_recordings_stand_side_by_side_and_a_lost_one_says_so(usual: Tab, server: Server) -> None:
    """Opened from the list of the folder; if its process ends, the page says that it is closed, and the other continues."""
    one = ready(usual)
    before = set(server.children())
    chosen = one.page.get_by_role("combobox", name="recording")
    one.click_until(one.page.get_by_role("button", name="Open a recording"), chosen.is_visible)
    chosen.click()
    one.page.get_by_role("option", name="plain.npz").click()
    one.page.get_by_role("button", name="Open", exact=True).click()
    second = one.page.locator(".panel").nth(1)
    one.until(lambda: one.page.locator(".panel").count() == 2 and "8 s at 2000 Hz" in str(second.text_content()), 30)
    first, last = (one.page.locator(".panel").nth(k).bounding_box() for k in (0, 1))
    assert abs(first["y"] - last["y"]) < 2 and last["x"] > first["x"] + 300
    one.until(lambda: second.locator("[data-act=diagnose]").is_enabled(), 30)
    (worker,) = set(server.children()) - before
    os.kill(worker, signal.SIGKILL)
    one.until(lambda: "Closed: its process has ended" in str(second.text_content()) and "plain.npz is closed" in one.notices(), 10)
    assert one.page.locator("[data-act=diagnose]").first.is_enabled()
    one.click_until(second.get_by_role("button", name="close recording"), lambda: one.page.locator(".panel").count() == 1)


def test_a_link_opens_the_same_view_and_a_reload_keeps_it(usual: Tab, tab: Callable[..., Tab], server: Server) -> None:
    """Recording, axis, model, figure, theme and added effects are in the address; a missing recording is reported."""
    one = ready(usual)
    wanted = "rec=dry.npz&axis=y&model=rigid&pictures=residual_position&effects=y:coulomb_friction&rec=plain.npz&theme=dark&units=um"
    link = f"{server.address}?{wanted}&rec=nowhere.npz"
    other = tab(address=link)
    other.until(lambda: "recording is 'nowhere.npz'" in other.notices(), 20)
    second = other.page.locator(".panel").nth(1)
    other.until(lambda: other.page.locator(".panel").count() == 2 and "8 s at 2000 Hz" in str(second.text_content()), 30)
    first = other.page.locator(".panel").first

    def shown() -> bool:
        pressed = " ".join(first.locator("button[aria-pressed=true]").all_text_contents())
        return len(other.ladder()) == 2 and "axis y" in pressed and "rigid, with delay" in pressed

    other.until(shown, 60, "the effect of the link was not added, or axis or model are not those of the link")
    assert first.locator(".js-plotly-plot[aria-label*=', residual position, axis y']").is_visible()
    assert " um/s" in str(first.locator("[data-part=headline]").text_content()) and "um/s" in str(first.locator(".facts").text_content())
    assert other.page.url == f"{server.address}?{wanted}"
    other.page.reload()
    other.until(lambda: shown() and other.page.locator(".panel").count() == 2, 30, "another view after a reload")
    assert other.page.url == f"{server.address}?{wanted}" and other.page.evaluate("document.body.classList.contains('body--dark')")
    close = other.page.get_by_role("button", name="close recording").nth(1)

    def closed_in_both() -> bool:
        return other.page.locator(".panel").count() == 1 and "plain.npz" not in one.page.url and "effects=y:coulomb_friction" in one.page.url

    # closed again after 20 s: a tab that is reloaded after a lost connection opens the recordings of its old address
    other.click_until(close, closed_in_both, 40, "the recording is not closed, or the other tab keeps an old address")
    reset = first.locator("[data-act=reset]")
    other.click_until(reset, lambda: "effects" not in other.page.url, 30, "an effect that was taken out is still in the address")
    assert other.errors == []


def test_columns_without_names_that_tell_are_chosen_by_clicks_and_two_recordings_stand_in_one_picture(usual: Tab) -> None:
    """A table with columns A, B, C, in mm: listed with its numbers, opened as chosen; then both recordings in one figure."""
    one = ready(usual)
    chosen = one.page.get_by_role("combobox", name="recording")
    one.click_until(one.page.get_by_role("button", name="Open a recording"), chosen.is_visible)
    chosen.click()
    one.page.get_by_role("option", name="export.csv").click()
    one.page.get_by_role("button", name="Columns ...").click()
    dialog = one.page.locator("[data-part=columns]")
    one.until(lambda: dialog.count() == 1 and "even steps of 0.0005" in str(dialog.text_content()), 30)
    dialog.get_by_role("button", name="Open", exact=True).click()
    one.until(lambda: "input of x is not chosen" in one.notices(), 10)
    for role, column in (("time", "A"), ("input", "B"), ("output", "C")):
        dialog.get_by_role("combobox", name=role, exact=True).click()
        option = one.page.locator(".q-menu").last.get_by_role("option", name=column, exact=True)
        option.click()
        option.wait_for(state="hidden")
    with one.unheard():  # the text on the page counts
        dialog.locator("input[data-pick=output-unit]").fill("mm")
    dialog.get_by_role("button", name="Open", exact=True).click()
    second = one.page.locator(".panel").nth(1)
    one.until(lambda: one.page.locator(".panel").count() == 2 and "8 s at 2000 Hz" in str(second.text_content()), 30)
    one.until(lambda: "Nothing is missing" in str(second.locator("[data-part=headline]").text_content()), 60)
    names = ("dry.npz, x", "export.csv, x: rigid, with delay")
    one.until(lambda: all(len(curve) > 50 for curve in one.curves("Responses of", *names)), 20)
    dry, plain = one.curves("Responses of", "dry.npz, x", "export.csv, x")
    assert abs(np.nanmedian(np.array(plain, dtype=float)) - np.nanmedian(np.array(dry, dtype=float))) < 12  # dB: both in mm/V
    one.click_until(second.get_by_role("button", name="close recording"), lambda: one.page.locator(".panel").count() == 1)


def answer(url: str, method: str = "GET", **headers: str) -> tuple[int, str]:
    """Status and text of a plain request."""
    request = urllib.request.Request(url, method=method, headers={name.replace("_", "-"): value for name, value in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=60) as found:
            return found.status, found.read().decode()
    except urllib.error.HTTPError as problem:
        return problem.code, problem.read().decode()


def test_a_page_from_elsewhere_cannot_give_orders(tab: Callable[..., Tab], server: Server) -> None:
    """A real page of another origin (another name for this machine is one): its POST and its WebSocket are refused."""
    port = server.address.rstrip("/").rpartition(":")[2]
    foreign = tab(address=f"http://localhost:{port}/alive")
    script = """async ([url]) => {
        const posted = await fetch(url + "stop", {method: "POST", mode: "no-cors"}).then(r => r.type, e => "failed");
        const socket = await new Promise(done => {
            const made = new WebSocket(url.replace("http", "ws") + "_nicegui_ws/socket.io/?EIO=4&transport=websocket");
            made.onopen = () => done("open"); made.onerror = () => done("refused");
        });
        return [posted, socket];
    }"""
    foreign.page.evaluate("document.querySelectorAll('meta').forEach(m => m.remove())")
    assert foreign.page.evaluate(script, [server.address])[1] == "refused"
    assert answer(f"{server.address}stop", "POST", origin="http://evil.example")[0] == 403
    assert answer(server.address, host="evil.example")[0] == 403
    for path in ("..%2f..%2fetc/passwd", "_nicegui/../../setup.py", "static/..%5c..%5cx", "%2e%2e/%2e%2e/setup.py"):
        status, text = answer(server.address + path)
        assert "install_requires" not in text and "root:" not in text, status


def test_from_another_machine_a_token_is_needed(chromium: Any, folder: Path) -> None:
    """Listening on all addresses: only the printed address gives access; the token is removed from the address."""
    made = Server(folder, folder / "plain.npz", "--host", "0.0.0.0", XY_SYSID_TOKEN="a-token-of-this-test")
    try:
        port = made.address.partition("?")[0].rstrip("/").rpartition(":")[2]
        here = f"http://127.0.0.1:{port}/"
        assert made.address.endswith("?token=a-token-of-this-test")
        assert answer(here)[0] == 401 and "token" in answer(f"{here}?token=wrong")[1]
        assert answer(f"{here}stop", "POST")[0] == 401
        one = Tab(chromium, f"{here}?token=a-token-of-this-test")
        one.until(lambda: one.page.locator(".panel").count() == 1)
        assert "token" not in one.page.url
        assert all("httpOnly" in json.dumps(cookie) and cookie["httpOnly"] for cookie in one.context.cookies() if "token" in cookie["name"])
        assert not one.page.get_by_text("No recording is open").is_visible()
        one.click_until(one.page.get_by_role("button", name="close recording"), one.page.get_by_text("No recording is open").is_visible, 10)
        one.close()
    finally:
        assert made.end() == 130
