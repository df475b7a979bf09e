"""Which effects are missing: sets of effects are searched, the simplest that does is taken, and what it comes to is told.

criteria:        every number that steers the search, and what it was measured on
beside_one_step: what acts beside an effect that only one-step prediction can judge
judge:           what moves promise, how well a set predicts what it has not seen, and which of two is better
best_first:      the search: most promising move next, every fit remembered
ladder:          what a search comes to: the rungs from the rigid base down, rivals, sizes
refine:          search, simpler sets, one-step prediction; and the rungs
diagnose:        which one is missing, with evidence and runner-up
of_run:          diagnose and refine of runs, one call each
findings:        the same in plain numbers and words
"""
