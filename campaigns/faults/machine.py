"""Real nodes over DDS while the machine is driven: the excitation is killed, or receives transitions that its state does not allow."""

from __future__ import annotations

import importlib.util
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found
from campaigns.faults.tabs import Scene

WORDS = (
    "Simulated machine and excitation as processes, 1 V constant on x. Longest: from the kill to rest. Travel: from the position at the kill to "
    "rest, with the drive's watchdog of 50 ms."
)
PUSH = ("x.kind:='off'", "x.offset:=1.0", "x.centring:=0.0", "y.kind:='off'", "y.centring:=0.0", "ramp:=0.05", "watchdog:=1.0")
WAY = 0.03  # m, bound in docs/real-machine-safely.md


@contextmanager
def driven(folder: Path) -> Iterator[tuple[Scene, list[float]]]:
    """Machine and excitation, and the received positions of x."""
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.cli.monitor import Monitor
    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import from_message

    os.environ.update(ROS_DOMAIN_ID=str(os.getpid() % 90 + 10), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    made, places = Scene(folder, Monitor(("x",), listeners=1)), list[float]()
    node = made.monitor._node
    node.create_subscription(Float64MultiArray, "voltage", lambda message: made.voltage.append(from_message(message)), DATA_QOS)
    node.create_subscription(Float64MultiArray, "position", lambda message: places.extend(from_message(message).values[:, 0].tolist()), DATA_QOS)
    made.monitor.statuses["streams"] = (0, "", {})  # there is no identifier to wait for
    ros = ("--ros-args", "-r", "__ns:=/xy")
    try:
        made.start("ballscrew", "-m", "xy_sim.node", *ros, "-p", "machine:=rigid.yaml", "-p", "realtime:=true", "-p", "watchdog:=0.05")
        made.start("excitation", "-m", "xy_sysid.nodes.excitation", *ros, *(word for pair in PUSH for word in ("-p", pair)))
        made.drive()
        yield made, places
    finally:
        for process in made.processes.values():
            process.kill()
            process.wait()
        made.monitor.close()


def _beyond(places: list[float], far: float) -> bool:
    return bool(places) and places[-1] > far


def killed(count: int, folder: Path) -> Iterator[Found]:
    """kill -9 of the excitation at full drive, at a random moment."""
    if importlib.util.find_spec("rclpy") is None:
        yield Found("skipped", note="ROS 2 is not installed")
        return
    for number in range(count):
        (folder / str(number)).mkdir()
        with driven(folder / str(number)) as (here, places):
            far = float(np.random.default_rng((101, number)).uniform(0.002, 0.05))
            here.until(partial(_beyond, places, far), 20.0)
            here.processes["excitation"].send_signal(signal.SIGKILL)
            here.monitor.spin(0.0)
            place, begun = places[-1], time.monotonic()
            here.until(lambda: "the drive went to 0 V" in here.said("ballscrew"), 3.0)
            seconds = time.monotonic() - begun
            here.monitor.spin(0.5)
            rest = places[-1]
            here.monitor.spin(0.3)
            good = abs(places[-1] - rest) < 1e-4 and rest - place < WAY
            yield Found("zero volts" if good else "too late", seconds, rest - place, "" if good else f"seed (101, {number}): {rest - place:.4f} m")


def _drives_on(here: Scene, sent: int) -> bool:
    return len(here.voltage) > sent + 5 and bool(here.voltage[-1].values.any())


def transitions(count: int, folder: Path) -> Iterator[Found]:
    """Every transition by number while it drives, allowed or not, deactivate and shutdown last: it continues, or is at zero volts."""
    if importlib.util.find_spec("rclpy") is None:
        yield Found("skipped", note="ROS 2 is not installed")
        return
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    with driven(folder) as (here, _):
        client: Any = here.monitor._client
        for number in (0, 1, 2, 3, 8, 9, 50, 60, 97, 255, 4, 7)[:count]:
            more = partial(_drives_on, here, len(here.voltage))
            call = client.call_async(ChangeState.Request(transition=Transition(id=number)))
            answered = here.until(call.done, 10.0)
            ended = here.processes["excitation"].poll() is not None
            if number in (4, 7):  # deactivate, shutdown from active
                good = answered and not ended and here.until(lambda: not here.voltage[-1].values.any(), 3.0)
                yield Found("zero volts" if good else "too late", note="" if good else f"{number}: {here.said('excitation')[-200:]}")
                continue
            drives = here.until(more, 5.0)
            refused = answered and not call.result().success
            yield Found(
                "one line" if refused and drives and not ended else "traceback", note="" if drives else f"{number}: {here.said('excitation')[-300:]}"
            )


ATTACKS = (
    Attack("kill -9 of the excitation", killed, 4, 0, "30 mm"),
    Attack("transitions that the state does not have", transitions, 12, 0, "it drives on"),
)
