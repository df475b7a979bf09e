"""Excitation signals: a pure stream of voltage samples for one axis.

``signal(settings, rate).next(n)`` returns the following samples; any chunking gives the same stream, bit for bit.

    contract:                                      the interface of every signal
    multisine, sweep, stepped, noise, prbs, pulse: one kind of signal per file
    drive:                                         from a signal to the applied voltage: ramps, centring, limits
    trajectory, motion_plan, trajectory_drive:     a motion within limits of position, speed and acceleration, in pieces that end at rest
    motion_check, sign_check, following:           whether the motion of each axis fits its voltage or reference
    encoder_noise:                                 smaller changes of the encoder are no motion
    travel_limits:                                 keeps axes away from the ends of travel
    stop_latch:                                    who has requested STOP
    first_run:                                     the first motion of an unknown machine
    designed:                                      an experiment from a file, within the machine's own limits
    pacing:                                        when the next block is due
    lockstep:                                      a machine driven without a clock: recordings for tests and simulations
"""

from __future__ import annotations

from xy_sysid.errors import BadInput
from xy_sysid.excitation.contract import Maker, Signal, crest
from xy_sysid.excitation.multisine import Multisine, MultisineLines, multisine
from xy_sysid.excitation.noise import noise
from xy_sysid.excitation.prbs import prbs
from xy_sysid.excitation.pulse import impulse, off, step
from xy_sysid.excitation.stepped import schedule, stepped_sine
from xy_sysid.excitation.sweep import sweep
from xy_sysid.settings import AxisExcitation

MAKERS: dict[str, Maker] = {
    "noise": noise,
    "multisine": multisine,
    "multisine_odd": multisine,
    "multisine_detect": multisine,
    "sweep": sweep,
    "stepped_sine": stepped_sine,
    "prbs": prbs,
    "impulse": impulse,
    "step": step,
    "off": off,
}


def signal(settings: AxisExcitation, rate: float) -> Signal:
    """The stream of these settings at a rate, Hz.

    Raises BadInput if the band or the period does not fit the rate.
    """
    if not 0 < rate < float("inf"):
        raise BadInput("rate", f"{rate} Hz", "a positive number", "Give the sampling rate.")
    return MAKERS[settings.kind](settings, rate)


__all__ = ["MAKERS", "Multisine", "MultisineLines", "Signal", "crest", "multisine", "schedule", "signal", "stepped_sine"]
