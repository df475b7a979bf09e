"""STOP fades out within its own time limit, for any ramps and in any state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block
from xy_sysid.settings import AxisExcitation, ExcitationSettings

CAP = 0.1  # s
SLOW = {"abort_ramp": 10.0}  # the longest allowed
WAYS: dict[str, dict[str, Any]] = {
    "blocks": {},
    "effort": {"output": "commands", "rate": 200.0, "block": 1},
    "velocity": {"output": "commands", "interface": "velocity", "rate": 200.0, "block": 1},
    "position": {"output": "commands", "interface": "position", "rate": 200.0, "block": 1},
}


@pytest.mark.parametrize("before", ["driving", "told to end", "deactivated", "a guard has tripped", "ramps set live"])
@pytest.mark.parametrize("way", WAYS)
def test_stop_is_over_in_a_tenth_of_a_second(way: str, before: str) -> None:
    """With the longest allowed ramps, set before or during driving: after 0.1 s and the current block, the output is safe."""
    axis = AxisExcitation(kind="off", offset=0.05, centring=0.0, limit=0.1, rms=0.05)
    settings = ExcitationSettings(axes={"x": axis}, **{**WAYS[way], "ramp": 0.0, "abort_ramp": 0.02})
    slow = settings.model_copy(update=SLOW)
    drive = Drive(settings if before == "ramps set live" else slow, watched=False)
    drive.start()
    rows = settings.block

    def see() -> None:
        seq = np.arange(drive.seq - rows, drive.seq, dtype=np.float64)
        drive.see(Block(("x",), seq, seq / settings.rate, np.zeros((rows, 1))))

    for _ in range(20):
        see()
        drive.next(rows)
    if before == "ramps set live":
        drive.change(slow)
    elif before != "driving":
        drive.stop(before, {"told to end": 60.0}.get(before, 10.0))
        drive.next(rows)
    assert drive.next(rows).values.any() and drive.state == ("active" if before in ("driving", "ramps set live") else "stopping")
    drive.obey_stop()
    sent, step = [], max(1, round(0.01 * settings.rate))
    for _ in range(30):
        see()
        sent.append(drive.next(step).values)
    values = np.concatenate(sent)
    late = round(CAP * settings.rate)
    assert not values[late + step :].any() and drive.report().state == "stopped"
    assert np.abs(np.diff(values[:, 0])).max() < 0.02, "it fades, and does not jump"


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("changed", [{"offset": 0.9}, {"offset": -0.9}, {"rms": 0.9, "limit": 1.0}, {"offset": 0.9, "limit": 1.0, "centring": 1.0}])
def test_settings_that_arrive_during_stop_do_not_raise_the_output(changed: dict[str, float], way: str) -> None:
    """Offset, rms, limit and centring raised right after STOP: the output never exceeds its value at STOP, and smaller values are used."""
    axis = AxisExcitation(kind="multisine", offset=0.05, centring=0.0, limit=0.1, rms=0.02, low=5.0, high=20.0)
    settings = ExcitationSettings(axes={"x": axis}, **{**WAYS[way], "ramp": 0.0})
    rows = settings.block

    def after_stop(change: dict[str, float]) -> np.ndarray:
        drive, sent = Drive(settings, watched=False), []
        drive.start()
        for k in range(40):
            seq = np.arange(drive.seq - rows, drive.seq, dtype=np.float64)
            drive.see(Block(("x",), seq, seq / settings.rate, np.zeros((rows, 1))))
            if k == 20:
                drive.obey_stop()
                drive.change(settings.model_copy(update={"axes": {"x": axis.model_copy(update=change)}}))
            values = drive.next(rows).values
            sent += [values] * (k >= 20)
        assert drive.state == "stopped"
        return np.concatenate(sent)[:, 0]

    usual = after_stop({})
    assert usual.any() and np.array_equal(after_stop(changed), usual)
    assert np.abs(after_stop({"offset": 0.0, "rms": 0.0})).sum() < np.abs(usual).sum()
