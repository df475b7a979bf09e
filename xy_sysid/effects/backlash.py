"""Motor and table are coupled through a gap."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects.contract import Effect, Parameter, law
from xy_sysid.effects.scene import Guess, Scene, columns

_STIFF = 2500.0  # rad/s of the contact: far above what the encoder sees, and still resolved by the sub-steps
_LOSS = 0.3  # damping ratio of the contact: flanks do not bounce long


@law
def advance(
    gap: float, share: float, apart: float, table: float, u: float, v: float, h: float, gain: float, pole: float
) -> tuple[float, float, float]:
    """(voltage that acts on the whole mass, motor minus table, speed of the table) after ``h`` s.

    share: the motor's part of the mass. The motor feels the voltage, its drag and the contact; the table only the contact.
    """
    reduced = share * (1.0 - share)
    depth = apart - min(max(apart, -0.5 * gap), 0.5 * gap)
    contact = 0.0
    if depth != 0.0:
        contact = reduced * (_STIFF * _STIFF * depth + 2.0 * _LOSS * _STIFF * (v - table))
        if contact * depth < 0.0:
            contact = 0.0
    push = contact / (pole * gain)
    faster = table + contact / (1.0 - share) * h
    left = (u - push - v / gain) / share + v / gain
    speed = v + pole * (gain * left - v) * h
    return left, apart + (speed - faster) * h, faster


def guesses(scene: Scene) -> Iterator[Guess]:
    """One start: what a gap does cannot be told from the measured motion alone."""
    missing = scene.direction() * abs(scene.missing_force())
    yield Guess(columns(missing), lambda c: (20e-6, 0.5))


EFFECT = Effect(
    name="backlash",
    law="m_motor v' = drive - contact(x_motor - x_table, gap / 2); m_table v_table' = contact",
    meaning="a nut without preload, a worn coupling",
    validity="free simulation is chaotic at the contact: use it for pictures and one-step prediction, not to judge a fit",
    source="Nordin & Gutman, Controlling mechanical systems with backlash, Automatica 38 (2002), sec. 2.2",
    category="state",
    parameters=(
        Parameter("gap", "m", 1e-9, 1e-2, 20e-6, "free play, flank to flank"),
        Parameter("share", "", 0.02, 0.98, 0.5, "the motor's part of the moving mass"),
    ),
    shows="fast, small motions meet less mass than large ones; knocks after each reversal",
    look_alikes=("presliding_hysteresis", "screw_compliance"),
    experiment="push the table while the motor holds: free play is felt; or a second encoder on the table",
    functions={"advance": advance},
    guesses=guesses,
    states=("apart", "table"),
    order=100,
    simulable=False,
)
