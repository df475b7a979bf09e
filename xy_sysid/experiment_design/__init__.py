"""What to measure next: the experiment that distinguishes effects that the present data do not distinguish.

criteria:    every threshold of the search, with its reason
limits:      the limits of the machine
experiment:  one experiment: excitation and duration
as_trajectory: the same for a robot that accepts only trajectories
proposals:   the experiments that are compared
beliefs:     a set of effects with its parameters and their uncertainty
rivals:      the sets that the present data do not rule out
prediction:  the expected measurement if a set is true
evidence:    how well a rival would explain it, and the probability of a decision after a given time
design:      the experiment that distinguishes the rivals in the shortest time
precision:   the experiment that determines parameters most precisely
first:       a first experiment for an unknown axis
loop:        one step: compare the sets, and design the next experiment
of_run:      one call for a diagnosis
walk:        the loop for recordings of a machine, which are diagnosed together after each experiment; progress in sentences
"""
