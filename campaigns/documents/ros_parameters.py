"""config/default.yaml, made from the settings: python -m campaigns.documents.ros_parameters > config/default.yaml"""

from __future__ import annotations

import yaml

from xy_sysid.files.ros_parameters import BARE_BOOLEANS, NODES, WITH_AXES
from xy_sysid.settings import Knob, knobs


def default_text() -> str:
    """The parameter file with every setting of every node at its default, with meaning and unit."""
    lines = [
        "# Every parameter of every node, at its default. Units are SI.",
        '# Made from xy_sysid/settings.py: python -m campaigns.documents.ros_parameters. Keep "x" and "y" quoted: a bare y means true.',
    ]
    for node, cls in NODES.items():
        lines += ["", f"/**/{node}:", "  ros__parameters:"]
        group, explained = "", set[str]()
        if node in WITH_AXES:
            lines.append('    axes: ["x", "y"]  # names; parameters of axes that are not named here are not used')
        for knob in knobs(cls()):
            axis, _, name = knob.name.rpartition(".")
            if axis != group:
                lines.append(f'    "{axis}":')
                group = axis
            lines += _lines(knob, name, "      " if axis else "    ", knob.meaning not in explained)
            explained.add(knob.meaning)
    return "\n".join(lines) + "\n"


def _lines(knob: Knob, name: str, indent: str, explain: bool) -> list[str]:
    value = yaml.safe_dump(knob.value, default_flow_style=True, width=1000).removesuffix("...\n").strip()
    if isinstance(knob.value, str):
        value = f'"{knob.value}"'
    limits = " | ".join(knob.choices) or (f"{knob.low:.10g} to {knob.high:.10g}" if knob.low is not None and knob.high is not None else "")
    facts = "; ".join(part for part in (knob.unit, limits) if part)
    comment = [f"{indent}# {knob.meaning}{f' [{facts}]' if facts else ''}"] if explain else []
    shown = f'"{name}"' if BARE_BOOLEANS.fullmatch(name) or name == "x" else name
    return [*comment, f"{indent}{shown}: {value}"]


if __name__ == "__main__":
    import sys

    sys.stdout.write(default_text())
