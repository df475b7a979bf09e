"""A simulator with first-order integration steps that resolves stops to one step only."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="first_order_steps",
    kind="integrator",
    group="imperfection",
    law="v(t + step) = v(t) + step v'(t), q(t + step) = q(t) + step v(t + step); a motor whose speed changes its sign stands at the step's end",
    meaning="the integration method of a simple simulator: events inside a step, such as a stop or a contact, are not resolved",
    source="semi-implicit Euler: Hairer, Lubich & Wanner, Geometric Numerical Integration, 2nd ed. 2006, sec. I.1.2",
    parameters=(Parameter("step", "s", 25e-6, 25e-6, 25e-6, "longest step", 1e-7, 1e-3),),
    drawn=False,
)
