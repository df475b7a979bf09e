"""Two hosts as network namespaces, and a cable between them that loses packets, is pulled, and comes back: no kernel module is needed.

Each host has a TAP device; one process copies Ethernet frames from one to the other, and drops some by a seed. This needs root.
"""

from __future__ import annotations

import ctypes
import fcntl
import json
import os
import random
import select
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

NEW_NETWORK = 0x40000000  # CLONE_NEWNET of setns(2)
SET_NAME, TAP, NO_HEADER = 0x400454CA, 0x0002, 0x1000  # TUNSETIFF, IFF_TAP, IFF_NO_PI of if_tun.h
LONGEST = 65536  # bytes of a frame
MACHINE, DESK = "10.77.0.1", "10.77.0.2"


@dataclass(frozen=True, slots=True)
class Hosts:
    """Names of the namespaces, and the address for orders to the cable."""

    machine: str
    desk: str
    orders: str

    def order(self, **values: float) -> None:
        """loss: fraction of lost frames, in each direction; 1 is a pulled cable. There is no delay."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
            line.sendto(json.dumps(values).encode(), self.orders)


def why_not() -> str:
    """Why such hosts cannot be made here; empty if they can."""
    if sys.platform != "linux" or os.geteuid() != 0:
        return "network namespaces need Linux and root"
    if not Path("/dev/net/tun").exists():
        return "there is no /dev/net/tun"
    name = f"xyf{os.getpid()}t"
    try:
        made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return "ip (iproute2) is not installed"
    if made.returncode != 0:
        return f"no network namespace may be made here ({made.stderr.strip()})"
    _run("ip", "netns", "del", name)
    return ""


@contextmanager
def hosts(folder: Path) -> Iterator[Hosts]:
    """The machine's host and the desk, with a cable without loss; removed at the end."""
    names = [f"xyf{os.getpid()}{place}" for place in ("m", "d")]
    orders = str(folder / "cable")
    cable: subprocess.Popen[str] | None = None
    try:
        for name in names:
            _run("ip", "netns", "add", name)
        words = [sys.executable, "-m", "campaigns.faults.cable", orders, *names]
        cable = subprocess.Popen(words, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True)
        assert cable.stdout is not None and cable.stdout.readline() == "ready\n"
        for name, address in zip(names, (MACHINE, DESK), strict=True):
            for line in (f"addr add {address}/24 dev eth0", "link set eth0 up", "link set lo up", "route add default dev eth0"):
                _run("ip", "-n", name, *line.split())
        yield Hosts(names[0], names[1], orders)
    finally:
        if cable is not None:
            cable.kill()
            cable.wait()
            if cable.stdout is not None:
                cable.stdout.close()
        for name in names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)


def _run(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)


def _tap(space: str) -> int:
    """A TAP device named eth0 in a namespace, as a file descriptor of this process."""
    libc = ctypes.CDLL(None, use_errno=True)
    here = os.open("/proc/self/ns/net", os.O_RDONLY)
    there = os.open(f"/var/run/netns/{space}", os.O_RDONLY)
    try:
        if libc.setns(there, NEW_NETWORK) != 0:
            raise OSError(ctypes.get_errno(), "setns")
        device = os.open("/dev/net/tun", os.O_RDWR)
        fcntl.ioctl(device, SET_NAME, struct.pack("16sH22x", b"eth0", TAP | NO_HEADER))
        return device
    finally:
        libc.setns(here, NEW_NETWORK)
        os.close(here)
        os.close(there)


def main(orders: str, *spaces: str) -> None:
    """Copy frames until killed."""
    ends = [_tap(space) for space in spaces]
    chance, loss = random.Random(7), 0.0
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
        line.bind(orders)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while True:
            for ready in select.select([*ends, line.fileno()], [], [])[0]:
                if ready == line.fileno():
                    loss = float(json.loads(line.recv(LONGEST)).get("loss", loss))
                    continue
                frame = os.read(ready, LONGEST)
                if chance.random() >= loss:
                    with suppress(OSError):  # the other device is not up yet
                        os.write(ends[1 - ends.index(ready)], frame)


if __name__ == "__main__":
    main(*sys.argv[1:])
