"""xy-sysid run --first: the nodes of the run file, and small pushes that find out what the machine is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xy_sysid.processes.run_plan import ProcessSpec


def first_run(specs: Sequence[ProcessSpec], say: Callable[[str], None]) -> dict[str, Any]:
    """Start the nodes, do the first run, stop them; the answer as JSON has it."""
    from xy_sysid.nodes.first_run import Conductor
    from xy_sysid.processes import starter

    over = threading.Event()
    conductor = Conductor(lambda words: say(f"first run: {words}"), over.is_set)
    thread = threading.Thread(target=conductor.run, name="first run", daemon=True)
    thread.start()
    try:
        code = starter.run(specs, say=say, enough=lambda: not thread.is_alive())
    finally:
        over.set()
        thread.join(15.0)
        conductor.close()
    found = {axis: asdict(one) for axis, one in conductor.found.items()}
    return {"exit_code": code or (1 if conductor.problem else 0), "problem": conductor.problem or None, "axes": found}
