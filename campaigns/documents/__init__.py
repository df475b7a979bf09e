"""Pages of docs/ that are made from the source, so that they say what it does.

architecture: the picture of the packages; effects, machines, settings: their pages; search: the table of its numbers
"""
