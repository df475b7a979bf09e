"""Fitting an axis model to a recording, and the floor that the data allow.

floor:           how large an error is, band by band, against the least that the data allow
axis_data:       what is fitted: one axis, cut into windows of which some are held out
start_rigid:     gain, delay and pole without a start value
start_inverse:   base and effect together by linear least squares
score_test:      how much of the error an effect would explain, to first order
least_squares:   Levenberg-Marquardt on the whitened error in velocity
parameters:      a model's parameters as one row: simulated, bounded, and read back with intervals
free_run:        the fit: base alone or with chosen effects, judged on data held out
one_step:        the fit of effects that only one-step prediction can judge
innovation_test: the score test on the innovations of that
whitened:        the rival of that: a simulation, and an autoregressive model of its error
open_loop:       a model on its own from the first sample to the last
"""
