"""The table of columns of docs/fleet.md, made from ``columns``: python -m campaigns.documents.fleet_columns --write"""

from __future__ import annotations

from xy_sysid.axis.model import STANDARD
from xy_sysid.fleets.columns import ROOTS, Column, columns

BEGIN, END = "<!-- made from xy_sysid/fleets/columns -->\n", "<!-- end -->\n"
SHOWN = ("coulomb_friction_coulomb",)  # the only effect parameters in the table, as an example


def document() -> str:
    """The table between its marks, with the first resonance and one effect parameter as examples."""
    rows = "".join(f"| `{item.name}` | {item.unit} | {item.meaning} |\n" for item in columns() if _shown(item))
    return f"{BEGIN}| column | unit | meaning |\n|---|---|---|\n{rows}{END}"


def _shown(item: Column) -> bool:
    name = item.name
    if name.endswith(("_low", "_high")) and not name.startswith("frf_"):
        return False
    other = any(f"resonance_{number}_" in name for number in range(2, ROOTS + 1))
    own = any(name.startswith(f"{effect}_") for effect in STANDARD.effects)
    return not other and (not own or name in SHOWN)


def with_table(page: str) -> str:
    """A page with its table replaced by the current one."""
    before, _, rest = page.partition(BEGIN)
    return before + document() + rest.partition(END)[2]


if __name__ == "__main__":
    import sys
    from pathlib import Path

    if sys.argv[1:] == ["--write"]:
        path = Path("docs/fleet.md")
        path.write_text(with_table(path.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        sys.stdout.write(document())
