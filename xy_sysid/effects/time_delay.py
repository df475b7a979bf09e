"""Time delay of computation, bus and drive."""

from __future__ import annotations

from xy_sysid.effects._contract import Effect, Parameter

EFFECT = Effect(
    name="time_delay",
    law="u_eff(t) = u(t - delay)",
    meaning="the chain from command to current acts after a fixed time, including fractions of a sample",
    validity="always in the model; constant delay, not jitter",
    source="Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., sec. 2.3 (sampled systems with a fractional delay)",
    category="base",
    parameters=(Parameter("delay", "s", 0.0, 1.0, 1.5e-3, "time from a sample of the input to its effect", positive=False),),
    shows="phase that falls in proportion to frequency, at unchanged magnitude",
    look_alikes=("amplifier_lag",),
    experiment="excite to a higher frequency: a lag also lowers the magnitude, a delay does not",
)
