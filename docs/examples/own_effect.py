"""An effect of your own: one file with its law, and it is simulated, fitted and diagnosed like those of the library.

    python own_effect.py mains_hum.py

docs/your-own-effect.md has that file.
"""

import sys

import numpy as np

import xy_sysid as xy

known = xy.library(sys.argv[1] if len(sys.argv) > 1 else "mains_hum.py")
name = list(known.effects)[-1]

# A motion with it, made here so that the answer is known: half of what the effect is typically, and encoder noise.
rate, gain, pole = 1000.0, 0.1, 60.0
random = np.random.default_rng(5)
voltage = np.repeat(random.normal(scale=3.0, size=6000), 5)
truth = xy.PhysicalModel(xy.AxisModel(gain, 0.0, pole, library=known).with_effect(name))
velocity = truth.velocity(rate, voltage, np.zeros_like(voltage))
position = np.concatenate(([0.0], np.cumsum(velocity) / rate)) + 1e-7 * random.normal(size=voltage.size)

run = xy.Recording.from_arrays(rate, voltage, position).run("x")
steps = xy.refine(run, add=[name], auto=False, library=known)
for step in steps:
    print(step)
for item in steps.model.parameters:
    print(f"{item.name:30} {item.value:.4g} [{item.low:.4g}, {item.high:.4g}] {item.unit}")
print("truth:", truth.model.values())
