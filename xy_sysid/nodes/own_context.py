"""A node with a context of its own: it can be made and removed at any time, and leaves signals to the program."""

from __future__ import annotations

from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions


class OwnContext:
    """The node and its executor, for the thread that calls them."""

    def __init__(self, name: str, namespace: str) -> None:
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node: Any = rclpy.create_node(name, namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def close(self) -> None:
        """Remove the node from the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()
