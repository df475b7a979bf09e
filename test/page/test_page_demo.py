"""The demo with its page, started like a user: an address within seconds, and Ctrl-C ends everything."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
import uuid
from pathlib import Path

from helpers.cli_tools import bare
from helpers.ros_tools import needs_ros, new_domain

from xy_sysid.cli.demo_page import wished

pytestmark = needs_ros


def test_the_demo_prints_the_address_of_a_page_that_answers_and_ctrl_c_ends_all_of_it(tmp_path: Path) -> None:
    """The page answers at the requested port while the nodes run; afterwards no process is left, and the folder is empty."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    mark = uuid.uuid4().hex
    environment = bare(ROS_DOMAIN_ID=str(new_domain()), XY_SYSID_TEST_MARK=mark)
    environment.pop("DISPLAY", None)
    words = [sys.executable, "-m", "xy_sysid", "demo", "--page", "--port", str(port), "--no-browser"]
    demo = subprocess.Popen(words, cwd=tmp_path, env=environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        assert demo.stdout is not None
        line = demo.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/", line)
        assert found and found.group() == f"http://127.0.0.1:{port}/", line
        with urllib.request.urlopen(found.group(), timeout=60) as page:
            assert "xy_sysid" in page.read().decode()
        time.sleep(0.5)
        demo.send_signal(signal.SIGINT)
        _, err = demo.communicate(timeout=120)
    finally:
        if demo.poll() is None:
            demo.kill()
            demo.wait(5)
    assert demo.returncode == 130 and "Traceback" not in err, err
    assert list(tmp_path.iterdir()) == []
    left = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if mark.encode() in (folder / "environ").read_bytes():
                left.append((folder / "cmdline").read_bytes())
        except OSError:
            continue
    assert left == []


def test_the_page_comes_only_where_somebody_sits() -> None:
    """Piped, in a script or with --json the demo has no page by default; --page and --no-page override this."""
    assert wished(None, False) is False  # no terminal here
    assert wished(True, False) is True and wished(False, False) is False
    assert wished(None, True) is False
