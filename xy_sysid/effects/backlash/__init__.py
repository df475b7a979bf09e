"""Backlash: motor and table are coupled through a gap.

contact:         its fit by one-step prediction, in stages
innovations:     innovations of the filter, as a function of the fitted numbers
starts:          start values of a fit
usual_machine:   a task on the scales of the reference machine
contact_filter:  the compiled filter for the laws of dry friction that act with it
filter_source:   its source text, made from these laws
filter_template: template of that text
filter_parts:    contact force, and the step of the covariance
"""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.effects.backlash.contact import Contact


@law
def advance(
    gap: float,
    share: float,
    rate: float,
    damping: float,
    loss: float,
    guide: float,
    hertz: float,
    rub: float,
    apart: float,
    table: float,
    u: float,
    v: float,
    h: float,
    gain: float,
    pole: float,
) -> tuple[float, float, float]:
    """(voltage that acts on the whole mass, motor minus table, speed of the table) after ``h`` s.

    Voltage, contact and a part of the drag act on the motor; contact, the other part of the drag and dry friction act on the table.
    """
    reduced = share * (1.0 - share)
    depth = apart - min(max(apart, -0.5 * gap), 0.5 * gap)
    contact, closing = 0.0, v - table
    if depth != 0.0:
        elastic = rate * depth * (1.0 - hertz + hertz * (2.0 * abs(depth) / gap) ** 0.5)
        contact = reduced * rate * (elastic + (loss * abs(elastic) + 2.0 * damping) * closing)
        if contact * depth < 0.0:
            contact = 0.0
    faster = table + (contact - pole * guide * table) / (1.0 - share) * h
    stopped = pole * abs(gain) * rub / (1.0 - share) * h
    faster -= min(max(faster, -stopped), stopped)
    left = (u - contact / (pole * gain) - (1.0 - guide) * v / gain) / share + v / gain
    speed = v + pole * (gain * left - v) * h
    return left, apart + (speed - faster) * h, faster


def guesses(scene: Scene) -> Iterator[Guess]:
    """One start value: the measured motion alone does not show the trace of a gap."""
    missing = scene.direction() * abs(scene.missing_force())
    yield Guess(columns(missing), lambda c: (20e-6, 0.5, 1500.0, 0.2, 5.0, 0.03, 0.0, 0.0))


EFFECT = Effect(
    name="backlash",
    law="m_motor v' = drive - contact(x_motor - x_table, gap / 2); m_table v_table' = contact; contact = k d s (1 + loss d') + c d', "
    "never pulling; s = 1 - hertz + hertz sqrt(2 d / gap)",
    meaning="a nut without preload, a worn coupling",
    validity="free simulation is chaotic at the contact: use it for pictures and one-step prediction, not to judge a fit",
    source="Nordin & Gutman, Automatica 38 (2002), sec. 2.2; Hunt & Crossley, J. Appl. Mech. 42 (1975), eq. 8",
    category="state",
    parameters=(
        Parameter("gap", "m", 1e-9, 1e-2, 20e-6, "free play, flank to flank"),
        Parameter("share", "", 0.02, 0.98, 0.5, "the motor's part of the moving mass"),
        Parameter("rate", "rad/s", 10.0, 1e5, 1500.0, "natural frequency of the closed contact, on the reduced mass, pressed in by half the gap"),
        Parameter("damping", "", 0.0, 2.0, 0.2, "damping ratio of the closed contact", positive=False),
        Parameter("loss", "s/m", 0.0, 500.0, 5.0, "loss of the contact per approach speed", positive=False),
        Parameter("guide", "", 0.0, 0.9, 0.03, "the table's part of the drag", positive=False),
        Parameter("hertz", "", 0.0, 1.0, 0.3, "0: the contact is linear; 1: Hertzian, force proportional to depth^1.5", positive=False),
        Parameter("rub", "V", 0.0, 10.0, 0.02, "dry friction on the table", positive=False),
    ),
    shows="fast, small motions move less mass than large ones; impacts after each reversal",
    look_alikes=("screw_compliance", "amplifier_lag", "presliding_hysteresis"),
    experiment="push the table while the motor holds: free play is felt; or a second encoder on the table",
    functions={"advance": advance},
    guesses=guesses,
    states=("apart", "table"),
    order=100,
    one_step=Contact(),
    start_friction="coulomb_friction",
    masks=("amplifier_lag",),
    suspects=("screw_compliance", "amplifier_lag", "presliding_hysteresis"),
)
