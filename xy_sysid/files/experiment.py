"""Files of designed experiments: written by ``xy-sysid next``, read by the node that runs them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from xy_sysid.bags.atomic import write_text
from xy_sysid.bags.opening import text_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.excitation.designed import Taken, document_of, motion_file, with_experiment
from xy_sysid.files.ros_parameters import load
from xy_sysid.files.trajectories import motion_of
from xy_sysid.settings import ExcitationSettings

if TYPE_CHECKING:
    from xy_sysid.experiment_design.of_run import NextExperiment


def document(found: NextExperiment) -> dict[str, Any]:
    """The content of an experiment's file. Raises BadInput without an experiment."""
    if found.experiment is None or found.needs is None:
        raise BadInput("experiment", "none", "one that helps", found.sentence)
    made = document_of(found.axis, found.sampling_rate, found.experiment, found.needs, found.limits.units)
    made["experiment"] |= {"expects": found.sentence, "sets": [list(names) for names in found.sets]}
    return made


def write_experiment(path: Path, found: NextExperiment, motion: Path | None = None) -> None:
    """Write the file of an experiment, for parameter ``experiment`` of the excitation node. motion: CSV in the same folder, of its trajectory."""
    exact = document(found)
    if motion is not None:
        exact["experiment"]["motion"] = motion.name
    told = _quoted(exact)
    told["experiment"]["needs"] = exact["experiment"]["needs"]  # not rounded to a value above the limit
    text = yaml.safe_dump(told, sort_keys=False, width=120, allow_unicode=True)
    units = found.limits.units
    head = (
        "# Made by xy-sysid next. Run it: parameter experiment of the excitation node. It is refused where it asks for more than the node's limits.\n"
        f"# rms, offset, slow and needs.voltage are in {units.input}, other needs are in {units.output} (and s), times in s, frequencies in Hz.\n"
        "# It was designed for an axis that stands at needs.start. Elsewhere the motion (needs.reach) has to stay within needs.within.\n"
    )
    write_text(path, head + text)


def read_experiment(settings: ExcitationSettings, path: Path) -> Taken:
    """Settings with the experiment of a file, and its allowed start positions.

    Raises BadInput for a file that cannot be read, or that needs more than the settings allow.
    """
    try:
        text = text_of(path, "an experiment")
    except BadRecording as problem:
        raise BadInput("experiment", f"{path}: {problem.problem}", "a file of xy-sysid next", problem.act) from None
    told = load(text, path.name)
    name = motion_file(told, path.name)
    return with_experiment(settings, told, path.name, motion_of(path.with_name(name)) if name and settings.holds else None)


def _quoted(value: Any) -> Any:
    """Plain numbers, texts and lists."""
    if isinstance(value, dict):
        return {key: _quoted(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_quoted(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
