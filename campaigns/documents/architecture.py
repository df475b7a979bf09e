"""The picture of the packages, docs/pictures/packages.svg, generated from the imports.

python -m campaigns.documents.architecture           # the picture
python -m campaigns.documents.architecture --write   # write it into its file
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from campaigns.documents.layers import svg
from xy_sysid.errors import BadInput

PICTURE = "docs/pictures/packages.svg"
COMMON = ("errors", "settings", "units", "jit", "tables")  # imported by nearly all packages, and not drawn
FLOORS = {
    "what arrives": ("samples", "excitation"),
    "in frequency": ("response", "linear", "fitting"),
    "in time": ("time_models", "effects", "axis", "greybox", "comparison", "hypotheses", "diagnosis", "experiment_design"),
    "told": ("story", "live", "control_design"),
    "the edge": ("bags", "imports", "files", "processes", "fleets"),
    "surfaces": ("nodes", "report", "paper", "page", "front_door", "cli"),
}


def imports(package: Path) -> dict[tuple[str, str], int]:
    """(who, whom) -> number of files of package ``who`` that import from package ``whom``, without ``COMMON``."""
    counted: Counter[tuple[str, str]] = Counter()
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package).parts
        if len(parts) == 1:
            continue
        found = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{package.name}."):
                found.add(str(node.module).split(".")[1])
            elif isinstance(node, ast.ImportFrom) and node.module == package.name:
                found |= {alias.name for alias in node.names}
        counted.update((parts[0], whom) for whom in found - {parts[0], *COMMON})
    return dict(counted)


def reduced(edges: Mapping[tuple[str, str], int]) -> list[tuple[str, str]]:
    """The edges without those that a longer path implies (transitive reduction), as (imported, importing)."""
    after: dict[str, set[str]] = {}
    for who, whom in edges:
        after.setdefault(whom, set()).add(who)

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        waiting = [start]
        while waiting:
            for name in after.get(waiting.pop(), ()):
                if name not in seen:
                    seen.add(name)
                    waiting.append(name)
        return seen

    return sorted((whom, who) for who, whom in edges if not any(who in reached(other) for other in after[whom] - {who}))


def picture(package: Path) -> str:
    """An SVG: arrows lead from the imported to the importing package, in the direction of the data."""
    edges = imports(package)
    known = [name for names in FLOORS.values() for name in names]
    there = sorted(path.parent.name for path in package.glob("*/__init__.py"))
    if sorted(known) != there:
        odd = sorted(set(known) ^ set(there))
        raise BadInput("packages", ", ".join(odd), "those of FLOORS", "Say in campaigns/documents/architecture.py on which floor they are.")
    return svg(FLOORS, reduced(edges), "Packages of xy_sysid: an arrow leads from what is imported to what imports it")


if __name__ == "__main__":
    root = Path(__file__).parents[2]
    made = picture(root / "xy_sysid")
    if "--write" in sys.argv[1:]:
        (root / PICTURE).write_text(made, encoding="utf-8")
    else:
        sys.stdout.write(made)
