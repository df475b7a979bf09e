"""The program in Python, without dependencies: its functions unchanged, and two classes that call them."""

from __future__ import annotations

import ast

from xy_sysid.control_design.program import Program


def source(of: Program, title: str) -> str:
    """A module with ``Axis().step(input)`` and ``Feedforward().input(position, speed, acceleration)``."""
    arrays = "\n".join(f"{key} = {values.tolist()!r}" for key, values in of.arrays.items())
    text = "\n\n\n".join(ast.unparse(ast.fix_missing_locations(item)) for item in of.functions)
    return f'''\
"""{title}"""

import math

RATE = {of.rate!r}  # Hz: one call a sample
AHEAD = {of.ahead!r}  # s, preview of the path
{arrays}


{text}


class Axis:
    """The simulated axis, at rest at position 0."""

    def __init__(self):
        self.s, self.w = [0.0] * {of.states}, [0.0] * {of.room}

    def step(self, held):
        """Holds the input for one sample; returns the position that the encoder shows after it."""
        return one_sample(held, MOVING, STILL, self.s, self.w)


class Feedforward:
    """The input that moves the axis along a path; position, speed and acceleration are those of the path AHEAD seconds later."""

    def __init__(self):
        self.s, self.w = [0.0] * {of.states}, [0.0] * {of.room}

    def input(self, position, speed, acceleration):
        """The input to be held for this sample."""
        return one_input(position, speed, acceleration, 1.0 / RATE, {of.parts}, LED, GUIDED, self.s, self.w)
'''
