"""The examples as notebooks: cells of a script, and their outputs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from campaigns.documents.notebooks import cells, executed, markdown

SCRIPT = '''"""What it is about."""

import math

# why
a = math.pi
plot(a).write_html("a.html", include_plotlyjs="cdn")
save(a)


def twice(x):

    return 2 * x
'''


def test_a_paragraph_is_a_cell_and_a_picture_ends_its_own() -> None:
    """Comments stay with their statement, a function with an empty line is one cell, and the figure is the last value of its cell."""
    said, code = cells(SCRIPT)
    assert said == "What it is about."
    assert code == ["import math", "# why\na = math.pi\nplot(a)", "save(a)", "def twice(x):\n\n    return 2 * x"]


def test_outputs_are_shown_and_no_word_of_them_is_markup() -> None:
    """Printed text is escaped; plotly.js draws a figure from its numbers."""
    figure = {"data": [{"name": "</script>"}], "layout": {}}
    outputs: list[dict[str, object]] = [
        {"output_type": "stream", "text": "<1 Hz>"},
        {"data": {"application/vnd.plotly.v1+json": figure, "text/plain": "Figure"}},
    ]
    made = markdown(SimpleNamespace(cells=[SimpleNamespace(cell_type="code", source="show()", outputs=outputs)]), "own")
    assert "```python\nshow()\n```" in made and "&lt;1 Hz&gt;" in made and "Figure" not in made
    assert 'Plotly.newPlot("own-1", ' in made and made.count("</script>") == 1


def test_a_script_is_run_in_a_kernel_in_an_empty_folder(tmp_path: Path) -> None:
    """The notebook has the output of its cells; its files are provided; no files remain here."""
    pytest.importorskip("nbclient", reason="pip install '.[docs]'")
    pytest.importorskip("ipykernel")
    script = tmp_path / "small.py"
    script.write_text(
        '"""Small."""\n\nfrom pathlib import Path\n\nprint(Path("given.txt").read_text(), sorted(Path().iterdir()))\n', encoding="utf-8"
    )
    notebook = executed(script, {"given.txt": "seen"})
    assert notebook.cells[0].source == "Small." and notebook.cells[1].source == "from pathlib import Path"
    assert "seen [PosixPath('given.txt')]" in notebook.cells[2].outputs[0].text
    assert [path.name for path in tmp_path.iterdir()] == ["small.py"]
