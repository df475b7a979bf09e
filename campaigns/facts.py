"""Place and date of a campaign, for the page that it writes."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def facts(*packages: str) -> str:
    """Day, commit, cores, processor, Python, and the versions of some packages."""
    asked = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=7", "--exclude=*"]
    try:
        commit = subprocess.run(asked, capture_output=True, text=True, timeout=10).stdout.strip()
    except OSError:
        commit = ""
    told = [str(date.today()), *([f"commit {commit}"] if commit else []), f"{os.cpu_count()} cores", platform.machine()]
    return ", ".join([*told, f"Python {platform.python_version()}", *map(_told, packages)]) + "."


def _told(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"{package} not installed"
