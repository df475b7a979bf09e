"""Which effects are missing: from the data of an axis to the sentences of the answer.

answer:     the result: the steps (rungs), the other sets that were tried, the verdict
sets:       which laws a set of effects has, and how much it explains
equal_laws: effects with equal equations: the more probable one, and its probability
unmodelled: the force that no effect explains
rungs:      from the fits of a search to its answer
refine:     search, simpler sets, one-step prediction
first_set:  a known set of effects is tried first; if it explains the data, no search is needed
words:      the sentences of an answer
as_json:    an answer as a JSON document
diagnose:   the verdict: which effect is missing, with its confidence
of_run:     diagnose and refine for runs, one call each
"""
