"""A Trigger service that is answered when the work is done, without blocking the executor.

rclpy's EventsExecutor calls a service's callback and sends its return value; it has no coroutines (7.1.6). So the
response is intercepted when it would be sent, and sent later.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from xy_sysid.errors import XySysidError


class LaterTrigger:
    """``ask`` begins the work and returns its number; ``answer`` sends the response to all clients that wait for it."""

    def __init__(self, node: Node, name: str, ask: Callable[[], int]) -> None:
        """ask: if it raises XySysidError, the service answers at once with that text."""
        self._ask = ask
        self._waiting: dict[int, list[tuple[Any, Any]]] = {}
        self._number: int | None = None
        service: Any = node.create_service(Trigger, name, self._on_request)
        self._send = service.send_response
        service.send_response = self._keep

    def _on_request(self, _request: Any, response: Any) -> Any:
        try:
            self._number = self._ask()
        except XySysidError as problem:
            self._number, response.message = None, str(problem)
        return response

    def _keep(self, response: Any, header: Any) -> None:
        if self._number is None:
            self._send(response, header)
        else:
            self._waiting.setdefault(self._number, []).append((response, header))

    def answer(self, number: int, success: bool, text: str) -> None:
        """Send the response to the clients that wait for this number."""
        for response, header in self._waiting.pop(number, []):
            response.success, response.message = success, text
            self._send(response, header)

    def give_up(self, text: str) -> None:
        """Answer all waiting clients with a failure."""
        for number in list(self._waiting):
            self.answer(number, False, text)
