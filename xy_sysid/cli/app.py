"""The commands by name. Each is one file; it imports other modules only when it runs, so that --help is fast."""

from __future__ import annotations

from typing import Annotated

import typer

from xy_sysid.cli.columns import columns
from xy_sysid.cli.compare import compare
from xy_sysid.cli.coupling import coupling
from xy_sysid.cli.demo import demo
from xy_sysid.cli.diagnose import diagnose
from xy_sysid.cli.effects import effects
from xy_sysid.cli.figures import figures
from xy_sysid.cli.fit import fit
from xy_sysid.cli.fleet import fleet
from xy_sysid.cli.frf import frf
from xy_sysid.cli.next import next_
from xy_sysid.cli.page import page
from xy_sysid.cli.record import record
from xy_sysid.cli.refine import refine
from xy_sysid.cli.replay import replay
from xy_sysid.cli.report import report
from xy_sysid.cli.servo import servo
from xy_sysid.cli.simulate import simulate
from xy_sysid.cli.start import run
from xy_sysid.cli.steps import steps
from xy_sysid.cli.study import study
from xy_sysid.cli.trajectory import trajectory
from xy_sysid.cli.trend import trend
from xy_sysid.cli.use import use
from xy_sysid.cli.validate import validate

app = typer.Typer(
    name="xy-sysid",
    help="Identify the axes of a machine: frequency response, transfer function with delay, and missing physical effects, all with uncertainty.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        import xy_sysid

        typer.echo(f"xy-sysid {xy_sysid.__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")] = False,
) -> None:
    pass


WATCH = (demo, page, run, trajectory, record, replay)
IDENTIFY = (simulate, columns, frf, fit, steps, servo, coupling, validate)
EXPLAIN = (compare, diagnose, refine, effects, use, study, report, figures)
MANY = (fleet, trend)
for command in (*WATCH, *IDENTIFY, *EXPLAIN, *MANY):
    app.command(name=command.__name__)(command)
app.command(name="next")(next_)
