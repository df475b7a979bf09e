"""Checks before a named file is opened: it is a regular file, not too long for its kind, and YAML of moderate size."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import Any

import yaml

from xy_sysid.errors import BadRecording

LONGEST = 1 << 20  # bytes of a text by people or the commands: a model, parameters, a run file
WORDS = 20_000  # parts of such a YAML document; repeated parts (aliases) count each time
DEEPEST = 30  # levels of a YAML document
PARSER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # the parser in C, if it is available


def regular_file(path: Path) -> None:
    """Raises BadRecording for a pipe, a device, a socket (reading may never end) or a folder; OSError if it does not exist."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise BadRecording(path, "not a file but a pipe, a device, a socket or a folder", "Copy its content into a file first.")


def text_of(path: Path, what: str, most: int = LONGEST) -> str:
    """The text of a file in UTF-8.

    what: kind of file, for the message; most: bytes
    Raises BadRecording in one line if it is not a regular file, longer, not readable, or not text.
    """
    try:
        regular_file(path)
        size = path.stat().st_size
        if size > most:
            raise BadRecording(path, f"{size / 1e6:.3g} MB, and {what} has {most / 1e6:.2g} MB at most", "Check the path.")
        return path.read_text(encoding="utf-8")
    except OSError as problem:
        raise BadRecording(path, problem.strerror or "cannot be read", "Check the path and the permissions.") from None
    except UnicodeDecodeError:
        raise BadRecording(path, "is not text in UTF-8", f"Give {what}.") from None


def yaml_of(path: Path, what: str, most: int = LONGEST) -> Any:
    """The document of a YAML file by people.

    what: kind of file, for the message; most: bytes
    Raises BadRecording in one line as ``text_of``, and for invalid YAML or a document that is too long (see ``too_much``).
    """
    text = text_of(path, what, most)
    try:
        problem = too_much(text)
        document = None if problem else yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:  # ValueError: an impossible date
        raise BadRecording(path, "no YAML", f"Correct it: {str(error).splitlines()[-1].strip()}.") from None
    if problem:
        raise BadRecording(path, f"it holds {problem}, and {what} has fewer", "Check the path.")
    return document


def too_much(text: str, most: int = WORDS) -> str:
    """Reason not to read a YAML text: it has too many parts, also by aliases, or too many levels. Empty if it may be read.

    most: parts. Raises yaml.YAMLError for invalid YAML.
    """
    parts, inside = 0, list[tuple[str | None, int]]()
    known: dict[str, int] = {}  # number of parts by anchor
    for event in yaml.parse(text, Loader=PARSER):
        if isinstance(event, yaml.AliasEvent):
            parts += known.get(event.anchor or "", most + 1)  # an alias within its own anchor never ends
        elif isinstance(event, yaml.CollectionStartEvent):
            inside.append((event.anchor, parts))
            parts += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, begun = inside.pop()
            known |= {anchor: parts - begun} if anchor else {}
        elif isinstance(event, yaml.ScalarEvent):
            parts += 1
            known |= {event.anchor: 1} if event.anchor else {}
        if parts > most:
            return f"more than {most} values"
        if len(inside) > DEEPEST:
            return f"nested deeper than {DEEPEST} levels"
    return ""
