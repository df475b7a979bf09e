"""Access to the page: host, origin, token; as a pure function, and in front of an application."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from xy_sysid.page.access import COOKIE, LARGEST, Access, cookie_of, is_loopback, judge, name_of, rules, same_origin
from xy_sysid.page.guard import Guard

HERE = {"host": "127.0.0.1:8080"}


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1:8080", "[::1]:8080", "LOCALHOST"])
def test_this_machine_may_come_in_by_its_names(host: str) -> None:
    """On loopback no token is needed."""
    assert judge(rules("127.0.0.1"), {"host": host}, "").status == 200


@pytest.mark.parametrize(
    "host", ["evil.example:8080", "127.0.0.1.evil.example", "", "localhost.evil.example", "[::1", "192.168.0.7:8080", "a@localhost.b"]
)
def test_a_name_that_was_made_to_point_here_is_refused(host: str) -> None:
    """DNS rebinding: the name in the request is not one of this machine."""
    answer = judge(rules("127.0.0.1"), {"host": host}, "")
    assert answer.status == 403 and "is not served" in answer.words


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "https://127.0.0.1.evil.example", "http://127.0.0.1:9999", "null", "http://localhost:8080", "file://", "x"]
)
def test_a_foreign_origin_is_refused(origin: str) -> None:
    """Other pages, other ports and sandboxes may not give orders, even with the token."""
    for access in (rules("127.0.0.1"), rules("0.0.0.0", "secret")):
        answer = judge(access, {**HERE, "origin": origin, "cookie": f"{COOKIE}=secret"}, "")
        assert answer.status == 403 and "refused" in answer.words
    assert not same_origin(origin, HERE["host"])


def test_the_page_s_own_origin_is_let_through() -> None:
    """Scheme http, same name, same port."""
    assert judge(rules("127.0.0.1"), {**HERE, "origin": "http://127.0.0.1:8080"}, "").status == 200


def test_a_cross_site_request_without_an_origin_is_refused_but_a_link_may_be_followed() -> None:
    """Images and scripts of other sites are refused; clicking a link to the page is not."""
    assert judge(rules("127.0.0.1"), {**HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, "").status == 403
    assert judge(rules("127.0.0.1"), {**HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, "").status == 200


@pytest.mark.parametrize(
    ("host", "here"), [("127.0.0.1", True), ("127.8.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("::", False), ("x", False)]
)
def test_only_loopback_goes_without_a_token(host: str, here: bool) -> None:
    """Any other address to listen on gets a token that cannot be guessed."""
    assert is_loopback(host) is here
    access = rules(host)
    assert bool(access.token) is not here
    assert here or (len(access.token) >= 32 and access.token != rules(host).token)


def test_a_token_in_the_address_becomes_a_cookie_and_leaves_the_address() -> None:
    """Right token: a cookie, and a redirect to the address without it. Wrong or none: 401 with a sentence."""
    access = Access("secret", ())
    entered = judge(access, {"host": "machine:8080"}, "token=secret&x=1")
    assert (entered.status, entered.cookie, entered.to) == (303, "secret", "/?x=1")
    assert judge(access, {"host": "machine:8080"}, "token=secret").to == "/"
    assert judge(access, {"host": "machine:8080", "cookie": f"a=b; {COOKIE}=secret"}, "").status == 200
    for headers, query in (({}, ""), ({}, "token=secre"), ({"cookie": f"{COOKIE}=secre"}, ""), ({"cookie": "\x00=;;"}, ""), ({}, "token=")):
        answer = judge(access, {"host": "machine:8080", **headers}, query)
        assert answer.status == 401 and "token" in answer.words.lower()


@pytest.mark.parametrize("length", ["1048577", "99999999999999999999", "-1", "1e3", "", "abc", "10, 20", "\u0663"])
def test_a_body_that_is_too_large_or_has_no_honest_length_is_refused(length: str) -> None:
    """Before a byte is read: 413 with a sentence; a smaller body is accepted."""
    answer = judge(rules("127.0.0.1"), {**HERE, "content-length": length}, "")
    assert answer.status == 413 and str(LARGEST) in answer.words
    assert judge(rules("127.0.0.1"), {**HERE, "content-length": str(LARGEST)}, "").status == 200


def test_a_body_without_a_length_ends_where_it_becomes_too_large() -> None:
    """Endless chunks: the application gets a disconnect, and no more data."""
    taken: list[int] = []

    async def application(scope: Any, receive: Any, send: Any) -> None:
        while (message := await receive())["type"] == "http.request":
            taken.append(len(message["body"]))

    async def endless() -> dict[str, Any]:
        return {"type": "http.request", "body": bytes(65536), "more_body": True}

    async def nowhere(message: Any) -> None:
        return None

    scope = {"type": "http", "method": "POST", "path": "/", "query_string": b"", "headers": [(b"host", b"127.0.0.1:8080")]}
    asyncio.run(asyncio.wait_for(Guard(application, rules("127.0.0.1"))(scope, endless, nowhere), 10.0))
    assert sum(taken) <= LARGEST


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_who_has_gone_before_anybody_listened_ends_in_silence_but_a_stop_is_obeyed(kind: str) -> None:
    """The library of the page's WebSocket raises KeyError for such a connection; POST /stop is handled even if its sender has left."""
    reached: list[str] = []

    async def application(scope: Any, receive: Any, send: Any) -> None:
        reached.append(f"{scope['path']} {(await receive())['type']}")

    async def gone() -> dict[str, Any]:
        return {"type": f"{kind}.disconnect"}

    async def nowhere(message: Any) -> None:
        return None

    for path in ("/_nicegui_ws/socket.io/", "/stop"):
        headers = [(b"host", b"127.0.0.1:8080"), (b"x-requested-with", b"xy_sysid")]
        asyncio.run(
            Guard(application, rules("127.0.0.1"))(
                {"type": kind, "method": "POST", "path": path, "query_string": b"", "headers": headers}, gone, nowhere
            )
        )
    assert reached == [f"/stop {kind}.disconnect"]


