"""Newton's law of one axis: from state and voltage to the state's rate of change.

Coordinates: motor and table relative to the base, the base in space, a rattling mass relative to the base. Forces that
parts give in volts of the drive are converted to newtons by ``force_per_volt``.
"""

from __future__ import annotations

from xy_sim import imperfections
from xy_sim.inlined import inlined
from xy_sim.layout import BASE, BASE_SPEED, BRISTLE, HEAT, MOTOR, MOTOR_SPEED, RATTLE, RATTLE_SPEED, TABLE, TABLE_SPEED, VOLTS, WORK, slot
from xy_sim.parts import (
    amplifier_lag,
    asymmetric_friction,
    asymmetric_viscous_friction,
    base_loosening,
    base_resonance,
    cogging,
    constant_load,
    contact,
    coulomb_friction,
    gain_drift,
    gravity,
    hardening_stiffness,
    load_dependent_friction,
    loose_mode,
    position_dependent_drag,
    position_dependent_gain,
    presliding_hysteresis,
    quadratic_drag,
    return_spring,
    stribeck_friction,
    thermal_viscosity,
    viscous_friction,
)
from xy_sysid.samples.block import FloatArray

FREE = 2  # friction mode: no dry friction to switch; otherwise the direction of sliding, and 0 sticks

_FORCE, _DRAG, _GUIDE, _ROTOR, _TABLE = slot("force_per_volt"), slot("drag"), slot("guide_share"), slot("rotor_mass"), slot("table_mass")
_TRAVEL, _STOP_K, _STOP_C = slot("travel"), slot("stop_stiffness"), slot("stop_damping")
_COUPLED, _COUPLING_K, _COUPLING_C = slot("coupled"), slot("coupling_stiffness"), slot("coupling_dashpot")
_COG_WAVE, _GAIN_WAVE = slot("cogging_wavenumber"), slot("gain_wavenumber")
_LAG = slot("amplifier_lag.lag")
_DRIFT, _DRIFT_LIMIT = slot("gain_drift.rate"), slot("gain_drift.limit")
_GAIN_DEPTH = slot("position_dependent_gain.depth")
_HEAT_DEPTH, _HEAT_TIME, _HEAT_SPEED = slot("thermal_viscosity.depth"), slot("thermal_viscosity.time"), slot("thermal_viscosity.speed")
_VISCOUS, _QUADRATIC = slot("viscous_friction.coefficient"), slot("quadratic_drag.coefficient")
_COULOMB = slot("coulomb_friction.coulomb")
_STRIBECK, _STRIBECK_COULOMB, _STRIBECK_V = slot("stribeck_friction.excess"), slot("stribeck_friction.coulomb"), slot("stribeck_friction.velocity")
_SIDED = slot("asymmetric_viscous_friction.asymmetry")
_ASYM, _ASYM_COULOMB = slot("asymmetric_friction.asymmetry"), slot("asymmetric_friction.coulomb")
_PRE, _PRE_LENGTH, _PRE_DAMPING = slot("presliding_hysteresis.coulomb"), slot("presliding_hysteresis.length"), slot("presliding_hysteresis.damping")
_LOADED = slot("load_dependent_friction.share")
_COG, _COG_PHASE = slot("cogging.amplitude"), slot("cogging.phase")
_LOAD, _CUBIC, _LINEAR = slot("constant_load.load"), slot("hardening_stiffness.cubic"), slot("hardening_stiffness.linear")
_WEIGHT, _WEIGHT_PHASE = slot("gravity.amplitude"), slot("gravity.phase")
_RETURN, _REST, _SOFTENING = slot("return_spring.stiffness"), slot("return_spring.rest"), slot("return_spring.softening")
_DRAG_SLOPE = slot("position_dependent_drag.slope")
_GAP, _GAP_C = slot("backlash.gap"), slot("backlash.damping")
_LOOSE_MASS, _LOOSE_F = slot("loose_mode.mass"), slot("loose_mode.frequency")
_LOOSE_GAP, _LOOSE_C = slot("loose_mode.gap"), slot("loose_mode.damping")
_BASE_MASS, _BASE_F, _BASE_D = slot("base_resonance.mass"), slot("base_resonance.frequency"), slot("base_resonance.damping")
_DROP, _DROP_START, _DROP_RATE = slot("base_loosening.drop"), slot("base_loosening.start"), slot("base_loosening.rate")


@inlined
def at_the_motor(p: FloatArray, y: FloatArray, i: int, t: float, volts: float, dirt: FloatArray | None) -> float:
    """Voltage that acts on the motor, V, for ``volts`` at the input of the amplifier; row ``i`` of ``y`` is the state."""
    if p[_LAG] > 0.0:
        volts = y[i, VOLTS]
    if p[_DRIFT] != 0.0:
        volts *= gain_drift.factor(p[_DRIFT], p[_DRIFT_LIMIT], t)
    if p[_GAIN_DEPTH] != 0.0:
        volts *= position_dependent_gain.factor(p[_GAIN_DEPTH], p[_GAIN_WAVE], y[i, MOTOR])
    if dirt is not None:
        volts = volts * imperfections.gain_and_drag(dirt, t, y[i, MOTOR])[0] + imperfections.hum(dirt, t)
    return volts


