"""Wrappers of the public functions: they convert what a user passes, and raise an error with the right call where they cannot.

calls: a path instead of a recording, a run instead of a frequency response, two arguments in the other order
types: whether a value has the annotated type, and the type in words
small_models, simulated_recording: public functions for short tests, and for recordings of the simulated machine
"""
