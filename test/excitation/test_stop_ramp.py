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
