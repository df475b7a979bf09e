"""The card *Use the model* in a browser: the command's words, and files, for the shown model."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.simulated import recorded

pytestmark = needs_browser


def test_numbers_to_paste_and_files_come_from_the_model_that_is_shown(tmp_path: Path) -> None:
    """kS, kV and kA with their intervals as printed by the command, also before and after on the recording; no overlaps."""
    run = recorded("coulomb_friction", seconds=12.0).run("x")
    rows = np.column_stack([np.arange(len(run)) / run.sampling_rate, run.voltage, run.position])
    np.savetxt(tmp_path / "mine.csv", rows, delimiter=",", header="time,x_voltage,x_position", comments="", fmt="%.9g")
    server = Server(tmp_path, tmp_path / "mine.csv")
    try:
        with browser() as made:
            tab = Tab(made, server.address)
            numbers = tab.page.locator("[data-act=use-numbers]")
            tab.until(lambda: numbers.count() and numbers.first.is_visible(), 60.0, "no card")
            text = tab.page.locator("[data-part=use-text]")
            tab.click_until(numbers.first, lambda: "kS kV kA" in (text.first.text_content() or ""), 60.0, "no numbers")
            said = text.first.text_content() or ""
            assert "95 % interval" in said and "predicted from the recorded motion" in said and "State feedback with an observer" in said
            tab.page.set_viewport_size({"width": 400, "height": 900})
            tab.page.wait_for_timeout(300)
            assert tab.over_each_other() == [] and tab.errors == []
    finally:
        server.end()


def test_the_files_of_each_axis_are_packed(tmp_path: Path) -> None:
    """The ZIP has the exports of the command in a folder for each axis."""
    from helpers.known_models import known

    from xy_sysid.page.use_job import used_files

    model = known("coulomb_friction")
    parameters = {item.name: {"value": item.value, "unit": item.unit, "ci95": [item.low, item.high]} for item in model.parameters}
    story = {
        "model": {"effects": ["coulomb_friction"], "parameters": parameters, "held_out_error": 1e-3, "noise_floor": 1e-3},
        "sampling_rate": 500.0,
    }
    with zipfile.ZipFile(io.BytesIO(used_files({"x": story}, None, (), 10.0))) as pack:
        names = set(pack.namelist())
        assert "RATE 500.0" in pack.read("x/axis_x.py").decode().replace(" =", ""), "the rate of the recording"
    assert {"x/axis_x.c", "x/axis_x.sdf", "x/axis_x_control.py", "x/x_friction.csv"} <= names
