"""How well does a set of effects predict what it has not seen, and what may be done next from it?

contract:        what a search asks of a judge, and the moves that it answers with
enough_data:     what is lacking before anything can be judged
moves:           what may be done next from a set, and what it promises
refusal:         why a fit explains nothing, whatever it leaves
axis_judge:      the judge of an axis: fits of its sets, and which of two is better
beside_one_step: what acts beside an effect that only one-step prediction can judge
"""
