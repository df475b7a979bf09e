"""Attacks on the page's server: large bodies, wrong headers, WebSockets from other origins or with nonsense; it must stay small and fast."""

from __future__ import annotations

import base64
import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from campaigns.faults.attack import Attack, Found, environment, judged
from campaigns.faults.damage import rigid
from campaigns.faults.soak import memory

WORDS = (
    "`xy-sysid page` on a recording, attacked through its port. After each try it must answer within 2 s, its memory must not have grown by more "
    "than 100 MB, and it must not have printed a traceback. Documents of the topic `story` are given to the page's own reader."
)
MORE, ANSWERS = 100.0, 2.0  # MB, allowed growth; s, limit for an answer
BIG = 40_000_000  # bytes of a body


@dataclass(slots=True)
class Server:
    """The page as a process."""

    process: subprocess.Popen[str]
    port: int
    log: Path
    before: float = 0.0

    def said(self) -> str:
        """Its output on stderr."""
        return self.log.read_text("utf-8", "replace")

    def alive(self) -> float:
        """Time of a health check, s."""
        begun = time.monotonic()
        with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/alive", timeout=10.0) as answer:
            json.load(answer)
        return time.monotonic() - begun


@contextmanager
def server(folder: Path) -> Iterator[Server]:
    """A server with a recording of a rigid axis, without a machine."""
    rec = rigid(folder / "rec.npz", 6000)
    words = [sys.executable, "-m", "xy_sysid", "page", str(rec), "--port", "0", "--no-browse", "--folder", str(folder)]
    with (folder / "page.log").open("wb") as log:
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, text=True, env=environment())
    assert process.stdout is not None
    try:
        address = process.stdout.readline().strip()
        made = Server(process, int(address.rstrip("/").rpartition(":")[2]), folder / "page.log")
        urllib.request.urlopen(address, timeout=30.0).read()
        made.alive()
        made.before = memory(process.pid)[0]
        yield made
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def request(method: str, path: str, headers: dict[str, str] | None = None) -> bytes:
    """The head of a request as the page sends it."""
    lines = {"Host": "127.0.0.1", "X-Requested-With": "xy_sysid", **(headers or {})}
    return f"{method} {path} HTTP/1.1\r\n{''.join(f'{name}: {value}' + chr(13) + chr(10) for name, value in lines.items())}\r\n".encode("latin-1")


def send(port: int, data: bytes, body: int = 0, wait: float = 2.0, chunked: bool = False) -> bytes:
    """Send data, then ``body`` bytes while they are accepted; returns the answer."""
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as line:
        line.settimeout(wait)
        with suppress(OSError):
            line.sendall(data)
            piece = b"x" * 65536
            framed = f"{len(piece):x}\r\n".encode() + piece + b"\r\n" if chunked else piece
            for _ in range(0, body, len(piece)):
                line.sendall(framed)
            if chunked and body:
                line.sendall(b"0\r\n\r\n")
        answer = b""
        with suppress(OSError):
            while len(answer) < 100_000 and (part := line.recv(65536)):
                answer += part
                if b"\r\n\r\n" in answer and not body:
                    break
        return answer


PATHS = ("/", "/stop", "/alive", "/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/nothing")


def _bodies(port: int, random: np.random.Generator) -> None:
    method, path = str(random.choice(["POST", "PUT", "GET"])), str(random.choice(PATHS))
    if random.random() < 0.5:
        send(port, request(method, path, {"Content-Length": str(BIG)}), BIG)
    else:
        send(port, request(method, path, {"Transfer-Encoding": "chunked"}), BIG, chunked=True)


def _lies(port: int, random: np.random.Generator) -> None:
    length = str(random.choice(["-1", "1e9", "99999999999999999999", "0x10", "", "10, 20", "abc"]))
    send(port, request("POST", str(random.choice(PATHS)), {"Content-Length": length}), 1000, 1.0)


def _headers(port: int, random: np.random.Generator) -> None:
    kinds = [
        {f"X-{k}": "a" * 1000 for k in range(500)},
        {"Cookie": "a=" + "b" * 200_000},
        {"Host": "a" * 60_000},
        {"Origin": "http://evil.example"},
        {"Cookie": "\x00\x01=;;;=\xff"},
        {"Range": "bytes=" + ",".join(f"{k}-{k + 1}" for k in range(5000))},
        {"Content-Type": "multipart/form-data; boundary=" + "a" * 50_000},
        {"Expect": "100-continue", "Content-Length": "1000000000000"},
    ]
    send(
        port,
        request(
            str(random.choice(["GET", "POST", "OPTIONS", "TRACE", "A" * 5000])), str(random.choice(PATHS)), kinds[int(random.integers(0, len(kinds)))]
        ),
        0,
        1.0,
    )


def _paths(port: int, random: np.random.Generator) -> None:
    paths = (
        "/../../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/_nicegui/../../etc/passwd",
        "/" + "a" * 100_000,
        "/%00",
        "/\xff\xfe",
        "//",
        "/_nicegui/auto/static/..%2f..%2f..%2fetc%2fpasswd",
    )
    answer = send(port, request("GET", str(paths[int(random.integers(0, len(paths)))])), 0, 1.0)
    assert b"root:" not in answer


