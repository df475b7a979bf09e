"""What to measure next: the experiment that distinguishes what the data at hand do not.

criteria:    every threshold of the search, with its reason
limits:      what an experiment may ask of the machine
experiment:  one experiment: what drives the axis, and for how long
proposals:   the experiments that are compared
beliefs:     a set of effects with its parameters and how well they are known
rivals:      the sets that the data at hand leave possible
prediction:  what would be measured if a set were true
evidence:    how well a rival would explain it, and how sure one would be after so many seconds
design:      the experiment that distinguishes the rivals soonest
precision:   the experiment that makes parameters known best
first:       a first experiment for an axis of which nothing is known
loop:        design, run, compare, and again until nothing is left to settle
of_run:      one call for a diagnosis
walk:        the loop for recordings of a machine: diagnosed together after each experiment, told in sentences
"""
