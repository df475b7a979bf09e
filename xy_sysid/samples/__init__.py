"""Streams of samples: their pairing, order and storage.

block:        consecutive samples of one quantity, as they travel in one message; a gap-free pair of both quantities
recording:    a whole recording, checked and in SI
ring:         one stream, kept by its counter, in whatever order its blocks come
pairing:      voltage and position, paired by that counter
joint_states: samples that carry a stamp and no counter
joint_fields: which numbers of a joint state are taken
integral:     velocity becomes position
newest:       the newest paired samples of a machine
"""
