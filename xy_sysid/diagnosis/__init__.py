"""Which effects are missing: the whole way from the data of an axis to the words.

refine:     search, simpler sets, one-step prediction
ladder:     what a search comes to, as data
rungs:      from the fits of a search to its ladder
equal_laws: one law with two names: the likelier, and how likely it is
diagnose:   which one is missing, with evidence and runner-up
of_run:     diagnose and refine of runs, one call each
findings:   the same in plain numbers and words
"""
