"""Freed memory stays with the process: page faults of a program that makes and drops arrays."""

import os
import subprocess
import sys

PROGRAM = """
import resource
import numpy as np
{before}
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def work():
    several = [np.ones(40_000 + 1000 * k) for k in range(24)]
    return sum(one[0] for one in several)
work()
begun = faults()
for _ in range(50):
    work()
print(faults() - begun)
"""


def _faults(before: str) -> int:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(before=before)], env=environment, capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_arrays_that_are_made_again_and_again_cause_few_page_faults() -> None:
    """Without the setting each of the 50 times touches new pages."""
    kept = _faults("from xy_sysid.processes.memory import keep_freed_memory\nkeep_freed_memory()")
    assert kept < 0.1 * _faults("")
