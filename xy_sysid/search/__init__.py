"""Which effects are missing: sets of effects are searched, the simplest that does is taken, and what it comes to is told.

criteria:        every number that steers the search, and what it was measured on
enough_data:     what is lacking before anything can be named
moves:           what may be done next from a set, and what it promises
refusal:         why a fit explains nothing, whatever it leaves
judge:           how well a set predicts what it has not seen, and which of two is better
best_first:      the search: most promising move next, every fit remembered
simplify:        what is no longer needed goes, and simpler relatives stay where they do as well
one_step_trials: effects that only one-step prediction can judge: when they are tried, and whether they win
beside_one_step: what acts beside such an effect
refine:          the whole way: search, simpler sets, one-step prediction
ladder:          what a search comes to, as data
rungs:           from the fits of a search to its ladder
equal_laws:      one law with two names: the likelier, and how likely it is
diagnose:        which one is missing, with evidence and runner-up
of_run:          diagnose and refine of runs, one call each
findings:        the same in plain numbers and words
"""
