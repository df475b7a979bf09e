"""A loaded machine: ``python -m helpers.busy 8 COMMAND...`` runs a command with eight busy processes beside it.

The exit code is the command's. The busy processes end with it, and also when this process is killed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

PATIENCE = 4.0  # a wait for something that happens gets so many times what it takes alone on the machine: success does not wait


def allowed(seconds: float) -> float:
    """How long something may take that must be quick, when others want the processors, too: s, and as given on a quiet machine."""
    return seconds * max(1.0, 2.0 * os.getloadavg()[0] / (os.cpu_count() or 1))


SPIN = """
import os
parent = os.getppid()
print("busy", flush=True)
while os.getppid() == parent:
    sum(range(100_000))
"""


@contextmanager
def busy(count: int) -> Iterator[list[int]]:
    """So many processes that work without end; the numbers of those, all of them at work."""
    workers: list[subprocess.Popen[bytes]] = []
    try:
        for _ in range(count):
            workers.append(subprocess.Popen([sys.executable, "-S", "-c", SPIN], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE))
        for worker in workers:
            assert worker.stdout is not None and worker.stdout.readline() == b"busy\n"
        yield [worker.pid for worker in workers]
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.communicate()


def main(words: Sequence[str]) -> int:
    """Number of busy processes, command."""
    if len(words) < 2 or not words[0].isdigit():
        sys.stderr.write("busy: give a number and a command, for example: busy 8 python -m pytest\n")
        return 2
    with busy(int(words[0])):
        return subprocess.call(words[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
