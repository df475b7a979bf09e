"""The tables of files, keys and parts in docs/machines.md, generated from these: python -m campaigns.documents.machines"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from xy_sim.couplings import Couplings
from xy_sim.drive import Drive
from xy_sim.machine_file import Spec, machine_path, read
from xy_sim.parts import PARTS
from xy_sim.parts.contract import Group, Parameter
from xy_sysid.settings import knobs

_GROUPS: dict[Group, str] = {
    "base": "part of every model",
    "effect": "effects that a diagnosis should name",
    "added": "further effects that a diagnosis should name (`draw` leaves them out)",
    "outside": "effects that are not in the library",
    "event": "changes during a run",
    "imperfection": "imperfections of every real machine",
}


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)])


def files() -> str:
    """The machine files of the package, with a description and the parts of each axis."""

    def parts(spec: Spec) -> str:
        return "; ".join(f"{axis.name}: {', '.join(axis.parts)}" for axis in spec.axes) + (", and drawn ones" if spec.hidden is not None else "")

    found = sorted(machine_path("paper.yaml").parent.glob("*.yaml"))
    return _table(("file", "machine", "parts"), [(f"`{path.name}`", read(path).description, parts(read(path))) for path in found])


def drive() -> str:
    """The keys of an axis."""
    rows = [(f"`{item.name}`", f"{item.default}", item.unit, item.meaning) for item in knobs(Drive())]
    return _table(("key", "default", "unit", "meaning"), rows)


def couplings() -> str:
    """The keys of ``coupling``."""
    rows = [(f"`{item.name}`", f"{item.default}", item.unit, item.meaning) for item in knobs(Couplings())]
    return _table(("key", "default", "unit", "meaning"), rows)


def _range(item: Parameter) -> str:
    ends = f"{item.low:g}" if item.low == item.high else f"{item.low:g} to {item.high:g}"
    return ("± " if item.signed else "") + ends


def parts() -> str:
    """Every part with its law, its parameters, default sizes and the ranges that they are drawn from."""
    texts = []
    for group, title in _GROUPS.items():
        texts.append(f"### Parts: {title}")
        for part in PARTS.values():
            if part.group != group:
                continue
            rows = [(f"`{item.name}`", f"{item.default:g}", item.unit, _range(item), item.meaning) for item in part.parameters]
            texts.append(f"#### `{part.name}`\n{part.meaning[0].upper()}{part.meaning[1:]}.\n\n`{part.law}`\n\nSource: {part.source}.")
            texts.append(_table(("parameter", "default", "unit", "drawn from", "meaning"), rows))
    return "\n\n".join(texts)


SECTIONS = {"files": files, "drive": drive, "couplings": couplings, "parts": parts}


def refreshed(text: str) -> str:
    """The document with everything between ``<!-- NAME -->`` and ``<!-- end NAME -->`` generated again."""
    for name, make in SECTIONS.items():
        before, _, rest = text.partition(f"<!-- {name} -->")
        _, _, after = rest.partition(f"<!-- end {name} -->")
        text = f"{before}<!-- {name} -->\n{make()}\n<!-- end {name} -->{after}"
    return text


if __name__ == "__main__":
    path = Path("docs/machines.md")
    path.write_text(refreshed(path.read_text(encoding="utf-8")), encoding="utf-8")
