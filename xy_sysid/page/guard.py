"""Applies the rules of ``access`` to HTTP and WebSocket before the application sees a request."""

from __future__ import annotations

from html import escape
from typing import Any

import engineio
import socketio
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from xy_sysid.page.access import HEADERS, LARGEST, Access, Answer, judge, set_cookie

PAGE = "<!DOCTYPE html><html lang=en><meta charset=utf-8><title>xy_sysid</title><body style='font-family:sans-serif'><h1>xy_sysid</h1><p>{}</p>"
NONSENSE = 1003  # close code for data that cannot be understood
TALK = "/_nicegui_ws/"  # path of the pages' WebSocket connection
GONE = ("http.disconnect", "websocket.disconnect")  # the client disconnected before the request was handled: the application fails on such a request
REFUSED = 4403  # close code of a refused WebSocket


class Guard:
    """ASGI middleware that accepts or refuses requests."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with security headers, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        answer = judge(self._access, headers, scope.get("query_string", b"").decode("latin-1"))
        if answer.status == 200:
            first = await receive()
            if first["type"] not in GONE or not scope["path"].startswith(TALK):  # a STOP is handled even if its sender has disconnected
                heard = _from(first, receive)
                await self._answered(scope, (_bounded if scope["type"] == "http" else _understood)(heard), _careful(send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": REFUSED, "reason": answer.words[:100]})
        else:
            await _answer(answer, send)

    async def _answered(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The application's answer. A page whose session has ended gets an error and starts a new session by itself."""
        if not scope["path"].startswith(TALK):
            await self._app(scope, receive, send)
            return
        told: list[Message] = []

        async def sending(message: Message) -> None:
            told.append(message)
            await send(message)

        try:
            await self._app(scope, receive, sending)
        except* KeyError:  # raised alone, or in a group from intermediate tasks
            if not told and scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": NONSENSE})
            elif not told:
                await _answer(Answer(400, "This session has ended. Reload the page."), send)


def _from(first: Message, receive: Receive) -> Receive:
    """A receive function that returns the message already read, then all that follow."""
    waiting = [first]

    async def receiving() -> Message:
        return waiting.pop() if waiting else await receive()

    return receiving


def _bounded(receive: Receive) -> Receive:
    """Limit a body without a declared length: above the limit, report a disconnect."""
    size = 0

    async def receiving() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        return {"type": "http.disconnect"} if size > LARGEST else message

    return receiving


def _understood(receive: Receive) -> Receive:
    """Report a disconnect for a WebSocket message that our page never sends; the application need not handle it."""

    async def receiving() -> Message:
        message = await receive()
        if message["type"] == "websocket.receive" and not _packet(message.get("text") or ""):
            return {"type": "websocket.disconnect", "code": NONSENSE}
        return message

    return receiving


def _packet(said: str) -> bool:
    """True for a text packet of Engine.IO, with Socket.IO inside; our page sends no bytes."""
    try:
        outer = engineio.packet.Packet(encoded_packet=said)
        if outer.packet_type == engineio.packet.MESSAGE:
            socketio.packet.Packet(encoded_packet=outer.data)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError, OverflowError):
        return False
    return True


def _careful(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
        await send(message)

    return sending


async def _answer(answer: Answer, send: Send) -> None:
    body = PAGE.format(escape(answer.words)).encode()
    headers: list[Any] = [(b"content-type", b"text/html; charset=utf-8"), (b"cache-control", b"no-store")]
    headers += [(name.encode(), value.encode()) for name, value in HEADERS.items()]
    if answer.cookie:
        headers += [(b"set-cookie", set_cookie(answer.cookie).encode()), (b"location", answer.to.encode("ascii", "ignore"))]
    await send({"type": "http.response.start", "status": answer.status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
