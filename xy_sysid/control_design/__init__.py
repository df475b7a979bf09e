"""Uses of a refined model: numbers for a controller, and the model in the formats of other programs.

gains, inverse:           kS, kV, kA with intervals; the whole feedforward along a path
tables, path, limits:     friction and correction tables, S-curve paths, the largest feasible speed
plant, feedback, filters: the sampled linear plant and its samples; PID and P-PI from margins; notches and input shapers
step_text, sample_step:   one sample of the refined model, as text that is compiled here and printed in other languages
closed_loop:              the refined model under a controller, with delay, saturation, noise and counts
to_c, to_python, to_matlab, mjcf, urdf, snippets: exports
use:                      all of these together, with their benefit on a recording of the machine
"""
