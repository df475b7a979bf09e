"""Which effects are missing: sets of effects, their fits, and the search over them.

criteria:    every threshold of the search
enough_data: whether the data suffice for a diagnosis
input_noise: whether a fit's error is noise on its input
refusal:     why a fit does not count, whatever its error
compare:     the gain of one fit over another, with its standard error
starts:      start values for the fit of a set
moves:       possible changes of a set
pool:        sets with their fits, and the search over them
companions:  effects together with one that only one-step prediction can judge
one_step:    when effects of one-step prediction are tried, and whether they are accepted
"""
