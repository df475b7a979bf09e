"""The story of one axis, as users see it: the steps from the rigid model to the noise floor.

pictures: one fit as short rows of numbers
standing: how far an axis is from being explained
story:    step after step: begin, diagnose, add, take out
document: a story as a JSON document
attempt:  a calculation whose errors become a sentence
acts:     one job on one axis' story, step by step
"""
