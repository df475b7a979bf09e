"""Wrappers of the public functions and classes: they convert what a user passes, and raise an error with the right call where they cannot.

calls: conversion and check of all arguments of a public function, constructor or method
conversions: a path instead of a recording or a model, a run instead of a frequency response, a list instead of an array
ranges: the range of each number, and of text
types: whether a value has the annotated type, and the type in words
small_models, simulated_recording: public functions that need several packages
"""
