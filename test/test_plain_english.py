"""Unclear phrases do not return: in README, the documentation, and all texts of the program."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from helpers import ROOT

# phrase -> replacement; proselint, in ``make lint``, checks general English
INSTEAD = {
    r"(told|tells?|telling)\b[^.:,;]{0,40} apart\b": "distinguish",
    r"\btakes? away\b": "explains, removes",
    r"\bthe (former|latter)\b": "the name itself",
    r"\bit is so that\b": "the statement alone",
    r"\bfor ever\b": "how long, or no end",
    r"\bwhoever\b": "the person: an operator, a reader, you",
    r"\bunasked\b": "by itself, by default",
    r"\b(brief|whole) fits?\b": "screening fit, full fit",
    r"\bnobody (tells|knows|says)\b": "it is not known",
    r"\bin vain\b": "without success",
    r"\bthis very\b": "this",
    r"\bof which the\b": "a second sentence",
    r"\bwhat is to be\b": "a noun",
    r"\bwhat (is left|(a|the) model leaves)\b": "residual error",
    r"\b(can|could)(not)? be told\b": "determine, distinguish",
    r"\banew\b": "again",
    r"\bsomebody\b": "a user, an operator",
}


def shown(path: Path) -> Iterator[tuple[int, str]]:
    """(line, text) of each string of a Python file that is not a docstring."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            docstrings.add(id(first.value) if isinstance(first, ast.Expr) else 0)
            if node in tree.body and path.parent.name == "cli" and isinstance(first, ast.Expr):
                yield first.lineno, ast.get_docstring(node) or ""  # the help of a command
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.lineno, node.value


def texts() -> Iterator[tuple[str, str]]:
    """(place, text) of all texts for people."""
    for page in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("config/*.md")]:
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            yield f"{page.name}:{number}", line
    for path in sorted((ROOT / "xy_sysid").rglob("*.py")):
        for number, text in shown(path):
            yield f"{path.relative_to(ROOT)}:{number}", text


def test_no_text_that_people_read_has_a_phrase_to_be_read_twice() -> None:
    """Each phrase has a plain replacement."""
    found = [
        f"{place}: {hit.group()!r}; write: {better}"
        for place, text in texts()
        for phrase, better in INSTEAD.items()
        if (hit := re.search(phrase, text, re.IGNORECASE))
    ]
    assert not found, "\n".join(found)
