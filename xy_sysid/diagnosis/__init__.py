"""Which effects are missing: the whole way from the data of an axis to the words.

answer:     what is found: the rungs, what else was tried, the verdict
sets:       which laws a set of effects has, and how much it explains
equal_laws: one law with two names: the likelier, and how likely it is
rungs:      from the fits of a search to its answer
refine:     search, simpler sets, one-step prediction
first_set:  a known set that explains the data needs no search
words:      the sentences of an answer
as_json:    an answer as a JSON document
diagnose:   the verdict: which effect is missing, and how sure that is
of_run:     diagnose and refine of runs, one call each
"""
