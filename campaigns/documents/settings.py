"""docs/settings.md, made from the settings: python -m campaigns.documents.settings > docs/settings.md"""

from __future__ import annotations

from xy_sysid.files.ros_parameters import NODES
from xy_sysid.settings import Knob, knobs

HEAD = """# Settings

All settings of all nodes. This page is made from `xy_sysid/settings.py` by `python -m campaigns.documents.settings > docs/settings.md`. They are ROS
parameters of the node; the identifier's are also `--set NAME=VALUE` of `xy-sysid frf`, `fit`, `replay`, `validate`, `report` and `study`, and
the excitation's axis settings are `--excite NAME=VALUE` of `xy-sysid simulate`. Units are SI. `x` stands for any axis.
"""


def document() -> str:
    """The page."""
    parts = [HEAD]
    for node, cls in NODES.items():
        parts.append(f"\n## {node}\n\n| name | default | unit | allowed | meaning |\n|---|---|---|---|---|")
        parts += [_row(item) for item in knobs(cls()) if not item.name.startswith("y.") and not item.name.endswith(".y")]
    return "\n".join(parts) + "\n"


def _row(item: Knob) -> str:
    allowed = ", ".join(item.choices)
    if item.low is not None or item.high is not None:
        allowed = " to ".join("" if limit is None else f"{limit:.6g}" for limit in (item.low, item.high))
    shown = ", ".join(item.value) if isinstance(item.value, list) else str(item.value).lower() if isinstance(item.value, bool) else str(item.value)
    cells = (f"`{item.name}`", f"`{shown or '(empty)'}`", item.unit, allowed, item.meaning)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    import sys

    sys.stdout.write(document())
