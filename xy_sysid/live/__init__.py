"""The online logic: samples and time are arguments; it never reads a clock or a stream.

identifier:      samples in, requests for fits out
fitter:          a sequence of fits
stretch_fits:    fits of stretches without common samples
resonance_watch: whether a resonance has moved
plain_messages:  a message of each type as plain values
messages, coupling_messages, diagnosis_messages: content of the topics, as plain numbers and words
status_values:   the values of a status that the page reads back
heard, recent:   the status of the streams, and which faults still occur
diagnoser:       the sequence of a live diagnosis
replay:          the same logic on blocks from any source
"""
