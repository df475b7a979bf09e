"""Sets of effects are searched, and the simplest that does is taken.

best_first:      the most promising move next, every fit remembered
simplify:        what is no longer needed goes, and simpler relatives stay where they do as well
one_step_trials: effects that only one-step prediction can judge: when they are tried, and whether they win
"""
