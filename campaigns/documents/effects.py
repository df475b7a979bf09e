"""docs/effects.md, made from the folder of effects: python -m campaigns.documents.effects > docs/effects.md"""

from __future__ import annotations

from collections.abc import Iterable

from xy_sysid.effects import EFFECTS, Effect

HEAD = """# Effects

All physical effects that a diagnosis can name. This page is made from `xy_sysid/effects/` by
`python -m campaigns.documents.effects > docs/effects.md`; `xy-sysid effects` prints the same. Bounds and usual sizes are given for a machine with
25 mm/s and 1 V rms at 2 kHz. They are scaled to the motion and the input of each recording. Forces are given in volts of the drive: the voltage that
overcomes them. Multiply by the drive's force per volt to get newtons. How to add your own: [your-own-effect.md](your-own-effect.md).

The base of every model is `v' = pole (gain (u_eff - F) - v)`. F is a force against the drive, u_eff the voltage that acts, v velocity, x position,
y the reading of the encoder; a prime is a time derivative. In the laws of resonances s is the Laplace variable, v_rigid the velocity without the
resonance, d is `damping` and d_p is `pole_damping`. In `backlash` d is the depth of contact.

Where an effect acts: `base`: a part of every model; `input`: changes the voltage; `state`: changes the voltage, and has states of its own;
`force`: a force against the drive; `friction`: dry friction; `bristle`: all dry friction acts through it; `motion`: a linear filter of the
motion; `encoder`: an error of the reading.

| name | law | where it acts | look-alikes |
|---|---|---|---|
"""

OWN = "; each of several recordings has its own"


def document(effects: Iterable[Effect] = EFFECTS.values()) -> str:
    """The page."""
    shown = sorted(effects, key=lambda effect: (effect.category != "base", effect.name))
    rows = [f"| [{e.name}](#{e.name}) | `{_cell(e.law)}` | {e.category} | {', '.join(e.look_alikes)} |" for e in shown]
    return HEAD + "\n".join(rows) + "\n" + "".join(_section(effect) for effect in shown)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _section(e: Effect) -> str:
    rows = [
        f"| `{item.name}` | {item.unit} | {item.bounds} | {item.typical:g} | {_cell(item.meaning)}{OWN if item.per_recording else ''} |"
        for item in e.parameters
    ]
    table = "\n".join(["| parameter | unit | allowed | usual | meaning |", "|---|---|---|---|---|", *rows])
    return f"""
## {e.name}

    {e.law}

{_sentence(e.meaning)}

{table}

- Valid for: {e.validity}{"; acts on the table: inside a backlash gap it does not reach the motor" if e.on_table else ""}
- Shows as: {e.shows}
- Look-alikes: {", ".join(e.look_alikes)}
- Distinguished by: {e.experiment}
- Source: {e.source}
"""


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


if __name__ == "__main__":
    import sys

    sys.stdout.write(document())
