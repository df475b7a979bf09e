"""Files that a library reads, each in a process of its own: one file for each kind, with ``leaves(path)``.

``leaves`` yields (name, values) or (name, values, unit, clock): values are an array or a list of words, and clock is the name of the leaf that
holds the instants of these values in seconds. None of these files imports anything of the package, so that the process starts quickly.
"""