@inlined
def dry_level(p: FloatArray, v: float, direction: float, volts: float) -> float:
    """Size of all dry friction at speed ``v``, sliding in ``direction`` (+1 or -1), with ``volts`` at the motor, V."""
    level: float = coulomb_friction.level(p[_COULOMB]) + asymmetric_friction.level(p[_ASYM], p[_ASYM_COULOMB], direction)
    level += stribeck_friction.level(p[_STRIBECK], p[_STRIBECK_COULOMB], p[_STRIBECK_V], v) + p[_PRE]
    if p[_LOADED] != 0.0:
        level += load_dependent_friction.level(p[_LOADED], volts)
    return level


@inlined
def breakaway(p: FloatArray, t: float, direction: float, volts: float, dirt: FloatArray | None) -> float:
    """Friction that must be overcome to start in ``direction`` at ``t`` (s) with ``volts`` at the motor, N."""
    level: float = p[_FORCE] * dry_level(p, 0.0, direction, volts)
    if dirt is not None:
        level *= imperfections.friction(dirt, t)
    return level


@inlined
def slide_length(p: FloatArray, v: float, volts: float) -> float:
    """Steady bristle deflection when sliding at speed ``v`` with ``volts`` at the motor, m."""
    length: float = p[_PRE_LENGTH] * dry_level(p, v, 1.0 if v >= 0.0 else -1.0, volts) / p[_PRE]
    return length


@inlined
def longest_step(p: FloatArray, v: float, step: float) -> float:
    """The inner step (s), shortened if the bristles deflect too fast for it at speed ``v``, also without a voltage."""
    if p[_PRE] == 0.0:
        return step
    return min(step, presliding_hysteresis.longest_step(v, slide_length(p, v, 0.0)))


@inlined
def regime(p: FloatArray, y: FloatArray, i: int) -> int:
    """A number that changes whenever a contact opens, closes or changes its branch; row ``i`` of ``y`` is the state."""
    x, v = y[i, MOTOR], y[i, MOTOR_SPEED]
    found = 0
    if p[_COUPLED] != 0.0:
        if p[_GAP] > 0.0:
            found = contact.regime(x - y[i, TABLE], v - y[i, TABLE_SPEED], 0.5 * p[_GAP], p[_GAP_C])
        x, v = y[i, TABLE], y[i, TABLE_SPEED]
    if p[_LOOSE_MASS] > 0.0:
        found += 5 * contact.regime(x - y[i, RATTLE], v - y[i, RATTLE_SPEED], 0.5 * p[_LOOSE_GAP], p[_LOOSE_C])
    return found + 25 * contact.regime(x, v, p[_TRAVEL], p[_STOP_C])


