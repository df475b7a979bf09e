"""The online logic: samples and time are arguments; it never asks for them.

identifier:      samples in, requests for fits out
fitter:          fits that follow one another
resonance_watch: has a resonance moved away
plain_messages:  a message of each type as plain values
messages:        what goes on the topics, as plain numbers and words
diagnoser:       what a live diagnosis does when
replay:          the same logic on blocks from anywhere
"""
