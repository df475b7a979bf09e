"""The numbers that decide which experiment is chosen."""

from __future__ import annotations

import ast
from pathlib import Path

import xy_sysid.experiment_design as package
from xy_sysid.experiment_design.criteria import TABLE

ELSEWHERE = {
    "first.py": {"POLE", "DELAY", "FRICTION", "CROSSES", "COUNTS", "WIDTH", "DRAWS", "SHORTEST"},  # the possible axes
    "experiment.py": {"AGE", "KEPT"},  # settings of the excitation, and a cache
    "limits.py": {"SECONDS"},  # a limit that is not set
    "proposals.py": {"PART", "NEAR", "HALVES", "FINER"},  # the grid of candidates
}


def test_every_number_that_decides_stands_in_one_table() -> None:
    """Constants in other modules are not allowed, except those of the candidates and of the possible axes."""
    for path in sorted(Path(package.__file__).parent.glob("*.py")):
        if path.name == "criteria.py":
            continue
        made = [node for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.Assign)]
        numbers = [
            node for node in made if any(isinstance(part, ast.Constant) and isinstance(part.value, int | float) for part in ast.walk(node.value))
        ]
        names = {target.id for node in numbers for target in node.targets if isinstance(target, ast.Name)}
        assert names <= ELSEWHERE.get(path.name, set()), (path.name, names)


def test_every_number_has_a_reason() -> None:
    """Its name is unique; its reason is more than its name."""
    assert len({row.name for row in TABLE}) == len(TABLE) > 20
    assert all(len(row.because) > 20 for row in TABLE)