@inlined
def rates(p: FloatArray, y: FloatArray, i: int, t: float, volts: float, mode: int, o: int, dirt: FloatArray | None = None) -> float:
    """Writes the derivative of row ``i`` of ``y`` into its row ``o``; returns the force (N) to be balanced to hold the motor at rest.

    p: parameters (layout.numbers); y: (rows, layout.STATES), SI; t: time, s; volts: input of the amplifier, V;
    dirt: p again if the machine has imperfections, else None (their code is then not compiled);
    mode: FREE, or the direction of sliding (-1, +1), or 0 when the motor sticks. A motor at rest stays at rest while the
    friction can balance the returned force.
    """
    k = p[_FORCE]
    coupled = p[_COUPLED] != 0.0
    q, v = y[i, MOTOR], y[i, MOTOR_SPEED]
    if mode == 0:
        v = 0.0
    x, xv = (y[i, TABLE], y[i, TABLE_SPEED]) if coupled else (q, v)

    if p[_LAG] > 0.0:
        y[o, VOLTS] = amplifier_lag.rate(p[_LAG], volts, y[i, VOLTS])
        volts = y[i, VOLTS]
    if p[_DRIFT] != 0.0:
        volts *= gain_drift.factor(p[_DRIFT], p[_DRIFT_LIMIT], t)
    drag = p[_DRAG]
    if p[_GAIN_DEPTH] != 0.0:
        factor = position_dependent_gain.factor(p[_GAIN_DEPTH], p[_GAIN_WAVE], q)
        volts *= factor
        drag *= factor * factor
    rub = 1.0
    if dirt is not None:
        stronger, slower = imperfections.gain_and_drag(dirt, t, q)
        rub = imperfections.friction(dirt, t)
        volts = volts * stronger + imperfections.hum(dirt, t)
        drag *= slower * rub
    if p[_DRAG_SLOPE] != 0.0:
        drag *= position_dependent_drag.factor(p[_DRAG_SLOPE], q)
    if p[_HEAT_DEPTH] != 0.0:
        drag *= thermal_viscosity.factor(p[_HEAT_DEPTH], y[i, HEAT])
        y[o, HEAT] = thermal_viscosity.rate(p[_HEAT_TIME], p[_HEAT_SPEED], v, y[i, HEAT])
    y[o, WORK] = k * volts * v

    on_motor = k * (volts - viscous_friction.force(p[_VISCOUS], v) - quadratic_drag.force(p[_QUADRATIC], v))
    on_motor -= (1.0 - p[_GUIDE]) * drag * asymmetric_viscous_friction.factor(p[_SIDED], v) * v
    if p[_COG] != 0.0:
        on_motor -= k * cogging.force(p[_COG], p[_COG_WAVE], p[_COG_PHASE], q)
    on_table = k * (constant_load.force(p[_LOAD]) + hardening_stiffness.force(p[_CUBIC], p[_LINEAR], x))
    if p[_WEIGHT] != 0.0:
        on_table += k * gravity.force(p[_WEIGHT], p[_WEIGHT_PHASE], x)
    if p[_RETURN] != 0.0:
        on_table += k * return_spring.force(p[_RETURN], p[_REST], p[_SOFTENING], x)
    on_table -= p[_GUIDE] * drag * asymmetric_viscous_friction.factor(p[_SIDED], xv) * xv
    on_table -= contact.force(x, xv, p[_TRAVEL], p[_STOP_K], p[_STOP_C])
    on_loose = 0.0
    if p[_LOOSE_MASS] > 0.0:
        stiffness = loose_mode.stiffness(p[_LOOSE_MASS], p[_LOOSE_F])
        on_loose = contact.force(x - y[i, RATTLE], xv - y[i, RATTLE_SPEED], 0.5 * p[_LOOSE_GAP], stiffness, p[_LOOSE_C])
        on_table -= on_loose
    weak = 0.0
    if dirt is not None:
        weak = imperfections.modes(dirt, y, i, x, xv, o)
        on_table += k * imperfections.cable(dirt, y, i, x, xv, o) - weak
    if coupled:
        if p[_GAP] > 0.0:
            link = contact.force(q - x, v - xv, 0.5 * p[_GAP], p[_COUPLING_K], p[_GAP_C])
        else:
            link = p[_COUPLING_K] * (q - x) + p[_COUPLING_C] * (v - xv)
        on_motor -= link
        on_table += link

    if p[_PRE] > 0.0:
        y[o, BRISTLE] = presliding_hysteresis.rate(y[i, BRISTLE], v, slide_length(p, v, volts))
        on_motor -= k * rub * (p[_PRE] / p[_PRE_LENGTH] * y[i, BRISTLE] + p[_PRE_DAMPING] * y[o, BRISTLE])
    elif mode == 1 or mode == -1:
        on_motor -= mode * k * dry_level(p, v, float(mode), volts) * rub

    on_base = 0.0
    base = p[_BASE_MASS]
    if base > 0.0:
        moving, frequency = base + p[_TABLE], p[_BASE_F]
        on_base = -base_resonance.dashpot(moving, frequency, p[_BASE_D]) * y[i, BASE_SPEED] - on_loose - weak
        if p[_DROP] != 0.0:
            frequency = base_loosening.frequency(frequency, p[_DROP], p[_DROP_START], p[_DROP_RATE], t)
        on_base -= base_resonance.stiffness(moving, frequency) * y[i, BASE]

    return _accelerations(p, y, i, o, mode, on_motor, on_table, on_base, on_loose, dirt)


@inlined
def _accelerations(
    p: FloatArray,
    y: FloatArray,
    i: int,
    o: int,
    mode: int,
    on_motor: float,
    on_table: float,
    on_base: float,
    on_loose: float,
    dirt: FloatArray | None,
) -> float:
    """Computes the accelerations of all masses; the reaction of the masses on the base acts on it."""
    rotor, table, base = p[_ROTOR], p[_TABLE], p[_BASE_MASS]
    of_base = 0.0
    if p[_COUPLED] != 0.0:
        if base > 0.0:
            of_base = (on_base - on_table) / base
        of_motor, needed = on_motor / rotor, on_motor
        y[o, TABLE], y[o, TABLE_SPEED] = y[i, TABLE_SPEED], on_table / table - of_base
    else:
        force, mass = on_motor + on_table, rotor + table
        needed = force
        if base == 0.0:
            of_motor = force / mass
        elif mode == 0:
            of_motor = 0.0
            of_base = on_base / (base + table)
            needed = force - table * of_base
        else:
            whole = base + table
            inverse = 1.0 / (mass * whole - table * table)
            of_motor = (whole * force - table * on_base) * inverse
            of_base = (mass * on_base - table * force) * inverse
    y[o, MOTOR], y[o, MOTOR_SPEED] = (0.0, 0.0) if mode == 0 else (y[i, MOTOR_SPEED], of_motor)
    y[o, BASE], y[o, BASE_SPEED] = y[i, BASE_SPEED], of_base
    if p[_LOOSE_MASS] > 0.0:
        y[o, RATTLE], y[o, RATTLE_SPEED] = y[i, RATTLE_SPEED], on_loose / p[_LOOSE_MASS] - of_base
    if dirt is not None:
        imperfections.on_a_moving_base(dirt, y, o, of_base)
    return needed
