"""A model against data that no fit saw.

noise_floor:     the smallest error that the data can show
where_it_fails:  by frequency, speed, direction, position, amplitude and time
which_is_better: two models on the same windows, in pairs
physical_model:  an axis with effects as a model to be judged
of_run:          models against the data of one axis: all of the above in one call each
"""
