"""xy-sysid run: start the nodes that a file names, and watch them."""

from __future__ import annotations

from typing import Annotated

import typer

from xy_sysid.cli import options as o


def run(
    params: Annotated[str, typer.Option("--params", metavar="FILE", help="run file: a path, or a name in config/")] = "demo.yaml",
    json: o.Json = False,
) -> None:
    """Start the nodes that the file names, as processes, and watch them until Ctrl-C."""
    from xy_sysid import starter
    from xy_sysid.cli.output import aside, emit

    o.ros_domain()
    code = starter.run(starter.load(params), say=(lambda line: aside.print(line, markup=False)) if json else starter._print)
    if json:
        emit({"run": params, "exit_code": code})
    raise typer.Exit(code)
