"""Readers of files by external libraries, each run in a separate process: one file for each kind, with ``leaves(path)``.

``leaves`` yields (name, values) or (name, values, unit, clock): values are an array or a list of words, and clock is the name of the leaf with
the instants of these values, s. These files import nothing of this package, so the process starts quickly.
"""
