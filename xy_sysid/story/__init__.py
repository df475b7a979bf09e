"""What people are shown of one axis, from the rigid base to the floor.

pictures: one fit as short rows of numbers
standing: how far an axis is from being explained
story:    step after step: begin, diagnose, add, take out
document: a story as a JSON document
attempt:  a calculation whose errors become a sentence
acts:     one job on one axis' story, step by step
"""
