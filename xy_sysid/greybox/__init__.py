"""Fits of an axis model to a recording, and the noise floor of the data.

floor:           the noise floor, and the error compared with it, band by band
axis_data:       the data of one axis, divided into fitted and held-out windows
start_rigid:     start values of gain, delay and pole
start_inverse:   start values of base and effect together, by linear least squares
score_test:      part of the error that an effect would explain, to first order
least_squares:   Levenberg-Marquardt on the whitened error in velocity
parameters:      the parameters of a model as one row: simulation, bounds, and intervals
objective:       the score of a model: the likelihood of its error
forces:          forces of the effects on the measured motion
free_run:        the fit by free simulation: base alone or with effects, scored on held-out data
one_step:        the fit of effects that only one-step prediction can judge
innovation_test: the score test on the innovations of one-step prediction
whitened:        the baseline for one-step prediction: a simulation with an autoregressive model of its error
open_loop:       free simulation of the position from the first sample to the last
"""
