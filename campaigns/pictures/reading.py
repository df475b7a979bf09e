"""docs/reading-pictures.md: how to read every picture, and a failing example per effect. Words here, facts from the library."""

from __future__ import annotations

from campaigns.pictures.examples import EXAMPLES, Example
from xy_sysid.effects import EFFECTS

HEAD = """# How to read the pictures

The page and the report show these pictures. All examples come from the simulated machine. `python -m campaigns.pictures`
(`make pictures`) makes the pictures and this page.

- **Colours**: blue is measured, orange is the model, green is the noise floor. Red marks where the model fails. Grey is not trusted.
  Where two models are compared, blue is the earlier and orange the later one.
- **Errors** are errors of velocity. The model starts with the speed of the first sample and is then driven with the measured voltage alone, so no
  feedback hides an error.
- **Held-out** data are parts of the recording, spread over it, that no fit has seen. For backlash it is the last third, because its filter must run
  without interruption.
- The **noise floor** is the smallest error that the data can show: encoder noise, together with a tolerated part of the motion (0.1 %).

## The ladder

![A staircase that falls over two steps to the noise floor](pictures/ladder.png)

Each step adds one effect and fits all parameters again. Look at the solid line: the held-out error.
Good: it ends on the dotted green floor and has a check mark. The dashed line is the error on the fitted data. If the dashed line falls while the
solid line rises, the last effect only fits noise; remove it. If both stop above the floor, the library lacks an effect.

## Before and after

![Error by frequency and in time, of the rigid model and of the last one](pictures/before_after.png)

Two steps overlaid, by frequency and in time. By frequency the axis is the error divided by the noise floor: at or below 1 the error is noise. Places
above 2 are reported as failures of the model.

## Candidates

![Bars: the error that remains with each candidate](pictures/candidates.png)

Each bar is the held-out error that remains when only this effect is added to the rigid model. Shorter is better. If the second bar is much longer
than the first, the name is certain. If bars have the same length, these data cannot distinguish the effects, and the diagnosis proposes an
experiment that can.

## Bode and coherence

![Magnitude and phase with the model over it; coherence](pictures/response.png)

The measurement with its 95 % band (often thinner than the drawn line), and the model dashed. Grey crosses are frequencies without excitation or
coherence; they are not fitted. The coherence is 1 where the input explains all of the output. Here it falls to 0.85 below 10 Hz, because
friction and cogging cause motion that a linear response cannot explain. Without them it is 0.99 or more down to the lowest frequency.

## Where the model fails: one picture per effect

The first picture shows a machine without a missing effect. Each further picture adds one effect to this machine; gravity acts on a rotary joint
instead. The model is always the *rigid* one: gain, delay and one pole. *Try it* gives the command that makes the recording `rec`;
`xy-sysid report rec -o report.html` then draws its pictures.
"""


def page() -> str:
    """The Markdown."""
    return HEAD + "".join(_section(example) for example in EXAMPLES)


def picture(example: Example) -> str:
    """Path of its file, relative to docs/."""
    return f"pictures/{example.name}.png"


def _section(example: Example) -> str:
    title = example.effect.replace("_", " ").capitalize() if example.effect else "Nothing is missing"
    shows = "error over the floor by frequency, " + ", ".join(_WORDS[made.__name__] for made in example.pictures[1:])
    lines = [f"\n### {title}\n", f"![{title}: {shows}]({picture(example)})\n", f"{example.look}\n"]
    if example.effect:
        effect = EFFECTS[example.effect]
        lines.append(f"- What it is: {effect.meaning}. Law: `{effect.law}`")
        lines.append(f"- Looks like: {', '.join(effect.look_alikes)}. Distinguished by: {effect.experiment}.")
        driven = "".join(f" --excite {name}={value:g}" for name, value in example.excite)
        made = f"xy-sysid simulate rec --machine {example.machine} --effect x:{example.typed}{driven}"
        lines.append(f"- Try it: `{made}`\n")
    return "\n".join(lines)


_WORDS = {
    "residual_speed": "against velocity",
    "residual_position": "against position",
    "residual_time": "against time",
    "zoom": "in time",
    "bode": "the response",
}
