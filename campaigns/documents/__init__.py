"""Pages of docs/ that are generated from the source, so that they agree with it.

architecture: the picture of the packages; effects, machines, settings: their pages; search: the table of its numbers
"""
