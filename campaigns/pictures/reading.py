"""docs/reading-pictures.md: how to read every picture, and a failing example per effect. Words here, facts from the library."""

from __future__ import annotations

from campaigns.pictures.examples import EXAMPLES, Example
from xy_sysid.effects import EFFECTS

HEAD = """# How to read the pictures

The page, the report and this text show the same pictures. Everything here is of the simulated machine, and `python -m campaigns.pictures`
(`make pictures`) makes it anew: pictures and text.

**Blue** is measured, **orange** is the model, **green** is the noise floor, **red** marks where the model fails, **grey** is not trusted.
Where two models lie over each other, blue is before and orange after.
Errors are those of velocity: the model is driven with the measured voltage alone, from the speed of the first sample on, so small errors
cannot hide in a correction. *Held out* are parts of the recording, spread over it, that no fit has seen (its last third for backlash,
whose filter must run through). The *noise floor* is what a perfect model would still be off by: the encoder's noise.

## The ladder

![A staircase that falls over two steps to the noise floor](pictures/ladder.png)

Each step is one more effect in the model, and everything is fitted again. Look at the solid line: the error on data that no fit has seen.
Good: it ends on the dotted green floor, with a tick. The dashed line is the error on the data of the fit; where it keeps falling while the solid line
rises, the last effect explains noise and should go. Where both stop above the floor, something is left that is not in the library.

## Before and after

![Error by frequency and in time, of the rigid model and of the last one](pictures/before_after.png)

Two steps over each other. By frequency: where the blue line is above 1 the rigid model fails; where the orange one is at or below 1 nothing is left.

## Candidates

![Bars: what each candidate leaves of the error](pictures/candidates.png)

What each effect leaves of the held-out error when it alone is added to the rigid model. Shorter is better. A runner-up far behind means a sure
name; bars of the same length mean that these data cannot tell the effects apart, and the diagnosis then names the experiment that can.

## Bode and coherence

![Magnitude and phase with the model over it; coherence](pictures/response.png)

Measured with its 95 % band (often thinner than the line), the model dashed over it. Grey crosses are not excited or not coherent; nothing is
fitted there. The coherence is 1 where the input explains all of the output. Here it falls to 0.85 below 10 Hz:
friction and cogging make motion that a linear response cannot explain. An axis without them has 0.99 and more down to the lowest line.

## Where the model fails: one picture per effect

First a machine without any missing effect, then each effect added to the same machine, always with the *rigid* model: gain, delay and one pole.
"""


def page() -> str:
    """The Markdown."""
    return HEAD + "".join(_section(example) for example in EXAMPLES)


def picture(example: Example) -> str:
    """Its file, seen from docs/."""
    return f"pictures/{example.name}.png"


def _section(example: Example) -> str:
    title = example.effect.replace("_", " ").capitalize() if example.effect else "Nothing is missing"
    shows = "error over the floor by frequency, and " + " and ".join(_WORDS[made.__name__] for made in example.pictures[1:])
    lines = [f"\n### {title}\n", f"![{title}: {shows}]({picture(example)})\n", f"{example.look}\n"]
    if example.effect:
        effect = EFFECTS[example.effect]
        lines.append(f"- What it is: {effect.meaning}. Law: `{effect.law}`")
        lines.append(f"- Taken for: {', '.join(effect.look_alikes)}. Told apart by: {effect.experiment}.")
        driven = "".join(f" --excite {name}={value:g}" for name, value in example.excite)
        made = f"xy-sysid simulate rec --machine {example.machine} --effect x:{example.typed}{driven}"
        lines.append(f"- See it: `{made}`, `xy-sysid report rec -o report.html`\n")
    return "\n".join(lines)


_WORDS = {
    "residual_speed": "against velocity",
    "residual_position": "against position",
    "residual_time": "against time",
    "zoom": "in time",
    "bode": "the response",
}
