"""The main loop of every node: after Ctrl-C or SIGTERM the node ends in order, exactly once.

Imports nothing large, so that the signal handlers are installed first.
"""

from __future__ import annotations

import functools
import signal
import sys
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from types import FrameType
from typing import Any, Protocol, cast

from xy_sysid.errors import MissingExtra, XySysidError
from xy_sysid.processes.terminal import printable

LOOK = 0.1  # s between two checks whether the node has to end
LONGEST_STOP = 3.0  # s that an orderly end may take; then ``last_words`` is called without waiting


class Runnable(Protocol):
    """The methods that a node class adds to rclpy's Node; ``WalledNode`` in common.py has the simplest ones."""

    exit_code: int | None  # set it to end the process

    def ask_to_stop(self, reason: str) -> None:
        """Begin to end; the node keeps spinning until ``has_stopped``."""
        ...

    def has_stopped(self) -> bool:
        """True if only ``last_words`` is left to do."""
        ...

    def last_words(self) -> None:
        """Called once, when the node ends or fails, while its publishers still work."""
        ...

    def destroy_node(self) -> None:
        """rclpy's."""
        ...

    def get_logger(self) -> Any:
        """rclpy's."""
        ...


def maker(place: str) -> Callable[[], Runnable]:
    """The factory of a node. place: module:class, imported when the node is made, after signal handlers and rclpy."""
    module, _, name = place.partition(":")
    return lambda: cast("Runnable", getattr(import_module(module), name)())


def executable(place: str) -> Callable[[], int]:
    """The ``main`` of a node's executable: it runs the node and returns the exit code. place: as for ``maker``."""
    return functools.partial(run_node, maker(place))


def run_node(factory: Callable[[], Runnable], args: Sequence[str] | None = None) -> int:
    """Make the node and spin it until a signal, its own ``exit_code`` or an error; returns the exit code of the process.

    factory: makes the node, after rclpy is initialised; args: as for rclpy.init, the process' own by default.
    The code is 2, with one line on stderr, if rclpy is missing or an argument or parameter is wrong.
    """
    asked: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        asked.append(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, note)
    try:
        import rclpy
        from rclpy.exceptions import ParameterException
        from rclpy.impl.implementation_singleton import rclpy_implementation
        from rclpy.signals import SignalHandlerOptions
        from rclpy.utilities import try_shutdown
    except ModuleNotFoundError as error:
        if error.name != "rclpy":
            raise
        return _refuse(MissingExtra("ROS 2 (rclpy)", "ros"))
    try:
        rclpy.init(args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO)
        node = factory()
    except (XySysidError, ParameterException, rclpy_implementation.RCLError) as error:
        try_shutdown()
        return _refuse(error)
    node.get_logger().info("ready")
    try:
        _spin(node, asked)
    finally:
        node.last_words()
        node.destroy_node()
        try_shutdown()
    return node.exit_code or 0


def _spin(node: Runnable, asked: list[int]) -> None:
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.task import Future

    executor, never = EventsExecutor(), Future()
    executor.add_node(cast("Any", node))
    while not asked and node.exit_code is None:
        executor.spin_until_future_complete(never, timeout_sec=LOOK)  # spin_once returns after every message, which is slower
    node.ask_to_stop(signal.Signals(asked[0]).name if asked else "finished")
    until = time.monotonic() + LONGEST_STOP
    while not node.has_stopped() and time.monotonic() < until:
        executor.spin_once(timeout_sec=0.02)


def _refuse(error: Exception) -> int:
    """Write one line on stderr, without rcl's references to its source files."""
    sys.stderr.write(printable(" ".join(str(error).split(", at /")[0].split())) + "\n")
    return 2
