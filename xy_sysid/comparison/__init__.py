"""Models compared with held-out data.

noise_floor:     the smallest error that the data can show
where_it_fails:  by frequency, speed, direction, position, amplitude and time
which_is_better: two models on the same windows, in pairs
physical_model:  an axis with effects as a model for comparison
of_run:          all of these for the data of one axis, one call each
"""
