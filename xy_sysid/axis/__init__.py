"""One axis in the time domain: a rigid base and any of a library's effects.

model:         gain, delay, pole, the values of the effects; its simulation
start_speed:   the speed at the first sample
forward:       simulation without measured motion
resonant_loop: resonances inside the loop
interpolation: the axis's position between two encoder samples
loop_template: template of the simulation loop
loop_source:   source text of one loop, generated from the laws of a set of effects
loop_compile:  from that text to machine code, cached on disk
linear_part:   the linear part as a transfer function
mechanics:     mass or inertia, damping and friction in SI
"""
