"""Viscous friction: drag of grease, seals and back-EMF, proportional to speed."""

from __future__ import annotations

from xy_sysid.effects._contract import Effect, Parameter

EFFECT = Effect(
    name="viscous_friction",
    law="v' = pole (gain u - v)",
    meaning="drag in proportion to speed; with the mass it makes the pole of every axis",
    validity="always in the model; one drag coefficient at every speed and temperature",
    source="Olsson et al., Friction models and friction compensation, Eur. J. Control 4 (1998), eq. 2",
    category="base",
    parameters=(Parameter("pole", "rad/s", 1e-2, 1e5, 250.0, "rate at which speed follows the input: drag over mass"),),
    shows="the response from input to velocity falls by 20 dB per decade above pole / (2 pi) Hz",
    look_alikes=("amplifier_lag",),
    experiment="measure the motor current: the lag is before it in the chain, the pole after it",
)
