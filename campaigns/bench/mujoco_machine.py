"""A machine of one joint, simulated by MuJoCo: other equations, other friction and another integrator than those of ``xy_sim``.

Extra ``mujoco`` (pip install '.[mujoco]'). The motor's torque is in volts: the joint's damping and inertia give speed per volt and pole. Sizes
of effects are in volts, too. The voltage acts after a whole number of samples.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from xy_sysid.samples.block import FloatArray

STEPS = 8  # steps of MuJoCo per sample
LATE = 2  # delay of the voltage, samples
XML = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" gravity="{gravity} 0 0" iterations="100" tolerance="1e-12"/>
  <worldbody>
    <body>
      <joint name="x" type="{kind}" axis="{axis}" damping="{damping}" stiffness="{stiffness}" frictionloss="{friction}" armature="{inertia}"
             solreffriction="{soft} 1" solimpfriction="0.9999 0.9999 0.001"/>
      <geom type="sphere" size="0.01" mass="{mass}" pos="{arm} 0 0"/>
    </body>
  </worldbody>
  <actuator><motor joint="x"/></actuator>
</mujoco>
"""


class MujocoMachine:
    """One joint; parts: effects with their sizes in volts: gravity, return_spring (of a hinge), constant_load, coulomb_friction (of a slide)."""

    axes = ("x",)

    def __init__(self, kind: str, parts: Mapping[str, Mapping[str, float]], noise: float, seed: int) -> None:
        """kind: hinge or slide; noise: of the encoder, rad or m rms; seed: of that noise."""
        self._mujoco: Any = importlib.import_module("mujoco")
        self.rate, self.noise, self.seed = 1000.0, noise, seed
        gain, pole, mass = (3.0, 40.0, 1e-3) if kind == "hinge" else (0.1, 60.0, 1e-4)
        inertia = 1.0 / (gain * pole)  # V s^2 per unit of length: torque is in volts here
        size = {name: next(iter(values.values())) for name, values in parts.items()}
        pull = size.get("gravity", 0.0) / (mass * 0.1) if kind == "hinge" else -size.get("constant_load", 0.0) / mass
        text = XML.format(
            step=1.0 / (STEPS * self.rate),
            kind=kind,
            axis="0 0 1" if kind == "hinge" else "1 0 0",
            gravity=pull,
            damping=1.0 / gain,
            stiffness=size.get("return_spring", 0.0),
            friction=size.get("coulomb_friction", 0.0),
            inertia=inertia - mass * (0.01 if kind == "hinge" else 1.0),
            soft=4.0 / (STEPS * self.rate),
            mass=mass,
            arm=0.1 if kind == "hinge" else 0.0,
        )
        self._model = self._mujoco.MjModel.from_xml_string(text)
        self.reset()

    def reset(self) -> None:
        """Back to rest at the origin."""
        self._data = self._mujoco.MjData(self._model)
        self._past: list[float] = [0.0] * LATE
        self._random = np.random.default_rng(self.seed)

    @property
    def place(self) -> float:
        """True position of the joint, rad or m."""
        return float(self._data.qpos[0])

    def step(self, voltage: FloatArray) -> FloatArray:
        """(n, 1) encoder positions for held voltages (n, 1), V."""
        seen = np.empty(voltage.shape[0])
        for row, volts in enumerate(voltage[:, 0].tolist()):
            seen[row] = self._data.qpos[0]
            self._past.append(volts)
            self._data.ctrl[0] = self._past.pop(0)
            self._mujoco.mj_step(self._model, self._data, STEPS)
        return np.asarray(seen + self.noise * self._random.standard_normal(seen.size))[:, None]
