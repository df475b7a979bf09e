"""A loaded computer: ``python -m helpers.busy 8 COMMAND...`` runs a command together with eight busy processes.

The exit code is the command's. The busy processes end with it, and also when this process is killed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

PATIENCE = 4.0  # factor on timeouts compared with an idle computer: success does not wait


def allowed(seconds: float) -> float:
    """Time limit of a fast operation on a loaded computer, s; on an idle one, the given time."""
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
    """Start endlessly busy processes; returns their ids once all are at work."""
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
