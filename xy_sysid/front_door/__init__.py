"""What stands between a person and the public functions: each takes what is meant, or says how it is called.

calls: a path where a recording is meant, a run where a frequency response is meant, two arguments in the other order
types: whether a value is what an annotation asks for, and the words for it
"""
