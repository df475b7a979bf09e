"""Effects that only one-step prediction can judge, as fits like all others.

Their error is the filter's innovation, measured minus predicted position one sample ahead, times the sampling rate: m/s,
as for a free simulation. Their floor is the encoder's noise.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.axis_model import AxisModel
from xy_sysid.effects import Effect
from xy_sysid.errors import BadInput
from xy_sysid.greybox import Z95, AxisData, Estimate, GreyboxFit
from xy_sysid.spectral_cost import count_size
from xy_sysid.traces import bounded

AT_NOISE = 3.5  # held-out innovation over the encoder's noise up to which an effect explains the axis
BETTER = 3.0  # innovation without the effect over that with it, at least


def one_step_fit(data: AxisData, base: GreyboxFit, effect: Effect) -> GreyboxFit:
    """Base and effect by one-step prediction; excess is 0 where it explains the axis. Raises BadInput if it cannot."""
    if effect.one_step is None:
        raise BadInput(f"effect {effect.name}", "no one-step prediction", "an effect that has one", "Fit it by simulation.")
    count = count_size(data.position)
    noise = min(data.floor.encoder, max(count / np.sqrt(12.0), 1e-12)) if count > 0.0 else data.floor.encoder
    start = base.model.gain, base.model.delay, base.model.pole
    dry = next((values[0] for name, values in base.model.effects if name == "coulomb_friction"), 0.0)
    found = effect.one_step(data.sampling_rate, data.voltage, data.position, start, noise, data.first, data.training, dry)
    error = found.innovation * data.sampling_rate
    settled = min(int(0.5 * data.sampling_rate), data.training // 4)
    held = float(np.sqrt(np.mean(error[data.training :] ** 2)))
    noise_floor = found.noise * data.sampling_rate
    far = max(held / (AT_NOISE * noise_floor), BETTER * held / max(found.without * data.sampling_rate, 1e-9 * held))
    gain, delay, pole = found.base
    model = AxisModel(gain, max(delay, 0.0), pole, library=base.model.library).with_effect(effect.name, bounded(effect, found.values))
    names = ["gain", "delay", "pole", *(f"{effect.name}.{item.name}" for item in effect.parameters)]
    units = ["m/s/V", "s", "rad/s", *(item.unit for item in effect.parameters)]
    values, spread = [*found.base, *found.values], [*found.base_spread, *found.spread]
    for name, own, errors in found.others:
        other = base.model.library[name]
        model = model.with_effect(name, bounded(other, own))
        names += [f"{name}.{item.name}" for item in other.parameters]
        units += [item.unit for item in other.parameters]
        values, spread = [*values, *own], [*spread, *errors]
    return GreyboxFit(
        model,
        tuple(Estimate(n, v, u, v - Z95 * s, v + Z95 * s) for n, v, u, s in zip(names, values, units, spread, strict=True)),
        float(np.sqrt(np.mean(error[settled : data.training] ** 2))),
        held,
        noise_floor,
        max(0.0, 2.0 * float(np.log(far))),
        data.velocity - error,
        error,
        found.runs,
        True,
    )
