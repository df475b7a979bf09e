"""The online logic: samples and time are arguments; it never reads a clock or a stream.

identifier:      samples in, requests for fits out
fitter:          a sequence of fits
resonance_watch: whether a resonance has moved
plain_messages:  a message of each type as plain values
messages:        content of the topics, as plain numbers and words
diagnoser:       the sequence of a live diagnosis
replay:          the same logic on blocks from any source
"""
