"""What several tests share: machines, recordings, bags, commands, nodes and browsers to test with."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]  # of the project
