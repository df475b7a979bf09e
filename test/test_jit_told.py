"""A person is told when laws are compiled, which takes half a minute once on a machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CODE = """
from xy_sysid.jit import compiled, tell_compiling
said = []
tell_compiling(lambda: said.append('compiling'))
from law import law
assert law(1.0) == 2.0
print(len(said))
"""


def test_it_is_said_once_where_something_is_compiled_and_never_where_the_disk_has_it(tmp_path: Path) -> None:
    """The first process compiles two functions and says it once; the second finds both on the disk."""
    text = "from xy_sysid.jit import compiled\n\n@compiled\ndef one(x):\n    return x + 1.0\n\n@compiled\ndef law(x):\n    return one(x)\n"
    (tmp_path / "law.py").write_text(text, encoding="utf-8")
    told = [subprocess.run([sys.executable, "-c", CODE], cwd=tmp_path, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert told == ["1\n", "0\n"]
