"""The results of small models in sentences, with what these data do not determine."""

from __future__ import annotations

import math

from xy_sysid.time_models.first_order import MOST, FirstOrder
from xy_sysid.time_models.output_error import Told
from xy_sysid.time_models.servo import Servo
from xy_sysid.units import moved

GOOD = 0.9  # fraction of the power from which a model describes a record
SETTLED = 3.0  # time constants after which a first order has settled to 5 %
REPEATS = 5.0  # samples; an error that is correlated for longer is not noise


def first_order_words(found: FirstOrder) -> tuple[str, ...]:
    """The result, then each quantity that these tests do not determine, with a test that would."""
    share = f"{100.0 * max(found.explained, 0.0):.4g} %"
    left = moved(found.error, found.units.speed)
    if found.explained >= GOOD:
        said = [f"A first order with delay explains {share} of the speed over {found.seconds:.3g} s and leaves {left} rms."]
    else:
        said = [
            f"A first order with delay does not describe this: it explains {share} of the speed and leaves {left} rms. "
            "Use fit or diagnose on a record with noise or a multisine."
        ]
    if found.unused > 0.0:
        said.append(f"The remaining {found.unused:.3g} s of the data are not used ({MOST:,} samples at most). Choose another part with --span.")
    constant, delay = found["time_constant"], found["delay"]
    if found.levels < 3 and "friction" not in found.terms and not found.both_ways:
        if "offset" in found.terms:
            said.append(
                "Two levels of the input in one direction: the offset is friction and load together. A step the other way distinguishes them."
            )
        else:
            said.append("One level of the input: friction and gain cannot be distinguished. Steps of two sizes or a slow ramp give kS.")
    elif "offset" in found.terms:
        said.append("All motion is in one direction: the offset is friction and load together. A test in the other direction distinguishes them.")
    elif not found.both_ways:
        said.append("All motion is in one direction, and no friction is distinguished from zero. A slow ramp in both directions determines it.")
    if found.settled < SETTLED and constant.value > 0.0 and found.levels < 10:
        said.append(
            f"The longest level lasts {found.settled:.2g} time constants: gain and time constant are extrapolated. "
            f"Hold each level for {SETTLED * constant.value:.2g} s or longer."
        )
    if not math.isfinite(constant.high):
        said.append("These tests do not determine all parameters together: add a step of another size, or in the other direction.")
    elif constant.value * found.sampling_rate < 1.0 or not constant.told or constant.high > 3.0 * constant.low:
        said.append(f"The time constant is known only to {_span(constant)} ms: sample faster, or repeat the step.")
    if delay.high >= found.longest_delay:
        said.append(
            f"The delay is unknown: any up to {1e3 * delay.high:.3g} ms fits as well. A quick step within a recording, after some samples at "
            "rest, determines it."
        )
    elif not delay.told:
        said.append(f"No delay is distinguished from zero (at most {1e3 * delay.high:.3g} ms).")
    if found.repeats * found.sampling_rate > REPEATS and found.explained >= GOOD:
        said.append(
            f"The residual error is correlated over {1e3 * found.repeats:.3g} ms: a ripple, a resonance or varying friction, not noise. "
            "The intervals include this."
        )
    return tuple(said)


def servo_words(found: Servo, inertia: float | None) -> tuple[str, ...]:
    """The result, then everything that target and angle alone do not determine."""
    share, left = f"{100.0 * max(found.explained, 0.0):.4g} %", moved(found.error, found.units.output)
    if found.explained >= GOOD:
        said = [f"The servo with its controller explains {share} of the angle that no fit saw, simulated from the target alone; {left} rms is left."]
    else:
        said = [f"This model describes the joint badly: {share} of the angle that no fit saw is explained; {left} rms is left."]
    if found.at_limit > 0.0:
        limit, damping = found["limit"], found["damping"]
        speed = f", which allows {moved(limit.value / damping.value, found.units.speed)}" if damping.value > 0.0 else ""
        said.append(f"The torque is at its limit for {100.0 * found.at_limit:.2g} % of the time{speed}.")
    else:
        said.append(f"The torque's limit is not reached: it is above {found.reached:.3g} {found.units.output}/s^2. Larger steps determine it.")
    if not found["friction"].told:
        said.append(
            f"No friction is distinguished from zero (at most {found['friction'].high:.3g} {found.units.output}/s^2). Slow ramps determine it."
        )
    if inertia is None:
        said.append(
            "Target and angle determine only ratios to the inertia: kp, damping, frictionloss and forcerange follow from a known inertia "
            "of joint and load (--inertia KG_M2), or from one recording with a known mass added."
        )
    said.append(
        "A derivative gain (kd, kv) of the controller and the joint's own damping act alike: the damping is their sum. The same joint without "
        "power, moved by hand, shows its own damping."
    )
    return tuple(said)


def _span(item: Told) -> str:
    return f"{1e3 * item.low:.3g} to {1e3 * item.high:.3g}"
