"""Tasks -> their results, on the processes of a dask cluster: the cores of this machine, or an existing scheduler.

A task whose process dies is tried once more at the end, alone, so that no other task can be the reason. If its process dies again, its row says so.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from xy_sysid.errors import BadInput, MissingExtra, XySysidError
from xy_sysid.fleets.of_file import Done, Task, lost, rows_of_file
from xy_sysid.fleets.row import FAULT
from xy_sysid.jit import cores
from xy_sysid.processes.deaf import deaf
from xy_sysid.processes.memory import ENVIRONMENT

if TYPE_CHECKING:
    from distributed import Client

AHEAD = 2  # tasks for each process that the scheduler has at a time
PATIENCE = 10.0  # s to wait for an answer of a scheduler
DIED = (
    "its process died twice while it was analysed (too little memory?). As long as file, options and version are the same it is not tried again. "
    "Analyse it alone: xy-sysid fleet --one FILE."
)
HERE = {
    "distributed.scheduler.allowed-failures": 0,  # a task whose process died is reported at once
    "distributed.scheduler.worker-saturation": 1.0,  # one task for each process
    "distributed.worker.profile.enabled": False,  # it stores the stacks of an hour, 100 MB and more
    "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": 1,  # as dask itself sets for BLAS
    # dask would return every array to the system at once: twice the processor time
    **{f"distributed.nanny.pre-spawn-environ.{name}": size for name, size in ENVIRONMENT.items()},
}


@dataclass(frozen=True, slots=True)
class Cluster:
    """Where tasks run. workers: processes on this machine, 0 for one per core; scheduler: address of an existing one, tcp://HOST:PORT."""

    workers: int = 0
    scheduler: str = ""


def dask() -> Any:
    """The module ``distributed``. Raises MissingExtra if it is not installed."""
    try:
        import distributed
    except ImportError:
        raise MissingExtra("dask.distributed, which runs a fleet's processes,", "fleet") from None
    return distributed


@contextmanager
def connected(where: Cluster) -> Iterator[Client]:
    """A client of the cluster; processes on this machine end with it. Raises BadInput if the scheduler does not answer."""
    distributed = dask()
    if where.scheduler:
        try:
            client = distributed.Client(where.scheduler, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            raise BadInput("--scheduler", where.scheduler, "the address of a dask scheduler, tcp://HOST:PORT", f"Start one ({error}).") from None
        with distributed.utils.silence_logging_cmgr("CRITICAL"), client:
            yield client
        return
    import dask as settings

    with _own_environment():
        with settings.config.set(HERE), deaf():
            cluster = distributed.LocalCluster(
                n_workers=where.workers or cores(), threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0",
                silence_logs="CRITICAL",
            )  # fmt: skip
        with cluster, distributed.Client(cluster) as client:
            yield client


@contextmanager
def _own_environment() -> Iterator[None]:
    """Restore this process's environment at the end: dask overwrites it with that of its workers."""
    before = dict(os.environ)
    try:
        yield
    finally:
        for name in {*os.environ} - {*before}:
            del os.environ[name]
        os.environ.update(before)


def processes(client: Client) -> int:
    """Threads of all workers of a cluster: tasks that run at the same time; 0 for a scheduler without workers."""
    workers: dict[str, dict[str, int]] = client.scheduler_info(n_workers=-1)["workers"]
    return sum(one["nthreads"] for one in workers.values())


def results(client: Client, tasks: Sequence[Task]) -> Iterator[tuple[Done, float]]:
    """(result, duration in s) of each task in order of completion; only a few tasks wait at the scheduler at a time.

    Raises XySysidError if the scheduler goes away.
    """
    waiting, doubtful = iter(tasks), list[Task]()
    blamed = list[Task]()
    try:
        yield from _window(client, waiting, lambda: AHEAD * max(processes(client), 1), doubtful)
        yield from _window(client, iter(doubtful), lambda: 1, blamed)
    except (CancelledError, OSError):
        raise XySysidError("The connection to the scheduler is lost. Finished recordings are in the table: run the same command again.") from None
    for task in blamed:
        yield lost(task, DIED), 0.0


def _window(client: Client, waiting: Iterator[Task], ahead: Callable[[], int], died: list[Task]) -> Iterator[tuple[Done, float]]:
    """Results of tasks, at most ``ahead()`` of them at the scheduler (more when a cluster grows). Tasks whose process died are added to ``died``."""
    distributed = dask()
    running: dict[Any, Task] = {}
    ended = distributed.as_completed()

    def fill() -> None:
        for task in itertools.islice(waiting, max(ahead() - len(running), 0)):
            future = client.submit(timed, task, pure=False)
            running[future] = task
            ended.add(future)

    fill()
    while running:
        future = next(ended)
        task = running.pop(future)
        error = future.exception()
        if error is None:
            yield future.result()
        elif isinstance(error, distributed.KilledWorker):
            died.append(task)
        else:
            text = f"{type(error).__name__}: {error}. {FAULT}"
            yield lost(task, " ".join(text.split())), 0.0
        future.release()
        fill()


def timed(task: Task) -> tuple[Done, float]:
    """The rows of a recording and the duration in s; runs in any process."""
    from time import perf_counter

    begun = perf_counter()
    done = rows_of_file(task)
    return done, perf_counter() - begun
