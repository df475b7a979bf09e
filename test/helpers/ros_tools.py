"""Real nodes over real DDS in tests: processes, a subscriber, lifecycle calls, a separate domain for each test.

Import from a test module that starts with ``pytestmark = needs_ros``.
"""

from __future__ import annotations

import faulthandler
import importlib.util
import itertools
import os
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from helpers.busy import PATIENCE
from helpers.cli_tools import bare
from xy_sysid.samples.block import Block

HAS_ROS = importlib.util.find_spec("rclpy") is not None
needs_ros = pytest.mark.skipif(not HAS_ROS, reason="ROS 2 is not installed: pip install 'xy_sysid[ros]'")

RUN = zlib.crc32(os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid())).encode())
WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))

SHARED = Path("/dev/shm")
CRASHES = 2  # file descriptor for the output of a crash; set for the whole run once it is known

_count = itertools.count()


def new_domain() -> int:
    """A DDS domain that no other test of this run, in any worker, and hardly one of another run, uses.

    It has no ports of killed processes of an earlier run, because a new participant would write into ports that nobody reads.
    """
    for _ in range(100 // WORKERS):
        domain = (RUN + next(_count) * WORKERS + WORKER) % 100 + 1
        if not left_behind(domain):
            return domain
    clean(domain)
    return domain


def left_behind(domain: int) -> list[Path]:
    """The ports of Fast DDS in shared memory of a domain, of its present and killed participants."""
    first = 7400 + 250 * domain
    names = {f"fastrtps_port{port}" for port in range(first, first + 250)}
    ports = [path for path in SHARED.glob("*fastrtps_port*") if path.name.removeprefix("sem.").removesuffix("_el").removesuffix("_mutex") in names]
    return sorted(ports)


def clean(domain: int) -> None:
    """Remove the ports of killed participants of a domain, if it is empty."""
    for path in left_behind(domain):
        path.unlink(missing_ok=True)


class NodeProcess:
    """A node in a separate process, with a log file of its output that can be read at any time."""

    def __init__(self, program: Sequence[str], arguments: Sequence[str], domain: int, log: Path) -> None:
        environment = bare(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        self._log = log
        with log.open("wb") as out:
            command = [sys.executable, *program, *arguments]
            self.process = subprocess.Popen(command, cwd=log.parent, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, env=environment)

    def output(self) -> str:
        """Its output so far."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    def send(self, number: signal.Signals) -> None:
        """A signal."""
        self.process.send_signal(number)

    def wait(self, seconds: float = 10.0) -> int:
        """Wait for its exit code; the timeout is that of an idle computer."""
        return self.process.wait(PATIENCE * seconds)

    def end(self) -> None:
        """End the process by any means."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(5)


class Integrator:
    """A machine whose position is the sum of the voltage, 0.1 m/s/V; silent after ``alive`` is cleared."""

    def __init__(self) -> None:
        self.place, self.alive = np.zeros(2), True

    def __call__(self, block: Block) -> Block | None:
        path = self.place + np.cumsum(block.values, axis=0) * 0.1 / 2000
        self.place = path[-1]
        return Block(block.axes, block.seq, block.time, path) if self.alive else None


class World:
    """The ROS environment of one test: its domain, a node to publish and subscribe, and the started processes."""

    def __init__(self, folder: Path) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.signals import SignalHandlerOptions

        self.domain, self.folder = new_domain(), folder
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain, signal_handler_options=SignalHandlerOptions.NO)
        self.node: Any = rclpy.create_node("test", namespace="/xy", context=self.context)
        self._executor = EventsExecutor(context=self.context)
        faulthandler.enable(CRASHES)  # the executor has redirected Python to stderr, which is captured
        self._executor.add_node(self.node)
        self._clients: dict[str, Any] = {}
        self.processes: list[NodeProcess] = []

    def start(self, module: str, parameters: dict[str, Any] | None = None, *, arguments: Sequence[str] = ()) -> NodeProcess:
        """Start a node process with these parameters (values as YAML writes them); module: its name, or a program text of lines."""
        pairs = [
            word
            for name, value in (parameters or {}).items()
            for word in ("-p", f"{name}:={str(value).lower() if value in (True, False) else value}")
        ]
        program = ("-c", module) if "\n" in module else ("-m", module)
        process = NodeProcess(program, ["--ros-args", *pairs, *arguments], self.domain, self.folder / f"node{len(self.processes)}.log")
        self.processes.append(process)
        return process

    def spin(self, seconds: float) -> None:
        """Receive messages for this time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.01)

    def until(self, done: Callable[[], bool], seconds: float = 10.0) -> bool:
        """Receive messages until ``done``; False after PATIENCE times the seconds."""
        end = time.monotonic() + PATIENCE * seconds
        while time.monotonic() < end:
            if done():
                return True
            self._executor.spin_once(timeout_sec=0.01)
        return done()

    def hears(self, kind: Any, topic: str, depth: int = 10) -> list[Any]:
        """A list that fills with the messages of a topic; kind: their type."""
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, depth)
        return heard

    def blocks(self, topic: str = "voltage") -> list[Block]:
        """A list that fills with the blocks of a topic."""
        from std_msgs.msg import Float64MultiArray

        from xy_sysid.nodes.common import DATA_QOS
        from xy_sysid.nodes.convert import from_message

        heard: list[Block] = []
        self.node.create_subscription(Float64MultiArray, topic, lambda message: heard.append(from_message(message)), DATA_QOS)
        return heard

    def statuses(self, topic: str = "metrics") -> list[Any]:
        """A list that fills with DiagnosticStatus."""
        from diagnostic_msgs.msg import DiagnosticArray

        heard: list[Any] = []
        self.node.create_subscription(DiagnosticArray, topic, lambda message: heard.extend(message.status), 10)
        return heard

    def machine(self, answer: Callable[[Block], Block | None]) -> None:
        """A machine in this process: the function computes the answer to every voltage block."""
        from std_msgs.msg import Float64MultiArray

        from xy_sysid.nodes.common import DATA_QOS
        from xy_sysid.nodes.convert import from_message, to_message

        position = self.node.create_publisher(Float64MultiArray, "position", DATA_QOS)

        def play(message: Any) -> None:
            block = answer(from_message(message))
            if block is not None:
                position.publish(to_message(block))

        self.node.create_subscription(Float64MultiArray, "voltage", play, DATA_QOS)

    def call(self, kind: Any, name: str, request: Any, seconds: float = 10.0, times: int = 1) -> Any:
        """The answer of a service. times: repetitions of a repeatable call, because a link that is not fully connected loses answers."""
        for _ in range(times):
            answer = self._try(kind, name, request, seconds)
            if answer is not None:
                return answer
        raise AssertionError(f"no answer from {name}")

    def _try(self, kind: Any, name: str, request: Any, seconds: float) -> Any:
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        client = self._clients[name]
        assert self.until(client.service_is_ready, 15.0), f"no service {name}"
        future = client.call_async(request)
        return future.result() if self.until(future.done, seconds) else None

    def transition(self, node: str, label: str) -> bool:
        """Request configure, activate, deactivate, cleanup, ... of a lifecycle node; True if it succeeded."""
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        goal = {"configure": "inactive", "activate": "active", "deactivate": "inactive", "cleanup": "unconfigured", "shutdown": "finalized"}[label]
        before = self.state(node)
        for _ in range(3):
            answer = self._try(ChangeState, f"/xy/{node}/change_state", ChangeState.Request(transition=Transition(label=label)), 4.0)
            if answer is not None:
                return bool(answer.success)
            if self.state(node) != before:  # done, but the answer was lost on a link that was not fully connected
                return self.state(node) == goal
        return False

    def state(self, node: str) -> str:
        """The lifecycle state: unconfigured, inactive, active, ..."""
        from lifecycle_msgs.srv import GetState

        for _ in range(5):
            answer = self._try(GetState, f"/xy/{node}/get_state", GetState.Request(), 2.0)
            if answer is not None:
                return str(answer.current_state.label)
        raise AssertionError(f"{node} does not tell its state")

    def set_parameter(self, node: str, name: str, value: bool | int | float | str | list[str]) -> tuple[bool, str]:
        """True if a parameter was changed, and the node's sentence otherwise."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        parameter: Any = Parameter
        request = SetParameters.Request(parameters=[parameter(name, value=value).to_parameter_msg()])
        result = self.call(SetParameters, f"/xy/{node}/set_parameters", request, times=3).results[0]
        return bool(result.successful), str(result.reason)

    def close(self) -> None:
        """End everything that was started."""
        self._executor.shutdown()  # it calls what the node has, and must not outlive it
        self.node.destroy_node()  # before the others are killed: Fast DDS crashes if one that shares memory with it dies just then
        self.context.try_shutdown()
        for process in self.processes:
            process.end()


@contextmanager
def world_in(folder: Path) -> Iterator[World]:
    """A World that is closed at the end."""
    before = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    try:
        world = World(folder)
        try:
            yield world
        finally:
            world.close()
            clean(world.domain)
    finally:
        if before is None:
            del os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"]
        else:
            os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = before
