"""The story of one axis: the steps from the rigid model to the noise floor.

pictures: one fit as short rows of numbers for figures
standing: how much of an axis's error is explained
story:    the steps: begin, diagnose, add, remove
document: a story as a JSON document
attempt:  a calculation whose errors become a sentence
acts:     one job on one axis's story, step by step
"""