@pytest.mark.parametrize(("kind", "told"), [("http", ("http.response.start", 400)), ("websocket", ("websocket.close", 1003))])
def test_a_page_whose_session_has_ended_is_told_so_and_other_errors_are_not_hidden(kind: str, told: tuple[str, int]) -> None:
    """The library raises KeyError for a session that was just closed; for our own addresses no error is hidden."""
    sent: list[Any] = []

    async def application(scope: Any, receive: Any, send: Any) -> None:
        raise KeyError("Session is disconnected")

    async def receive() -> dict[str, Any]:
        return {"type": f"{kind}.request" if kind == "http" else "websocket.connect"}

    async def send(message: Any) -> None:
        sent.append(message)

    def asked(path: str) -> None:
        scope = {"type": kind, "method": "POST", "path": path, "query_string": b"", "headers": [(b"host", b"127.0.0.1:8080")]}
        asyncio.run(Guard(application, rules("127.0.0.1"))(scope, receive, send))

    asked("/_nicegui_ws/socket.io/")
    assert (sent[0]["type"], sent[0].get("status", sent[0].get("code"))) == told
    with pytest.raises(KeyError):
        asked("/")


def test_odd_headers_do_not_break_it() -> None:
    """Invalid names and cookies are ignored."""
    assert name_of("[[[") == "" and cookie_of("=;=\xff;") == "" and name_of("Host:notaport") == "host"


async def _application(scope: Any, receive: Any, send: Any) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"inside"})


def ask(access: Access, path: str = "/", kind: str = "http", query: str = "", **headers: str) -> tuple[dict[str, Any], dict[str, str], str]:
    """First message, headers and body of a guarded application's answer."""
    given = {"host": "127.0.0.1:8080", **{name.replace("_", "-"): value for name, value in headers.items()}}
    scope = {
        "type": kind,
        "path": path,
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode()) for name, value in given.items()],
    }
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        sent.append(dict(message))

    asyncio.run(Guard(_application, access)(scope, receive, send))
    told = {name.decode(): value.decode() for name, value in sent[0].get("headers", [])}
    return sent[0], told, b"".join(message.get("body", b"") for message in sent).decode()


def test_the_guard_stands_before_http_and_websockets() -> None:
    """A refused request never reaches the application; an accepted page cannot be framed by others."""
    access = rules("127.0.0.1")
    first, headers, body = ask(access)
    assert first["status"] == 200 and body == "inside" and headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    first, _, body = ask(access, "/stop", origin="http://evil.example")
    assert first["status"] == 403 and "inside" not in body
    assert "<script>" not in ask(access, host="<script>")[2]
    assert ask(access, kind="websocket", origin="http://127.0.0.1:8080")[0]["type"] == "websocket.accept"
    refused = ask(access, kind="websocket", origin="http://evil.example")[0]
    assert refused["type"] == "websocket.close" and refused["code"] == 4403


def test_stop_is_obeyed_without_the_page_and_without_an_origin() -> None:
    """As by ``curl -X POST``, even with the headers of another site's form: it can only stop. An origin must be the page's own."""
    access = rules("127.0.0.1")
    assert ask(access, "/stop")[2] == "inside"
    assert ask(access, "/stop", **{"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"})[2] == "inside"
    for origin in ("null", "http://evil.example"):
        assert ask(access, "/stop", origin=origin, **{"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"})[0]["status"] == 403


def test_scripts_come_from_this_server_only() -> None:
    """No scripts from data or blob addresses, no embedded objects, and no other base address."""
    policy = dict(part.split(" ", 1) for part in ask(rules("127.0.0.1"))[1]["content-security-policy"].split("; "))
    assert not {"data:", "blob:", "*", "https:"} & set(policy["script-src"].split())
    assert policy["default-src"] == "'self'" and policy["object-src"] == policy["base-uri"] == policy["frame-ancestors"] == "'none'"


def test_the_guard_sets_a_cookie_out_of_reach_of_scripts() -> None:
    """HttpOnly and SameSite=Strict, and the redirect never leaves this server."""
    access = Access("secret", ())
    assert ask(access)[0]["status"] == 401
    first, headers, _ = ask(access, "//evil.example/", query="token=secret")
    assert first["status"] == 303 and headers["location"] == "/"
    assert "HttpOnly" in headers["set-cookie"] and "SameSite=Strict" in headers["set-cookie"]
    assert ask(access, cookie=headers["set-cookie"].partition(";")[0])[2] == "inside"
