"""The drive of each axis: motor, screw, masses, travel and encoder."""

from __future__ import annotations

from typing import Literal

from xy_sysid.settings import Settings, knob


class Drive(Settings):
    """One axis without its parts; every key of ``axes.<name>`` in a machine file except ``parts``."""

    velocity_gain: float = knob(0.097, "steady speed per volt, without any part", "m/s/V", gt=0.0, le=100.0)
    pole: float = knob(236.0, "drag (with back-EMF) over moving mass, on a fixed base", "rad/s", gt=0.0, le=1e5)
    table_mass: float = knob(18.0, "moving mass of the table", "kg", gt=0.0, le=1e5)
    rotor_mass: float = knob(7.0, "motor and screw, as seen at the table: inertia (2 pi / lead)^2", "kg", gt=0.0, le=1e5)
    guide_share: float = knob(0.05, "part of the drag that acts on the table instead of the motor", "", ge=0.0, le=1.0)
    lead: float = knob(0.005, "travel in one turn of the screw", "m", gt=0.0, le=1.0)
    counts_per_revolution: float = knob(10_000.0, "encoder counts in one turn", "", gt=0.0, le=1e9)
    encoder_noise: float = knob(0.0, "rms of the encoder's noise before it counts", "m", ge=0.0, le=1e-3)
    encoder_on: Literal["motor", "table"] = knob("motor", "which side of screw and backlash the encoder sees")
    travel: float = knob(0.15, "distance from the middle to each end stop", "m", gt=0.0, le=100.0)
    stop_stiffness: float = knob(1e7, "stiffness of an end stop", "N/m", gt=0.0, le=1e9)
    stop_damping: float = knob(2.0, "loss of an end stop per approach speed (about 1.5 (1 - restitution) / speed)", "s/m", ge=0.0, le=1e3)

    @property
    def moving_mass(self) -> float:
        """Rotor and table together, kg."""
        return self.rotor_mass + self.table_mass

    @property
    def drag(self) -> float:
        """Viscous drag and back-EMF together, N s/m."""
        return self.pole * self.moving_mass

    @property
    def force_per_volt(self) -> float:
        """Force of the motor, as seen at the table, N/V."""
        return self.drag * self.velocity_gain

    @property
    def count(self) -> float:
        """Size of an encoder count, m."""
        return self.lead / self.counts_per_revolution
