"""xy-sysid run: start the nodes of a run file, and monitor them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o

if TYPE_CHECKING:
    from xy_sysid.processes.run_plan import ProcessSpec


def run(
    params: Annotated[str, typer.Option("--params", metavar="FILE", help="run file: a path, or a name in config/")] = "demo.yaml",
    first: Annotated[bool, typer.Option("--first", help="first motion of an unknown machine: small steps, each of them checked")] = False,
    json: o.Json = False,
) -> None:
    """Start the nodes of a run file as processes and monitor them until Ctrl-C."""
    from xy_sysid.cli.output import aside, emit
    from xy_sysid.processes import starter

    o.ros_domain()
    say = (lambda line: aside.print(line, markup=False)) if json else starter._print
    if first:
        answer = first_run(starter.load(params), say)
        if json:
            emit({"run": params, **answer})
        elif not answer["exit_code"]:
            axis = next(iter(answer["axes"]), "x")
            say(f"Next, a first experiment for axis {axis}: xy-sysid next --for nothing --params {params} --axis {axis} -o first.yaml")
        raise typer.Exit(answer["exit_code"])
    code = starter.run(starter.load(params), say=say)
    if json:
        emit({"run": params, "exit_code": code})
    raise typer.Exit(code)


def first_run(specs: Sequence[ProcessSpec], say: Callable[[str], None]) -> dict[str, Any]:
    """Start the nodes, measure the machine with small steps, and stop the nodes; returns the JSON document."""
    import threading

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