def _noise(port: int, random: np.random.Generator) -> None:
    send(port, random.bytes(int(random.integers(1, 100_000))), 0, 1.0)


def upgrade(port: int, origin: str = "") -> socket.socket:
    """Open a WebSocket of the page like a browser; the caller closes it."""
    key = base64.b64encode(os.urandom(16)).decode()
    headers = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13"}
    line = socket.create_connection(("127.0.0.1", port), timeout=5.0)
    line.sendall(request("GET", "/_nicegui_ws/socket.io/?EIO=4&transport=websocket", headers | ({"Origin": origin} if origin else {})))
    return line


def frame(data: bytes, kind: int = 1) -> bytes:
    """A masked WebSocket frame (RFC 6455, section 5.2)."""
    size = len(data)
    head = bytes([0x80 | kind]) + (
        bytes([0x80 | size]) if size < 126 else bytes([0xFE]) + size.to_bytes(2, "big") if size < 65536 else bytes([0xFF]) + size.to_bytes(8, "big")
    )
    return head + bytes(4) + data


def _sockets(port: int, random: np.random.Generator) -> None:
    said = (
        b"[" * 100_000,
        b"40" + b"{" * 100_000,
        b'42["event",' + b"[" * 50_000,
        b"4" * 3_000_000,
        b"x" * 8_000_000,
        random.bytes(1000),
        b"451-" + b'["a",{"_placeholder":true,"num":9e9}]',
        b"",
    )
    with upgrade(port, "http://evil.example" if random.random() < 0.2 else "") as line, suppress(OSError):
        line.settimeout(1.0)
        line.recv(4096)
        for data in (b"40", said[int(random.integers(0, len(said)))], said[int(random.integers(0, len(said)))]):
            line.sendall(frame(data, int(random.choice([1, 1, 2, 9, 15]))))
        line.recv(65536)


def _lie_in_wait(port: int, random: np.random.Generator) -> None:
    """Forty connections that send an incomplete request."""
    lines = [socket.create_connection(("127.0.0.1", port), timeout=5.0) for _ in range(40)]
    for line in lines:
        line.sendall(b"POST /stop HTTP/1.1\r\nHost: 127")
    begun = time.monotonic()
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/alive", timeout=10.0):
        assert time.monotonic() - begun < ANSWERS
    for line in lines:
        line.close()


def attacking(attack: Callable[[int, np.random.Generator], None], seed: int) -> Callable[[int, Path], Iterator[Found]]:
    """Tries of one attack on a server."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        with server(folder) as made:
            for number in range(count):
                what = f"seed ({seed}, {number})"

                def once(number: int = number, what: str = what) -> Found:
                    attack(made.port, np.random.default_rng((seed, number)))
                    seconds, grown = made.alive(), memory(made.process.pid)[0] - made.before
                    if "Traceback" in made.said():
                        return Found("traceback", note=f"{what}: {made.said()[-400:]}")
                    good = seconds < ANSWERS and grown < MORE
                    return Found("full" if good else "too late", seconds, note="" if good else f"{what}: {seconds:.1f} s, {grown:.0f} MB more")

                yield judged(once, what)

    return tries


def stories(tries: int, folder: Path) -> Iterator[Found]:
    """Wrong texts of the topic story/x: brackets, numbers, names and nonsense."""
    from xy_sysid.page.topics_state import TopicsState

    made = (
        "[" * 100_000,
        '{"a":' * 50_000,
        '{"axis": ' + "9" * 100_000 + "}",
        "\x00",
        "",
        "NaN",
        "[]",
        '"a"',
        "\ud800",
        '{"a": 1e999}',
        "{" + '"a":1,' * 100_000 + '"b":2}',
    )
    for number in range(tries):
        random = np.random.default_rng((95, number))
        text = made[number] if number < len(made) else bytes(random.integers(32, 127, size=int(random.integers(1, 3000))).tolist()).decode()

        def once(text: str = text) -> Found:
            problem = TopicsState().story("x", text)
            return Found("one line" if problem and "\n" not in problem else "full")

        yield judged(once, f"story {text[:40]!r}", 2.0)


ATTACKS = (
    Attack("bodies of 40 MB", attacking(_bodies, 91), 40, 2, "2 s, 100 MB"),
    Attack("lengths that lie", attacking(_lies, 92), 60, 0, "2 s, 100 MB"),
    Attack("headers", attacking(_headers, 93), 100, 0, "2 s, 100 MB"),
    Attack("paths", attacking(_paths, 94), 60, 0, "2 s, 100 MB"),
    Attack("random bytes", attacking(_noise, 96), 60, 0, "2 s, 100 MB"),
    Attack("WebSockets that say nonsense", attacking(_sockets, 97), 100, 4, "2 s, 100 MB"),
    Attack("connections that say no more", attacking(_lie_in_wait, 98), 10, 0, "2 s"),
    Attack("stories", stories, 400, 20, "2 s"),
)
