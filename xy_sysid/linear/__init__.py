"""Linear models in the frequency and in the time domain.

transfer_function: numerator, denominator and delay
hold:              what a zero-order hold and sampling add to a continuous response
simulate:          its motion in time, exact for an input held between samples
reduction:         smaller models
any_model:         what a model of an axis can do, of whatever it is made
to_others:         objects of python-control and scipy
"""
