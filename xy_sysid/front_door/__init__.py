"""Wrappers of the public functions: they convert what a user passes, and raise an error with the right call where they cannot.

calls:       functions, constructors and methods with checked arguments, which may be in the other order
conversions: a path instead of a recording, a run instead of a frequency response, a list instead of an array
ranges:      the range of each number, by the name of its argument
types:       whether a value has the annotated type, and the type in words
"""
