"""Identification of machine axes: live over ROS 2, and the same from a recording.

In a notebook::

    import xy_sysid as xy

    run = xy.load("rec").run("x")            # the longest stretch of an axis without a gap
    frf = xy.frf(run)                        # H1 with coherence and sigma; xy.frf_from("FRF.csv") of one that was measured elsewhere
    model = xy.fit(frf)                      # transfer function with delay; model.verdicts
    fails = xy.compare(run, model)           # where it fails
    found = xy.diagnose(run)                 # which effect is missing; found.sentence, found.runner_up
    for step in xy.refine(run):
        print(step.added, step.held_out_error)
    xy.save(step.model, "axis.yaml")
    used = xy.use(step.model, run)           # kS, kV, kA, tables, feedback, limits: used.gains, used.feedback, used.tracking

Packages in the order of the data; each imports only from those before it.

    samples, excitation:       recorded samples, and signals that drive the machine
    response, linear, fitting: windows and spectra to a frequency response, transfer functions, their fits and verdicts
    time_models:               small models for short tests
    effects, axis, greybox:    physical effects, simulation of an axis with effects, its fit
    comparison:                where a model fails
    hypotheses, diagnosis:     which effect is missing
    experiment_design:         what to measure next
    story, live:               the steps that are shown to users, and the online logic
    control_design:            what to do with the model
    bags, imports, files, processes: reading, writing, other processes
    fleets:                     many recordings of many machines, and what changes over time
    nodes, report, page, cli:  user interfaces
    paper:                      the paper's study
    front_door:                wrappers of the public functions

All packages may import ``errors``, ``settings``, ``units``, ``tables`` and ``jit``. The names of ``__all__`` are public, and each is loaded
when it is first used; all other modules may change.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xy_sysid.axis.model import AxisModel
    from xy_sysid.comparison.of_run import better, compare, validate
    from xy_sysid.comparison.physical_model import PhysicalModel
    from xy_sysid.control_design.use import use
    from xy_sysid.diagnosis.of_run import diagnose, refine
    from xy_sysid.errors import BadInput, BadRecording, MissingExtra, XySysidError
    from xy_sysid.experiment_design.limits import MachineLimits
    from xy_sysid.experiment_design.of_run import next_experiment, sharpen
    from xy_sysid.files.effects import library
    from xy_sysid.files.models import load_model, save
    from xy_sysid.fitting.of_run import LinearModel, fit, frf
    from xy_sysid.fleets.of_paths import fleet
    from xy_sysid.fleets.trends import trend
    from xy_sysid.front_door.simulated_recording import simulate
    from xy_sysid.front_door.small_models import coupling, mechanics, servo, steps
    from xy_sysid.imports import load
    from xy_sysid.imports.response_file import frf_from
    from xy_sysid.linear.reduction import balanced_truncation
    from xy_sysid.linear.to_others import to_control, to_scipy
    from xy_sysid.linear.transfer_function import TransferFunction
    from xy_sysid.report import plots as plot
    from xy_sysid.report.written import write_report
    from xy_sysid.response.frf import FrequencyResponse
    from xy_sysid.samples.recording import Recording, Run

    __version__: str

__all__ = [
    "AxisModel",
    "BadInput",
    "BadRecording",
    "FrequencyResponse",
    "LinearModel",
    "MachineLimits",
    "MissingExtra",
    "PhysicalModel",
    "Recording",
    "Run",
    "TransferFunction",
    "XySysidError",
    "__version__",
    "balanced_truncation",
    "better",
    "compare",
    "coupling",
    "diagnose",
    "fit",
    "fleet",
    "frf",
    "frf_from",
    "library",
    "load",
    "load_model",
    "mechanics",
    "next_experiment",
    "plot",
    "refine",
    "save",
    "servo",
    "sharpen",
    "simulate",
    "steps",
    "to_control",
    "to_scipy",
    "trend",
    "use",
    "validate",
    "write_report",
]

_HOMES = {
    "samples.recording": ("Recording", "Run"),
    "response.frf": ("FrequencyResponse",),
    "linear.transfer_function": ("TransferFunction",),
    "linear.reduction": ("balanced_truncation",),
    "linear.to_others": ("to_control", "to_scipy"),
    "fitting.of_run": ("LinearModel", "fit", "frf"),
    "axis.model": ("AxisModel",),
    "control_design.use": ("use",),
    "files.effects": ("library",),
    "comparison.physical_model": ("PhysicalModel",),
    "comparison.of_run": ("better", "compare", "validate"),
    "diagnosis.of_run": ("diagnose", "refine"),
    "experiment_design.limits": ("MachineLimits",),
    "experiment_design.of_run": ("next_experiment", "sharpen"),
    "imports": ("load",),
    "imports.response_file": ("frf_from",),
    "files.models": ("load_model", "save"),
    "fleets.of_paths": ("fleet",),
    "fleets.trends": ("trend",),
    "front_door.small_models": ("coupling", "mechanics", "servo", "steps"),
    "front_door.simulated_recording": ("simulate",),
    "report.written": ("write_report",),
    "errors": ("BadInput", "BadRecording", "MissingExtra", "XySysidError"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}
_PICTURES = {"FrequencyResponse": "bode", "Comparison": "residual", "Answer": "ladder"}  # of xy.plot, in a notebook


def __getattr__(name: str) -> Any:
    """A public name, from its own package, when it is first used."""
    if name == "__version__":
        value: Any = _version()
    elif name == "plot":
        value = _calls().pictures(importlib.import_module("xy_sysid.report.plots"))
    elif name in _HOME:
        home = importlib.import_module(f"xy_sysid.{_HOME[name]}")
        _show_as_pictures(home)
        _guard()
        value = getattr(home, name)
        if not isinstance(value, type):
            value = _calls().for_people(value, f"xy.{name}")
    else:
        raise AttributeError(f"module 'xy_sysid' has no attribute {name!r}; it has {', '.join(__all__)}")
    globals()[name] = value
    return value


def _calls() -> Any:
    """The wrapped public function: a path or a run is converted, and a wrong type raises one line."""
    return importlib.import_module("xy_sysid.front_door.calls")


def _guard() -> None:
    """Constructors and methods of the public classes that are loaded check their arguments, in calls from outside this package."""
    for name, home in _HOME.items():
        kind = getattr(sys.modules.get(f"xy_sysid.{home}"), name, None)
        if isinstance(kind, type):
            _calls().guard(kind, f"xy.{name}")


def _show_as_pictures(home: Any) -> None:
    """Results draw themselves in a notebook; plotly is imported with the first one."""
    for kind in (getattr(home, name) for name in _PICTURES if hasattr(home, name)):
        kind._repr_html_ = _html


def _html(result: Any) -> str | None:
    """For the notebook: ``repr`` as text and the picture; None if there is nothing to draw."""
    html: str | None = importlib.import_module("xy_sysid.report.notebook").html(result, _PICTURES[type(result).__name__])
    return html


def __dir__() -> list[str]:
    return sorted(__all__)


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("xy_sysid")
    except PackageNotFoundError:
        return "0+source"
