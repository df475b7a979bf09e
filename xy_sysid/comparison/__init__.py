"""Models compared with held-out data.

where_it_fails:  by frequency, speed, direction, position, amplitude and time
residual_correlation: whether the residual error is noise
which_is_better: two models on the same windows, in pairs
physical_model:  an axis with effects as a model for comparison
of_run:          all of these for the data of one axis, one call each
"""
