"""python -m campaigns.pictures [name ...]: make docs/reading-pictures.md and the pictures in docs/pictures/ (only those named, with names)."""

from __future__ import annotations

import sys
from pathlib import Path

from campaigns.pictures.examples import EXAMPLES, rigid_model, whole_story
from campaigns.pictures.page_shot import shoot_page
from campaigns.pictures.reading import page
from campaigns.pictures.shots import shoot
from xy_sysid.errors import BadInput
from xy_sysid.report import story_figures as f

DOCS = Path(__file__).parents[2] / "docs"
SMALL, WIDE = (380, 300), (760, 320)  # px


def main(names: list[str]) -> int:
    """Make the pictures; returns the exit code."""
    folder = DOCS / "pictures"
    folder.mkdir(exist_ok=True)
    known = [*(example.name for example in EXAMPLES), "ladder", "before_after", "candidates", "response", "page"]
    for name in names:
        if name not in known:
            raise BadInput("picture", repr(name), ", ".join(known), "Choose some of these.")
    wanted = names or known
    for example in EXAMPLES:
        if example.name in wanted:
            story = rigid_model(example)
            shoot([made(story) for made in example.pictures], folder / f"{example.name}.png", *SMALL)
            print(example.name, flush=True)
    whole = [name for name in wanted if name in known[len(EXAMPLES) : -1]]
    if whole:
        story = whole_story()
        made = {
            "ladder": ([f.ladder(story)], WIDE),
            "before_after": ([f.before_after(story)], (WIDE[0], 460)),
            "candidates": ([f.candidates(story)], (WIDE[0], 260)),
            "response": ([f.bode(story), f.coherence(story)], (560, 380)),
        }
        for name in whole:
            figures, size = made[name]
            shoot(figures, folder / f"{name}.png", *size)
            print(name, flush=True)
    if "page" in wanted:
        shoot_page(folder / "page.png")
        print("page", flush=True)
    (DOCS / "reading-pictures.md").write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except BadInput as problem:
        sys.exit(f"pictures: {problem}")
