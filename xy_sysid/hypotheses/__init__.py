"""Which effects are missing: sets of effects, their fits, and what follows from them.

criteria:    every number that decides
enough_data: what is lacking before anything can be judged
refusal:     why a fit explains nothing, whatever error it leaves
compare:     the gain of one fit over another, with its standard error
starts:      where the fit of a set begins
moves:       what may be tried next from a set
pool:        sets with their fits, and the search over them
companions:  what acts together with an effect that only one-step prediction can judge
one_step:    when such effects are tried, and whether they win
"""
