"""xy-sysid page from the command line: errors in one line before anything starts."""

from __future__ import annotations

import json
import socket
import urllib.request
from pathlib import Path

import pytest
from helpers.browser_tools import Server
from helpers.cli_tools import npz, refused

from xy_sysid.cli.page import reading
from xy_sysid.errors import BadInput
from xy_sysid.page.access import rules
from xy_sysid.page.orders import Order, OrderState
from xy_sysid.page.server import listen, url


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere.npz",), "is not there"),
        (("REC", "--folder", "nowhere"), "an existing folder"),
        (("REC", "--port", "99999"), "65535"),
        (("REC", "--namespace", "9bad", "--live"), "names after slashes"),
        (("REC", "--topic", "what=/x"), "voltage=NAME"),
        (("REC", "--effect-file", "nothing.py"), "a .py file that is there"),
        (("REC", "--host", "not.an.address.invalid"), "an address of this machine"),
    ],
)
def test_a_wrong_use_is_one_line(arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 2, the value, and the allowed range."""
    monkeypatch.chdir(tmp_path)
    recording = npz(tmp_path / "a.npz", rows=600)
    assert words in refused("page", *(recording if word == "REC" else word for word in arguments))


def test_how_recordings_are_read_reaches_worker_and_report() -> None:
    """--topic and --effort become arguments of load and, unchanged, of the report."""
    how = reading(["voltage=/drive/u"], True, None)
    assert how.load == {"voltage_topic": "/drive/u", "effort_as_voltage": True}
    assert how.words == ("--topic", "voltage=/drive/u", "--effort")
    with pytest.raises(BadInput):
        reading(["voltage"], False, None)


def test_how_tables_are_read_reaches_worker_and_report() -> None:
    """--map, --unit, --scale and --rate, too."""
    how = reading(None, False, None, {"--map": ["input=a,output=b"], "--unit": [], "--scale": ["output=2"], "--rate": ["500"]})
    assert how.load == {"columns": {"input": "a", "output": "b"}, "scales": {"output": 2.0}, "rate": 500.0}
    assert how.words == ("--map", "input=a,output=b", "--scale", "output=2", "--rate", "500")
    with pytest.raises(BadInput):
        reading(None, False, None, {"--map": ["input"]})


def test_a_port_that_is_taken_gives_the_next() -> None:
    """Two pages on one computer; the printed address is the one that answers, with the token if there is one."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with listen("127.0.0.1", port) as found:
            assert port < found.getsockname()[1] <= port + 20
    assert url("127.0.0.1", 8080, rules("127.0.0.1")) == "http://127.0.0.1:8080/"
    assert url("::1", 8080, rules("::1")) == "http://[::1]:8080/"
    assert url("0.0.0.0", 8080, rules("0.0.0.0", "abc")) == f"http://{socket.gethostname()}:8080/?token=abc"


def test_the_address_comes_as_json_and_ctrl_c_ends_the_page(tmp_path: Path) -> None:
    """One document with the address that answers; afterwards 130 and no traceback."""
    server = Server(tmp_path, npz(tmp_path / "a.npz", rows=600), "--json")
    try:
        with urllib.request.urlopen(json.loads(server.first)["address"] + "alive", timeout=60) as answer:
            assert json.loads(answer.read()) == {"page": "xy_sysid"}
    finally:
        code = server.end()
    assert code == 130 and "Traceback" not in server.said(), server.said()


def test_what_is_done_is_told_in_words() -> None:
    """The name of the effect with spaces; the diagnoser's own words if available."""
    assert OrderState(Order(1, "add", "x", "dead_zone"), 0.0).words == "adding dead zone"
    assert OrderState(Order(1, "auto", "x"), 0.0, said="axis x: fitting").words == "axis x: fitting"
