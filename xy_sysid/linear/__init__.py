"""Linear models in the frequency and in the time domain.

transfer_function: numerator, denominator and delay
hold:              effect of a zero-order hold and sampling on a continuous response
simulate:          simulation in time, exact for an input held between samples
reduction:         smaller models
any_model:         the interface of every model of an axis
to_others:         conversion to objects of python-control and scipy
"""
