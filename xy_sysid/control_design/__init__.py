"""Uses of a refined model: numbers for a controller, and the model in the formats of other programs.

gains, inverse:           kS, kV, kA with intervals; the whole feedforward along a path
tables, path, limits:     friction and correction tables, S-curve paths, the largest feasible speed
sampled, uncertain:       the sampled linear part; intervals of numbers from those of the parameters
feedback, filters:        PID and P-PI from margins; notches and input shapers
bandwidth, cascade:       what limits the bandwidth; the cascade of an ODrive
state_feedback:           state feedback with an observer
laws, compensation:       forces by speed and position, and which of them the feedforward should compensate
measured_table:           the force by position that the model does not explain
step_text, sample_step:   one sample of the refined model, as text that is compiled here and printed in other languages
step_template, law_text, series: the frame of that text, its laws, and its linear part
inverse_text, state_text: the same for one sample of the feedforward, and of state feedback
program, printing:        these texts in a small language, and its printer
closed_loop:              the refined model under a controller, with delay, saturation, noise and counts
follower, worth:          one axis along a path with three kinds of feedforward; the benefit of a feedforward
to_c, to_python, to_matlab, mjcf, urdf, sdf, fmu, snippets: exports
use:                      all of these together, with their benefit on a recording of the machine
"""
