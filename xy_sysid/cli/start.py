"""xy-sysid run: start the nodes that a file names, and watch them."""

from __future__ import annotations

from typing import Annotated

import typer

from xy_sysid.cli import options as o


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
        from xy_sysid.cli.first import first_run

        answer = first_run(starter.load(params), say)
        if json:
            emit({"run": params, **answer})
        raise typer.Exit(answer["exit_code"])
    code = starter.run(starter.load(params), say=say)
    if json:
        emit({"run": params, "exit_code": code})
    raise typer.Exit(code)
